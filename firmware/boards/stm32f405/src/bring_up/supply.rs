//! The supply, from the chip's internal reference.

use embassy_stm32::pac::adc::vals::SampleTime;
use embassy_stm32::pac::{ADC1, ADC123_COMMON};
use embassy_time::{Duration, Timer};

/// Address of the reference's code measured in the factory at 3.3 V (DS8626, internal reference voltage calibration
/// values \[M\]).
const CALIBRATION: usize = 0x1FFF_7A2A;

/// Input of ADC1 that is connected to the reference (RM0090, 13.10 \[M\]).
const REFERENCE: u8 = 17;

/// First input whose sampling time is in `ADC_SMPR1`.
const FIRST_OF_SMPR1: u8 = 10;

/// Conversions in a reading.
const CONVERSIONS: u32 = 16;

/// Code measured in the factory.
pub fn calibration() -> u16 {
    // SAFETY: the factory area can be read at any time, and holds no variable of the program.
    unsafe { core::ptr::with_exposed_provenance::<u16>(CALIBRATION).read_volatile() }
}

/// Mean code of the reference; `None` if the converter does not finish.
///
/// From now on the converter no longer reads the load sensor. The reference needs 10 µs to start and to be sampled
/// (DS8626, embedded internal reference voltage \[M\]). A sampling time of 480 cycles at 20 MHz is 24 µs.
pub async fn reference() -> Option<u16> {
    ADC1.cr2().modify(|w| {
        w.set_cont(false);
        w.set_adon(false);
    });
    ADC123_COMMON.ccr().modify(|w| w.set_tsvrefe(true));
    let input = usize::from(REFERENCE - FIRST_OF_SMPR1);
    ADC1.smpr1().modify(|w| w.set_smp(input, SampleTime::CYCLES480));
    ADC1.sqr3().modify(|w| w.set_sq(0, REFERENCE));
    ADC1.cr2().modify(|w| w.set_adon(true));
    Timer::after(Duration::from_millis(1)).await;
    let mut sum = 0;
    for _ in 0..CONVERSIONS {
        ADC1.sr().modify(|w| w.set_eoc(false));
        ADC1.cr2().modify(|w| w.set_swstart(true));
        Timer::after(Duration::from_millis(1)).await;
        if !ADC1.sr().read().eoc() {
            return None;
        }
        sum += u32::from(ADC1.dr().read().data());
    }
    Some((sum / CONVERSIONS) as u16)
}
