//! 160 MHz, from the crystal if it starts and has the right frequency, otherwise from the internal
//! oscillator. A crystal that is not the board's would set another frequency: 12 MHz instead of 8 would run the core
//! at 240 MHz.
//!
//! SYSCLK 160 MHz and not 168: APB2 is then 80 MHz and SPI1 runs at exactly 5.0 MHz, half of the sensor's limit;
//! the dividers of 84 MHz give 5.25 MHz.

use embassy_stm32::Config;
use embassy_stm32::pac::{FLASH, RCC, TIM11, timer::vals::CcmrInputCcs};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource,
    Sysclk,
};
use embassy_stm32::time::Hertz;

use super::wiring::CRYSTAL_MHZ;

/// Internal oscillator, MHz.
const HSI_MHZ: u32 = 16;

/// Input of the PLL after its divider, MHz: 1 or 2 are allowed, and RM0090 recommends 2 to limit
/// jitter, which an odd crystal frequency excludes.
const PLL_INPUT_MHZ: u32 = if CRYSTAL_MHZ.is_multiple_of(2) { 2 } else { 1 };

/// Oscillator of the PLL, MHz; half of it is the system clock.
const PLL_MHZ: u32 = 320;

const _: () = assert!(
    4 <= CRYSTAL_MHZ && CRYSTAL_MHZ <= 26,
    "CRYSTAL_MHZ: the STM32F405 takes crystals of 4 to 26 MHz"
);

/// Permitted deviation of the measured crystal, kHz: 6 %, more than the internal oscillator's 4 %. A crystal that
/// differs by less than 10 % can pass.
const TOLERANCE_KHZ: u32 = CRYSTAL_MHZ * 60;

/// Polls of HSERDY before the crystal counts as missing, on the internal oscillator right after reset:
/// each takes at least 5 cycles of 16 MHz, so this is at least 20 ms, ten times the 2 ms that the
/// data sheet calls typical.
const CRYSTAL_POLLS: u32 = 64_000;

/// Source of the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The crystal.
    Crystal,
    /// The internal oscillator, with the frequency of the crystal, kHz, which is 0 if it does not start. It is within 1 % at 25 °C, within 4 % from −10 to 85 °C (data sheet DS8626,
    /// HSI oscillator characteristics). Not accurate enough for CAN; the serial line tolerates some 4 % in all
    /// (RM0090, tolerance of the USART receiver).
    Internal(u32),
}

/// Starts the crystal and measures it. The HAL would wait for a missing one indefinitely.
pub fn start() -> Source {
    RCC.cr().modify(|w| w.set_hseon(true));
    let starts = (0..CRYSTAL_POLLS).any(|_| RCC.cr().read().hserdy());
    let khz = if starts { measure_crystal() } else { 0 };
    if khz.abs_diff(CRYSTAL_MHZ * 1000) <= TOLERANCE_KHZ {
        return Source::Crystal;
    }
    RCC.cr().modify(|w| w.set_hseon(false));
    Source::Internal(khz)
}

/// Measures the crystal with the internal oscillator, on which the processor runs after reset: TIM11 captures
/// every eighth edge of the crystal's frequency divided by [`DIVIDER`] (RM0090, 7.2.11 and 19.5.11 \[M\]).
/// Returns kHz, or 0 if it stops.
fn measure_crystal() -> u32 {
    /// Largest divider of the clock `HSE_RTC`.
    const DIVIDER: u8 = 31;
    const EDGES: u32 = 8;
    /// Duration 2 ms at 4 MHz, half a round of the counter.
    const CAPTURES: u32 = 32;
    /// Longer than four captures at 4 MHz: each takes at least 5 cycles.
    const POLLS: u32 = 800;
    /// Value of `TIM11_OR` that connects channel 1 to `HSE_RTC`.
    const TO_CRYSTAL: u32 = 0b10;
    RCC.cfgr().modify(|w| w.set_rtcpre(DIVIDER));
    RCC.apb2enr().modify(|w| w.set_tim11en(true));
    // A write just after the clock is enabled can be lost (ES0182, delay after an RCC peripheral clock enabling \[M\]).
    let _ = RCC.apb2enr().read();
    TIM11.or().write_value(TO_CRYSTAL);
    TIM11.ccmr_input(0).write(|w| {
        w.set_ccs(0, CcmrInputCcs::TI4);
        w.set_icpsc(0, 0b11);
    });
    TIM11.ccer().write(|w| w.set_cce(0, true));
    TIM11.cr1().write(|w| w.set_cen(true));
    let capture = || {
        let captured = (0..POLLS).any(|_| TIM11.sr().read().ccif(0));
        captured.then(|| TIM11.ccr(0).read().ccr())
    };
    let first = capture();
    let last = (0..CAPTURES).fold(first, |last, _| last.and_then(|_| capture()));
    RCC.apb2rstr().modify(|w| w.set_tim11rst(true));
    RCC.apb2rstr().modify(|w| w.set_tim11rst(false));
    RCC.apb2enr().modify(|w| w.set_tim11en(false));
    RCC.cfgr().modify(|w| w.set_rtcpre(0));
    let counts = first
        .zip(last)
        .map(|(first, last)| last.wrapping_sub(first));
    let edges = CAPTURES * EDGES * u32::from(DIVIDER);
    (HSI_MHZ * 1000 * edges)
        .checked_div(u32::from(counts.unwrap_or(0)))
        .unwrap_or(0)
}

/// The HAL's configuration for `source`.
pub fn config(source: Source) -> Config {
    let (pll_src, input_mhz) = match source {
        Source::Crystal => (PllSource::HSE, CRYSTAL_MHZ),
        Source::Internal(_) => (PllSource::HSI, HSI_MHZ),
    };
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = (source == Source::Crystal).then_some(Hse {
        freq: Hertz::mhz(CRYSTAL_MHZ),
        mode: HseMode::Oscillator,
    });
    rcc.pll_src = pll_src;
    rcc.pll = Some(Pll {
        prediv: PllPreDiv::from_bits((input_mhz / PLL_INPUT_MHZ) as u8),
        mul: PllMul::from_bits((PLL_MHZ / PLL_INPUT_MHZ) as u16),
        divp: Some(PllPDiv::DIV2),
        // Unused, but its reset value is lost and 0 is forbidden: 45.7 of at most 48 MHz.
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV1;
    rcc.apb1_pre = APBPrescaler::DIV4;
    rcc.apb2_pre = APBPrescaler::DIV2;
    config
}

/// Makes the loss of the crystal an exception (NMI) instead of a silent halt.
pub fn watch_crystal() {
    RCC.cr().modify(|w| w.set_csson(true));
}

/// Enables the caches that hide the flash's five wait states. The HAL leaves them off.
pub fn enable_caches() {
    FLASH.acr().modify(|w| {
        w.set_icrst(true);
        w.set_dcrst(true);
    });
    FLASH.acr().modify(|w| {
        w.set_icrst(false);
        w.set_dcrst(false);
        w.set_icen(true);
        w.set_dcen(true);
        w.set_prften(true);
    });
}
