//! Search for recordings: named files, and trees of folders.

use std::collections::{HashMap, HashSet};
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use recordings::input::{Format, is_recording, is_rosbag2};
use serde::Serialize;
use thiserror::Error;
use walkdir::{DirEntry, WalkDir};

use super::fingerprint;
use super::identity::{Identity, UNKNOWN};
use super::pattern::PathPattern;

/// Options of the search.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Search {
    /// Robot of all recordings; if `None`, the first folder below a source.
    pub robot: Option<String>,
    /// Pattern of the recordings' paths.
    pub pattern: Option<PathPattern>,
    /// Format of all recordings.
    pub format: Option<Format>,
    /// Results folder, excluded from the search.
    pub out: PathBuf,
}

/// Recording that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundRecording {
    /// Path of the recording.
    pub path: PathBuf,
    /// Identity of the recording.
    pub identity: Identity,
    /// Size in bytes, for progress; 0 if it cannot be read.
    pub bytes: u64,
}

/// Files and folders that are passed over.
#[derive(Clone, Debug, Eq, PartialEq, Serialize)]
pub struct PassedOver {
    /// Where it is.
    pub path: String,
    /// Why.
    pub reason: String,
}

/// Result of the search.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sources {
    /// Recordings, in the order of their names.
    pub recordings: Vec<FoundRecording>,
    /// Visible files that are not recordings.
    pub passed_over: Vec<PassedOver>,
    /// Names of the recordings whose path does not match the pattern.
    pub not_as_the_pattern: Vec<String>,
}

/// Error for a missing source.
#[derive(Debug, Error)]
#[error("{} cannot be read: {error}", path.display())]
pub struct NoSource {
    path: PathBuf,
    error: io::Error,
}

/// Finds the recordings in `sources`: files and rosbag2 folders as named, and everything in other folders that
/// looks like a recording. Each is found once, even if it is linked several times.
///
/// # Errors
/// A source is missing.
pub fn find(sources: &[PathBuf], search: &Search) -> Result<Sources, NoSource> {
    let mut finder = Finder {
        search,
        out: fs::canonicalize(&search.out).ok(),
        found: Sources::default(),
        seen: HashMap::new(),
        links: Vec::new(),
    };
    for source in sources {
        let error = |error| NoSource {
            path: source.clone(),
            error,
        };
        let real = fs::canonicalize(source).map_err(error)?;
        if real.is_dir() && !is_rosbag2(&real) {
            finder.walk(source, &real);
        } else {
            finder.add(source, &real, UNKNOWN);
        }
    }
    Ok(finder.finish())
}

struct Finder<'a> {
    search: &'a Search,
    out: Option<PathBuf>,
    found: Sources,
    /// Names of recordings by their real path.
    seen: HashMap<PathBuf, String>,
    /// Recordings reached through a link: path, real path and robot.
    links: Vec<(PathBuf, PathBuf, String)>,
}

