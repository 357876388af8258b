//! Start of the crystal, and its measurement by the internal oscillator, from which the processor runs after reset. A
//! crystal of another frequency would set another clock: 12 MHz instead of 8 would run the core at one and a half times
//! its rate.

use core::ops::RangeInclusive;

use stm32_metapac::timer::vals::CcmrInputCcs;
use stm32_metapac::{RCC, TIM11};

/// Internal oscillator, MHz.
pub const HSI_MHZ: u32 = 16;

/// Permitted deviation of the measured crystal, kHz per MHz: 6 %, more than the internal oscillator's 4 %. A crystal
/// that differs by less than 10 % can pass.
const TOLERANCE_KHZ: u32 = 60;

/// Polls of HSERDY before the crystal counts as missing. They run on the internal oscillator right after reset, and
/// each takes at least 5 cycles of 16 MHz. So they take at least 20 ms, ten times the typical 2 ms of the data sheet.
const POLLS: u32 = 64_000;

/// Frequencies of crystals that the chip accepts, widened by the tolerance of their measurement, kHz.
const POSSIBLE_KHZ: RangeInclusive<u32> = 3_600..=28_600;

/// Frequency of a crystal in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frequency {
    /// Measured frequency, kHz. It fits the board, within the error of the internal oscillator.
    Measured(u32),
    /// Unknown. The crystal starts, but no crystal can have the measured frequency.
    NotMeasured,
}

/// Starts the crystal and measures it. A crystal that starts is used even if the measurement fails. No board has yet
/// shown that the crystal's clock reaches the timer, and a bus that stays off is worse than an unchecked frequency.
///
/// # Errors
/// The measured frequency, kHz, if it does not fit the board, or 0 if the crystal does not start. In both cases the
/// crystal is switched off.
pub fn start(expected_mhz: u32) -> Result<Frequency, u32> {
    RCC.cr().modify(|w| w.set_hseon(true));
    let starts = (0..POLLS).any(|_| RCC.cr().read().hserdy());
    let khz = if starts {
        match measure().filter(|khz| POSSIBLE_KHZ.contains(khz)) {
            None => return Ok(Frequency::NotMeasured),
            Some(khz) if khz.abs_diff(expected_mhz * 1000) <= expected_mhz * TOLERANCE_KHZ => {
                return Ok(Frequency::Measured(khz));
            }
            Some(khz) => khz,
        }
    } else {
        0
    };
    RCC.cr().modify(|w| w.set_hseon(false));
    Err(khz)
}

/// Measures the crystal with the internal oscillator. TIM11 captures every eighth edge of the crystal's frequency
/// divided by [`DIVIDER`] (RM0090, 7.2.11 and 19.5.11 \[M\]). Returns kHz, or `None` without captures. The manual does
/// not say whether the divided clock runs before the RTC selects it (`RTCSEL`).
fn measure() -> Option<u32> {
    /// Largest divider of the clock `HSE_RTC`.
    const DIVIDER: u8 = 31;
    const EDGES: u32 = 8;
    /// Number of captures. At 4 MHz they take 2 ms, half a round of the counter.
    const CAPTURES: u32 = 32;
    /// Maximum polls for a capture: longer than four captures at 4 MHz. Each poll takes at least 5 cycles.
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
    let counts = first.zip(last).map(|(first, last)| last.wrapping_sub(first))?;
    let edges = CAPTURES * EDGES * u32::from(DIVIDER);
    (HSI_MHZ * 1000 * edges).checked_div(u32::from(counts))
}
