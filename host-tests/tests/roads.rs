//! The same walk gives the same probabilities from every format: as a CSV table, in bags of ROS 2 and in Parquet,
//! written by third-party libraries.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::packages;
use clap::Parser;
use estimator_core::any::AnyParams;
use estimator_core::{ContactEstimate, Validity};
use files::file_kind::FileKind;
use footfall::commands::Arguments;
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams, simulate};
use host_tests::committed::assert_block;
use options::{BagOptions, Correction, Format, InputOptions, Topics};
use recordings::Opened;
use samples::RecordedSample;
use samples::estimate::Estimator;
use samples::mounting::parse_axes;
use tables::output::write_recording;
use tempfile::TempDir;

const REQUIREMENTS: &str = include_str!("python/roads.txt");
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/roads.py");

const COPIED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/copied.py");

const LOW_STATE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/low_state.py");

const RECORDED: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/recorded.py");

const RECIPES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/recipes.py");

const ESTIMATES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/estimates.py");

/// Loads of the feet, whose places are in Unitree's order.
const LOADS_OF_A_ROBOT: &str = "--load-topic=/lowstate.foot_force[1] --load-topic=/lowstate.foot_force[0] \
    --load-topic=/lowstate.foot_force[3] --load-topic=/lowstate.foot_force[2]";

/// Number of rows of the walk: five seconds with steps on firm ground.
const ROWS: usize = 5000;

/// Number of these rows in the bags of two feet.
const ROWS_OF_FEET: usize = 2000;

/// The files of the script together with `walk.csv`, or `None` if they cannot be created.
static ROADS: LazyLock<Option<TempDir>> = LazyLock::new(|| {
    let packages = packages::install("python-roads", REQUIREMENTS)?;
    let folder = tempfile::tempdir().expect("a folder");
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
    packages.run(SCRIPT, &[&walk, &folder.path()]);
    Some(folder)
});

fn roads() -> Option<&'static Path> {
    ROADS.as_ref().map(TempDir::path)
}

/// Files and folders, sorted by name.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder");
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    paths
}

fn input_options(topics: &[&str], loads: &[&str]) -> InputOptions {
    let topics: Vec<String> = topics.iter().map(|topic| (*topic).to_owned()).collect();
    InputOptions {
        bag: BagOptions {
            topics: Topics::from_names(&topics),
            loads: loads.iter().map(|load| load.parse().expect("a load")).collect(),
            ..BagOptions::default()
        },
        ..InputOptions::default()
    }
}

/// A foot: its name, its samples, and its estimates.
struct Foot {
    name: Option<String>,
    samples: Vec<RecordedSample>,
    estimates: Vec<ContactEstimate>,
}

fn read(path: &Path, input_options: &InputOptions) -> Vec<Foot> {
    let named = path.display();
    let opened = Opened::new(path, None).unwrap_or_else(|error| panic!("{error}"));
    let feet = opened.store_all(input_options).unwrap_or_else(|error| panic!("{error}"));
    let foot = |mut stored: stored::Stored| {
        let rate = stored.about.sample_rate;
        let mut estimator =
            Estimator::new(rate, stored.about.gravity, &AnyParams::DEFAULT).expect("valid");
        let samples: Vec<_> = stored
            .samples()
            .unwrap_or_else(|error| panic!("{named}: {error}"))
            .map(|sample| sample.expect("a sample"))
            .collect();
        Foot {
            name: stored.about.foot.clone(),
            estimates: samples.iter().map(|sample| estimator.update(sample)).collect(),
            samples,
        }
    };
    feet.into_iter().map(foot).collect()
}

/// The walk of `walk.csv` as far as the bags of two feet have it.
fn left(folder: &Path) -> Foot {
    let mut left = read(&folder.join("walk.csv"), &InputOptions::default()).remove(0);
    left.samples.truncate(ROWS_OF_FEET);
    left.estimates.truncate(ROWS_OF_FEET);
    left
}

/// Runs the program with arguments separated by white space.
fn footfall(arguments: &str) -> Result<(), String> {
    let arguments = ["footfall"].into_iter().chain(arguments.split_whitespace());
    let arguments = Arguments::try_parse_from(arguments).expect("arguments");
    arguments.run().map_err(|error| error.to_string())
}

