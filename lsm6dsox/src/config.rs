//! Settings of the part and their validation.
//!
//! [`Params`] is the user's input. [`Params::validate`] turns it into the [`Config`] of a driver, or names the invalid
//! field. [`Config::writes`] is the only place where settings become register values.

use core::fmt;

use crate::register::{
    self, Register, counter_bdr_reg1, ctrl1_xl, ctrl2_g, ctrl3_c, ctrl4_c, ctrl6_c, ctrl8_xl,
    ctrl9_xl, ctrl10_c, int1_ctrl, int2_ctrl,
};
use crate::scale::{AccelFullScale, GyroFullScale};
use crate::setting::{AccelFilter, DataReadyMode, Ftype, GyroFilter, Odr, Pin, Sensor};

/// Pin that signals new samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DataReady {
    /// Sensor whose samples are signalled.
    pub sensor: Sensor,
    /// Pin that is driven.
    pub pin: Pin,
    /// Duration of the signal.
    pub mode: DataReadyMode,
}

/// The accelerometer's settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AccelParams {
    /// Output data rate.
    pub odr: Odr,
    /// Full scale.
    pub full_scale: AccelFullScale,
    /// Low-pass filter.
    pub filter: AccelFilter,
}

/// The gyroscope's settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GyroParams {
    /// Output data rate.
    pub odr: Odr,
    /// Full scale.
    pub full_scale: GyroFullScale,
    /// Low-pass filters.
    pub filter: GyroFilter,
}

/// Settings of the part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Params {
    /// The accelerometer.
    pub accel: AccelParams,
    /// The gyroscope.
    pub gyro: GyroParams,
    /// Whether a word is not updated between the reads of its two bytes. This protects each 16-bit word, not the set of
    /// six.
    pub block_data_update: bool,
    /// Pin that signals new samples.
    pub data_ready: Option<DataReady>,
    /// Enables the part's 25 µs counter, which the drivers do not read.
    pub timestamp: bool,
}

impl Params {
    /// A fresh sample at each tick of a 1 kHz timer.
    ///
    /// The part has no 1 kHz rate, and a clock of its own. So both sensors run at 6667 Hz, and at each tick the next
    /// data-ready edge is at most 150 µs away. Low-pass filters of matching cut-off (gyroscope 335 Hz, accelerometer
    /// 333 Hz) keep the signal below the 500 Hz that a 1 kHz timer can carry. 833 Hz would repeat samples; 1667 Hz
    /// leaves the gyroscope 1108 Hz wide.
    ///
    /// The filters are of second order. They fold motion above 500 Hz down, attenuated by 12 dB at 667 Hz, 17 dB at 900
    /// Hz and 19 dB at 1 kHz. `docs/reference/evaluation.md` compares settings that attenuate more, on a
    /// leg that rings.
    pub const FRESH_KILOHERTZ: Self = Self {
        accel: AccelParams {
            odr: Odr::Hz6667,
            full_scale: AccelFullScale::G16,
            filter: AccelFilter::OdrDiv20,
        },
        gyro: GyroParams {
            odr: Odr::Hz6667,
            full_scale: GyroFullScale::Dps2000,
            filter: GyroFilter::Lpf1(Ftype::F0),
        },
        block_data_update: true,
        data_ready: Some(DataReady {
            sensor: Sensor::Gyro,
            pin: Pin::Int1,
            mode: DataReadyMode::Pulsed,
        }),
        timestamp: true,
    };

    /// A fresh sample at each tick of a 417 Hz timer, for processors that are too slow for a kilohertz. As
    /// [`FRESH_KILOHERTZ`](Self::FRESH_KILOHERTZ), with filters of 148 and 171 Hz, below the 208 Hz that such a timer
    /// can carry.
    pub const FRESH_417_HERTZ: Self = Self {
        accel: AccelParams { filter: AccelFilter::OdrDiv45, ..Self::FRESH_KILOHERTZ.accel },
        gyro: GyroParams { filter: GyroFilter::Lpf1(Ftype::F2), ..Self::FRESH_KILOHERTZ.gyro },
        ..Self::FRESH_KILOHERTZ
    };

