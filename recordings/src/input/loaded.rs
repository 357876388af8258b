//! What a reader needs besides a file, and what it returns.

use estimator_core::{AngularRate, Gravity, ImuSample, SpecificForce, Timestamp, Validity, Vec3};

use super::correction::Correction;
use super::options::TableOptions;
use super::topics::BagOptions;
use crate::recording::Recording;

/// What is known about a file beyond its format.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hints {
    /// Sample rate in Hz, above 0, where it is given.
    pub sample_rate: Option<f32>,
    /// Whether the samples contain gravity, where it differs from what the format says.
    pub gravity: Option<Gravity>,
    /// The sensor's static calibration, and its mounting.
    pub correction: Correction,
    /// How columns with names are to be understood; units and times are those of bags, too.
    pub table: TableOptions,
    /// Which topics of a bag are read.
    pub bag: BagOptions,
}

/// Rows of a `csv` that are not in the recording as they stand in the file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Rows left out because all six axes are blank in them.
    pub blank_rows: usize,
    /// Rows left out because their times do not advance.
    pub dropped_rows: usize,
    /// Rows that got another time.
    pub retimed_rows: usize,
}

impl Repairs {
    /// One sentence on each that there is.
    pub(super) fn notices(self, file: &str) -> Vec<String> {
        let Self {
            blank_rows,
            dropped_rows,
            retimed_rows,
        } = self;
        [
            (blank_rows, "left out, in which all six axes are blank"),
            (dropped_rows, "left out, whose times do not advance"),
            (
                retimed_rows,
                "moved by more than half a period, to where the sample rate has them",
            ),
        ]
        .into_iter()
        .filter(|(rows, _)| *rows > 0)
        .map(|(rows, what)| {
            let noun = if rows == 1 { "row" } else { "rows" };
            format!("{file}: {rows} {noun} {what}")
        })
        .collect()
    }
}

/// A file that has been read.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The recording. Its first sample is at time 0.
    pub recording: Recording,
    /// What the file's clock says at the first sample, µs; 0 where the file has no clock. It may
    /// be negative, as before a trigger, or count from 1970.
    pub start_us: i64,
    /// One sentence on each thing that was left out or reinterpreted, for people to read.
    pub notices: Vec<String>,
    /// Rows that were left out or got another time.
    pub repairs: Repairs,
}

/// The time of row `index` at a steady `sample_rate` in Hz.
pub(super) fn steady_time(index: usize, sample_rate: f32) -> Timestamp {
    let micros = index as f64 * 1.0e6 / f64::from(sample_rate);
    Timestamp::from_micros(micros.round() as u64)
}

/// A sample from six readings in SI units, in the order of
/// [`Axis::ALL`](estimator_core::Axis::ALL), with what is known to be wrong with them put
/// right, in the frame of the foot.
pub(super) fn imu_sample(
    timestamp: Timestamp,
    readings: [f64; 6],
    validity: Validity,
    correction: &Correction,
) -> ImuSample {
    let [ax, ay, az, wx, wy, wz] = readings.map(|value| value as f32);
    let (specific_force, angular_rate) = correction.apply(
        SpecificForce(Vec3::new(ax, ay, az)),
        AngularRate(Vec3::new(wx, wy, wz)),
    );
    ImuSample {
        timestamp,
        specific_force,
        angular_rate,
        validity,
    }
}
