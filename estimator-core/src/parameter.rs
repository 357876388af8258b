//! Table of all parameters, with their names, units, ranges and defaults.
//!
//! [`Params::validate`], the object dictionary and the configuration file use it for their checks. A new
//! parameter needs a row here, its field in [`Params`], and an entry in the object dictionary: see
//! `docs/design/architecture.md`. The rate of the samples has its row in [`SAMPLE_RATE`], the numbers of a warm start in
//! [`Learnt::ROWS`], and the constants of self-calibration check themselves.

use crate::params::{AnyParams, GyroTiming, HalfWidthParams, Learnt, Params, WindowLength};

pub use crate::range::Row;
use crate::range::{ParamsError, in_range, name};
pub use crate::stream::SAMPLE_RATE;
pub use crate::units::Unit;

/// Generates the enumeration and the functions below, from one row per parameter, in groups of one struct each.
macro_rules! parameters {
    ($($group:ident: $Group:ident {
        $($variant:ident = $head:ident $(. $tail:ident)*, $unit:ident, $least:literal to $most:literal, $key:literal: $about:expr;)*
    })*) => {
        /// A number of [`AnyParams`]; its documentation is its name, its range and its unit.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Parameter {
            $($(
                #[doc = concat!(
                    "`", $key, "`: ",
                    stringify!($least), " to ", stringify!($most), ", [`Unit::", stringify!($unit), "`]."
                )]
                $variant,
            )*)*
        }

        impl Parameter {
            /// All parameters, in the order in which they are checked.
            pub const ALL: [Self; [$($(stringify!($variant)),*),*].len()] = [$($(Self::$variant),*),*];

            /// The table, in the order of [`Self::ALL`].
            const ROWS: [Row; Self::ALL.len()] = [$($(Row {
                name: name($key),
                about: name($about),
                unit: Unit::$unit,
                least: $least,
                most: $most,
                default: AnyParams::DEFAULT.$group.$head$(.$tail)*,
            }),*),*];

            /// The row of the table.
            #[must_use]
            #[allow(clippy::indexing_slicing)] // There are as many rows as numbers.
            pub const fn row(self) -> Row {
                Self::ROWS[self as usize]
            }

            /// Name in files, in messages and on a foot; empty on a microcontroller, to save space.
            #[must_use]
            pub const fn name(self) -> &'static str {
                if cfg!(target_os = "none") { "" } else { self.row().name }
            }

            /// Returns its value in `params`.
            #[must_use]
            pub const fn get(self, params: &AnyParams) -> f32 {
                match self {
                    $($(Self::$variant => params.$group.$head$(.$tail)*,)*)*
                }
            }

            /// Sets the number in `params` without a check. [`AnyParams::validate`] checks it.
            // As a separate function it is a look-up of the field's offset; inlined it is a branch per field.
            #[inline(never)]
            pub const fn set(self, params: &mut AnyParams, value: f32) {
                let field = match self {
                    $($(Self::$variant => &mut params.$group.$head$(.$tail)*,)*)*
                };
                *field = value;
            }
        }

        $(impl $Group {
            const PARAMETERS: [Parameter; [$(stringify!($variant)),*].len()] = [$(Parameter::$variant),*];

            /// The numbers, in the order of [`Self::PARAMETERS`].
            const fn numbers(&self) -> [f32; Self::PARAMETERS.len()] {
                [$(self.$head$(.$tail)*),*]
            }
        })*
    };
}

const BANDWIDTH: &str = "kernel standard deviation h: the sensor's noise at its filter setting";
// Half-widths end at that of free fall, 9.8 m/s², above the largest of the paper, 0.9 g and 100 °/s. An off delay ends at
// the shortest swings. Settings beyond these limits would call every swing stable.
const HALF_WIDTH: &str = "half-width δ: motion within ±δ counts as rest; it belongs to a robot";

