//! Configuration of the signal paths by the registers.

use super::channel::{self, Setting};
use super::part::Part;
use crate::noise;
use crate::register::{self, ctrl1_xl, ctrl2_g, ctrl4_c, ctrl5_c, ctrl6_c, ctrl8_xl};
use crate::scale::{AccelFullScale, DEGREE, STANDARD_GRAVITY};
use crate::setting::{AccelFilter, Ftype, GyroFilter, Odr};

/// Fraction of the data rate used if the gyroscope's cut-off is unknown.
const UNKNOWN_CUTOFF: f64 = 0.4;

impl Part {
    pub(super) fn accel_setting(&self) -> Setting {
        let ctrl1 = self.memory.get(register::CTRL1_XL);
        let odr_code = ctrl1_xl::ODR_XL.of(ctrl1);
        let ctrl8 = self.memory.get(register::CTRL8_XL);
        let full_scale = match channel::accel_full_scale(ctrl1_xl::FS_XL.of(ctrl1)) {
            // The code of 16 g is a second code of 2 g in the mode that ends at 8 g.
            AccelFullScale::G16 if ctrl8_xl::XL_FS_MODE.is_set(ctrl8) => AccelFullScale::G2,
            full_scale => full_scale,
        };
        let rate = nominal_rate(odr_code);
        let filter = if ctrl1_xl::LPF2_XL_EN.is_set(ctrl1) {
            let hpcf = ctrl8_xl::HPCF_XL.of(ctrl8);
            AccelFilter::ALL[usize::from(hpcf) + 1]
        } else {
            AccelFilter::OdrDiv2
        };
        let sign = match ctrl5_c::ST_XL.of(self.memory.get(register::CTRL5_C)) {
            0b01 => 1.0,
            0b10 => -1.0,
            _ => 0.0,
        };
        let density = noise::accel_micro_g_per_root_hertz(full_scale);
        Setting {
            divider: channel::divider(odr_code),
            cutoff: Some(rate / f64::from(filter.divisor())),
            sensitivity: channel::accel_sensitivity(full_scale),
            density: f64::from(density) * 1.0e-6 * f64::from(STANDARD_GRAVITY),
            test_signal: self.options.accel_test_signal.map(|signal| sign * signal),
        }
    }

    pub(super) fn gyro_setting(&self) -> Setting {
        let ctrl2 = self.memory.get(register::CTRL2_G);
        let odr_code = ctrl2_g::ODR_G.of(ctrl2);
        let full_scale = channel::gyro_full_scale(ctrl2);
        let filter = if ctrl4_c::LPF1_SEL_G.is_set(self.memory.get(register::CTRL4_C)) {
            let ftype = ctrl6_c::FTYPE.of(self.memory.get(register::CTRL6_C));
            GyroFilter::Lpf1(Ftype::ALL[usize::from(ftype)])
        } else {
            GyroFilter::Lpf2
        };
        let cutoff =
            filter.cutoff(odr(odr_code)).map_or(UNKNOWN_CUTOFF * nominal_rate(odr_code), f64::from);
        let sign = match ctrl5_c::ST_G.of(self.memory.get(register::CTRL5_C)) {
            0b01 => 1.0,
            0b11 => -1.0,
            _ => 0.0,
        };
        let asleep = ctrl4_c::SLEEP_G.is_set(self.memory.get(register::CTRL4_C));
        // The gyroscope has no 1.6 Hz rate.
        let divider = if odr_code > 10 || asleep { 0 } else { channel::divider(odr_code) };
        Setting {
            divider,
            cutoff: Some(cutoff),
            sensitivity: channel::gyro_sensitivity(full_scale),
            density: f64::from(noise::GYRO_MILLI_DPS_PER_ROOT_HERTZ) * 1.0e-3 * f64::from(DEGREE),
            test_signal: self.options.gyro_test_signal.map(|signal| sign * signal),
        }
    }
}

fn odr(code: u8) -> Odr {
    Odr::ALL.into_iter().find(|odr| odr.code() == code).unwrap_or_default()
}

/// Nominal rate by ST's names, Hz, for the cut-offs that are fractions of it.
fn nominal_rate(odr_code: u8) -> f64 {
    f64::from(odr(odr_code).hertz())
}
