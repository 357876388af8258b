//! Inputs of a reader besides a file, and its results.

use std::collections::BTreeMap;

use crate::samples::recording::Recording;
use estimator_core::{
    AngularRate, Gravity, ImuSample, Load, SpecificForce, Timestamp, Validity, Vec3,
};

use super::correction::Correction;
use super::store::contacts::ContactUse;
use super::table::options::TableOptions;
use super::topics::BagOptions;

/// Properties of a file that its format does not define.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Hints {
    /// Sample rate in Hz, above 0, if given.
    pub sample_rate: Option<f32>,
    /// Whether the samples contain gravity, if different from the format's default.
    pub gravity: Option<Gravity>,
    /// Static calibration and mounting of the sensor.
    pub correction: Correction,
    /// Those of single feet in its place, by the name of the foot, or of the recording of one foot.
    pub foot_corrections: BTreeMap<String, Correction>,
    /// Interpretation of named columns; units and times also apply to bags.
    pub table: TableOptions,
    /// Topics of a bag that are read.
    pub bag: BagOptions,
    /// Whether the estimates are the contacts that a bag has of its feet; [`Stored`](super::Stored) then describes those.
    pub contacts: ContactUse,
}

impl Hints {
    /// Correction of a foot with these names: its own, else that of all.
    #[must_use]
    pub fn correction_of(&self, names: &[&str]) -> &Correction {
        let mut own = self.foot_corrections.iter();
        own.find(|(foot, _)| is_among(foot, names))
            .map_or(&self.correction, |(_, correction)| correction)
    }
}

/// Returns whether a foot is among names, whose letters count alike in upper and lower case.
pub fn is_among(foot: &str, names: impl IntoIterator<Item = impl AsRef<str>>) -> bool {
    let mut names = names.into_iter();
    names.any(|name| name.as_ref().eq_ignore_ascii_case(foot))
}

/// Rows of a `csv` that were left out or changed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Repairs {
    /// Rows left out because all six axes are blank in them.
    pub blank_rows: usize,
    /// Rows left out because their times do not advance.
    pub dropped_rows: usize,
    /// Rows whose time was changed.
    pub retimed_rows: usize,
}

impl Repairs {
    /// One sentence for each kind of repair that occurred.
    pub(super) fn notices(self, file: &str) -> Vec<String> {
        let blank = "left out, in which all six axes are blank";
        let dropped = "left out, whose times do not advance";
        let retimed = "moved by more than half a period, to where the sample rate has them";
        let sentence = |(rows, what)| match rows {
            0 => None,
            1 => Some(format!("{file}: 1 row {what}")),
            _ => Some(format!("{file}: {rows} rows {what}")),
        };
        let rows = [self.blank_rows, self.dropped_rows, self.retimed_rows];
        let counted = rows.into_iter().zip([blank, dropped, retimed]);
        counted.filter_map(sentence).collect()
    }
}

/// Age up to which a load that has a stream of its own is valid, µs: half of the shortest stance of a walking robot.
/// It must arrive at 10 Hz or more.
pub(super) const OLDEST_LOAD_US: u64 = 100_000;

/// Load of a number; `None` if it is not finite, which marks an unknown load.
#[must_use]
pub fn finite_load(value: f64) -> Option<Load> {
    value.is_finite().then_some(Load(value as f32))
}

/// A file that has been read.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// Recording. Its first sample is at time 0.
    pub recording: Recording,
    /// Time of the file's clock at the first sample, µs; 0 if the file has no clock. It may be negative, as before
    /// a trigger, or count from 1970.
    pub start_us: i64,
    /// One sentence for each thing that was left out or reinterpreted, for people to read.
    pub notices: Vec<String>,
    /// Rows that were left out or whose time was changed.
    pub repairs: Repairs,
}

/// Time of row `index` at a constant `sample_rate` in Hz.
#[must_use]
pub fn steady_time(index: usize, sample_rate: f32) -> Timestamp {
    let micros = index as f64 * 1.0e6 / f64::from(sample_rate);
    Timestamp::from_micros(micros.round() as u64)
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
