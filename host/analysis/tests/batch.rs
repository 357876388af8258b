//! Estimation of one recording of a batch: its files, rows and errors.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use analysis::batch::{
    BatchRow, BatchSettings, FeetWanted, Identity, Plausibility, Progress, Status,
    estimate_recording,
};
use gait::{GaitName, Ground, Plan, SensorParams, record};
use recordings::output::write_recording;
use recordings::parquet_rows::read;
use tempfile::TempDir;

fn walk(seconds: f64) -> Vec<u8> {
    let plan = Plan::steady(GaitName::Walk, Ground::Hard, seconds, 3);
    let recording = record(&plan, &SensorParams::LSM6DSOX, 3);
    let mut bytes = Vec::new();
    write_recording(&recording.samples, &mut bytes).unwrap();
    bytes
}

struct Bench {
    folder: TempDir,
    identity: Identity,
    settings: BatchSettings,
}

impl Bench {
    fn new(content: impl AsRef<[u8]>) -> Self {
        let bench = Self {
            folder: tempfile::tempdir().unwrap(),
            identity: Identity::new("logs/spot/fl.csv", "spot"),
            settings: BatchSettings::default(),
        };
        fs::write(bench.input(), content).unwrap();
        bench
    }

    fn input(&self) -> PathBuf {
        self.folder.path().join("local-copy.csv")
    }

    fn out(&self) -> PathBuf {
        self.folder.path().join("out")
    }

    fn run(&self) -> Vec<BatchRow> {
        let (input, out) = (self.input(), self.out());
        let progress: Progress = Arc::new(|_| ());
        estimate_recording(&input, &self.identity, &self.settings, &out, &progress).unwrap()
    }

    /// Returns all files below the results folder, with their bytes.
    fn files(&self) -> Vec<(PathBuf, Vec<u8>)> {
        let mut files = Vec::new();
        collect(&self.out(), &mut files);
        files.sort();
        files
    }

    fn row_on_disk(&self, row: &BatchRow) -> BatchRow {
        let path = self.out().join("recordings").join(row.place().path());
        let mut rows: Vec<BatchRow> = read(fs::File::open(path).unwrap()).unwrap();
        let read = rows.remove(0);
        assert!(rows.is_empty());
        // Robot, foot and day are in the path only.
        BatchRow {
            robot: row.robot.clone(),
            foot: row.foot.clone(),
            day: row.day.clone(),
            ..read
        }
    }
}

fn collect(folder: &Path, files: &mut Vec<(PathBuf, Vec<u8>)>) {
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            collect(&path, files);
        } else {
            files.push((path.clone(), fs::read(path).unwrap()));
        }
    }
}

#[test]
fn walk_writes_samples_events_and_a_readable_row() {
    let bench = Bench::new(walk(12.0));
    let rows = bench.run();
    let [row] = &rows[..] else {
        panic!("{rows:?}");
    };
    assert_eq!(
        (&*row.robot, &*row.foot, &*row.day),
        ("spot", "fl", "unknown")
    );
    assert_eq!((row.origin.status, row.origin.feet), (Status::Done, 1));
    let found = row.found.as_ref().unwrap();
    assert_eq!(found.samples, 12_000);
    assert!((8..20).contains(&found.steps), "{found:?}");
    assert!(found.stance_s > 3.0 && found.swing_s > 3.0, "{found:?}");
    let states = [
        found.stance_s,
        found.slip_s,
        found.swing_s,
        found.quiet_swing_s,
        found.unknown_s,
    ];
    assert!(
        (states.iter().sum::<f64>() - 12.0).abs() < 1.0e-9,
        "{states:?}"
    );
    assert_eq!(found.settled, Some(true));
    let half_width = found.acceleration_half_width_m_s2.unwrap();
    let (still, moving) = (
        found.acceleration_still.unwrap(),
        found.acceleration_moving.unwrap(),
    );
    assert!(
        still.exp() < half_width && half_width < moving.exp(),
        "{found:?}"
    );
    assert!(found.gyro_bias_end_wx_rad_s.is_some(), "{found:?}");
    assert_eq!(bench.row_on_disk(row), *row);
    assert_eq!(bench.files().len(), 3);
}

