//! Recordings of simulated robots: ATLAS, published with the method, and those of `lcd`, which have the same columns.
//! They have no header.
//!
//! Sources: `offline/data` of the authors' repository,
//! <https://github.com/MichaelMarav/ProbabilisticContactEstimation>; <https://github.com/mrsp/lcd>.
//!
//! # ATLAS
//! `Fx Fy Fz Tx Ty Tz ax ay az wx wy wz label`, N, N m, m/s², rad/s; 1 kHz; gravity was removed by the simulator.
//! The load is `Fz`; label 1 is stable.
//!
//! # LCD
//! Simulated ATLAS and NAO, as above but at 100 Hz and with a class as the label: 0 stable, 1 no contact, 2 slip;
//! the last two count as not stable.
use crate::samples::recording::{Label, RecordedSample, Recording};
use estimator_core::{Load, Params, Validity};

use crate::input::Format;
use crate::input::error::InputError;
use crate::input::loaded::{Hints, imu_sample, steady_time};
use crate::input::store::stored::Stored;
use crate::input::table::cells::{Cells, label};
use crate::input::table::reader::Table;

/// Rate of the ATLAS recordings, Hz.
pub const ATLAS_SAMPLE_RATE: f32 = Params::PAPER.sample_rate;

/// Rate of the recordings of `lcd`, Hz.
pub const LCD_SAMPLE_RATE: f32 = 100.0;

const ATLAS_COLUMNS: [&str; 13] =
    ["Fx", "Fy", "Fz", "Tx", "Ty", "Tz", "ax", "ay", "az", "wx", "wy", "wz", "label"];

/// Reads a recording with ATLAS' 13 columns, of which the last has the labels of the format.
///
/// # Errors
/// The first error found, with file, line and column.
pub(in crate::input) fn read(
    mut table: Table,
    format: Format,
    hints: &Hints,
) -> Result<Stored, InputError> {
    let is_lcd = format == Format::Lcd;
    let usual = if is_lcd { LCD_SAMPLE_RATE } else { ATLAS_SAMPLE_RATE };
    let sample_rate = hints.sample_rate.unwrap_or(usual);
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
        gravity: hints.gravity.unwrap_or(Params::PAPER.gravity),
        load_title: "vertical force (N)".to_owned(),
        samples,
    };
    Stored::from_recording(recording, Vec::new(), &table.file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::error::RowPlace;
    use crate::input::loaded::Loaded;
    use estimator_core::Vec3;

    fn load(text: &str) -> Result<Loaded, InputError> {
        load_with(text, Format::PceAtlas)
    }

    fn load_with(text: &str, format: Format) -> Result<Loaded, InputError> {
        let directory = tempfile::tempdir().unwrap();
        let path = directory.path().join("recording.csv");
        std::fs::write(&path, text).unwrap();
        let table = Table::open(&path)?;
        let stored = read(table, format, &Hints::default())?;
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
            Err(InputError::Label { text, .. }) => assert_eq!(text, "2"),
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
            Err(InputError::Label { cell, .. }) => assert_eq!(cell.place, RowPlace::Line(2)),
            other => panic!("{other:?}"),
        }
    }
}
