//! 160 MHz, from the crystal if it starts with the right frequency, otherwise from the internal oscillator.
//!
//! A crystal of another frequency would set another clock: 12 MHz instead of 8 would run the core at 240 MHz. A crystal
//! that starts but could not be measured is used.
//!
//! The HAL sets five wait states, and with these the flash allows 160 MHz only from 2.7 V on (RM0090, table 10). At a
//! lower supply the start waits, then continues with 72 MHz, which two wait states allow from 2.4 V on.
//!
//! SYSCLK is 160 MHz and not 168, so that APB2 is 80 MHz and SPI1 runs at exactly 5.0 MHz, half of the sensor's limit.
//! At 168 MHz, APB2 is 84 MHz and its dividers give 5.25 MHz.

use embassy_stm32::Config;
use embassy_stm32::pac::{FLASH, RCC};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource,
    Sysclk,
};
use embassy_stm32::time::Hertz;
use stm32f405_chip::crystal::{self, Frequency};
use stm32f405_chip::supply;

use crate::watchdog;
use crate::wiring::CRYSTAL_MHZ;

/// Internal oscillator, MHz.
const HSI_MHZ: u32 = crystal::HSI_MHZ;

/// Input of the PLL after its divider, MHz. 1 or 2 are allowed. RM0090 recommends 2 to limit jitter, but an odd crystal
/// frequency excludes it.
const PLL_INPUT_MHZ: u32 = if CRYSTAL_MHZ.is_multiple_of(2) { 2 } else { 1 };

/// Oscillator of the PLL, MHz; half of it is the system clock.
const PLL_MHZ: u32 = 320;

/// Oscillator of the PLL at a low supply, MHz.
const PLL_AT_LOW_SUPPLY_MHZ: u32 = 144;

/// Maximum polls while the supply is low, on the internal oscillator. Each takes at least 5 cycles of 16 MHz, so all
/// take at least 50 ms. The output of a regulator has risen by then.
const SUPPLY_POLLS: u32 = 160_000;

const _: () = assert!(
    4 <= CRYSTAL_MHZ && CRYSTAL_MHZ <= 26,
    "CRYSTAL_MHZ: the STM32F405 takes crystals of 4 to 26 MHz"
);

/// Clock of the board.
#[derive(Clone, Copy, Debug)]
pub struct Clock {
    /// Source of the clock.
    pub source: Source,
    supply: Supply,
}

/// Supply at the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Supply {
    /// Above 2.7 V.
    Sufficient,
    /// Below 2.7 V after the wait.
    Low,
}

/// Source of the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The crystal.
    Crystal(Frequency),
    /// The internal oscillator. The value is the crystal's frequency, kHz; 0 if it does not start.
    ///
    /// The oscillator is within 1 % at 25 °C and within 4 % from −10 to 85 °C (DS8626, HSI oscillator characteristics).
    /// That is too inaccurate for CAN. The serial line tolerates some 4 % in all (RM0090, tolerance of the USART
    /// receiver).
    Internal(u32),
}

/// Starts the crystal, measures it, and checks the supply, whose detector has settled by then. The HAL would wait
/// indefinitely for a missing crystal.
pub fn start() -> Clock {
    supply::watch();
    let source = match crystal::start(CRYSTAL_MHZ) {
        Ok(frequency) => Source::Crystal(frequency),
        Err(khz) => Source::Internal(khz),
    };
    let suffices = (0..SUPPLY_POLLS).any(|_| !supply::is_low());
    watchdog::feed();
    Clock { source, supply: if suffices { Supply::Sufficient } else { Supply::Low } }
}

/// The HAL's configuration for a clock.
pub fn config(clock: Clock) -> Config {
    let (pll_src, input_mhz) = match clock.source {
        Source::Crystal(_) => (PllSource::HSE, CRYSTAL_MHZ),
        Source::Internal(_) => (PllSource::HSI, HSI_MHZ),
    };
    let (pll_mhz, apb1_pre, apb2_pre) = match clock.supply {
        Supply::Sufficient => (PLL_MHZ, APBPrescaler::DIV4, APBPrescaler::DIV2),
        Supply::Low => (PLL_AT_LOW_SUPPLY_MHZ, APBPrescaler::DIV2, APBPrescaler::DIV1),
    };
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = matches!(clock.source, Source::Crystal(_))
        .then_some(Hse { freq: Hertz::mhz(CRYSTAL_MHZ), mode: HseMode::Oscillator });
    rcc.pll_src = pll_src;
    rcc.pll = Some(Pll {
        prediv: PllPreDiv::from_bits((input_mhz / PLL_INPUT_MHZ) as u8),
        mul: PllMul::from_bits((pll_mhz / PLL_INPUT_MHZ) as u16),
        divp: Some(PllPDiv::DIV2),
        // This output is unused, but its divider must be set, because its reset value is lost and 0 is forbidden. It has
        // 45.7 MHz, and 48 MHz are allowed.
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV1;
    rcc.apb1_pre = apb1_pre;
    rcc.apb2_pre = apb2_pre;
    config
}

/// Clock of the peripherals on APB1, Hz, by the divider that [`config`] has set. The HAL's function for it can panic.
pub fn apb1_hertz() -> u32 {
    match RCC.cfgr().read().ppre1() {
        APBPrescaler::DIV4 => PLL_MHZ / 2 / 4 * 1_000_000,
        _ => PLL_AT_LOW_SUPPLY_MHZ / 2 / 2 * 1_000_000,
    }
}

/// Clock of the processor, kHz, by the same divider.
pub fn processor_khz() -> u32 {
    match RCC.cfgr().read().ppre1() {
        APBPrescaler::DIV4 => PLL_MHZ / 2 * 1_000,
        _ => PLL_AT_LOW_SUPPLY_MHZ / 2 * 1_000,
    }
}

/// Makes the loss of the crystal an exception (NMI) instead of a silent halt.
pub fn watch_crystal() {
    RCC.cr().modify(|w| w.set_csson(true));
}

/// Enables the caches that hide the wait states of the flash, and the prefetch. The prefetch must be off below 2.1 V
/// (RM0090, table 10). The HAL leaves all of them off.
pub fn enable_caches(clock: Clock) {
    FLASH.acr().modify(|w| {
        w.set_icrst(true);
        w.set_dcrst(true);
    });
    FLASH.acr().modify(|w| {
        w.set_icrst(false);
        w.set_dcrst(false);
        w.set_icen(true);
        w.set_dcen(true);
        w.set_prften(clock.supply == Supply::Sufficient);
    });
}
