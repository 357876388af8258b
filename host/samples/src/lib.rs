//! A recorded or simulated stream of a foot's samples, in SI units, and its estimates.
//!
//! | part | module |
//! |---|---|
//! | a sample with its load and label, a recording in memory, the names and codes of their parts in files | this one |
//! | the estimator applied to them | [`estimate`] |
//! | counts of the steps between their times | [`steps`] |
//! | mounting of the sensor in the foot: as text, from gravity at rest, as a report | [`mounting`] |
//! | vectors and rotations in f64 | [`space`] |
//! | messages of ROS 2 with samples or contacts | [`ros`] |
//! | numbers in messages, enums whose variants have names | [`number`], [`mod@named`] |

pub mod estimate;
pub mod mounting;
pub mod named;
pub mod number;
pub mod ros;
pub mod space;
pub mod steps;

use estimator_core::{
    AngularRate, Gravity, ImuSample, Load, Phase, Saturation, SpecificForce, Timestamp, Validity,
    Vec3,
};

/// True state of a sample, if known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Label {
    /// The foot is in stable contact.
    Stable,
    /// The foot swings, lands, slips or lifts off.
    NotStable,
}

/// One row of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedSample {
    /// Measurement of the IMU, SI units, with its time.
    pub imu: ImuSample,
    /// Load on the foot, if recorded.
    pub load: Option<Load>,
    /// True state, if known.
    pub label: Option<Label>,
}

/// A stream of samples with its properties.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Name of the source, for titles and messages.
    pub name: String,
    /// Samples per second.
    pub sample_rate: f32,
    /// Whether the accelerometer samples contain gravity.
    pub gravity: Gravity,
    /// Name and unit of the load signal, for axis titles, such as `vertical force (N)`.
    pub load_title: String,
    /// The samples in order of time.
    pub samples: Vec<RecordedSample>,
}

impl Recording {
    /// Time from the first sample to the last, s; 0 if there are no samples.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match (self.samples.first(), self.samples.last()) {
            (Some(first), Some(last)) => {
                let elapsed = last.imu.timestamp.micros_since(first.imu.timestamp);
                elapsed.unwrap_or(0) as f64 / 1.0e6
            }
            _ => 0.0,
        }
    }
}

impl RecordedSample {
    /// Time of the sample, s since the start of the recording's clock.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.imu.timestamp.as_micros() as f64 / 1.0e6
    }
}

/// Converts six readings in SI units, in the order of [`Axis::ALL`](estimator_core::Axis::ALL), into a sample in the
/// frame of the sensor.
#[must_use]
pub fn imu_sample(timestamp: Timestamp, readings: [f64; 6], validity: Validity) -> ImuSample {
    let [ax, ay, az, wx, wy, wz] = readings.map(|value| value as f32);
    ImuSample {
        timestamp,
        specific_force: SpecificForce(Vec3::new(ax, ay, az)),
        angular_rate: AngularRate(Vec3::new(wx, wy, wz)),
        validity,
    }
}

/// Load of a number; `None` if it is not finite, which marks an unknown load.
#[must_use]
pub fn finite_load(value: f64) -> Option<Load> {
    value.is_finite().then_some(Load(value as f32))
}

/// Time of row `index` at a constant `sample_rate` in Hz.
#[must_use]
pub fn steady_time(index: usize, sample_rate: f32) -> Timestamp {
    let micros = index as f64 * 1.0e6 / f64::from(sample_rate);
    Timestamp::from_micros(micros.round() as u64)
}

/// Values of the column `validity`.
pub const VALIDITIES: [(&str, Validity); 6] = [
    ("valid", Validity::Valid),
    ("accelerometer_saturated", Validity::Saturated(Saturation::Accelerometer)),
    ("gyroscope_saturated", Validity::Saturated(Saturation::Gyroscope)),
    ("both_saturated", Validity::Saturated(Saturation::Both)),
    ("stale", Validity::Stale),
    ("invalid", Validity::Invalid),
];

/// Name of a validity.
#[must_use]
pub fn validity_name(validity: Validity) -> &'static str {
    let known = VALIDITIES.iter().find(|(_, known)| *known == validity);
    known.map_or(VALIDITIES[0].0, |(name, _)| name)
}

/// Validity with this name.
#[must_use]
pub fn validity_of_name(name: &str) -> Option<Validity> {
    let known = VALIDITIES.iter().find(|(known, _)| *known == name);
    known.map(|(_, validity)| *validity)
}

/// Returns the code of a phase: its place in [`Phase::ALL`].
#[must_use]
pub const fn phase_code(phase: Phase) -> u8 {
    phase as u8
}

/// Returns the phase of a code; unknown for an invalid one.
#[must_use]
pub fn phase_of_code(code: u8) -> Phase {
    let phase = Phase::ALL.get(usize::from(code));
    phase.copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_places_among_all_phases() {
        for (place, phase) in Phase::ALL.into_iter().enumerate() {
            assert_eq!(usize::from(phase_code(phase)), place);
            assert_eq!(phase_of_code(phase_code(phase)), phase);
        }
        assert_eq!(phase_of_code(6), Phase::Unknown);
        assert_eq!(phase_of_code(u8::MAX), Phase::Unknown);
    }
}
