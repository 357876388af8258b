//! Index of the results folder: files by the key of their recording.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::path::{Path, PathBuf};

use recordings::parquet_rows::read;
use serde::Serialize;
use walkdir::WalkDir;

use super::identity::decoded;
use super::notes::Notes;
use super::recording::BatchError;
use super::row::{BatchRow, Status};
use super::tables::{self, Table};
use crate::whole_file::is_unfinished;

/// The files of all recordings below a folder of results.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Index {
    out: PathBuf,
    /// Paths by the key of their recording.
    files: BTreeMap<String, BTreeSet<PathBuf>>,
    /// Unfinished files of a killed process.
    unfinished: Vec<PathBuf>,
}

/// Results of a recording that was not found any more.
#[derive(Clone, Debug, Eq, PartialEq, Serialize)]
pub struct Stale {
    /// Its name; `null` where no row of it is left.
    pub recording: Option<String>,
    /// The name of its files, without extension.
    pub key: String,
    /// How many there are.
    pub files: usize,
}

impl Index {
    /// Indexes a folder, which may be missing.
    pub(super) fn of(out: &Path) -> Self {
        let mut index = Self {
            out: out.to_owned(),
            ..Self::default()
        };
        let own = fs::read_dir(out).into_iter().flatten().flatten();
        let own = own.map(|entry| entry.path());
        index.unfinished = own.filter(|path| Notes::are_unfinished(path)).collect();
        for table in Table::ALL {
            // An unreadable folder counts as empty; writing to it reports the error.
            for entry in WalkDir::new(out.join(table.name())).into_iter().flatten() {
                let path = entry.path();
                if !entry.file_type().is_file() {
                    continue;
                }
                if is_unfinished(path) {
                    index.unfinished.push(path.to_owned());
                } else if path
                    .extension()
                    .is_some_and(|extension| extension == "parquet")
                {
                    let key = path.file_stem().unwrap_or_default().to_string_lossy();
                    let files = index.files.entry(key.into_owned()).or_default();
                    files.insert(path.to_owned());
                }
            }
        }
        index
    }

    /// Returns the keys of all recordings.
    pub(super) fn keys(&self) -> impl Iterator<Item = &String> {
        self.files.keys()
    }

    /// Returns the rows of a recording if exactly its files are present; each with its path below the folder of a
    /// table. `noted` returns the row in a file if it is known without reading it, from its path and that below the
    /// folder of the table.
    pub(super) fn complete_rows(
        &self,
        key: &str,
        noted: impl Fn(&Path, &Path) -> Option<BatchRow>,
    ) -> Result<Vec<(PathBuf, BatchRow)>, Incomplete> {
        let files = self.files.get(key).ok_or(Incomplete::Missing)?;
        let folder = self.out.join(Table::Recordings.name());
        let mut rows = Vec::new();
        for file in files {
            if let Ok(below) = file.strip_prefix(&folder) {
                let row = noted(file, below).or_else(|| read_row(file, below));
                let row = row.ok_or(Incomplete::Unfinished)?;
                rows.push((below.to_owned(), row));
            }
        }
        let expected = rows.iter().flat_map(|(below, row)| {
            let tables: &[Table] = match row.origin.status {
                Status::Done => &Table::ALL,
                Status::Failed => &[Table::Recordings],
            };
            tables
                .iter()
                .map(move |table| self.out.join(table.name()).join(below))
        });
        let expected: BTreeSet<PathBuf> = expected.collect();
        let mut feet = rows.iter().map(|(_, row)| row.origin.feet);
        let is_whole = feet.all(|feet| feet == rows.len() as u64);
        if rows.is_empty() || !is_whole || expected != *files {
            return Err(Incomplete::Unfinished);
        }
        Ok(rows)
    }

    /// Returns the name of a recording, if it has a row, with the key and number of its files.
    pub(super) fn about(&self, key: &str) -> Stale {
        let folder = self.out.join(Table::Recordings.name());
        let files = self.files.get(key);
        let mut rows = files.into_iter().flatten().filter_map(|file| {
            let below = file.strip_prefix(&folder).ok()?;
            read_row(file, below)
        });
        Stale {
            recording: rows.next().map(|row| row.origin.recording),
            key: key.to_owned(),
            files: files.map_or(0, BTreeSet::len),
        }
    }

    /// Removes all files of a recording, rows first, so that a partly removed recording does not count as done.
    pub(super) fn remove(&self, key: &str) -> Result<(), BatchError> {
        let folder = self.out.join(Table::Recordings.name());
        let files = self.files.get(key).into_iter().flatten();
        let (rows, others): (Vec<_>, Vec<_>) = files.partition(|file| file.starts_with(&folder));
        rows.into_iter()
            .chain(others)
            .try_for_each(|path| remove(path))
    }

    /// Removes the unfinished files of a killed process.
    pub(super) fn remove_unfinished(&self) -> Result<(), BatchError> {
        self.unfinished.iter().try_for_each(|path| remove(path))
    }
}

/// Reason why a recording has to be estimated, as far as its files show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Incomplete {
    /// No files.
    Missing,
    /// Files are missing, unreadable or surplus.
    Unfinished,
}

/// Removes empty folders.
pub(super) fn remove_empty_folders(out: &Path) {
    for table in Table::ALL {
        let folder = out.join(table.name());
        let entries = WalkDir::new(&folder).contents_first(true).into_iter();
        for entry in entries.flatten() {
            if entry.file_type().is_dir() {
                // Fails if the folder is not empty.
                let _ = fs::remove_dir(entry.path());
            }
        }
    }
}

fn remove(path: &Path) -> Result<(), BatchError> {
    tables::remove(path).map_err(BatchError::output(path))
}

/// Reads the row in a file; robot, foot and day come from its path.
fn read_row(file: &Path, below: &Path) -> Option<BatchRow> {
    let mut rows: Vec<BatchRow> = read(File::open(file).ok()?).ok()?;
    let row = rows.pop().filter(|_| rows.is_empty())?;
    let mut partitions = below.components().map(|part| {
        let part = part.as_os_str().to_string_lossy();
        part.split_once('=').map(|(_, value)| decoded(value))
    });
    let mut next = || partitions.next().flatten();
    Some(BatchRow {
        robot: next()?,
        foot: next()?,
        day: next()?,
        ..row
    })
}
