//! The foot's program on an Arduino Nano RP2040 Connect.

#![no_std]
#![no_main]

#[cortex_m_rt::entry]
fn main() -> ! {
    rp::run()
}