    /// Checks that the part supports this combination.
    ///
    /// # Errors
    /// The first invalid field, and the reason.
    pub const fn validate(&self) -> Result<Config, ParamsError> {
        let (accel_off, gyro_off) = (self.accel.odr.is_off(), self.gyro.odr.is_off());
        if accel_off && gyro_off {
            return ParamsError::new("accel.odr", "both sensors are off: nothing to measure");
        }
        if matches!(self.gyro.odr, Odr::Hz1_6) {
            return ParamsError::new("gyro.odr", "the gyroscope has no 1.6 Hz rate");
        }
        if matches!(self.accel.odr, Odr::Hz1_6) && self.accel.filter.uses_lpf2() {
            return ParamsError::new("accel.filter", "there is no LPF2 in low power at 1.6 Hz");
        }
        if let Some(data_ready) = self.data_ready {
            let off = match data_ready.sensor {
                Sensor::Accel => accel_off,
                Sensor::Gyro => gyro_off,
            };
            if off {
                return ParamsError::new("data_ready.sensor", "the sensor is off");
            }
        }
        Ok(Config::new(*self))
    }

    /// Register values for [`Config::writes`].
    const fn writes(&self) -> [Write; Config::WRITES] {
        let Params { accel, gyro, timestamp, .. } = *self;
        let (pulsed, int1, int2) = self.pins();
        let (lpf1, ftype) = match gyro.filter {
            GyroFilter::Lpf2 => (0, 0),
            GyroFilter::Lpf1(ftype) => (1, ftype.code()),
        };
        let low_power = matches!(accel.odr, Odr::Hz1_6);
        let fs_125 = matches!(gyro.full_scale, GyroFullScale::Dps125);
        [
            write(&register::FUNC_CFG_ACCESS, 0),
            write(&register::CTRL9_XL, I3C_DISABLED),
            write(
                &register::CTRL4_C,
                ctrl4_c::I2C_DISABLE.mask() | ctrl4_c::LPF1_SEL_G.place(lpf1),
            ),
            write(&register::CTRL3_C, self.ctrl3_c()),
            write(&register::I3C_BUS_AVB, 0),
            write(&register::COUNTER_BDR_REG1, pulsed),
            write(&register::INT1_CTRL, int1),
            write(&register::INT2_CTRL, int2),
            write(
                &register::CTRL6_C,
                ctrl6_c::FTYPE.place(ftype) | ctrl6_c::XL_HM_MODE.place(low_power as u8),
            ),
            write(&register::CTRL8_XL, ctrl8_xl::HPCF_XL.place(accel.filter.code())),
            write(&register::PIN_CTRL, register::PIN_CTRL.reset),
            write(&register::CTRL5_C, 0),
            write(&register::CTRL7_G, 0),
            write(&register::X_OFS_USR, 0),
            write(&register::Y_OFS_USR, 0),
            write(&register::Z_OFS_USR, 0),
            write(&register::CTRL10_C, ctrl10_c::TIMESTAMP_EN.place(timestamp as u8)),
            write(&register::FIFO_CTRL1, 0),
            write(&register::FIFO_CTRL2, 0),
            write(&register::FIFO_CTRL3, 0),
            write(&register::FIFO_CTRL4, 0),
            write(
                &register::CTRL2_G,
                ctrl2_g::ODR_G.place(gyro.odr.code())
                    | ctrl2_g::FS_G.place(gyro.full_scale.code())
                    | ctrl2_g::FS_125.place(fs_125 as u8),
            ),
            write(
                &register::CTRL1_XL,
                ctrl1_xl::ODR_XL.place(accel.odr.code())
                    | ctrl1_xl::FS_XL.place(accel.full_scale.code())
                    | ctrl1_xl::LPF2_XL_EN.place(accel.filter.uses_lpf2() as u8),
            ),
        ]
    }

    /// Value of `CTRL3_C`.
    pub(crate) const fn ctrl3_c(&self) -> u8 {
        ctrl3_c::IF_INC.mask() | ctrl3_c::BDU.place(self.block_data_update as u8)
    }

    /// Values of `COUNTER_BDR_REG1`, `INT1_CTRL` and `INT2_CTRL`.
    const fn pins(&self) -> (u8, u8, u8) {
        let (mut pulsed, mut int1, mut int2) = (0, 0, 0);
        if let Some(DataReady { sensor, pin, mode }) = self.data_ready {
            pulsed = match mode {
                DataReadyMode::Pulsed => counter_bdr_reg1::DATAREADY_PULSED.mask(),
                DataReadyMode::Latched => 0,
            };
            match (pin, sensor) {
                (Pin::Int1, Sensor::Accel) => int1 = int1_ctrl::DRDY_XL.mask(),
                (Pin::Int1, Sensor::Gyro) => int1 = int1_ctrl::DRDY_G.mask(),
                (Pin::Int2, Sensor::Accel) => int2 = int2_ctrl::DRDY_XL.mask(),
                (Pin::Int2, Sensor::Gyro) => int2 = int2_ctrl::DRDY_G.mask(),
            }
        }
        (pulsed, int1, int2)
    }
}

