//! Start of the crystal, and its measurement by the internal oscillator, on which the processor runs after reset. A
//! crystal that is not the board's would set another frequency: 12 MHz instead of 8 would run the core at half as
//! much again.
//!
//! On the target alone; the bootloader and the foot's program both begin with it.

use core::ops::RangeInclusive;

use stm32_metapac::timer::vals::CcmrInputCcs;
use stm32_metapac::{RCC, TIM11};

/// Internal oscillator, MHz.
pub const HSI_MHZ: u32 = 16;

/// Permitted deviation of the measured crystal, kHz per MHz: 6 %, more than the internal oscillator's 4 %. A crystal
/// that differs by less than 10 % can pass.
const TOLERANCE_KHZ: u32 = 60;

/// Polls of HSERDY before the crystal counts as missing, on the internal oscillator right after reset:
/// each takes at least 5 cycles of 16 MHz, so this is at least 20 ms, ten times the 2 ms that the
/// data sheet calls typical.
const POLLS: u32 = 64_000;

/// Frequencies of crystals that the chip takes, and the tolerance of their measurement, kHz.
const POSSIBLE_KHZ: RangeInclusive<u32> = 3_600..=28_600;

/// Frequency of a crystal that is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Frequency {
    /// That of the board.
    Measured,
    /// Unknown: the crystal starts, and its measurement gives nothing that a crystal can be.
    NotMeasured,
}

/// Starts the crystal and measures it. One that starts is used where the measurement fails: no board has shown yet that
/// the crystal's clock reaches the timer, and a bus that stays off is worse than a frequency that is not checked.
///
/// # Errors
/// Its frequency, kHz, if it is not that of the board; 0 if it does not start. It is switched off.
pub fn start(expected_mhz: u32) -> Result<Frequency, u32> {
    RCC.cr().modify(|w| w.set_hseon(true));
    let starts = (0..POLLS).any(|_| RCC.cr().read().hserdy());
    let khz = if starts {
        match measure().filter(|khz| POSSIBLE_KHZ.contains(khz)) {
            None => return Ok(Frequency::NotMeasured),
            Some(khz) if khz.abs_diff(expected_mhz * 1000) <= expected_mhz * TOLERANCE_KHZ => {
                return Ok(Frequency::Measured);
            }
            Some(khz) => khz,
        }
    } else {
        0
    };
    RCC.cr().modify(|w| w.set_hseon(false));
    Err(khz)
}

/// Measures the crystal with the internal oscillator: TIM11 captures
/// every eighth edge of the crystal's frequency divided by [`DIVIDER`] (RM0090, 7.2.11 and 19.5.11 \[M\]).
/// Returns kHz, or `None` without captures. The manual does not say whether the divided clock runs before the RTC selects
/// it (`RTCSEL`).
fn measure() -> Option<u32> {
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
    let counts = first.zip(last).map(|(first, last)| last.wrapping_sub(first))?;
    let edges = CAPTURES * EDGES * u32::from(DIVIDER);
    (HSI_MHZ * 1000 * edges).checked_div(u32::from(counts))
}