#[test]
fn bytes_depend_on_neither_path_nor_earlier_results() {
    let [one, other] = [Bench::new(walk(3.0)), Bench::new(walk(3.0))];
    other.run();
    let bytes = |bench: &Bench| -> Vec<Vec<u8>> {
        bench.run();
        bench.files().into_iter().map(|(_, bytes)| bytes).collect()
    };
    assert!(bytes(&one) == bytes(&other));
}

#[test]
fn failed_recording_has_a_row_with_the_reason() {
    for (content, why) in [
        ("", "logs/spot/fl.csv"),
        ("t,ax\n0,0\n", "logs/spot/fl.csv, line 1: missing"),
        ("%PDF-1.7", "logs/spot/fl.csv is a PDF"),
    ] {
        let bench = Bench::new(content);
        let rows = bench.run();
        let [row] = &rows[..] else {
            panic!("{rows:?}");
        };
        let error = row.origin.error.as_deref().unwrap();
        assert!(error.starts_with(why), "{error}");
        assert!(row.found.is_none() && row.origin.input_blake3.is_some());
        assert_eq!(row.origin.status, Status::Failed);
        assert_eq!(bench.row_on_disk(row), *row);
        assert_eq!(bench.files().len(), 1);
    }
}

#[test]
fn unreadable_recording_has_no_hash() {
    let bench = Bench::new("");
    fs::remove_file(bench.input()).unwrap();
    let rows = bench.run();
    assert_eq!(rows[0].origin.input_blake3, None);
    let error = rows[0].origin.error.as_deref().unwrap();
    assert!(
        error.starts_with("logs/spot/fl.csv cannot be read: "),
        "{error}"
    );
}

#[test]
fn implausible_recording_fails_if_required_and_keeps_findings() {
    let still = |k: u32| format!("{:.3},0,0,1,0,0,0\n", f64::from(k) * 0.002);
    let in_g = "t,ax,ay,az,wx,wy,wz\n".to_owned() + &(0..2000).map(still).collect::<String>();
    let mut bench = Bench::new(in_g);
    let reported = bench.run();
    assert_eq!(reported[0].origin.status, Status::Done);
    assert_eq!(bench.files().len(), 3);
    bench.settings.plausibility = Plausibility::Required;
    let refused = bench.run();
    assert_eq!(refused[0].origin.status, Status::Failed);
    let found = refused[0].found.as_ref().unwrap();
    assert!(
        found.findings.contains(&"acceleration_in_g".to_owned()),
        "{found:?}"
    );
    assert_eq!(bench.files().len(), 1);
    assert_ne!(
        refused[0].origin.settings_blake3,
        reported[0].origin.settings_blake3
    );
}

#[test]
fn missing_foot_error_lists_the_feet() {
    let mut bench = Bench::new(walk(1.0));
    bench.settings.feet = FeetWanted::Named("hl".to_owned());
    let rows = bench.run();
    assert_eq!(
        rows[0].origin.error.as_deref(),
        Some("logs/spot/fl.csv has no foot \"hl\"; it has fl")
    );
    bench.settings.feet = FeetWanted::Named("fl".to_owned());
    assert_eq!(bench.run()[0].origin.status, Status::Done);
}

#[test]
fn day_comes_from_the_clock_or_the_identity() {
    let row = |k: u32| {
        format!(
            "{:.3},0,0,9.81,0,0,0\n",
            1_714_564_800.0 + f64::from(k) * 0.01
        )
    };
    let rows: String = (0..100).map(row).collect();
    let mut bench = Bench::new(format!("t,ax,ay,az,wx,wy,wz\n{rows}"));
    bench.identity.day = Some("2020-01-01".parse().unwrap());
    assert_eq!(bench.run()[0].day, "2024-05-01");
    let mut bench = Bench::new(walk(1.0));
    bench.identity.day = Some("2020-01-01".parse().unwrap());
    assert_eq!(bench.run()[0].day, "2020-01-01");
}
