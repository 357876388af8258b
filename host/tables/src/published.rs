//! Published recordings of robots: `pce-atlas` and `lcd` of simulated ones, `pce-go1` of a real one.
//!
//! # Simulated robots
//! ATLAS, published with the method, and the tables of `lcd`, which have the same columns.
//! They have no header.
//!
//! Sources: `offline/data` of the authors' repository,
//! <https://github.com/MichaelMarav/ProbabilisticContactEstimation>; <https://github.com/mrsp/lcd>.
//!
//! ATLAS has the columns `Fx Fy Fz Tx Ty Tz ax ay az wx wy wz label` in N, N m, m/s², rad/s; 1 kHz; gravity was removed by the simulator.
//! The load is `Fz`; label 1 is stable.
//!
//! `lcd` has a simulated ATLAS and a NAO, as above but at 100 Hz and with a class as the label: 0 stable, 1 no contact, 2 slip;
//! the last two count as not stable.
//!
//! # GO1
//! A real GO1, recorded by the authors of the method. The files have no header and the columns
//! `Fz ax ay az wx wy wz`: raw force, accelerations in g with gravity, rates in °/s. The IMU was read at about 70 Hz,
//! and its values were repeated to nominally 250 Hz; repeats count as samples, as in the paper.
//!
//! Force and IMU come from two logs that were joined column by column: row *n* of one is not related to row *n* of the
//! other. The force log is longer, so the last rows have only a force. Both logs show the same trot, which gives their
//! alignment:
//!
//! * The step period (lag of the autocorrelation's third peak, over 3) is 336.3, 336.7 and 336.7
//!   force rows and 176.7, 177.3 and 179.7 IMU rows on mattress, normal and slippery ground:
//!   1.87 to 1.90 force rows per IMU row. The nominal 500 and 250 Hz would make it 2. The
//!   spans that the authors' plot scripts mark in both signals by hand end at 4.673 and 4.960 s
//!   (mattress) and at 2.732 and 2.846 s (slippery): 1.88 and 1.92.
//! * With 1.9, the correlation between force and log angular speed is at its strongest where
//!   force row 0 lies 40, 60 and 60 rows before IMU row 0: −0.48, −0.31, −0.55. The impacts of
//!   landing then fall on the rise of the force. Rows paired one to one give −0.02, 0.05 and
//!   0.05; with 2 and no offset it is −0.32, 0.06 and −0.20, as drift adds up to half a step.
//!
//! Hence IMU row *k* takes the load of force row [`FORCE_ROWS_PER_IMU_ROW`] · k +
//! [`FORCE_LEAD_ROWS`], good to about ±20 force rows (40 ms).

use estimator_core::{Axis, Gravity, Load, Saturation, Validity};

use crate::csv::label;
use crate::reader::{Cells, Row, Table};
use options::format::Format;
use options::format::{ATLAS_SAMPLE_RATE, GO1_SAMPLE_RATE};
use options::{AccelerationUnit, InputOptions, RateUnit, Units};
use samples::{Label, RecordedSample, Recording, finite_load, imu_sample, steady_time};
use stored::Stored;
use stored::error::{InputError, Problem};

/// Rate of the recordings of `lcd`, Hz.
pub const LCD_SAMPLE_RATE: f32 = 100.0;

const ATLAS_COLUMNS: [&str; 13] =
    ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz", "ax", "ay", "az", "wx", "wy", "wz", "label"];

/// Reads a recording with ATLAS' 13 columns. The last column has the labels of the format.
///
/// # Errors
/// The first error found, with file, line and column.
pub fn read_simulated(
    mut table: Table,
    format: Format,
    input_options: &InputOptions,
) -> Result<Stored, InputError> {
    let is_lcd = format == Format::Lcd;
    let usual = if is_lcd { LCD_SAMPLE_RATE } else { ATLAS_SAMPLE_RATE };
    let sample_rate = input_options.sample_rate.unwrap_or(usual);
    let mut samples = Vec::new();
    while let Some(row) = table.next_row()? {
        row.expect_columns(ATLAS_COLUMNS.len())?;
        let mut values = [0.0; ATLAS_COLUMNS.len()];
        for (index, (value, name)) in values.iter_mut().zip(ATLAS_COLUMNS).enumerate() {
            *value = row.number(index, name)?;
        }
        let [_, _, fz, _, _, _, ax, ay, az, wx, wy, wz, truth] = values;
        let time = steady_time(samples.len(), sample_rate);
        samples.push(RecordedSample {
            imu: imu_sample(time, [ax, ay, az, wx, wy, wz], Validity::Valid),
            load: Some(Load(fz as f32)),
            label: Some(match (is_lcd, truth) {
                (true, 0.0) => Label::Stable,
                (true, 1.0 | 2.0) => Label::NotStable,
                _ => label(&row, ATLAS_COLUMNS.len() - 1, truth)?,
            }),
        });
    }
    if samples.is_empty() {
        return Err(InputError::empty(&table.file));
    }
    let recording = Recording {
        name: table.recording_name.clone(),
        sample_rate,
        gravity: input_options.gravity.unwrap_or(Gravity::Removed),
        load_title: "vertical force (N)".to_owned(),
        samples,
    };
    Stored::from_recording(recording, Vec::new(), &table.file)
}

