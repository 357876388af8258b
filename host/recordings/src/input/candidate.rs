//! Detects recordings among other files, by name and first bytes.

use std::fs::{self, File};
use std::io;
use std::path::Path;

use super::Opened;
use super::format::Format;
use super::open::beginning;
use samples::compressed::without_ending;
use samples::foreign::Foreign;
use samples::magic;

/// Extensions used only for recordings. A file of this name that is not a recording is an error.
const OF_RECORDINGS: [&str; 5] = ["csv", "tsv", "parquet", "mcap", "db3"];

/// Extensions of any text.
const OF_TEXTS: [&str; 2] = ["txt", "dat"];

/// File in which rosbag2 describes its folder.
const METADATA: &str = "metadata.yaml";

/// Returns whether a file is a recording, judged by its name and its first bytes. If a format is given, every text
/// may be one.
///
/// # Errors
/// The file cannot be read.
pub fn is_recording(path: &Path, format: Option<Format>) -> io::Result<bool> {
    let extension = extension(path);
    if OF_RECORDINGS.contains(&extension.as_str()) {
        return Ok(true);
    }
    let first = beginning(&mut File::open(path)?)?;
    Ok(match magic::known(&first) {
        // Many programs use SQLite databases.
        Some(Foreign::Sqlite) => false,
        // It is read where its converter is installed; the reason is said where it is not.
        Some(Foreign::Ros1Bag) => true,
        Some(kind) => Format::of_kind(kind).is_some(),
        None if OF_TEXTS.contains(&extension.as_str()) => {
            format.is_some() || Opened::new(path, None).is_ok()
        }
        None => false,
    })
}

/// Returns whether a folder is a rosbag2.
#[must_use]
pub fn is_rosbag2(folder: &Path) -> bool {
    let is_bag = |name: &Path| ["mcap", "db3"].contains(&extension(name).as_str());
    folder.join(METADATA).is_file()
        && fs::read_dir(folder)
            .is_ok_and(|entries| entries.flatten().any(|entry| is_bag(&entry.path())))
}

/// Extension of a file in lower case; that of its content if it is compressed.
fn extension(path: &Path) -> String {
    let path = path.to_string_lossy().to_ascii_lowercase();
    let extension = without_ending(Path::new(&path)).extension();
    extension.unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recordings_are_detected_among_other_files() {
        let folder = tempfile::tempdir().unwrap();
        let table = "t,ax,ay,az,wx,wy,wz\n0,0,0,9.8,0,0,0\n";
        for (name, content, format, expected) in [
            ("walk.csv", table, None, true),
            ("empty.CSV", "", None, true),
            ("walk.csv.gz", "", None, true),
            ("walk.mcap", "damaged", None, true),
            ("walk", "PAR1", None, true),
            ("walk.bin", "\u{89}MCAP0", None, false),
            ("walk.bag", "#ROSBAG V2.0\n", None, true),
            ("thumbs.db", "SQLite format 3\0", None, false),
            ("walk.txt", table, None, true),
            ("README.txt", "Walks of May, on gravel.\n", None, false),
            ("atlas.txt", "1 2 3\n", Some(Format::PceAtlas), true),
            ("README", table, None, false),
            ("README.md", "# Walks", Some(Format::PceAtlas), false),
            ("walk.png", "\u{89}PNG", None, false),
            ("empty", "", None, false),
        ] {
            let path = folder.path().join(name);
            fs::write(&path, content).unwrap();
            assert_eq!(is_recording(&path, format).unwrap(), expected, "{name}");
        }
        assert!(is_recording(&folder.path().join("absent"), None).is_err());
    }

    #[test]
    fn folder_of_bags_is_a_rosbag2_only_with_metadata() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("walk_0.db3.zstd"), "").unwrap();
        assert!(!is_rosbag2(folder.path()));
        fs::write(folder.path().join(METADATA), "").unwrap();
        assert!(is_rosbag2(folder.path()));
    }
}
