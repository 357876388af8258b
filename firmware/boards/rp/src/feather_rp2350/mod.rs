//! An Adafruit Feather RP2350, with an LSM6DSOX breakout on its STEMMA QT socket.
//!
//! The cable has the wires of I²C and of the supply, and none for the sensor's INT1. So samples are read at the ticks,
//! and each tick finds a sample that is at most 150 µs old. Reading one takes 0.44 ms at 400 kHz, the fastest clock of
//! the sensor.
//!
//! The pins are those of pico-sdk, `adafruit_feather_rp2350.h`. The breakout answers at the address of a low SA0
//! (`Adafruit_LSM6DS`, `LSM6DS_I2CADDR_DEFAULT`).

pub mod usb_errata;

use embassy_rp::clocks::ClockConfig;
use embassy_rp::gpio::{Level, Output};
use embassy_rp::peripherals::{I2C1, PIN_2, PIN_3, USB};
use embassy_rp::{Peripherals, bind_interrupts, i2c, otp, pac};
use lsm6dsox::Config;

use crate::flash::SettingsFlash;
use crate::wiring::Wiring;
use crate::{sensor, usb_watch};

bind_interrupts!(pub struct Irqs {
    I2C1_IRQ => i2c::InterruptHandler<I2C1>;
    USBCTRL_IRQ => usb_watch::FrameHandler, embassy_rp::usb::InterruptHandler<USB>;
});

/// Name of the board.
pub const HARDWARE: &str = "Adafruit Feather RP2350";

/// Period of the ticks: 1 kHz.
pub const TICK_US: u32 = 1_000;

/// Configuration of the sensor.
pub const SENSOR: Config = Config::FRESH_KILOHERTZ;

/// Size of the flash, bytes.
pub const FLASH_SIZE: usize = 8 * 1024 * 1024;

/// Frequency of the crystal, Hz. The chip's usual clock of 150 MHz is derived from it.
const CRYSTAL_HZ: u32 = 12_000_000;

/// Steps of the watchdog's counter in a microsecond.
pub const WATCHDOG_STEPS: u32 = 1;

/// Bits of everything the watchdog can reset, without those of both oscillators (pico-sdk, `watchdog.c`).
pub const ALL_BUT_OSCILLATORS: u32 = 0x1FF_FFF3;

/// Register of the watchdog that the ROM does not write. 2 and 3 are arguments of a restart by the ROM, and 4 to 7 its
/// kind (pico-bootrom-rp2350, `varm_apis.c`).
pub const MARK_REGISTER: usize = 1;

/// Controller and pins of the sensor's bus.
pub type Controller = I2C1;
pub type Data = PIN_2;
pub type Clock = PIN_3;

/// Clock of the sensor's bus at its three speeds, fastest first, Hz. Below 300 kHz, a sample with the registers that
/// are read back takes longer than a tick.
pub const BUS_HERTZ: [u32; 3] = [400_000, 350_000, 300_000];

/// Timer that counts microseconds.
pub const TIMER: pac::timer::Timer = pac::TIMER0;

/// Peripherals and pins in use.
pub fn wiring(p: Peripherals) -> Wiring {
    Wiring {
        watchdog: p.WATCHDOG,
        flash: p.FLASH,
        usb: p.USB,
        sensor: sensor::Parts { controller: p.I2C1, data: p.PIN_2, clock: p.PIN_3 },
        // The cable has no wire for it.
        data_ready: None,
        led: Output::new(p.PIN_7, Level::Low),
        _unused_reset: None,
    }
}

/// Clocks of the chip: 150 MHz.
pub fn clocks() -> ClockConfig {
    ClockConfig::crystal(CRYSTAL_HZ)
}

/// Identifier of the chip, of eight bytes.
pub fn identifier(_: &mut SettingsFlash) -> [u8; 16] {
    // Zeros identify a chip that does not give its number.
    (u128::from(otp::get_chipid().unwrap_or(0)) << 64).to_be_bytes()
}

/// Identification number of the chip, unique to it.
pub fn unique_id(&[a, b, c, d, e, f, g, h, ..]: &[u8; 16]) -> [u8; 8] {
    [a, b, c, d, e, f, g, h]
}
