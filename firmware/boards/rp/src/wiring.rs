//! The parts of a board that are the same on each. The table of the selected board, [`board`](crate::board), names its
//! pins, clocks and numbers.

use embassy_rp::Peri;
use embassy_rp::gpio::{Input, Output};
use embassy_rp::peripherals::{FLASH, USB, WATCHDOG};

use crate::board::TIMER;
use crate::{resets, sensor};

/// Peripherals and pins in use.
pub struct Wiring {
    pub watchdog: Peri<'static, WATCHDOG>,
    pub flash: Peri<'static, FLASH>,
    pub usb: Peri<'static, USB>,
    pub sensor: sensor::Parts,
    /// INT1 of the sensor, if the board has a wire for it.
    pub data_ready: Option<Input<'static>>,
    pub led: Output<'static>,
    /// Reset of a part that is not used, held low.
    pub _unused_reset: Option<Output<'static>>,
}

/// Low word of the time, µs.
pub fn micros() -> u32 {
    TIMER.timerawl().read()
}

/// Starts the loader. After copying a program, the loader starts it through the watchdog.
pub fn start_loader() -> ! {
    resets::forget();
    embassy_rp::rom_data::reset_to_usb_boot(0, 0);
    loop {
        cortex_m::asm::nop();
    }
}
