//! A recorded or simulated stream: what every source gives and every consumer takes.

use estimator_core::{Gravity, ImuSample, Load};

/// The truth about a sample, where it is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Label {
    /// The foot is in stable contact.
    Stable,
    /// It is not: it swings, lands, slips or lifts off.
    NotStable,
}

/// One row of a recording.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RecordedSample {
    /// What the IMU measured, SI units, with its time.
    pub imu: ImuSample,
    /// The load on the foot, where it was recorded.
    pub load: Option<Load>,
    /// The truth, where it is known.
    pub label: Option<Label>,
}

/// A stream of samples with what its source knows about it.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// Where it comes from, for titles and messages.
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
    /// Time from the first sample to the last, s; 0 where there is none.
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
    /// When the sample was acquired, s since the recording's clock started.
    #[must_use]
    pub fn time_s(&self) -> f64 {
        self.imu.timestamp.as_micros() as f64 / 1.0e6
    }
}
