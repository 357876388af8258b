//! The same walk gives the same probabilities from every format: as a CSV table, in bags of ROS 2 and in Parquet,
//! written by third-party libraries.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use crate::packages;
use clap::Parser;
use estimator_core::{ContactEstimate, Params, Validity};
use footfall::commands::Arguments;
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams, simulate};
use host_tests::committed::assert_block;
use host_tests::requirements::unmet;
use recordings::input::{BagOptions, Correction, Foreign, Format, Hints, Opened, Topics};
use recordings::output::write_recording;
use recordings::replay::Replay;
use recordings::samples::recording::RecordedSample;
use tempfile::TempDir;

const REQUIREMENTS: &str = include_str!("python/roads.txt");
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/roads.py");

const ESTIMATES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/estimates.py");

/// Number of rows of the walk: five seconds with steps on firm ground.
const ROWS: usize = 5000;

/// Number of these rows in the bags of two feet.
const ROWS_OF_FEET: usize = 2000;

/// The files of the script and `walk.csv` beside them; an error is a single line.
static ROADS: LazyLock<Result<TempDir, String>> = LazyLock::new(|| {
    let packages = packages::install("python-roads", REQUIREMENTS)?;
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let simulation = simulate(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED);
    let walk = folder.path().join("walk.csv");
    let mut table = Vec::new();
    let mut samples = simulation.recording.samples[..ROWS].to_vec();
    for sample in &mut samples {
        // Messages do not carry the validity of samples.
        sample.imu.validity = Validity::Valid;
    }
    write_recording(&samples, &mut table).expect("a table");
    fs::write(&walk, table).expect("a file");
    let output = Command::new(packages.interpreter)
        .arg(SCRIPT)
        .arg(&walk)
        .arg(folder.path())
        .env("PYTHONPATH", packages.folder)
        .output()
        .map_err(|error| error.to_string())?;
    // A failure after this point is not caused by missing packages.
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    Ok(folder)
});

/// The folder with the files, or `None` if they cannot be created.
fn roads() -> Option<&'static Path> {
    match &*ROADS {
        Ok(folder) => Some(folder.path()),
        Err(missing) => {
            unmet(missing);
            None
        }
    }
}

/// Files and folders, sorted by name.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    paths
}

fn hints(topics: &[&str], loads: &[&str]) -> Hints {
    let topics: Vec<String> = topics.iter().map(|topic| (*topic).to_owned()).collect();
    Hints {
        bag: BagOptions {
            topics: Topics::from_names(&topics),
            loads: loads
                .iter()
                .map(|load| load.parse().expect("a load"))
                .collect(),
            ..BagOptions::default()
        },
        ..Hints::default()
    }
}

/// A foot: its name, its samples, and its estimates.
struct Foot {
    name: Option<String>,
    samples: Vec<RecordedSample>,
    estimates: Vec<ContactEstimate>,
}

fn read(path: &Path, hints: &Hints) -> Vec<Foot> {
    let named = path.display();
    let opened = Opened::new(path, None).unwrap_or_else(|error| panic!("{error}"));
    let feet = opened
        .store_all(hints)
        .unwrap_or_else(|error| panic!("{error}"));
    let foot = |mut stored: recordings::input::Stored| {
        let rate = stored.about.sample_rate;
        let mut replay = Replay::new(rate, stored.about.gravity, &Params::DEFAULT).expect("valid");
        let samples: Vec<_> = stored
            .samples()
            .unwrap_or_else(|error| panic!("{named}: {error}"))
            .map(|sample| sample.expect("a sample"))
            .collect();
        Foot {
            name: stored.about.foot.clone(),
            estimates: samples.iter().map(|sample| replay.update(sample)).collect(),
            samples,
        }
    };
    feet.into_iter().map(foot).collect()
}

/// Asserts that a foot equals that of the table except for labels, which bags do not have.
fn assert_same(foot: &Foot, expected: &Foot, path: &Path) {
    let named = path.display();
    assert_eq!(foot.samples.len(), expected.samples.len(), "{named}");
    for (found, expected) in foot.samples.iter().zip(&expected.samples) {
        assert_eq!(found.imu, expected.imu, "{named}");
        assert_eq!(found.load, expected.load, "{named}");
    }
    assert!(foot.estimates == expected.estimates, "{named}");
}

