//! Parameters of the attitude filter, and its coefficients at a sample rate.

use super::inclination::InclinationCoefficients;
use super::quietness::QuietnessCoefficients;
use crate::attitude::rest::{RestCoefficients, RestParams};
use crate::order::Order;
use crate::units::{DEGREE, STANDARD_GRAVITY};

/// Longest time between samples, s, across which the gyroscope can be integrated for a foot that
/// swings; three sample periods at low rates. A longer time is a gap, in which the turn is a guess.
///
/// RMS of the tilt in the stances of simulated feet with 5 % of the samples lost in bursts; the error
/// comes from the change of rate between the two samples on either side:
///
/// | burst | walk | trot | run |
/// |---|---|---|---|
/// | none | 0.04° | 0.09° | 0.4° |
/// | 10 ms | 0.07° | 0.2° | 0.5° |
/// | 20 ms | 0.2° | 0.7° | 1.1° |
/// | 30 ms | 0.3° | 1.4° | 2.5° |
/// | 40 ms | 1.0° | 3.7° | 4.1° |
const LONGEST_STEP: f32 = 0.03;

/// Longest gap, s, across which the two samples on either side are used to guess how far the foot turned. A leg
/// returns: after a gap of 60 ms in every two seconds, a walking GO1, NAO and shoe keep an RMSE of 0.25, 0.29 and 0.30,
/// where it is 0.54, 0.59 and 0.45 if up has to be found again.
const LONGEST_GUESS: f32 = 0.5;

/// Time within the sample period to which a gyroscope sample refers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GyroTiming {
    /// A sample is the mean over the sample period that ends with it, as from a sensor whose
    /// low-pass filter fits the rate: half a period of delay.
    PeriodMean,
    /// A sample is the rate this many seconds before its timestamp: 0 for an ideal simulated
    /// gyroscope.
    Delay(f32),
}

/// Parameters of the attitude filter. Times are in seconds; the result does not depend on
/// the sample rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeParams {
    /// Time to which a gyroscope sample refers.
    pub gyro_timing: GyroTiming,
    /// Time constant of the inclination correction while the foot moves, s.
    pub motion_time_constant: f32,
    /// Factor by which the correction is faster while the foot is perfectly quiet.
    pub quiet_gain: f32,
    /// Deviation of the acceleration from its short mean that still counts as quiet, m/s²: a few times the sensor's noise.
    pub quiet_acceleration: f32,
    /// Angular rate that still counts as quiet, rad/s.
    pub quiet_rate: f32,
    /// Rest detection and bias estimation.
    pub rest: RestParams,
}

impl Default for AttitudeParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

impl AttitudeParams {
    /// Valid for every sensor, robot and rate. Chosen on the six BROAD trials, the GO1
    /// recordings and a simulated foot together.
    ///
    /// | field | value | reason |
    /// |---|---|---|
    /// | `gyro_timing` | period mean | the delay of a low-pass at a third of the rate |
    /// | `motion_time_constant` | 5 s | 4 to 6 s give the same; VQF uses 3 s with √2/3 where this has 2/5 rad/s |
    /// | `quiet_gain` | 200 | tilt settles within a short stance; 30 is too slow for a foot on a mattress, 600 costs accuracy in the hand |
    /// | `quiet_acceleration` | 0.025 g | a dozen times the sensor's noise of 2 mg; more lets flat sliding pass for rest |
    /// | `quiet_rate` | 3 °/s | above the trembling of a loaded leg, far below a swing |
    pub const DEFAULT: Self = Self {
        gyro_timing: GyroTiming::PeriodMean,
        motion_time_constant: 5.0,
        quiet_gain: 200.0,
        quiet_acceleration: 0.025 * STANDARD_GRAVITY,
        quiet_rate: 3.0 * DEGREE,
        rest: RestParams::DEFAULT,
    };
}

/// Validated [`AttitudeParams`] in the form used by the filter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttitudeCoefficients {
    /// Sample period, s.
    pub(super) period: f32,
    /// Longest time between samples that is integrated over, s.
    pub(super) longest_step: f32,
    /// Longest gap across which the turn is estimated, s.
    pub(super) longest_guess: f32,
    /// Delay of the gyroscope, s.
    pub(super) gyro_delay: f32,
    pub(super) inclination: InclinationCoefficients,
    pub(super) quietness: QuietnessCoefficients,
    pub(super) rest: RestCoefficients,
}

impl AttitudeCoefficients {
    /// Coefficients of checked parameters at a sample rate, Hz.
    pub fn new(params: &AttitudeParams, sample_rate: f32) -> Self {
        Self {
            period: 1.0 / sample_rate,
            longest_step: LONGEST_STEP.greater(3.5 / sample_rate),
            longest_guess: LONGEST_GUESS.greater(3.5 / sample_rate),
            gyro_delay: match params.gyro_timing {
                GyroTiming::PeriodMean => 0.5 / sample_rate,
                GyroTiming::Delay(delay) => delay,
            },
            inclination: InclinationCoefficients::new(params.motion_time_constant),
            quietness: QuietnessCoefficients::new(
                params.quiet_gain,
                params.quiet_acceleration,
                params.quiet_rate,
            ),
            rest: RestCoefficients::new(&params.rest),
        }
    }
}