/// Asserts that a foot equals the foot of the table, except for labels, which bags do not have.
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
    let table = read(&folder.join("walk.csv"), &InputOptions::default());
    let [expected] = &table[..] else {
        panic!("one foot");
    };
    assert_eq!(expected.samples.len(), ROWS);
    let ps = expected.estimates.iter().map(|estimate| estimate.probabilities.stable);
    assert!(ps.clone().any(|p| p > 0.9) && ps.clone().any(|p| p < 0.1));
    let mut roads = [0; 3];
    for path in entries(&folder.join("same")) {
        let format = Opened::new(&path, None).expect("a file that is known").format();
        let (kind, input_options) = match format {
            Format::Parquet => (0, InputOptions::default()),
            Format::Mcap => (1, input_options(&[], &["/ft"])),
            _ => (2, input_options(&[], &["/ft:force.z"])),
        };
        roads[kind] += 1;
        let feet = read(&path, &input_options);
        assert_eq!(feet.len(), 1, "{}", path.display());
        assert_same(&feet[0], expected, &path);
    }
    assert_eq!(roads, [11, 5, 15], "Parquet, MCAP, rosbag2");
}

#[test]
fn two_feet_of_a_bag_match_the_table_and_its_mirror() {
    let Some(folder) = roads() else { return };
    let left = left(folder);
    for path in entries(&folder.join("feet")) {
        let feet = read(&path, &input_options(&["all"], &["/ft/fl", "/ft/fr"]));
        let names: Vec<_> = feet.iter().filter_map(|foot| foot.name.as_deref()).collect();
        assert_eq!(names, ["fl", "fr"], "{}", path.display());
        assert_same(&feet[0], &left, &path);
        for (right, left) in feet[1].samples.iter().zip(&left.samples) {
            let [right, left] = [right, left].map(|sample| sample.imu.specific_force.0);
            assert_eq!((right.x, right.y, right.z), (-left.x, -left.y, left.z));
        }
        // Mounted with its axes turned, the right foot is as the left one.
        let mut turned = input_options(&["all"], &["/ft/fl", "/ft/fr"]);
        let correction =
            Correction { mounting: parse_axes("-x,-y,z").expect("axes"), ..Correction::NONE };
        turned.foot_corrections.insert("FR".to_owned(), correction);
        for foot in read(&path, &turned) {
            assert!(foot.samples.iter().zip(&left.samples).all(|(found, expected)| {
                found.imu.specific_force == expected.imu.specific_force
            }));
        }
        let only = read(&path, &input_options(&["/imu/fr"], &[]));
        assert_eq!(only[0].samples.len(), feet[1].samples.len());
        let said = Opened::new(&path, None)
            .and_then(|opened| opened.store_all(&InputOptions::default()))
            .err()
            .expect("several feet")
            .to_string();
        assert!(said.contains("choose with topic, or topic all"), "{said}");
        assert!(said.contains(&format!("/imu/fl ({ROWS_OF_FEET} messages")), "{said}");
    }
}

#[test]
fn frames_of_one_topic_are_recorded_as_they_are_read() {
    const FRAMES: [&str; 4] = ["fl_foot", "fr_foot", "rl_foot", "rr_foot"];
    let Some(folder) = roads() else { return };
    let packages = packages::install("python-roads", REQUIREMENTS).expect("as for the bags");
    let left = left(folder);
    for path in entries(&folder.join("frames")) {
        let feet = read(&path, &input_options(&["all"], &[]));
        let names = feet.iter().filter_map(|foot| foot.name.as_deref());
        assert!(names.eq(FRAMES), "{}", path.display());
        for (foot, factor) in feet.iter().zip([1.0, -1.0, 0.5, 0.25]) {
            assert_eq!(foot.samples.len(), ROWS_OF_FEET);
            for (found, expected) in foot.samples.iter().zip(&left.samples) {
                let [found, expected] = [found, expected].map(|sample| sample.imu.specific_force.0);
                assert_eq!((found.x, found.z), (factor * expected.x, expected.z));
            }
        }
        let recording = folder.join("recorded.mcap");
        let source = format!("file:{}", path.display());
        let output = recording.display();
        footfall(&format!("record {source} --topic all --output {output} --overwrite"))
            .expect("a recording");
        let equal = packages.run(RECORDED, &[&path, &"/foot_imus", &recording]);
        assert_eq!(equal, (4 * ROWS_OF_FEET).to_string());
    }
}

