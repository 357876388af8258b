//! Measures a new Feather.

#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    stm32f405::bring_up::run()
}