#[test]
fn every_format_gives_the_same_probabilities() {
    let Some(folder) = roads() else { return };
    let table = read(&folder.join("walk.csv"), &Hints::default());
    let [expected] = &table[..] else {
        panic!("one foot");
    };
    assert_eq!(expected.samples.len(), ROWS);
    let ps = expected
        .estimates
        .iter()
        .map(|estimate| estimate.probabilities.stable);
    assert!(ps.clone().any(|p| p > 0.9) && ps.clone().any(|p| p < 0.1));
    let mut roads = [0; 3];
    for path in entries(&folder.join("same")) {
        let format = Opened::new(&path, None)
            .expect("a file that is known")
            .format();
        let (kind, hints) = match format {
            Format::Parquet => (0, Hints::default()),
            Format::Mcap => (1, hints(&[], &["/ft"])),
            _ => (2, hints(&[], &["/ft:force.z"])),
        };
        roads[kind] += 1;
        let feet = read(&path, &hints);
        assert_eq!(feet.len(), 1, "{}", path.display());
        assert_same(&feet[0], expected, &path);
    }
    assert_eq!(roads, [11, 5, 15], "Parquet, MCAP, rosbag2");
}

#[test]
fn two_feet_of_a_bag_match_the_table_and_its_mirror() {
    let Some(folder) = roads() else { return };
    let table = read(&folder.join("walk.csv"), &Hints::default());
    let mut left = table.into_iter().next().expect("a foot");
    left.samples.truncate(ROWS_OF_FEET);
    left.estimates.truncate(ROWS_OF_FEET);
    for path in entries(&folder.join("feet")) {
        let feet = read(&path, &hints(&["all"], &["/ft/fl", "/ft/fr"]));
        let names: Vec<_> = feet
            .iter()
            .filter_map(|foot| foot.name.as_deref())
            .collect();
        assert_eq!(names, ["fl", "fr"], "{}", path.display());
        assert_same(&feet[0], &left, &path);
        for (right, left) in feet[1].samples.iter().zip(&left.samples) {
            let [right, left] = [right, left].map(|sample| sample.imu.specific_force.0);
            assert_eq!((right.x, right.y, right.z), (-left.x, -left.y, left.z));
        }
        // Mounted with its axes turned, the right foot is as the left one.
        let mut turned = hints(&["all"], &["/ft/fl", "/ft/fr"]);
        let correction = Correction {
            mounting: "-x,-y,z".parse().expect("axes"),
            ..Correction::NONE
        };
        turned.foot_corrections.insert("FR".to_owned(), correction);
        for foot in read(&path, &turned) {
            assert!(
                foot.samples
                    .iter()
                    .zip(&left.samples)
                    .all(|(found, expected)| {
                        found.imu.specific_force == expected.imu.specific_force
                    })
            );
        }
        let only = read(&path, &hints(&["/imu/fr"], &[]));
        assert_eq!(only[0].samples.len(), feet[1].samples.len());
        let said = Opened::new(&path, None)
            .and_then(|opened| opened.store_all(&Hints::default()))
            .err()
            .expect("several feet")
            .to_string();
        assert!(
            said.contains("choose with --topic, or --topic all"),
            "{said}"
        );
        assert!(
            said.contains(&format!("/imu/fl ({ROWS_OF_FEET} messages")),
            "{said}"
        );
    }
}