#[test]
fn axes_and_loads_are_read_from_fields_of_any_message() {
    let Some(folder) = roads() else { return };
    let expected = left(folder);
    let bags = entries(&folder.join("states"));
    assert_eq!(bags.len(), 3);
    for path in bags {
        let named = path.display();
        let with_effort = |topics: &[&str]| input_options(topics, &["/joints.effort[1]"]);
        let refused = |input_options: &InputOptions| {
            let stored =
                Opened::new(&path, None).and_then(|opened| opened.store_all(input_options));
            stored.err().expect("an error").to_string()
        };
        // The message has one IMU. Only the user knows whether it is on a foot, and on which one.
        let said = refused(&InputOptions::default());
        assert!(
            said.ends_with("; /lowstate.imu_state has six axes, of a foot or of the trunk: topic /lowstate.imu_state"),
            "{said}"
        );
        let said = refused(&input_options(&["/lowstate"], &[]));
        assert!(said.contains("imu_state is the IMU of the robot's trunk"), "{said}");
        let state = read(&path, &with_effort(&["/lowstate.imu_state"]));
        assert_same(&state[0], &expected, &path);
        let pressed =
            read(&path, &input_options(&["/lowstate.imu_state"], &["/lowstate.foot_force[1]"]));
        for (found, expected) in pressed[0].samples.iter().zip(&expected.samples) {
            let rounded = expected.load.map(|load| load.0.round_ties_even());
            assert_eq!(found.load.map(|load| load.0), rounded, "{named}");
        }
        let said = refused(&input_options(&["/lowstate.imu_state"], &["/lowstate:foot_force[4]"]));
        assert!(said.ends_with("foot_force has the elements [0] to [3]"), "{said}");
        if path.ends_with("sqlite3_8") {
            let said = refused(&input_options(&["/feet.feet[1]"], &[]));
            assert!(said.ends_with("its definition is not in the bag"), "{said}");
            continue;
        }
        let feet = read(&path, &with_effort(&["/feet.feet[1]"]));
        assert_same(&feet[0], &expected, &path);
        let mut mapped = with_effort(&["/feet"]);
        let axes = "ax=acc.x,ay=acc.y,az=acc.z,wx=gyro.x,wy=gyro.y,wz=gyro.z";
        mapped.table.mapping = axes.replace('=', "=feet[1].").parse().expect("a mapping");
        assert_same(&read(&path, &mapped)[0], &expected, &path);
        let said = refused(&input_options(&["/feet.feet[2]"], &[]));
        assert!(said.contains("message 1: it has fewer elements"), "{said}");
        let both = read(&path, &input_options(&["/feet.feet[0]", "/feet.feet[1]"], &[]));
        assert_eq!(both.len(), 2, "{named}");
        assert_eq!(both[1].samples[7].imu, expected.samples[7].imu);
    }
}

#[test]
fn robot_states_are_played_and_estimated() {
    let Some(folder) = roads() else { return };
    let out = tempfile::tempdir().expect("a folder");
    let load = "/lowstate.foot_force[1]";
    for path in entries(&folder.join("states")) {
        let run = |command: &[&str]| {
            let command = command.join(" ");
            footfall(&format!("{command} --topic /lowstate.imu_state --load-topic {load}"))
                .unwrap_or_else(|error| panic!("{error}"));
        };
        let name = path.file_name().expect("a name").to_string_lossy();
        let played = out.path().join(format!("{name}.mcap"));
        let source = format!("file:{}@max", path.display());
        run(&["record", &source, "--output", &played.to_string_lossy()]);
        let [expected, found] = [
            &read(&path, &input_options(&["/lowstate.imu_state"], &[]))[0],
            &read(&played, &InputOptions::default())[0],
        ];
        assert!(found.samples == expected.samples, "{name}");
        run(&["replay", &path.to_string_lossy()]);
    }
}

