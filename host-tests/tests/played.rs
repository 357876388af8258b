//! A bag of a robot with several IMUs, written by a third-party library, as a source of streaming feet.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use crate::packages;
use clap::Parser;
use estimator_core::Gravity;
use feet::feed::Fed;
use feet::{Feed, Playback, Source};
use footfall::commands::Arguments;
use host_tests::requirements::unmet;
use recordings::input::Hints;
use recordings::input::bag::copy;

const REQUIREMENTS: &str = include_str!("python/roads.txt");
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/robot_bag.py");
const WALK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/recordings/walk.csv");

/// Options that select the feet, with their loads.
const FEET: &str = "--topic all --not-topic /trunk* --load-topic /ft/{foot}";

fn footfall(arguments: &str, paths: &[&Path]) -> Result<(), String> {
    let words = arguments.split_whitespace().map(AsRef::as_ref);
    let paths = paths.iter().map(|path| path.as_os_str());
    let all = [std::ffi::OsStr::new("footfall")]
        .into_iter()
        .chain(words)
        .chain(paths);
    let arguments = Arguments::try_parse_from(all).map_err(|error| error.to_string())?;
    arguments.run().map_err(|error| error.to_string())
}

/// Number of messages of each topic of a bag.
#[derive(Default)]
struct Counts(BTreeMap<String, u64>);

impl Counts {
    fn of(bag: &Path) -> Self {
        let mut counts = Self::default();
        let copied = copy(bag, &mut |channel, _, _| {
            *counts.0.entry(channel.topic.clone()).or_default() += 1;
            Ok(())
        });
        copied.expect("a bag").expect("messages");
        counts
    }
}

#[test]
fn feet_of_a_bag_with_other_imus_stream_with_their_loads() {
    let packages = match packages::install("python-roads", REQUIREMENTS) {
        Ok(packages) => packages,
        Err(missing) => return unmet(&missing),
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let output = Command::new(&packages.interpreter)
        .args([Path::new(SCRIPT), Path::new(WALK), &path("bag")])
        .env("PYTHONPATH", &packages.folder)
        .output()
        .expect("Python runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");

    let table = path("feet.csv");
    footfall(
        &format!("replay {FEET} --axes fr=-x,-y,z"),
        &[&path("bag"), "--output".as_ref(), &table],
    )
    .expect("two feet");
    let table = fs::read_to_string(&table).expect("a table");
    let rows = |foot: &str| -> Vec<&str> {
        let rows = table.lines().filter_map(|row| row.strip_prefix(foot));
        rows.collect()
    };
    assert_eq!(rows("fl,").len(), 3000);
    assert_eq!(rows("fl,"), rows("fr,"));
    assert!(rows("fl,").iter().any(|row| row.contains(",stance,")));

    // A foot whose sensor of load has another zero.
    let robot = path("robot.toml");
    fs::write(
        &robot,
        "[feet.FR.load]\non_threshold = 9e5\noff_threshold = 8e5\n",
    )
    .expect("a file");
    let loaded = path("loaded.csv");
    footfall(
        &format!("replay {FEET} --axes fr=-x,-y,z"),
        &[
            &path("bag"),
            "--config".as_ref(),
            &robot,
            "--output".as_ref(),
            &loaded,
        ],
    )
    .expect("two feet");
    let loaded = fs::read_to_string(loaded).expect("a table");
    let has_stance = |foot: &str| {
        let mut rows = loaded.lines().filter(|row| row.starts_with(foot));
        rows.any(|row| row.contains(",stance,"))
    };
    assert_eq!(["fl,", "fr,"].map(has_stance), [true, false]);

    // The same as a source.
    let recording = path("rec.mcap");
    let source = format!("file:{}", path("bag").display());
    let record = format!("record {source} {FEET} --axes fr=-x,-y,z -o");
    footfall(&record, &[&recording]).expect("a recording");
    let Counts(counts) = Counts::of(&recording);
    for foot in ["fl", "fr"] {
        assert_eq!(counts[&format!("/footfall/{foot}/contact")], 3000);
    }
    assert!(counts.keys().all(|topic| !topic.contains("trunk")));

    // One foot, whose name is a part of its topic.
    let one = path("one.csv");
    let options = "replay --topic /fl/imu --load-topic /ft/{foot} --output";
    footfall(options, &[&one, &path("bag")]).expect("one foot");
    let one = fs::read_to_string(one).expect("a table");
    assert_eq!(one.lines().skip(1).collect::<Vec<_>>(), rows("fl,"));

    // One foot as a source has the name that it has beside the others.
    let alone = path("alone.mcap");
    let record = format!("record {source} --topic /fl/imu --compat bool -o");
    footfall(&record, &[&alone]).expect("a recording");
    let Counts(counts) = Counts::of(&alone);
    assert_eq!(counts["/footfall/fl/contact"], 3000);
    assert!(counts["/footfall/FL/contact/decision"] > 100, "{counts:?}");
    assert!(
        counts.keys().all(|topic| !topic.contains("bag")),
        "{counts:?}"
    );

    let said = footfall("monitor demo:seconds=1 --topic all", &[]).expect_err("no bag");
    assert!(said.contains("are for file:"), "{said}");
    let said = footfall(
        "replay --topic all --not-topic * --load-topic /ft/{foot}",
        &[&path("bag")],
    )
    .expect_err("no foot");
    assert!(said.contains("/trunk/imu"), "{said}");
}

/// Returns the remarks of a source about a foot at rest with this `force` along z, m/s².
fn remarks(force: f32, gravity: Gravity) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("rest.csv");
    let row = |k: u32| format!("{:.3},0,0,{force},0,0,0\n", f64::from(k) * 0.005);
    let rows: String = (0..600).map(row).collect();
    fs::write(&path, format!("t,ax,ay,az,wx,wy,wz\n{rows}")).expect("a file");
    let source: Source = format!("file:{}@max", path.display())
        .parse()
        .expect("a source");
    let hints = Hints {
        gravity: Some(gravity),
        ..Hints::default()
    };
    let feed = Feed::open(source.played_with(Playback {
        hints,
        ..Playback::default()
    }));
    let mut remarks = Vec::new();
    loop {
        match feed.next(Duration::from_secs(600)).expect("it ends") {
            Fed::Remark(text) => remarks.push(text),
            Fed::Ended(_) => return remarks,
            _ => {}
        }
    }
}

#[test]
fn computed_imu_of_a_source_without_gravity_is_remarked() {
    assert_eq!(remarks(9.81, Gravity::Included), [""; 0]);
    assert_eq!(
        remarks(0.0, Gravity::Removed),
        [
            "rest: gravity was removed from its accelerations, so that messages of an IMU are computed, with \
             gravity by the estimated orientation"
        ]
    );
}
