//! Row with the results of one foot of a recording. It is written last; its presence marks the recording as done.

use std::sync::Arc;

use recordings::parquet_rows::{DataType, Field};
use serde::{Deserialize, Serialize};

use super::identity::FootFiles;

/// Whether a recording could be estimated.
#[derive(Clone, Copy, Debug, Deserialize, Eq, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// It was.
    Done,
    /// It was not; the column `error` says why.
    Failed,
}

/// Type of a row's field.
pub(super) trait Column {
    /// Returns the type in a table, and whether it is nullable.
    fn column() -> (DataType, bool);
}

macro_rules! column {
    ($($rust:ty => $arrow:expr),* $(,)?) => {$(
        impl Column for $rust {
            fn column() -> (DataType, bool) {
                ($arrow, false)
            }
        }
    )*};
}

column! {
    Status => DataType::Utf8,
    String => DataType::Utf8,
    &str => DataType::Utf8,
    bool => DataType::Boolean,
    // Spark has no unsigned integers.
    u64 => DataType::Int64,
    f32 => DataType::Float32,
    f64 => DataType::Float64,
    Vec<String> => DataType::List(Arc::new(Field::new("element", DataType::Utf8, false))),
}

impl<T: Column> Column for Option<T> {
    fn column() -> (DataType, bool) {
        (T::column().0, true)
    }
}

