//! The foot's program on an Adafruit Feather RP2350.

#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    rp::run()
}