#[test]
fn copy_of_a_bag_has_the_contacts_beside_all_messages() {
    let Some(folder) = roads() else { return };
    let packages = packages::install("python-roads", REQUIREMENTS).expect("installed before");
    let out = tempfile::tempdir().expect("a folder");
    let events = out.path().join("events.csv");
    let run = |bag: &Path, output: &Path| {
        let loads = if bag.starts_with(folder.join("robots")) {
            LOADS_OF_A_ROBOT
        } else {
            "--load-topic=/ft/{foot}"
        };
        let [bag, output, events] = [bag, output, &events].map(Path::display);
        footfall(&format!(
            "replay --topic all {loads} {bag} --output {output} --events {events} --overwrite"
        ))
    };
    let [copy, table] = ["copy.mcap", "table.csv"].map(|name| out.path().join(name));
    for (name, feet, rows) in [
        ("robots/mcap_9", 4, 3000),
        ("feet/ros2_zstd.mcap", 2, ROWS_OF_FEET),
        ("feet/big_endian.mcap", 2, ROWS_OF_FEET),
        ("feet/sqlite3_message_9", 2, ROWS_OF_FEET),
        ("feet/mcap_file_8", 2, ROWS_OF_FEET),
    ] {
        let bag = folder.join(name);
        run(&bag, &copy).expect("a copy");
        run(&bag, &table).expect("a table");
        let counts = packages.run(COPIED, &[&bag, &copy, &table, &events]);
        let counts: Vec<usize> =
            counts.split_whitespace().map(|count| count.parse().expect("a count")).collect();
        assert_eq!(counts[0], feet * rows, "{name}");
        // The feet of the first two seconds stand.
        assert_eq!(counts[1], if feet == 4 { 21 } else { 0 }, "{name}");
    }
    // Types without definitions keep their names.
    let bag = folder.join("states/sqlite3_8");
    let states = out.path().join("states.mcap");
    let [from, to] = [&bag, &states].map(|path| path.display());
    footfall(&format!("replay --topic /lowstate.imu_state --output {to} {from}")).expect("a copy");
    let [of_bag, of_copy] =
        [&bag, &states].map(|path| read(path, &input_options(&["/lowstate.imu_state"], &[])));
    assert_same(&of_copy[0], &of_bag[0], &states);
    let inside = folder.join("feet/sqlite3_none_9");
    let said = run(&inside, &inside.join("contacts.mcap")).expect_err("a part of the bag");
    assert!(said.contains("it is the recording itself"), "{said}");
    let again = run(&copy, &out.path().join("again.mcap")).expect_err("contacts are there");
    assert!(again.contains("from an earlier estimate"), "{again}");
    assert!(!out.path().join("again.mcap").exists());
    let table = run(&folder.join("walk.csv"), &copy).expect_err("no bag");
    assert!(table.contains("each recording must be mcap, rosbag2 or rosbag1"), "{table}");
}

#[test]
fn states_of_a_robot_have_the_forces_of_the_estimates() {
    let Some(folder) = roads() else { return };
    let packages = packages::install("python-roads", REQUIREMENTS).expect("installed before");
    let out = tempfile::tempdir().expect("a folder");
    let copy = out.path().join("copy.mcap");
    let run = |bag: &Path, options: &[&str]| {
        let (bag, output, options) = (bag.display(), copy.display(), options.join(" "));
        footfall(&format!(
            "--quiet replay --topic all {LOADS_OF_A_ROBOT} {options} {bag} --output {output} --overwrite"
        ))
    };
    let bags = entries(&folder.join("robots"));
    assert_eq!(bags.len(), 3);
    for bag in &bags {
        let decisions = &["--lowstate", "/lowstate", "--compat", "champ"][..];
        let loads = &["--lowstate", "/lowstate", "--lowstate-scale", "-0.5"][..];
        // The kind of the bag has no influence on the forces that are written.
        let is_scaled = bag.ends_with("big_endian.mcap");
        let scaled = is_scaled.then_some((loads, Some("-0.5")));
        for (options, scale) in [(decisions, None)].into_iter().chain(scaled) {
            run(bag, options).expect("a copy");
            let mut arguments: Vec<&dyn AsRef<OsStr>> = vec![&copy];
            arguments.extend(scale.iter().map(|scale| scale as &dyn AsRef<OsStr>));
            let states = packages.run(LOW_STATE, &arguments);
            assert_eq!(states, "1500", "{}", bag.display());
        }
    }
    fs::remove_file(&copy).expect("the copy");
    for (options, expected) in [
        (
            &["--lowstate", "/highstate"][..],
            "topic /highstate: no forces of four feet to replace: the bag has no message on it",
        ),
        (
            &["--lowstate", "/imu/fl"],
            "topic /imu/fl: no forces of four feet to replace: there is no foot_force, but header,",
        ),
        (&["--lowstate", "/lowstate", "--compat", "unitree"], "both write /footfall/lowstate"),
    ] {
        let said = run(&bags[0], options).expect_err("no forces");
        assert!(said.contains(expected), "{said}");
        assert!(!copy.exists(), "{said}");
    }
}