#[test]
fn axes_and_loads_are_read_from_fields_of_any_message() {
    let Some(folder) = roads() else { return };
    let table = read(&folder.join("walk.csv"), &Hints::default());
    let mut expected = table.into_iter().next().expect("a foot");
    expected.samples.truncate(ROWS_OF_FEET);
    expected.estimates.truncate(ROWS_OF_FEET);
    let bags = entries(&folder.join("states"));
    assert_eq!(bags.len(), 3);
    for path in bags {
        let named = path.display();
        let with_effort = |topics: &[&str]| hints(topics, &["/joints.effort[1]"]);
        let refused = |hints: &Hints| {
            let stored = Opened::new(&path, None).and_then(|opened| opened.store_all(hints));
            stored.err().expect("an error").to_string()
        };
        // A body has one IMU: which foot it is, and that it is one, the user says.
        let said = refused(&Hints::default());
        assert!(
            said.ends_with("; /lowstate.imu_state has six axes, of a foot or of the trunk: --topic /lowstate.imu_state"),
            "{said}"
        );
        let said = refused(&hints(&["/lowstate"], &[]));
        assert!(
            said.contains("imu_state is the IMU of the robot's trunk"),
            "{said}"
        );
        let state = read(&path, &with_effort(&["/lowstate.imu_state"]));
        assert_same(&state[0], &expected, &path);
        let pressed = read(
            &path,
            &hints(&["/lowstate.imu_state"], &["/lowstate.foot_force[1]"]),
        );
        for (found, expected) in pressed[0].samples.iter().zip(&expected.samples) {
            let rounded = expected.load.map(|load| load.0.round_ties_even());
            assert_eq!(found.load.map(|load| load.0), rounded, "{named}");
        }
        let said = refused(&hints(
            &["/lowstate.imu_state"],
            &["/lowstate:foot_force[4]"],
        ));
        assert!(
            said.ends_with("foot_force has the elements [0] to [3]"),
            "{said}"
        );
        if path.ends_with("sqlite3_8") {
            let said = refused(&hints(&["/feet.feet[1]"], &[]));
            assert!(said.ends_with("its definition is not in the bag"), "{said}");
            continue;
        }
        let feet = read(&path, &with_effort(&["/feet.feet[1]"]));
        assert_same(&feet[0], &expected, &path);
        let mut mapped = with_effort(&["/feet"]);
        let axes = "ax=acc.x,ay=acc.y,az=acc.z,wx=gyro.x,wy=gyro.y,wz=gyro.z";
        mapped.table.mapping = axes.replace('=', "=feet[1].").parse().expect("a mapping");
        assert_same(&read(&path, &mapped)[0], &expected, &path);
        let said = refused(&hints(&["/feet.feet[2]"], &[]));
        assert!(said.contains("message 1: it has fewer elements"), "{said}");
        let both = read(&path, &hints(&["/feet.feet[0]", "/feet.feet[1]"], &[]));
        assert_eq!(both.len(), 2, "{named}");
        assert_eq!(both[1].samples[7].imu, expected.samples[7].imu);
    }
}

#[test]
fn pandas_reads_the_table_estimates_from_parquet() {
    let Some(folder) = roads() else { return };
    let (csv, parquet) = (
        folder.join("estimates.csv"),
        folder.join("estimates.parquet"),
    );
    let feet = [folder.join("walk.csv"), folder.join("again.csv")];
    fs::copy(&feet[0], &feet[1]).expect("a file");
    for output in [&csv, &parquet] {
        let arguments =
            ["footfall", "--quiet", "replay", "--jobs", "2", "--output"].map(OsStr::new);
        let files = [output, &feet[0], &feet[1]].map(|path| path.as_os_str());
        let arguments = Arguments::parse_from(arguments.into_iter().chain(files));
        arguments.run().expect("a replay");
    }
    let packages = packages::install("python-roads", REQUIREMENTS).expect("they are there");
    let output = Command::new(packages.interpreter)
        .arg(ESTIMATES)
        .args([csv, parquet])
        .env("PYTHONPATH", packages.folder)
        .output()
        .expect("Python");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let rows = String::from_utf8_lossy(&output.stdout);
    assert_eq!(rows.trim(), (2 * ROWS).to_string());
}

#[test]
fn files_of_unsupported_kinds_are_named() {
    let Some(folder) = roads() else { return };
    let kinds = [
        ("arrow_ipc.feather", Foreign::ArrowIpc),
        ("html.parquet", Foreign::Html),
        ("json.json", Foreign::Json),
        ("json_records.json", Foreign::Json),
        ("numpy.npy", Foreign::Numpy),
        ("numpy_archive.npz", Foreign::NumpyArchive),
        ("pickle.pkl", Foreign::Pickle),
        ("sqlite.db", Foreign::Sqlite),
        ("tar.tar.gz", Foreign::Tar),
        ("zip.zip", Foreign::Zip),
    ];
    let paths = entries(&folder.join("other"));
    assert_eq!(paths.len(), kinds.len());
    for (path, (name, kind)) in paths.iter().zip(kinds) {
        assert!(path.ends_with(name), "{}", path.display());
        let opened = Opened::new(path, None).and_then(|opened| opened.store(&Hints::default()));
        assert_eq!(
            opened.err().expect("no recording").to_string(),
            format!(
                "{} is {kind}; {}",
                path.display(),
                kind.advice().expect("not read")
            )
        );
    }
}

#[test]
fn the_document_lists_the_unsupported_kinds() {
    let mut table = "| it is | do this |\n|---|---|\n".to_owned();
    for kind in Foreign::ALL {
        let Some(advice) = kind.advice() else {
            continue;
        };
        let name = kind
            .name()
            .split_once(' ')
            .filter(|(article, _)| matches!(*article, "a" | "an"))
            .map_or(kind.name(), |(_, name)| name);
        let advice = advice.replace('|', "\\|");
        table += &format!("| {name} | {advice} |\n");
    }
    assert_block("docs/formats.md", "other kinds", &table);
}
