//! Table of all parameters, with their names, units, ranges and defaults.
//!
//! [`Params::validate`], the object dictionary and the configuration file check by it. A new
//! parameter needs only a row here, beside its field in [`Params`]. The numbers of a warm start
//! have their rows in [`Learnt::ROWS`]; the constants of self-calibration cannot be set and are
//! checked by the compiler.

use crate::attitude::GyroTiming;
use crate::params::{Params, WindowLength};
use crate::range::{ParamsError, in_range, name, ranges};
use crate::stillness::Learnt;
use crate::units::Unit;

pub use crate::range::Row;

/// Generates the enumeration and the functions below, from one row per parameter.
macro_rules! parameters {
    ($($variant:ident = $head:ident $(. $tail:ident)*, $unit:ident, $least:literal to $most:literal;)*) => {
        /// A number of [`Params`]; its documentation is its name, its range and its unit.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Parameter {
            $(
                #[doc = concat!(
                    "`", stringify!($head) $(, ".", stringify!($tail))*, "`: ",
                    stringify!($least), " to ", stringify!($most), ", [`Unit::", stringify!($unit), "`]."
                )]
                $variant,
            )*
        }

        impl Parameter {
            /// All parameters, in the order in which they are checked.
            pub const ALL: [Self; [$(stringify!($variant)),*].len()] = [$(Self::$variant),*];

            /// The table, in the order of [`Self::ALL`].
            const ROWS: [Row; Self::ALL.len()] = [$(Row {
                name: name(concat!(stringify!($head) $(, ".", stringify!($tail))*)),
                unit: Unit::$unit,
                least: $least,
                most: $most,
                default: Params::DEFAULT.$head$(.$tail)*,
            }),*];

            /// The row of the table.
            #[must_use]
            #[allow(clippy::indexing_slicing)] // There are as many rows as numbers.
            pub const fn row(self) -> Row {
                Self::ROWS[self as usize]
            }

            /// The path in [`Params`]; empty on a microcontroller, to save space.
            #[must_use]
            pub const fn name(self) -> &'static str {
                if cfg!(target_os = "none") { "" } else { self.row().name }
            }

            /// Returns its value in `params`.
            #[must_use]
            pub const fn get(self, params: &Params) -> f32 {
                match self {
                    $(Self::$variant => params.$head$(.$tail)*,)*
                }
            }

            /// Sets it in `params` without a check: [`Params::validate`] checks it.
            // As a separate function it is a look-up of the field's offset; inlined it is a branch per field.
            #[inline(never)]
            pub const fn set(self, params: &mut Params, value: f32) {
                let field = match self {
                    $(Self::$variant => &mut params.$head$(.$tail)*,)*
                };
                *field = value;
            }
        }
    };
}

parameters! {
    SampleRate = sample_rate, Hertz, 20.0 to 10_000.0;
    BandwidthAx = bandwidth.ax, MetrePerSecondSquared, 1.0e-6 to 1.0e3;
    BandwidthAy = bandwidth.ay, MetrePerSecondSquared, 1.0e-6 to 1.0e3;
    BandwidthAz = bandwidth.az, MetrePerSecondSquared, 1.0e-6 to 1.0e3;
    BandwidthWx = bandwidth.wx, RadianPerSecond, 1.0e-6 to 1.0e3;
    BandwidthWy = bandwidth.wy, RadianPerSecond, 1.0e-6 to 1.0e3;
    BandwidthWz = bandwidth.wz, RadianPerSecond, 1.0e-6 to 1.0e3;
    HalfWidthAx = half_width.ax, MetrePerSecondSquared, 1.0e-6 to 1.0e4;
    HalfWidthAy = half_width.ay, MetrePerSecondSquared, 1.0e-6 to 1.0e4;
    HalfWidthAz = half_width.az, MetrePerSecondSquared, 1.0e-6 to 1.0e4;
    HalfWidthWx = half_width.wx, RadianPerSecond, 1.0e-6 to 1.0e4;
    HalfWidthWy = half_width.wy, RadianPerSecond, 1.0e-6 to 1.0e4;
    HalfWidthWz = half_width.wz, RadianPerSecond, 1.0e-6 to 1.0e4;
    DecisionThreshold = decision.threshold, One, 0.01 to 0.99;
    DecisionOnDelay = decision.on_delay, Second, 0.0 to 10.0;
    DecisionOffDelay = decision.off_delay, Second, 0.0 to 10.0;
    LoadOnThreshold = load.on_threshold, LoadSignal, -1.0e9 to 1.0e9;
    LoadOffThreshold = load.off_threshold, LoadSignal, -1.0e9 to 1.0e9;
    MotionTimeConstant = attitude.motion_time_constant, Second, 0.1 to 100.0;
    QuietGain = attitude.quiet_gain, One, 1.0 to 1.0e4;
    QuietAcceleration = attitude.quiet_acceleration, MetrePerSecondSquared, 1.0e-3 to 10.0;
    QuietRate = attitude.quiet_rate, RadianPerSecond, 1.0e-4 to 1.0;
    RestDuration = attitude.rest.duration, Second, 0.1 to 100.0;
    RestAcceleration = attitude.rest.acceleration, MetrePerSecondSquared, 1.0e-3 to 10.0;
    RestRate = attitude.rest.rate, RadianPerSecond, 1.0e-4 to 1.0;
    BiasLimit = attitude.rest.bias_limit, RadianPerSecond, 0.0 to 1.0;
    BiasTimeConstant = attitude.rest.bias_time_constant, Second, 0.1 to 1.0e3;
    VelocitySpeed = velocity.speed, MetrePerSecond, 1.0e-3 to 10.0;
    VelocityLever = velocity.lever, Metre, 0.0 to 10.0;
    VelocityFloor = velocity.floor, MetrePerSecond, 1.0e-4 to 1.0;
}

