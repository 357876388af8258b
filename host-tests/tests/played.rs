//! A bag of a robot with several IMUs, written by a third-party library, as a source of streaming feet.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;
use std::process::Command;

use clap::Parser;
use footfall::commands::Arguments;
use host_tests::requirements::unmet;
use recordings::input::bag::{Channel, Receiver, Written, copy};

#[path = "../../wire/tests/python/environment.rs"]
mod environment;
#[path = "python/packages.rs"]
mod packages;

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

impl Receiver for Counts {
    fn message(&mut self, channel: &Channel, _: Written, _: &[u8]) -> io::Result<()> {
        *self.0.entry(channel.topic.clone()).or_default() += 1;
        Ok(())
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

    // The same as a source.
    let recording = path("rec.mcap");
    let source = format!("file:{}", path("bag").display());
    let record = format!("record {source} {FEET} --axes fr=-x,-y,z -o");
    footfall(&record, &[&recording]).expect("a recording");
    let mut counts = Counts::default();
    copy(&recording, &mut counts)
        .expect("a bag")
        .expect("messages");
    let Counts(counts) = counts;
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

    let said = footfall("monitor demo:seconds=1 --topic all", &[]).expect_err("no bag");
    assert!(said.contains("are for file:"), "{said}");
    let said = footfall(
        "replay --topic all --not-topic * --load-topic /ft/{foot}",
        &[&path("bag")],
    )
    .expect_err("no foot");
    assert!(said.contains("/trunk/imu"), "{said}");
}
