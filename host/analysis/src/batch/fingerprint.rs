//! BLAKE3 fingerprint of a recording, to detect changes.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use blake3::Hasher;
use serde::{Deserialize, Serialize};

/// Hash of a recording's bytes, and the file metadata that reveals a change while it is read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fingerprint {
    /// BLAKE3 hash in hexadecimal: of a file's bytes, or of the names, lengths and bytes of all files in a folder,
    /// in the order of their names.
    pub blake3: String,
    stamps: Vec<Stamp>,
}

/// Metadata of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Stamp {
    path: PathBuf,
    length: u64,
    modified: Option<SystemTime>,
}

impl Fingerprint {
    /// Hashes all bytes of a file, or of the folder of a rosbag2.
    ///
    /// # Errors
    /// The path cannot be read, or is neither a file nor a folder, such as a pipe.
    pub fn of(path: &Path) -> io::Result<Self> {
        let stamps = stamps(path)?;
        let mut hasher = Hasher::new();
        let is_folder = path.is_dir();
        for Stamp { path, length, .. } in &stamps {
            if is_folder {
                let name = path.file_name().unwrap_or_default().as_encoded_bytes();
                hasher.update(&(name.len() as u64).to_le_bytes());
                hasher.update(name);
                hasher.update(&length.to_le_bytes());
            }
            hasher.update_reader(File::open(path)?)?;
        }
        Ok(Self {
            blake3: hasher.finalize().to_string(),
            stamps,
        })
    }

    /// Returns whether the lengths and modification times of its files are unchanged.
    #[must_use]
    pub fn is_unchanged(&self, path: &Path) -> bool {
        stamps(path).is_ok_and(|now| now == self.stamps)
    }
}

/// Length and time of modification of one file of a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Listed {
    name: String,
    length: u64,
    /// ns since 1970.
    modified_ns: u64,
}

/// Returns length and time of all files of a recording; `None` where one has no time, or cannot be read.
pub(super) fn listed(path: &Path) -> Option<Vec<Listed>> {
    let stamps = stamps(path).ok()?.into_iter();
    let listed = stamps.map(|stamp| {
        let since = stamp.modified?.duration_since(UNIX_EPOCH).ok()?;
        let name = stamp.path.file_name().unwrap_or_default();
        Some(Listed {
            name: name.to_string_lossy().into_owned(),
            length: stamp.length,
            modified_ns: u64::try_from(since.as_nanos()).ok()?,
        })
    });
    listed.collect()
}

/// Returns the size of a recording in bytes: of the file, or of all files in the folder.
///
/// # Errors
/// The path cannot be read.
pub fn bytes(path: &Path) -> io::Result<u64> {
    Ok(stamps(path)?.iter().map(|stamp| stamp.length).sum())
}

fn stamps(path: &Path) -> io::Result<Vec<Stamp>> {
    let about = fs::metadata(path)?;
    if about.is_file() {
        return Ok(vec![Stamp {
            path: path.to_owned(),
            length: about.len(),
            modified: about.modified().ok(),
        }]);
    }
    if !about.is_dir() {
        return Err(io::Error::other("it is neither a file nor a folder"));
    }
    let mut stamps = Vec::new();
    for entry in fs::read_dir(path)? {
        let path = entry?.path();
        let about = fs::metadata(&path)?;
        if about.is_file() {
            stamps.push(Stamp {
                path,
                length: about.len(),
                modified: about.modified().ok(),
            });
        }
    }
    stamps.sort_by(|a, b| a.path.cmp(&b.path));
    Ok(stamps)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn file_hash_matches_b3sum() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("abc");
        fs::write(&path, "abc").unwrap();
        let fingerprint = Fingerprint::of(&path).unwrap();
        // `b3sum` of the same bytes.
        assert_eq!(
            fingerprint.blake3,
            "6437b3ac38465133ffb63b75273a8db548c558465d79db03fd359c6cd5bd9d85"
        );
        assert!(fingerprint.is_unchanged(&path));
        fs::write(&path, "abcd").unwrap();
        assert!(!fingerprint.is_unchanged(&path));
    }

    #[test]
    fn folder_hash_depends_on_names_and_bytes() {
        let hash = |files: &[(&str, &str)]| {
            let folder = tempfile::tempdir().unwrap();
            for (name, content) in files {
                fs::write(folder.path().join(name), content).unwrap();
            }
            assert_eq!(bytes(folder.path()).unwrap(), 4);
            Fingerprint::of(folder.path()).unwrap().blake3
        };
        let one = hash(&[("a", "xx"), ("b", "yy")]);
        assert_eq!(one, hash(&[("b", "yy"), ("a", "xx")]));
        for other in [
            hash(&[("a", "xxy"), ("b", "y")]),
            hash(&[("a", "xx"), ("c", "yy")]),
            hash(&[("a", "xx"), ("b", "yz")]),
        ] {
            assert_ne!(one, other);
        }
    }
}