/// Rows of the GO1's force log per row of its IMU log, measured: see the module documentation.
pub const FORCE_ROWS_PER_IMU_ROW: f64 = 1.9;

/// Rows by which the GO1's force log begins before its IMU log, measured: see the module documentation. A delay of
/// the force signal would look the same.
pub const FORCE_LEAD_ROWS: f64 = 50.0;

/// Acceleration, in g, from which a GO1 sample counts as saturated. The range is ±4 g and no reading exceeds 3.9996.
/// Impacts reach that limit, but few readings are exactly at it. So the last 2.5 % of the range also count as
/// saturated.
pub const CLIPPING_G: f64 = 3.9;

/// Units of its IMU columns.
const UNITS: Units =
    Units { acceleration: AccelerationUnit::StandardGravity, rate: RateUnit::DegreesPerSecond };

const COLUMNS: [&str; 7] = ["Fz", "ax", "ay", "az", "wx", "wy", "wz"];

/// Reads a GO1 recording: one sample per row of the IMU columns, converted to SI, with the load at the same time.
///
/// # Errors
/// The first error found, with file, line and column.
pub fn read_go1(mut table: Table, input_options: &InputOptions) -> Result<Stored, InputError> {
    let sample_rate = input_options.sample_rate.unwrap_or(GO1_SAMPLE_RATE);
    let mut forces = Vec::new();
    let mut imu_rows = Vec::new();
    while let Some(row) = table.next_row()? {
        row.expect_columns(COLUMNS.len())?;
        if let Some(axes) = axes_of(&row)? {
            if imu_rows.len() < forces.len() {
                return Err(row.error(1, COLUMNS[1], Problem::ImuAfterForceOnly));
            }
            imu_rows.push(axes);
        }
        forces.push(row.number(0, COLUMNS[0])?);
    }
    if imu_rows.is_empty() {
        return Err(InputError::empty(&table.file));
    }
    let samples: Vec<_> = imu_rows
        .iter()
        .enumerate()
        .map(|(k, axes)| RecordedSample {
            imu: imu_sample(steady_time(k, sample_rate), UNITS.to_si(*axes), validity_of(axes)),
            load: forces.get(force_row(k)).copied().and_then(finite_load),
            label: None,
        })
        .collect();
    let notice = notice(&table.file, samples.len(), forces.len());
    let recording = Recording {
        name: table.recording_name.clone(),
        sample_rate,
        gravity: input_options.gravity.unwrap_or(Gravity::Included),
        load_title: "foot force (raw)".to_owned(),
        samples,
    };
    Stored::from_recording(recording, vec![notice.into()], &table.file)
}

/// Six axes of a row in g and °/s; `None` if all of them are blank.
fn axes_of(row: &Row) -> Result<Option<[f64; 6]>, InputError> {
    if row.cells().skip(1).all(str::is_empty) {
        return Ok(None);
    }
    let mut axes = [0.0; 6];
    for (k, (value, axis)) in axes.iter_mut().zip(Axis::ALL).enumerate() {
        *value = row.number(k + 1, axis.name())?;
    }
    Ok(Some(axes))
}

fn validity_of(axes: &[f64; 6]) -> Validity {
    if axes[..3].iter().any(|a| a.abs() >= CLIPPING_G) {
        Validity::Saturated(Saturation::Accelerometer)
    } else {
        Validity::Valid
    }
}

/// Force row at the time of IMU row `k`.
fn force_row(k: usize) -> usize {
    (FORCE_ROWS_PER_IMU_ROW * k as f64 + FORCE_LEAD_ROWS).round() as usize
}

