//! Copies of bags with contacts keep everything about the other messages: times, numbers, definitions and qualities of
//! service, as third-party libraries write and read them.

use std::ffi::OsStr;
use std::fs;
use std::iter;
use std::path::Path;

use crate::packages;
use clap::Parser;
use footfall::commands::Arguments;
use options::{InputOptions, Topics};
use recordings::Opened;

const REQUIREMENTS: &str = include_str!("python/roads.txt");
const SCRIPT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/bag_copies.py");

/// Number of samples in each bag.
const SAMPLES: usize = 400;

/// Runs the script, and returns its output.
fn script(packages: &packages::Packages, what: &str, paths: &[&Path]) -> String {
    let paths = paths.iter().map(|path| path as &dyn AsRef<OsStr>);
    let arguments: Vec<_> = iter::once(&what as &dyn AsRef<OsStr>).chain(paths).collect();
    packages.run(SCRIPT, &arguments)
}

#[test]
fn copy_keeps_all_of_the_messages_of_others() {
    let Some(packages) = packages::install("python-roads", REQUIREMENTS) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    script(&packages, "write", &[folder.path()]);
    // Beside each sample two gauges of one type with different definitions, and a title.
    for (bag, messages) in [("sent.mcap", 4 * SAMPLES), ("offered", SAMPLES)] {
        let (bag, copy) = (path(bag), path("copy.mcap"));
        let paths = [bag.as_os_str(), "--output".as_ref(), copy.as_os_str()];
        let command = ["footfall", "--quiet", "replay"].map(AsRef::as_ref);
        let arguments = Arguments::parse_from(command.into_iter().chain(paths));
        arguments.run().expect("a copy");
        let compared = script(&packages, "compare", &[&bag, &copy]);
        assert_eq!(compared, messages.to_string(), "{}", bag.display());
        fs::remove_file(&copy).expect("the copy");
    }
    // A number together with a text of wide characters.
    let mut input_options = InputOptions::default();
    input_options.bag.topics = Topics::All;
    input_options.bag.loads = vec!["/titled.force".parse().expect("a load")];
    let opened = Opened::new(&path("sent.mcap"), None).expect("a bag");
    let mut feet = opened.store_all(&input_options).expect("feet");
    let loads = feet[0].samples().expect("samples");
    for (k, sample) in loads.enumerate() {
        let load = sample.expect("a sample").load.map(|load| load.0);
        assert_eq!(load, Some(80.0 + (k % 7) as f32), "sample {k}");
    }
}