#[test]
fn pandas_reads_the_table_estimates_from_parquet() {
    let Some(folder) = roads() else { return };
    let (csv, parquet) = (folder.join("estimates.csv"), folder.join("estimates.parquet"));
    let feet = [folder.join("walk.csv"), folder.join("again.csv")];
    fs::copy(&feet[0], &feet[1]).expect("a file");
    for output in [&csv, &parquet] {
        let [output, one, other] = [output, &feet[0], &feet[1]].map(|path| path.display());
        footfall(&format!("--quiet replay --jobs 2 --output {output} {one} {other}"))
            .expect("a replay");
    }
    let packages = packages::install("python-roads", REQUIREMENTS).expect("they are there");
    let rows = packages.run(ESTIMATES, &[&csv, &parquet]);
    assert_eq!(rows, (2 * ROWS).to_string());
}

#[test]
fn files_of_unsupported_kinds_are_named() {
    let Some(folder) = roads() else { return };
    let kinds = [
        ("arrow_ipc.feather", FileKind::Feather),
        ("html.parquet", FileKind::Other),
        ("json.json", FileKind::Other),
        ("json_records.json", FileKind::Other),
        ("numpy.npy", FileKind::Numpy),
        ("numpy_archive.npz", FileKind::Npz),
        ("pickle.pkl", FileKind::Pickle),
        ("sqlite.db", FileKind::Sqlite),
        ("tar.tar.gz", FileKind::Other),
        ("zip.zip", FileKind::Zip),
    ];
    let paths = entries(&folder.join("other"));
    assert_eq!(paths.len(), kinds.len());
    for (path, (name, kind)) in paths.iter().zip(kinds) {
        assert!(path.ends_with(name), "{}", path.display());
        let opened =
            Opened::new(path, None).and_then(|opened| opened.store(&InputOptions::default()));
        assert_eq!(
            opened.err().expect("no recording").to_string(),
            format!("{} is {kind}; {}", path.display(), kind.advice().expect("not read"))
        );
    }
}

#[test]
fn recipes_for_arrays_give_the_samples_of_the_walk() {
    let Some(folder) = roads() else { return };
    let packages = packages::install("python-roads", REQUIREMENTS).expect("they are there");
    let target = tempfile::tempdir().expect("a folder");
    let walk = folder.join("walk.csv");
    // Returns the code in Python within an advice, without the words before it and the remark after it.
    let recipe = |kind: FileKind| {
        let advice = kind.advice().expect("a recipe");
        let from = advice.find("m = numpy").or_else(|| advice.find("m = scipy"));
        let from = from.or_else(|| advice.find("numpy.savetxt")).expect("Python");
        let (code, _) = advice.split_once(" with the names").unwrap_or((advice, ""));
        code[from..].to_owned()
    };
    let recipes = [FileKind::Npz, FileKind::Matlab, FileKind::Numpy].map(recipe);
    let [npz, matlab, numpy] = &recipes;
    packages.run(RECIPES, &[&walk, &target.path(), npz, matlab, numpy]);
    let read = |path: &Path| {
        recordings::read(path, Format::Csv, &InputOptions::default()).expect("a table").recording
    };
    let expected = read(&walk).samples;
    for number in 0..recipes.len() {
        let found = read(&target.path().join(format!("walk{number}.csv"))).samples;
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            assert_eq!(found.imu, expected.imu, "{}", recipes[number]);
        }
    }
}

#[test]
fn the_document_lists_the_unsupported_kinds() {
    let mut table = "| it is | do this |\n|---|---|\n".to_owned();
    for kind in FileKind::ALL {
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
    assert_block("docs/reference/formats.md", "other kinds", &table);
}