parameters! {
    params: Params {
        DecisionThreshold = decision.threshold, One, 0.01 to 0.99, "decision.threshold":
            "probability above which contact counts as stable";
        DecisionOnDelay = decision.on_delay, Second, 0.0 to 10.0, "decision.on_delay_s":
            "time for which the probability must be above the threshold before the decision is stable";
        DecisionOffDelay = decision.off_delay, Second, 0.0 to 0.2, "decision.off_delay_s":
            "time for which the probability must be at or below the threshold before the decision is not stable";
        LoadOnThreshold = load.on_threshold, LoadSignal, -1.0e9 to 1.0e9, "load.on_threshold":
            "load from which the foot counts as loaded, in the unit of the load signal";
        LoadOffThreshold = load.off_threshold, LoadSignal, -1.0e9 to 1.0e9, "load.off_threshold":
            "load below which the foot counts as unloaded, in the unit of the load signal";
        MotionTimeConstant = attitude.motion_time_constant, Second, 0.1 to 100.0, "attitude.motion_time_constant_s":
            "time constant of the inclination's correction while the foot moves";
        QuietGain = attitude.quiet_gain, One, 1.0 to 1.0e4, "attitude.quiet_gain":
            "factor by which the inclination's correction is faster while the foot is perfectly quiet";
        QuietAcceleration = attitude.quiet_acceleration, MetrePerSecondSquared, 1.0e-3 to 10.0, "attitude.quiet_acceleration_m_s2":
            "deviation of the acceleration from its short mean that still counts as quiet";
        QuietRate = attitude.quiet_rate, RadianPerSecond, 1.0e-4 to 1.0, "attitude.quiet_rate_rad_s":
            "angular rate that still counts as quiet";
        RestDuration = attitude.rest.duration, Second, 0.1 to 100.0, "attitude.rest.duration_s":
            "time for which the sensor must be still to be at rest";
        RestAcceleration = attitude.rest.acceleration, MetrePerSecondSquared, 1.0e-3 to 10.0, "attitude.rest.acceleration_m_s2":
            "largest deviation of the acceleration from its mean at rest";
        RestRate = attitude.rest.rate, RadianPerSecond, 1.0e-4 to 1.0, "attitude.rest.rate_rad_s":
            "largest deviation of the angular rate from its mean at rest";
        BiasLimit = attitude.rest.bias_limit, RadianPerSecond, 0.0 to 1.0, "attitude.rest.bias_limit_rad_s":
            "largest gyroscope bias per axis that is accepted at the first rest; 0: the bias is not estimated";
        BiasTimeConstant = attitude.rest.bias_time_constant, Second, 0.1 to 1.0e3, "attitude.rest.bias_time_constant_s":
            "time constant of the bias estimate at rest";
        VelocitySpeed = velocity.speed, MetrePerSecond, 1.0e-3 to 10.0, "velocity.speed_m_s":
            "standard deviation of the velocity of a foot that does not turn and is in stable contact with a probability of a half";
        VelocityLever = velocity.lever, Metre, 0.0 to 10.0, "velocity.lever_m":
            "distance between the IMU and the point about which a standing foot turns";
        VelocityFloor = velocity.floor, MetrePerSecond, 1.0e-4 to 1.0, "velocity.floor_m_s":
            "least standard deviation of the velocity, of a foot in certain contact";
    }
    half_widths: HalfWidthParams {
        BandwidthAx = bandwidth.ax, MetrePerSecondSquared, 1.0e-6 to 1.0e3, "bandwidth.acceleration_m_s2.ax": BANDWIDTH;
        BandwidthAy = bandwidth.ay, MetrePerSecondSquared, 1.0e-6 to 1.0e3, "bandwidth.acceleration_m_s2.ay": BANDWIDTH;
        BandwidthAz = bandwidth.az, MetrePerSecondSquared, 1.0e-6 to 1.0e3, "bandwidth.acceleration_m_s2.az": BANDWIDTH;
        BandwidthWx = bandwidth.wx, RadianPerSecond, 1.0e-6 to 1.0e3, "bandwidth.angular_rate_rad_s.wx": BANDWIDTH;
        BandwidthWy = bandwidth.wy, RadianPerSecond, 1.0e-6 to 1.0e3, "bandwidth.angular_rate_rad_s.wy": BANDWIDTH;
        BandwidthWz = bandwidth.wz, RadianPerSecond, 1.0e-6 to 1.0e3, "bandwidth.angular_rate_rad_s.wz": BANDWIDTH;
        HalfWidthAx = half_width.ax, MetrePerSecondSquared, 1.0e-6 to 10.0, "half_width.acceleration_m_s2.ax": HALF_WIDTH;
        HalfWidthAy = half_width.ay, MetrePerSecondSquared, 1.0e-6 to 10.0, "half_width.acceleration_m_s2.ay": HALF_WIDTH;
        HalfWidthAz = half_width.az, MetrePerSecondSquared, 1.0e-6 to 10.0, "half_width.acceleration_m_s2.az": HALF_WIDTH;
        HalfWidthWx = half_width.wx, RadianPerSecond, 1.0e-6 to 3.0, "half_width.angular_rate_rad_s.wx": HALF_WIDTH;
        HalfWidthWy = half_width.wy, RadianPerSecond, 1.0e-6 to 3.0, "half_width.angular_rate_rad_s.wy": HALF_WIDTH;
        HalfWidthWz = half_width.wz, RadianPerSecond, 1.0e-6 to 3.0, "half_width.angular_rate_rad_s.wz": HALF_WIDTH;
    }
}

