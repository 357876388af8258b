//! Voltage of the load sensor, converted continuously by ADC1.

use embassy_stm32::pac::adc::vals::{Exten, Res, SampleTime};
use embassy_stm32::pac::adccommon::vals::Adcpre;
use embassy_stm32::pac::{ADC1, ADC123_COMMON};
use embassy_stm32::{Peri, peripherals, rcc};

use crate::wiring::{self, LOAD_INPUT};

/// Inputs from 10 on have their sampling time in `ADC_SMPR1` (RM0090, 13.13.4).
const FIRST_OF_SMPR1: u8 = 10;

const _: () = assert!(FIRST_OF_SMPR1 <= LOAD_INPUT && LOAD_INPUT <= 18);

/// Running converter.
pub struct LoadSensor(());

impl LoadSensor {
    /// Starts the conversion: 12 bits at 20 MHz, a new value every 25 µs. It samples over 480 cycles, because load
    /// sensors are weak sources.
    pub(crate) fn start(
        _converter: Peri<'static, peripherals::ADC1>,
        pin: Peri<'static, wiring::Load>,
    ) -> Self {
        embassy_stm32::gpio::Flex::new(pin).set_as_analog();
        rcc::enable_and_reset::<peripherals::ADC1>();
        ADC123_COMMON.ccr().modify(|w| w.set_adcpre(Adcpre::DIV4));
        ADC1.cr1().modify(|w| w.set_res(Res::BITS12));
        ADC1.smpr1().modify(|w| {
            w.set_smp(usize::from(LOAD_INPUT - FIRST_OF_SMPR1), SampleTime::CYCLES480);
        });
        ADC1.sqr3().modify(|w| w.set_sq(0, LOAD_INPUT));
        ADC1.cr2().modify(|w| {
            w.set_adon(true);
            w.set_cont(true);
            w.set_exten(Exten::DISABLED);
        });
        // The converter is stable after 3 µs.
        cortex_m::asm::delay(480);
        ADC1.cr2().modify(|w| w.set_swstart(true));
        Self(())
    }

    /// Newest reading, 0 to 4095 for 0 V to the supply.
    pub fn reading(&self) -> u16 {
        ADC1.dr().read().data()
    }
}
