//! The foot's program on the reference board.

#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    stm32f405::foot::run()
}
