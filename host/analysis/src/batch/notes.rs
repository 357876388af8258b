//! Lengths and times of the recordings when they were hashed, and of the files of their rows, so that a later run need
//! open none of them.
//!
//! The notes are an aid: without them, or where a file differs from its note, its bytes count.

use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::fingerprint::{Listed, listed};
use super::row::BatchRow;
use super::tables::Table;
use crate::whole_file::{WholeFile, is_unfinished};

/// Name of the file of notes in the folder of results.
const FILE: &str = ".inputs.json";

/// Evidence that a recording is unchanged.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Verify {
    /// Length and time of modification of its files, as noted when they were hashed; their bytes where they differ.
    #[default]
    Listing,
    /// The bytes of its files.
    Contents,
}

/// Notes on recordings, by the keys of these.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Notes(BTreeMap<String, Note>);

/// A recording when it was hashed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Note {
    /// BLAKE3 hash, as in [`Fingerprint`](super::fingerprint::Fingerprint).
    blake3: String,
    files: Vec<Listed>,
    rows: Vec<NotedRow>,
}

impl Note {
    /// Notes the hash in these rows of a recording whose files were `before` when it was read, and the rows; `None` if the
    /// files have changed since.
    pub(super) fn of(
        path: &Path,
        before: Option<Vec<Listed>>,
        rows: &[BatchRow],
        out: &Path,
    ) -> Option<Self> {
        let blake3 = rows.first()?.origin.input_blake3.clone()?;
        let files = before.filter(|files| listed(path).as_ref() == Some(files))?;
        let folder = out.join(Table::Recordings.name());
        let noted = |row: &BatchRow| {
            Some(NotedRow {
                file: listed(&folder.join(row.place().path()))?,
                row: serde_json::to_value(row).ok()?,
            })
        };
        let rows = rows.iter().filter_map(noted).collect();
        Some(Self {
            blake3,
            files,
            rows,
        })
    }
}

/// A row, whose file was like this.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct NotedRow {
    file: Vec<Listed>,
    row: Value,
}

impl Notes {
    /// Reads the notes of a folder of results; none where they are missing or damaged.
    pub(super) fn read(out: &Path) -> Self {
        let text = fs::read(out.join(FILE)).unwrap_or_default();
        serde_json::from_slice(&text).unwrap_or_default()
    }

    /// Returns whether this is the file of notes that a killed process was writing.
    pub(super) fn are_unfinished(path: &Path) -> bool {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        is_unfinished(path) && name.contains(FILE)
    }

    /// Hash of a recording whose files are as noted.
    pub(super) fn hash_of(&self, key: &str, path: &Path) -> Option<&str> {
        let note = self.0.get(key)?;
        (listed(path)? == note.files).then_some(&*note.blake3)
    }

    /// Row of a recording in this file, at its path below the folder of the table, if the file is as noted.
    pub(super) fn row(&self, key: &str, file: &Path, below: &Path) -> Option<BatchRow> {
        let now = listed(file)?;
        let noted = self.0.get(key)?.rows.iter();
        let mut rows = noted
            .filter(|noted| noted.file == now)
            .filter_map(|noted| BatchRow::deserialize(&noted.row).ok());
        rows.find(|row| row.place().path() == below)
    }

    /// Replaces the note on a recording; none removes it.
    pub(super) fn set(&mut self, key: String, note: Option<Note>) {
        match note {
            Some(note) => self.0.insert(key, note),
            None => self.0.remove(&key),
        };
    }

    /// Removes the notes on recordings without this property.
    pub(super) fn retain(&mut self, is_kept: impl Fn(&String) -> bool) {
        self.0.retain(|key, _| is_kept(key));
    }

    /// Replaces the notes of a folder of results.
    ///
    /// # Errors
    /// An error of the operating system.
    pub(super) fn write(&self, out: &Path) -> io::Result<()> {
        let mut file = WholeFile::create(&out.join(FILE))?;
        serde_json::to_writer(&mut file, self)?;
        file.write_all(b"\n")?;
        file.finish()
    }
}