/// Limits of the window if it is a duration. It must also contain at least one sample, and no more
/// than the estimator's capacity.
pub const WINDOW: Row = Row {
    name: name("window"),
    about: name("length of the estimate's window"),
    unit: Unit::Second,
    least: 1.0e-4,
    most: 1.0e3,
    default: match HalfWidthParams::DEFAULT.window {
        WindowLength::Duration(seconds) => seconds,
        WindowLength::Samples(samples) => samples as f32 / SAMPLE_RATE.default,
    },
};

/// Limits of the gyroscope's delay if its timing is a delay.
pub const GYRO_DELAY: Row = Row {
    name: name("attitude.gyro_timing"),
    about: name(
        "when the gyroscope measured what a sample says: the mean over the period before it, or a delay \
         behind the accelerometer",
    ),
    unit: Unit::Second,
    least: 0.0,
    most: 0.05,
    default: match Params::DEFAULT.attitude.gyro_timing {
        GyroTiming::Delay(seconds) => seconds,
        GyroTiming::PeriodMean => 0.5 / SAMPLE_RATE.default,
    },
};

/// All rows.
pub fn rows() -> impl Iterator<Item = Row> {
    let numbers = Parameter::ALL.into_iter().map(Parameter::row);
    [SAMPLE_RATE].into_iter().chain(numbers).chain([WINDOW, GYRO_DELAY]).chain(Learnt::ROWS)
}

/// Ranges as stored in the foot's flash, without names, units and defaults. Only the compiler evaluates this function,
/// and it would report an index out of range.
#[allow(clippy::indexing_slicing)]
const fn ranges<const N: usize>(rows: &[Row; N]) -> [(f32, f32); N] {
    let mut ranges = [(0.0, 0.0); N];
    let mut i = 0;
    while i < N {
        ranges[i] = (rows[i].least, rows[i].most);
        i += 1;
    }
    ranges
}

static RANGES: [(f32, f32); Parameter::ALL.len()] = ranges(&Parameter::ROWS);

/// Checks that every number is in its range, the load's off threshold is at most its on threshold, and the learnt state
/// is consistent.
pub(crate) fn check(params: &Params) -> Result<(), ParamsError> {
    check_numbers(&Params::PARAMETERS, &params.numbers(), params.load.on_threshold)?;
    if let GyroTiming::Delay(delay) = params.attitude.gyro_timing {
        GYRO_DELAY.check(delay)?;
    }
    match &params.learnt {
        Some(learnt) => learnt.validate(),
        None => Ok(()),
    }
}

/// Checks that every number is in its range. The window depends on the sample rate and is not checked.
pub(crate) fn check_half_widths(params: &HalfWidthParams) -> Result<(), ParamsError> {
    check_numbers(&HalfWidthParams::PARAMETERS, &params.numbers(), f32::NAN)
}

/// Checks numbers against their ranges. The range of the off threshold ends at `load_on`.
fn check_numbers(
    parameters: &[Parameter],
    values: &[f32],
    load_on: f32,
) -> Result<(), ParamsError> {
    for (&parameter, &value) in parameters.iter().zip(values) {
        let Some(&(least, most)) = RANGES.get(parameter as usize) else {
            continue;
        };
        let most = if parameter == Parameter::LoadOffThreshold { load_on } else { most };
        in_range(parameter.name(), value, least, most)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_any(params: &AnyParams) -> Result<(), ParamsError> {
        check(&params.params)?;
        check_half_widths(&params.half_widths)
    }

    #[test]
    fn every_number_is_set_alone_and_read_back() {
        for parameter in Parameter::ALL {
            let mut params = AnyParams::DEFAULT;
            assert_eq!(parameter.get(&params), parameter.row().default);
            parameter.set(&mut params, 4321.0);
            for other in Parameter::ALL {
                let expected = if other == parameter { 4321.0 } else { other.row().default };
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
            let Row { name, least, most, .. } = parameter.row();
            let check_with = |value: f32| {
                let mut params = AnyParams::DEFAULT;
                // Keeps the load's off threshold below every tested value.
                params.params.load.off_threshold = -1.0e9;
                if parameter == Parameter::LoadOffThreshold {
                    params.params.load.on_threshold = most;
                }
                parameter.set(&mut params, value);
                check_any(&params)
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
