//! A recorded or simulated stream, as sources produce and consumers take it.

use estimator_core::{Gravity, ImuSample, Load};

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
