//! An Arduino Nano RP2040 Connect, which carries its sensor. The radio module, with its RGB LED, is held in reset.

pub mod loader;
mod soft_float;
pub mod usb_errata;

use embassy_rp::clocks::ClockConfig;
use embassy_rp::gpio::{Input, Level, Output, Pull};
use embassy_rp::peripherals::{I2C0, PIN_12, PIN_13, USB};
use embassy_rp::{Peripherals, bind_interrupts, i2c, pac};
use lsm6dsox::Config;

use crate::flash::SettingsFlash;
use crate::wiring::Wiring;
use crate::{sensor, usb_watch};

bind_interrupts!(pub struct Irqs {
    I2C0_IRQ => i2c::InterruptHandler<I2C0>;
    USBCTRL_IRQ => usb_watch::FrameHandler, embassy_rp::usb::InterruptHandler<USB>;
});

/// Name of the board.
pub const HARDWARE: &str = "Arduino Nano RP2040 Connect";

/// Period of the ticks: 416.7 Hz.
pub const TICK_US: u32 = 2_400;

/// Configuration of the sensor.
pub const SENSOR: Config = Config::FRESH_417_HERTZ;

/// Size of the flash, bytes.
pub const FLASH_SIZE: usize = 16 * 1024 * 1024;

/// Clock of the cores, Hz: the highest that the RP2040's data sheet allows at the usual voltage.
const CLOCK_HZ: u32 = 133_000_000;

/// Steps of the watchdog's counter in a microsecond: it counts down by two (erratum RP2040-E1).
pub const WATCHDOG_STEPS: u32 = 2;

/// Bits of everything the watchdog can reset, without those of both oscillators.
pub const ALL_BUT_OSCILLATORS: u32 = 0x1_FFFC;

/// Register of the watchdog that the ROM does not write. 0 and 1 are arguments of the loader, with the mask of its
/// light; 4 to 7 hold the start address (pico-bootrom-rp2040, `bootrom_main.c`).
pub const MARK_REGISTER: usize = 2;

/// Controller and pins of the sensor's bus.
pub type Controller = I2C0;
pub type Data = PIN_12;
pub type Clock = PIN_13;

/// Clock of the sensor's bus at its three speeds, fastest first, Hz.
pub const BUS_HERTZ: [u32; 3] = [400_000, 300_000, 200_000];

/// Timer that counts microseconds.
pub const TIMER: pac::timer::Timer = pac::TIMER;

/// Peripherals and pins in use.
pub fn wiring(p: Peripherals) -> Wiring {
    Wiring {
        watchdog: p.WATCHDOG,
        flash: p.FLASH,
        usb: p.USB,
        sensor: sensor::Parts { controller: p.I2C0, data: p.PIN_12, clock: p.PIN_13 },
        // The sensor enters I3C mode if INT1 is high at power-up, so the pin has a pull-down, never a pull-up.
        data_ready: Some(Input::new(p.PIN_24, Pull::Down)),
        led: Output::new(p.PIN_6, Level::Low),
        // The radio would take most of the current.
        _unused_reset: Some(Output::new(p.PIN_3, Level::Low)),
    }
}

/// Clocks of the chip.
pub fn clocks() -> ClockConfig {
    ClockConfig::system_freq(CLOCK_HZ).unwrap_or_else(|_| ClockConfig::crystal(12_000_000))
}

/// Manufacturer of the flash chips with an identifier of 16 bytes, by JEDEC: ISSI.
const ISSI: u8 = 0x9D;

/// Returns the identifier of the flash chip. An IS25LP128F sends 16 bytes. Any other chip, such as an AT25SF128A, counts
/// as one that sends eight, because its output then floats, and further bytes could differ from one start to the next.
pub fn identifier(flash: &mut SettingsFlash) -> [u8; 16] {
    let mut id = [0; 16];
    let [_, manufacturer, ..] = flash.0.blocking_jedec_id().unwrap_or(0).to_be_bytes();
    let length = if manufacturer == ISSI { 16 } else { 8 };
    // Zeros identify a board whose chip does not answer.
    let _ = flash.0.blocking_unique_id(id.get_mut(..length).unwrap_or_default());
    id
}

/// Identification number, unique to the board. The first half of an IS25LP128F's identifier is the same on many chips
/// (raspberrypi/pico-sdk#1641).
pub fn unique_id(id: &[u8; 16]) -> [u8; 8] {
    let [first, second] = *id.as_chunks::<8>().0 else { return [0; 8] };
    // Equal halves would give each board the number 0.
    if second == first {
        return first;
    }
    (u64::from_ne_bytes(first) ^ u64::from_ne_bytes(second)).to_ne_bytes()
}