/// Describes the alignment of the two logs in one line.
fn notice(file: &str, imu_rows: usize, force_rows: usize) -> String {
    let end = force_row(imu_rows);
    let unused = force_rows.saturating_sub(end);
    let without = (0..imu_rows).rev().take_while(|k| force_row(*k) >= force_rows).count();
    format!(
        "{file}: {} of {force_rows} rows are force only; IMU row k takes the load of force row \
         {FORCE_ROWS_PER_IMU_ROW} k + {FORCE_LEAD_ROWS}, which leaves {unused} force rows at the \
         end unused and {without} samples without load",
        force_rows - imu_rows
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fmt::Write as _;

    use estimator_core::params::STANDARD_GRAVITY;
    use estimator_core::{Load, Vec3};

    use stored::Loaded;
    use stored::error::{Place, RowPlace};

    fn load(text: &str) -> Result<Loaded, InputError> {
        load_with(text, Format::PceAtlas)
    }

    fn load_with(text: &str, format: Format) -> Result<Loaded, InputError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("recording.csv");
        std::fs::write(&path, text).unwrap();
        let table = Table::open(&path)?;
        let stored = read_simulated(table, format, &InputOptions::default())?;
        Ok(stored.into_loaded().unwrap())
    }

    #[test]
    fn atlas_row_yields_force_motion_and_label() {
        let text = "1,2,3,4,5,6,7,8,9,10,11,12,1.000000\n1,2,3,4,5,6,7,8,9,10,11,12,0\n";
        let recording = load(text).unwrap().recording;
        let sample = recording.samples[0];
        assert_eq!(sample.load, Some(Load(3.0)));
        assert_eq!(sample.imu.specific_force.0, Vec3::new(7.0, 8.0, 9.0));
        assert_eq!(sample.imu.angular_rate.0, Vec3::new(10.0, 11.0, 12.0));
        assert_eq!(sample.label, Some(Label::Stable));
        assert_eq!(recording.samples[1].label, Some(Label::NotStable));
        assert_eq!(recording.samples[1].imu.timestamp.as_micros(), 1000);
    }

    #[test]
    fn label_of_another_dataset_is_rejected() {
        let text = "0,0,0,0,0,0,0,0,0,0,0,0,2\n";
        match load(text) {
            Err(InputError { problem: Problem::Label(text), .. }) => assert_eq!(text, "2"),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn contact_class_is_mapped_to_stable_or_not() {
        let rows = |classes: &[u8]| -> String {
            let row = |class| format!("1,2,3,4,5,6,7,8,9,10,11,12,{class}\n");
            classes.iter().map(row).collect()
        };
        let loaded = load_with(&rows(&[0, 1, 2]), Format::Lcd);
        let recording = loaded.unwrap().recording;
        let labels: Vec<_> = recording.samples.iter().filter_map(|s| s.label).collect();
        assert_eq!(labels, [Label::Stable, Label::NotStable, Label::NotStable]);
        assert_eq!(recording.samples[2].load, Some(Load(3.0)));
        assert_eq!(recording.samples[1].imu.timestamp.as_micros(), 10_000);

        match load_with(&rows(&[0, 3]), Format::Lcd) {
            Err(InputError {
                place: Place::Cell { row, .. }, problem: Problem::Label(_), ..
            }) => {
                assert_eq!(row, RowPlace::Line(2));
            }
            other => panic!("{other:?}"),
        }
    }

    fn load_go1(text: &str) -> Result<Loaded, InputError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("recording.csv");
        std::fs::write(&path, text).unwrap();
        let stored = read_go1(Table::open(&path)?, &InputOptions::default())?;
        Ok(stored.into_loaded().unwrap())
    }

    #[test]
    fn row_is_converted_to_si() {
        let recording = load_go1("250,1,0,-0.5,180,-90,0\n").unwrap().recording;
        let imu = recording.samples[0].imu;
        let g = STANDARD_GRAVITY;
        assert_eq!(imu.specific_force.0, Vec3::new(g, 0.0, -0.5 * g));
        let pi = std::f32::consts::PI;
        assert_eq!(imu.angular_rate.0, Vec3::new(pi, -0.5 * pi, 0.0));
    }

    #[test]
    fn sample_has_the_force_at_the_same_time() {
        let mut text = String::new();
        for row in 0..200 {
            let imu = if row < 80 { "0,0,1,0,0,0" } else { ",,,,," };
            writeln!(text, "{row},{imu}").unwrap();
        }
        let Loaded { recording, notices, .. } = load_go1(&text).unwrap();
        assert_eq!(recording.samples.len(), 80);
        assert_eq!(recording.samples[10].load, Some(Load(69.0)));
        // 1.9 · 79 + 50 = 200.1 lies past the last force row, 199.
        assert_eq!(recording.samples[79].load, None);
        assert!(notices[0].text.contains("120 of 200 rows are force only"), "{notices:?}");
        assert!(
            notices[0]
                .text
                .ends_with("leaves 0 force rows at the end unused and 1 samples without load")
        );
    }

    #[test]
    fn acceleration_at_the_end_of_the_range_is_saturated() {
        let text = "0,3.9,0,0,0,0,0\n0,0,-3.99,0,0,0,0\n0,0,0,3.89,0,0,0\n";
        let recording = load_go1(text).unwrap().recording;
        let validities: Vec<_> = recording.samples.iter().map(|s| s.imu.validity).collect();
        let saturated = Validity::Saturated(Saturation::Accelerometer);
        assert_eq!(validities, [saturated, saturated, Validity::Valid]);
    }

    #[test]
    fn imu_values_after_a_row_without_any_are_rejected() {
        let text = "0,0,0,1,0,0,0\n0,,,,,,\n0,0,0,1,0,0,0\n";
        match load_go1(text) {
            Err(InputError {
                place: Place::Cell { row, .. },
                problem: Problem::ImuAfterForceOnly,
                ..
            }) => assert_eq!(row, RowPlace::Line(3)),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn row_with_some_axes_blank_is_rejected() {
        match load_go1("0,0,0,,0,0,0\n") {
            Err(InputError {
                place: Place::Cell { name, .. }, problem: Problem::Blank, ..
            }) => {
                assert_eq!(name, "az");
            }
            other => panic!("{other:?}"),
        }
    }
}
