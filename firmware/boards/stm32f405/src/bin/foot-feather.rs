//! The foot's program on the Feather.

#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    stm32f405::foot::run()
}
