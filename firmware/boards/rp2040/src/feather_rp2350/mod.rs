//! An Adafruit Feather RP2350, with an LSM6DSOX breakout on its STEMMA QT socket.
//!
//! The cable has the wires of I²C and of the supply, and none for the sensor's INT1. Samples are read at the ticks, of
//! which each finds a sample that is at most 150 µs old. Reading one takes 0.44 ms at 400 kHz, the fastest clock of the
//! sensor.
//!
//! The pins are those of pico-sdk, `adafruit_feather_rp2350.h`. The breakout answers at the address of a low SA0
//! (`Adafruit_LSM6DS`, `LSM6DS_I2CADDR_DEFAULT`).

pub mod usb_errata;

use embassy_rp::clocks::ClockConfig;
use embassy_rp::gpio::{Input, Level, Output};
use embassy_rp::peripherals::{FLASH, I2C1, PIN_2, PIN_3, USB, WATCHDOG};
use embassy_rp::{Peri, Peripherals, bind_interrupts, i2c, otp, pac};
use lsm6dsox::{BusSpeed, Config};

use crate::flash::SettingsFlash;
use crate::{resets, sensor, usb_watch};

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

/// Peripherals and pins in use.
pub struct Wiring {
    pub watchdog: Peri<'static, WATCHDOG>,
    pub flash: Peri<'static, FLASH>,
    pub usb: Peri<'static, USB>,
    pub sensor: sensor::Parts,
    /// INT1 of the sensor, for which the cable has no wire.
    pub data_ready: Option<Input<'static>>,
    pub led: Output<'static>,
}

impl Wiring {
    pub fn new(p: Peripherals) -> Self {
        Self {
            watchdog: p.WATCHDOG,
            flash: p.FLASH,
            usb: p.USB,
            sensor: sensor::Parts { controller: p.I2C1, data: p.PIN_2, clock: p.PIN_3 },
            data_ready: None,
            led: Output::new(p.PIN_7, Level::Low),
        }
    }
}

/// Clocks of the chip: 150 MHz.
pub fn clocks() -> ClockConfig {
    ClockConfig::crystal(CRYSTAL_HZ)
}

/// Clock of the sensor's bus, Hz. A sample and the registers read back with it take longer than a tick at less than
/// 300 kHz.
pub const fn bus_hertz(speed: BusSpeed) -> u32 {
    match speed {
        BusSpeed::Full => 400_000,
        BusSpeed::Half => 350_000,
        BusSpeed::Quarter => 300_000,
    }
}

/// Identification number of the chip, unique to it.
pub fn unique_id(_: &mut SettingsFlash) -> [u8; 8] {
    // Zeros identify a chip that does not give its number.
    otp::get_chipid().unwrap_or(0).to_be_bytes()
}

/// Low word of the time, µs.
pub fn micros() -> u32 {
    pac::TIMER0.timerawl().read()
}

/// Starts the loader. After copying a program, the loader starts it through the watchdog.
pub fn start_loader() -> ! {
    resets::forget();
    embassy_rp::rom_data::reset_to_usb_boot(0, 0);
    loop {
        cortex_m::asm::nop();
    }
}