/// Validated settings. Only [`Params::validate`] creates them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    params: Params,
    writes: [Write; Self::WRITES],
}

/// A register and the value to write.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Write {
    /// Register to write.
    pub register: &'static Register,
    /// Value to write.
    pub value: u8,
}

impl Config {
    /// [`Params::FRESH_KILOHERTZ`], validated.
    pub const FRESH_KILOHERTZ: Self = Self::new(Params::FRESH_KILOHERTZ);

    /// [`Params::FRESH_417_HERTZ`], validated.
    pub const FRESH_417_HERTZ: Self = Self::new(Params::FRESH_417_HERTZ);

    /// The accelerometer's self-test: 52 Hz, ±4 g, everything else as after a reset.
    pub(crate) const ACCEL_SELF_TEST: Self =
        Self::new(Params { accel: AccelParams { odr: Odr::Hz52, ..SELF_TEST.accel }, ..SELF_TEST });

    /// The gyroscope's self-test: 208 Hz, ±2000 °/s, everything else as after a reset.
    pub(crate) const GYRO_SELF_TEST: Self =
        Self::new(Params { gyro: GyroParams { odr: Odr::Hz208, ..SELF_TEST.gyro }, ..SELF_TEST });

    const fn new(params: Params) -> Self {
        Self { params, writes: params.writes() }
    }

    /// Number of registers in a configuration.
    pub const WRITES: usize = 23;

    /// Adapts the settings to the bus: a part on I²C keeps this interface, and a part on SPI switches it off.
    pub(crate) const fn on_bus(mut self, is_i2c: bool) -> Self {
        if is_i2c {
            let [_, _, third, ..] = &mut self.writes;
            third.value &= !ctrl4_c::I2C_DISABLE.mask();
        }
        self
    }

    /// The settings as given.
    #[must_use]
    pub const fn params(&self) -> &Params {
        &self.params
    }

    /// Cut-off of the accelerometer's filter, Hz; `None` if it is off.
    #[must_use]
    pub fn accel_cutoff(&self) -> Option<f32> {
        let accel = &self.params.accel;
        (!accel.odr.is_off()).then(|| accel.odr.hertz() / accel.filter.divisor())
    }

    /// Cut-off of the gyroscope's filters, Hz; `None` if it is off or the cut-off is unknown.
    #[must_use]
    pub const fn gyro_cutoff(&self) -> Option<f32> {
        self.params.gyro.filter.cutoff(self.params.gyro.odr)
    }

    /// The configuration as register values, in the order in which they are written after a
    /// reset: the register bank and foreign interfaces first, data rates last.
    ///
    /// Registers that this configuration leaves at their reset value are included if another value
    /// would void the data: self-test, high-pass filter and low power of the gyroscope, user
    /// offsets, pins.
    pub fn writes(&self) -> impl Iterator<Item = Write> + '_ {
        self.writes.iter().copied()
    }

    /// Returns the write with this index in [`writes`](Self::writes); `None` from [`WRITES`](Self::WRITES) on.
    #[must_use]
    pub fn write(&self, index: usize) -> Option<Write> {
        self.writes.get(index).copied()
    }
}

/// Both sensors off, at the full scales and filters of their self-tests.
const SELF_TEST: Params = Params {
    accel: AccelParams {
        odr: Odr::Off,
        full_scale: AccelFullScale::G4,
        filter: AccelFilter::OdrDiv2,
    },
    gyro: GyroParams {
        odr: Odr::Off,
        full_scale: GyroFullScale::Dps2000,
        filter: GyroFilter::Lpf2,
    },
    block_data_update: true,
    data_ready: None,
    timestamp: false,
};

/// Value of `CTRL9_XL`.
pub(crate) const I3C_DISABLED: u8 = register::CTRL9_XL.reset | ctrl9_xl::I3C_DISABLE.mask();

const fn write(register: &'static Register, value: u8) -> Write {
    Write { register, value }
}