impl Finder<'_> {
    /// Adds everything below a folder that looks like a recording.
    fn walk(&mut self, source: &Path, real_source: &Path) {
        let mut entries = WalkDir::new(source)
            .follow_links(true)
            .sort_by_file_name()
            .into_iter();
        while let Some(entry) = entries.next() {
            let entry = match entry {
                Ok(entry) => entry,
                Err(error) => {
                    let path = error.path().unwrap_or(source).to_owned();
                    let reason = if error.loop_ancestor().is_some() {
                        "it is a link to a folder above".to_owned()
                    } else {
                        error
                            .io_error()
                            .map_or_else(|| error.to_string(), ToString::to_string)
                    };
                    self.pass_over(&path, reason);
                    continue;
                }
            };
            let path = entry.path();
            let real = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
            let is_folder = entry.file_type().is_dir();
            if is_hidden(&entry) || (is_folder && self.out.as_ref() == Some(&real)) {
                if is_folder {
                    entries.skip_current_dir();
                }
                continue;
            }
            if is_folder {
                if entry.depth() == 0 || !is_rosbag2(path) {
                    continue;
                }
                entries.skip_current_dir();
            } else if let Err(error) = self.check(&entry) {
                self.pass_over(path, error.to_string());
                continue;
            }
            let below = path.strip_prefix(source).unwrap_or(path);
            let robot = robot_of(below, real_source);
            if real == real_source.join(below) {
                self.add(path, &real, &robot);
            } else {
                self.links.push((path.to_owned(), real, robot));
            }
        }
    }

    /// Checks that a file is a recording.
    fn check(&self, entry: &DirEntry) -> io::Result<()> {
        // Opening a pipe would wait for its writer.
        if entry.file_type().is_file() && is_recording(entry.path(), self.search.format)? {
            return Ok(());
        }
        Err(io::Error::other("it is not a recording"))
    }

    fn add(&mut self, path: &Path, real: &Path, robot: &str) {
        let name = name(path);
        if let Some(before) = self.seen.get(real) {
            if *before != name {
                let reason = format!("it is {before}");
                self.pass_over(path, reason);
            }
            return;
        }
        let robot = self.search.robot.as_deref().unwrap_or(robot);
        let mut identity = Identity::new(&name, robot);
        if let Some(pattern) = &self.search.pattern
            && pattern.apply(&mut identity).is_err()
        {
            self.found.not_as_the_pattern.push(name.clone());
        }
        self.seen.insert(real.to_owned(), name);
        self.found.recordings.push(FoundRecording {
            path: path.to_owned(),
            identity,
            bytes: fingerprint::bytes(path).unwrap_or(0),
        });
    }

    fn pass_over(&mut self, path: &Path, reason: String) {
        let path = path.display().to_string();
        self.found.passed_over.push(PassedOver { path, reason });
    }

    fn finish(mut self) -> Sources {
        for (path, real, robot) in std::mem::take(&mut self.links) {
            self.add(&path, &real, &robot);
        }
        let mut recordings = std::mem::take(&mut self.found.recordings);
        recordings.sort_by(|a, b| a.identity.name.cmp(&b.identity.name));
        let mut names = HashSet::new();
        for recording in recordings {
            if names.insert(recording.identity.name.clone()) {
                self.found.recordings.push(recording);
            } else {
                let reason = format!("another is called {}, too", recording.identity.name);
                self.pass_over(&recording.path, reason);
            }
        }
        self.found
    }
}

/// Returns whether a file or folder below a source is hidden.
fn is_hidden(entry: &DirEntry) -> bool {
    entry.depth() > 0 && entry.file_name().as_encoded_bytes().starts_with(b".")
}

/// Returns the first folder below a source, or the source's own name if there is none.
fn robot_of(below: &Path, source: &Path) -> String {
    let folder = below.parent().and_then(|parent| parent.components().next());
    let name = folder.map(Component::as_os_str).or(source.file_name());
    let name = name.map(|name| name.to_string_lossy().into_owned());
    name.unwrap_or_else(|| UNKNOWN.to_owned())
}

/// Returns the name of a recording: its path as given, without root, `.` and `..`.
pub(super) fn name(path: &Path) -> String {
    let mut parts: Vec<String> = Vec::new();
    for component in path.components() {
        match component {
            Component::Normal(part) => parts.push(part.to_string_lossy().into_owned()),
            Component::ParentDir => {
                parts.pop();
            }
            Component::Prefix(_) | Component::RootDir | Component::CurDir => {}
        }
    }
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn name_is_the_path_as_given() {
        for (path, expected) in [
            ("logs/spot/a.csv", "logs/spot/a.csv"),
            ("./logs//spot/a.csv", "logs/spot/a.csv"),
            ("/data/logs/a.csv", "data/logs/a.csv"),
            ("../logs/x/../a.csv", "logs/a.csv"),
        ] {
            assert_eq!(name(Path::new(path)), expected);
        }
    }

    #[test]
    fn robot_is_the_first_folder_below_the_source() {
        for (below, expected) in [
            ("spot/run/a.csv", "spot"),
            ("spot/a.csv", "spot"),
            ("a.csv", "lab"),
        ] {
            assert_eq!(robot_of(Path::new(below), Path::new("/data/lab")), expected);
        }
    }
}
