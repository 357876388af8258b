//! Batch estimation of a bag with two feet.

use std::fs;
use std::path::Path;

use analysis::batch::run::{Reason, RecordingOutcome, Results, Watch};
use analysis::batch::sources::{FoundRecording, Search, find};
use analysis::batch::{BatchSettings, Status, Verify};
use recordings::input::Topics;
use rusqlite::Connection;
use std::num::NonZeroUsize;
use std::sync::Mutex;

/// Encodes a `sensor_msgs/msg/Imu` of a foot at rest as CDR.
fn imu(seconds: i32, nanoseconds: u32, up_m_s2: f64) -> Vec<u8> {
    let mut message = vec![0, 1, 0, 0];
    message.extend(seconds.to_le_bytes());
    message.extend(nanoseconds.to_le_bytes());
    // An empty frame name with its zero byte, padded to a multiple of eight after the first four bytes.
    message.extend([1, 0, 0, 0, 0, 0, 0, 0]);
    let orientation = [0.0, 0.0, 0.0, 1.0];
    let (rate, acceleration, covariance) = ([0.0; 3], [0.0, 0.0, up_m_s2], [0.0; 9]);
    let numbers = orientation
        .iter()
        .chain(&covariance)
        .chain(&rate)
        .chain(&covariance)
        .chain(&acceleration)
        .chain(&covariance);
    numbers.for_each(|number: &f64| message.extend(number.to_le_bytes()));
    message
}

/// Writes two seconds of feet at rest on these topics, from noon of 2024-05-01 on.
fn write_bag(folder: &Path, topics: &[&str]) {
    fs::create_dir_all(folder).unwrap();
    fs::write(
        folder.join("metadata.yaml"),
        "rosbag2_bagfile_information:\n",
    )
    .unwrap();
    let path = folder.join("walk_0.db3");
    let _ = fs::remove_file(&path);
    let bag = Connection::open(path).unwrap();
    bag.execute_batch(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
         CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);
         BEGIN",
    )
    .unwrap();
    for (id, topic) in topics.iter().enumerate() {
        let sql = "INSERT INTO topics VALUES(?, ?, 'sensor_msgs/msg/Imu', 'cdr')";
        bag.execute(sql, (id as i64, topic)).unwrap();
    }
    for k in 0..1000_u32 {
        let (seconds, nanoseconds) = (1_714_564_800 + k as i32 / 500, k % 500 * 2_000_000);
        for id in 0..topics.len() {
            let data = imu(seconds, nanoseconds, 9.81 + 0.01 * id as f64);
            let sql = "INSERT INTO messages(topic_id, timestamp, data) VALUES(?, ?, ?)";
            let time = i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds);
            bag.execute(sql, (id as i64, time, data)).unwrap();
        }
    }
    bag.execute_batch("COMMIT").unwrap();
}

#[derive(Default)]
struct Outcomes(Mutex<Vec<RecordingOutcome>>);

impl Watch for Outcomes {
    fn done(&self, _: &FoundRecording, outcome: RecordingOutcome) {
        self.0.lock().unwrap().push(outcome);
    }
}

/// Estimates the only recording below a folder and returns its outcome.
fn run(logs: &Path, out: &Path, topics: Topics) -> RecordingOutcome {
    let mut settings = BatchSettings::default();
    settings.hints.bag.topics = topics;
    let found = find(&[logs.to_owned()], &Search::default()).unwrap();
    assert_eq!(found.recordings.len(), 1, "{found:?}");
    let outcomes = Outcomes::default();
    let results = Results::open(out).unwrap();
    results
        .estimate(
            &found.recordings,
            &settings,
            Verify::Listing,
            NonZeroUsize::MIN,
            &outcomes,
        )
        .unwrap();
    outcomes.0.into_inner().unwrap().remove(0)
}

/// Returns the folders of a table, below that of the robot.
fn feet(out: &Path, table: &str) -> Vec<String> {
    let entries = fs::read_dir(out.join(table).join("robot=spot")).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn bag_feet_have_rows_and_lost_feet_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let (logs, out) = (folder.path().join("logs"), folder.path().join("out"));
    let bag = logs.join("spot/walk");
    write_bag(&bag, &["/imu/fl", "/imu/fr"]);
    let RecordingOutcome::Estimated(Reason::Missing, rows) = run(&logs, &out, Topics::All) else {
        panic!("it is new");
    };
    let named: Vec<_> = rows
        .iter()
        .map(|row| (&*row.foot, &*row.day, row.origin.feet))
        .collect();
    assert_eq!(named, [("fl", "2024-05-01", 2), ("fr", "2024-05-01", 2)]);
    assert!(rows.iter().all(|row| row.origin.status == Status::Done));
    assert_eq!(feet(&out, "samples"), ["foot=fl", "foot=fr"]);
    assert!(matches!(
        run(&logs, &out, Topics::All),
        RecordingOutcome::UpToDate(_)
    ));
    // A missing row is detected although the other is present.
    fs::remove_dir_all(out.join("recordings/robot=spot/foot=fr")).unwrap();
    let again = run(&logs, &out, Topics::All);
    assert!(
        matches!(again, RecordingOutcome::Estimated(Reason::Incomplete, _)),
        "{again:?}"
    );
    write_bag(&bag, &["/imu/fl", "/imu/hl"]);
    let changed = run(&logs, &out, Topics::All);
    assert!(
        matches!(
            changed,
            RecordingOutcome::Estimated(Reason::InputChanged, _)
        ),
        "{changed:?}"
    );
    for table in ["samples", "events", "recordings"] {
        assert_eq!(feet(&out, table), ["foot=fl", "foot=hl"]);
    }
    // Two topics are ambiguous without a selection.
    let failed = run(&logs, &out, Topics::TheOnly);
    assert!(failed.error().unwrap().contains("--topic"), "{failed:?}");
    assert_eq!(feet(&out, "recordings"), ["foot=walk"]);
    assert!(!out.join("samples").exists());
    let same = run(&logs, &out, Topics::TheOnly);
    assert!(matches!(same, RecordingOutcome::UpToDate(_)) && same.error().is_some());
}