/// Reason why parameters were rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ParamsError {
    /// Path of the field in [`Params`].
    pub field: &'static str,
    /// Description of the problem.
    pub problem: &'static str,
}

impl ParamsError {
    const fn new(field: &'static str, problem: &'static str) -> Result<Config, Self> {
        Err(Self { field, problem })
    }
}

impl fmt::Display for ParamsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.field, self.problem)
    }
}

impl core::error::Error for ParamsError {}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    fn refused(change: impl FnOnce(&mut Params)) -> &'static str {
        let mut params = Params::FRESH_KILOHERTZ;
        change(&mut params);
        params.validate().map_or_else(|error| error.field, |_| "")
    }

    fn value_of(params: &Params, register: Register) -> u8 {
        let config = params.validate().unwrap();
        let mut found = config.writes().filter(|w| *w.register == register);
        let value = found.next().unwrap().value;
        assert!(found.next().is_none(), "{} is written twice", register.name);
        value
    }

    #[test]
    fn the_presets_cut_offs_match_and_lie_below_500_hz() {
        let accel = Config::FRESH_KILOHERTZ.accel_cutoff().unwrap();
        let gyro = Config::FRESH_KILOHERTZ.gyro_cutoff().unwrap();
        assert!((accel - 333.35).abs() < 0.01 && gyro == 335.0);
    }

    #[test]
    fn unsupported_setting_is_rejected_with_its_field_name() {
        assert_eq!(refused(|p| p.gyro.odr = Odr::Hz1_6), "gyro.odr");
        assert_eq!(refused(|p| p.accel.odr = Odr::Hz1_6), "accel.filter");
        assert_eq!(refused(|p| p.gyro.odr = Odr::Off), "data_ready.sensor");
        assert_eq!(
            refused(|p| {
                p.gyro.odr = Odr::Off;
                p.accel.odr = Odr::Off;
            }),
            "accel.odr"
        );
    }

    #[test]
    fn the_message_names_the_field_and_the_problem() {
        let mut params = Params::FRESH_KILOHERTZ;
        params.gyro.odr = Odr::Hz1_6;
        assert_eq!(
            params.validate().unwrap_err().to_string(),
            "gyro.odr: the gyroscope has no 1.6 Hz rate"
        );
    }

    #[test]
    fn no_configuration_touches_a_reserved_bit() {
        for odr in Odr::ALL {
            for full_scale in GyroFullScale::ALL {
                for ftype in Ftype::ALL {
                    let mut params = Params::FRESH_KILOHERTZ;
                    params.gyro.odr = odr;
                    params.gyro.full_scale = full_scale;
                    params.gyro.filter = GyroFilter::Lpf1(ftype);
                    let Ok(config) = params.validate() else {
                        continue;
                    };
                    for Write { register, value } in config.writes() {
                        assert!(register.keeps_reserved_bits(value), "{}", register.name);
                    }
                }
            }
        }
    }

    #[test]
    fn full_scales_use_the_codes_of_st() {
        let mut params = Params::FRESH_KILOHERTZ;
        for (full_scale, value) in AccelFullScale::ALL.into_iter().zip([0xA2, 0xAA, 0xAE, 0xA6]) {
            params.accel.full_scale = full_scale;
            assert_eq!(value_of(&params, register::CTRL1_XL), value, "{full_scale:?}");
        }
        let values = [0xA2, 0xA0, 0xA4, 0xA8, 0xAC];
        for (full_scale, value) in GyroFullScale::ALL.into_iter().zip(values) {
            params.gyro.full_scale = full_scale;
            assert_eq!(value_of(&params, register::CTRL2_G), value, "{full_scale:?}");
        }
    }

    #[test]
    fn the_data_ready_pin_is_driven_by_the_chosen_sensor_alone() {
        let mut params = Params::FRESH_KILOHERTZ;
        assert_eq!(value_of(&params, register::INT1_CTRL), 0x02);
        assert_eq!(value_of(&params, register::INT2_CTRL), 0x00);
        assert_eq!(value_of(&params, register::COUNTER_BDR_REG1), 0x80);
        params.data_ready =
            Some(DataReady { sensor: Sensor::Accel, pin: Pin::Int2, mode: DataReadyMode::Latched });
        assert_eq!(value_of(&params, register::INT1_CTRL), 0x00);
        assert_eq!(value_of(&params, register::INT2_CTRL), 0x01);
        assert_eq!(value_of(&params, register::COUNTER_BDR_REG1), 0x00);
    }
}