/// Limits of the window if it is a duration. It must also contain at least one sample, and no more
/// than the estimator's capacity.
pub const WINDOW: Row = Row {
    name: name("window"),
    unit: Unit::Second,
    least: 1.0e-4,
    most: 1.0e3,
    default: match Params::DEFAULT.window {
        WindowLength::Duration(seconds) => seconds,
        WindowLength::Samples(samples) => samples as f32 / Params::DEFAULT.sample_rate,
    },
};

/// Limits of the gyroscope's delay if its timing is one.
pub const GYRO_DELAY: Row = Row {
    name: name("attitude.gyro_timing"),
    unit: Unit::Second,
    least: 0.0,
    most: 0.05,
    default: match Params::DEFAULT.attitude.gyro_timing {
        GyroTiming::Delay(seconds) => seconds,
        GyroTiming::PeriodMean => 0.5 / Params::DEFAULT.sample_rate,
    },
};

/// All rows.
pub fn rows() -> impl Iterator<Item = Row> {
    Parameter::ALL
        .into_iter()
        .map(Parameter::row)
        .chain([WINDOW, GYRO_DELAY])
        .chain(Learnt::ROWS)
}

static RANGES: [(f32, f32); Parameter::ALL.len()] = ranges(&Parameter::ROWS);

/// Checks that every number is in its range, and that the load's off threshold does not exceed its
/// on threshold.
pub(crate) fn check(params: &Params) -> Result<(), ParamsError> {
    for (parameter, (least, most)) in Parameter::ALL.into_iter().zip(RANGES) {
        let most = match parameter {
            Parameter::LoadOffThreshold => params.load.on_threshold,
            _ => most,
        };
        in_range(parameter.name(), parameter.get(params), least, most)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_set_alone_and_read_back() {
        for parameter in Parameter::ALL {
            let mut params = Params::DEFAULT;
            assert_eq!(parameter.get(&params), parameter.row().default);
            parameter.set(&mut params, 4321.0);
            for other in Parameter::ALL {
                let expected = match other == parameter {
                    true => 4321.0,
                    false => other.row().default,
                };
                assert_eq!(other.get(&params), expected, "{parameter:?}, {other:?}");
            }
        }
    }

    #[test]
    fn names_are_unique_and_defaults_are_in_range() {
        for row in rows() {
            assert_eq!(row.check(row.default), Ok(()));
            assert_eq!(rows().filter(|other| other.name == row.name).count(), 1);
        }
    }

    #[test]
    fn range_ends_are_accepted_and_values_beyond_are_rejected() {
        for parameter in Parameter::ALL {
            let Row {
                name, least, most, ..
            } = parameter.row();
            let check_with = |value: f32| {
                let mut params = Params::DEFAULT;
                // Keeps the load's off threshold below every tested value.
                params.load.off_threshold = -1.0e9;
                if parameter == Parameter::LoadOffThreshold {
                    params.load.on_threshold = most;
                }
                parameter.set(&mut params, value);
                check(&params)
            };
            for value in [least, most] {
                assert_eq!(check_with(value), Ok(()), "{name}");
            }
            for value in [least.next_down(), most.next_up(), f32::NAN] {
                let Err(ParamsError::OutOfRange { field, .. }) = check_with(value) else {
                    panic!("{name} may be {value}");
                };
                assert_eq!(field, name);
            }
        }
    }
}