/// Defines a struct, and the columns of a table with its fields.
macro_rules! columns {
    ($(#[$about:meta])* pub struct $name:ident $(<$of:lifetime>)? { $($(#[$meta:meta])* $field:ident: $type:ty,)* }) => {
        $(#[$about])*
        pub struct $name $(<$of>)? {
            $($(#[$meta])* pub $field: $type,)*
        }

        impl $(<$of>)? $name $(<$of>)? {
            fn columns() -> Vec<Field> {
                vec![$({
                    let (data_type, nullable) = <$type as Column>::column();
                    Field::new(stringify!($field), data_type, nullable)
                }),*]
            }
        }
    };
}

pub(super) use columns;

/// Result of one foot of a recording.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct BatchRow {
    /// The robot; in the table it is a partition.
    #[serde(default)]
    pub robot: String,
    /// The foot; in the table it is a partition.
    #[serde(default)]
    pub foot: String,
    /// The day in UTC, `YYYY-MM-DD`, or `unknown`; in the table it is a partition.
    #[serde(default)]
    pub day: String,
    /// Inputs of the result.
    #[serde(flatten)]
    pub origin: Origin,
    /// Findings; absent, and in the table null, where the recording could not be read.
    #[serde(flatten)]
    pub found: Option<Found>,
}

impl BatchRow {
    /// Returns the columns of a table of rows. Robot, foot and day are partitions.
    #[must_use]
    pub fn columns() -> Vec<Field> {
        let found = Found::columns().into_iter();
        let found = found.map(|field| field.with_nullable(true));
        Origin::columns().into_iter().chain(found).collect()
    }

    /// Returns the location of its files.
    #[must_use]
    pub fn place(&self) -> FootFiles {
        FootFiles {
            robot: self.robot.clone(),
            foot: self.foot.clone(),
            day: self.day.clone(),
            key: self.origin.key.clone(),
        }
    }
}

columns! {
    /// Inputs of a row.
    #[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
    pub struct Origin {
        /// The name of the recording: its path as it was named.
        recording: String,
        /// The name of its files, without extension.
        key: String,
        /// How many rows the recording has: one for each foot.
        feet: u64,
        /// Whether it could be estimated.
        status: Status,
        /// Why it could not be.
        error: Option<String>,
        /// BLAKE3 hash of the recording's bytes, in hexadecimal; of a folder, of the names, lengths and bytes of its files. Null where they could not be read.
        input_blake3: Option<String>,
        /// Version of footfall.
        version: String,
        /// BLAKE3 hash of the settings in force, in hexadecimal.
        settings_blake3: String,
    }
}

columns! {
    /// Findings of a foot's recording.
    #[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
    pub struct Found {
        /// How the recording is laid out, as `--format` has it.
        format: String,
        /// Where the parameters started from, as `--preset` has it; null where the estimates are contacts that the foot sent.
        preset: Option<String>,
        /// All parameters in force, as a JSON object; null as well.
        parameters: Option<String>,
        /// How readings were corrected before, as a JSON object.
        correction: String,
        /// Whether the accelerations contain gravity: included or removed.
        gravity: String,
        /// Time of the first sample on the recording's clock, s; 0 where it has none.
        start_s: f64,
        /// Number of samples.
        samples: u64,
        /// Time from the first sample to the last, s.
        duration_s: f64,
        /// Sample rate, Hz.
        sample_rate_hz: f32,
        /// Rows left out because all six axes are blank in them.
        blank_rows: u64,
        /// Rows left out because their times do not advance.
        dropped_rows: u64,
        /// Rows that got another time.
        retimed_rows: u64,
        /// A sentence on each thing that was left out or reinterpreted.
        notices: Vec<String>,
        /// The names of what is not plausible; docs/formats.md lists all.
        findings: Vec<String>,
        /// The same as sentences, in the same order.
        finding_messages: Vec<String>,
        /// Time in the state `stance`, s.
        stance_s: f64,
        /// Time in the state `slip`, s.
        slip_s: f64,
        /// Time in the state `swing`, s.
        swing_s: f64,
        /// Time in the state `quiet_swing`, s.
        quiet_swing_s: f64,
        /// Time in the state `unknown`, as without a load, s.
        unknown_s: f64,
        /// Time in which the decision is stable, s.
        stable_s: f64,
        /// Touch-downs.
        steps: u64,
        /// Lift-offs.
        lift_offs: u64,
        /// Slips that began.
        slips: u64,
        /// How far the foot slid in all slips of which the distance is known, along the ground, m.
        slip_distance_m: f64,
        /// Slips that did not end in the recording, or in which a sample was missing or in doubt.
        slips_without_distance: u64,
        /// Stances in which the foot was loaded and never stable.
        unstable_stances: u64,
        /// Samples with the flag `window_not_full`.
        window_not_full_samples: u64,
        /// Samples with the flag `attitude_not_initialised`.
        attitude_not_initialised_samples: u64,
        /// Samples with the flag `saturated`.
        saturated_samples: u64,
        /// Samples with the flag `stale`.
        stale_samples: u64,
        /// Samples with the flag `invalid_sample`.
        invalid_sample_samples: u64,
        /// Samples with the flag `time_gap`.
        time_gap_samples: u64,
        /// Samples with the flag `settling`.
        settling_samples: u64,
        /// Samples with a label.
        labelled_samples: u64,
        /// Root mean square error of the probability against the labels.
        rmse: Option<f64>,
        /// Area under the ROC curve against the labels.
        roc_auc: Option<f64>,
        /// Calibration error of the probability against the labels.
        calibration_error: Option<f64>,
        /// Whether the foot has shown enough of stance and swing. This and what follows up to the half-widths: at the end of the recording, null where half-widths are set.
        settled: Option<bool>,
        /// Stillness that was learnt from, s.
        still_seconds: Option<f32>,
        /// Motion that was learnt from, s.
        moving_seconds: Option<f32>,
        /// How long the foot has run since it last learnt anything, s.
        idle_seconds: Option<f32>,
        /// Mean of ln(acceleration in m/s²) in stillness.
        acceleration_still: Option<f32>,
        /// The same in motion.
        acceleration_moving: Option<f32>,
        /// Mean deviation of it in stillness.
        acceleration_width: Option<f32>,
        /// Where stillness ends in acceleration: the half-width found, m/s².
        acceleration_half_width_m_s2: Option<f32>,
        /// Mean of ln(angular rate in rad/s) in stillness.
        rate_still: Option<f32>,
        /// The same in motion.
        rate_moving: Option<f32>,
        /// Mean deviation of it in stillness.
        rate_width: Option<f32>,
        /// Where stillness ends in angular rate: the half-width found, rad/s.
        rate_half_width_rad_s: Option<f32>,
        /// Mean of ln(leaky mean of the acceleration in m/s²) in stillness.
        velocity_still: Option<f32>,
        /// The same in motion.
        velocity_moving: Option<f32>,
        /// Mean deviation of it in stillness.
        velocity_width: Option<f32>,
        /// Where stillness ends in the leaky mean of the acceleration: the half-width found, m/s².
        velocity_half_width_m_s2: Option<f32>,
        /// Gyroscope bias about the foot's x where it was first known, rad/s; null where the foot never was at rest, or gravity is removed.
        gyro_bias_start_wx_rad_s: Option<f32>,
        /// The same about y.
        gyro_bias_start_wy_rad_s: Option<f32>,
        /// The same about z.
        gyro_bias_start_wz_rad_s: Option<f32>,
        /// Gyroscope bias about the foot's x at the end, rad/s.
        gyro_bias_end_wx_rad_s: Option<f32>,
        /// The same about y.
        gyro_bias_end_wy_rad_s: Option<f32>,
        /// The same about z.
        gyro_bias_end_wz_rad_s: Option<f32>,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{Flag, Phase};

    #[test]
    fn every_state_and_flag_has_a_column() {
        let columns = BatchRow::columns();
        let has = |name: String| columns.iter().any(|column| *column.name() == name);
        for phase in Phase::ALL {
            assert!(has(format!("{}_s", phase.name())), "{phase:?}");
        }
        for flag in Flag::ALL {
            assert!(has(format!("{}_samples", flag.name())), "{flag:?}");
        }
    }
}
