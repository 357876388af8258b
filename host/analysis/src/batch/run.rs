//! Batch runs on the threads of one machine. Recordings that are up to date are skipped.

use std::collections::HashSet;
use std::fs::{self, File, TryLockError};
use std::io;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use serde::Serialize;

use super::fingerprint::{Fingerprint, listed};
use super::identity::{Day, FootFiles, Identity, day_or_unknown};
pub use super::index::Stale;
use super::index::{Incomplete, Index, remove_empty_folders};
use super::notes::{Note, Notes, Verify};
use super::recording::{BatchError, Progress, estimate_recording};
use super::row::{BatchRow, Status};
use super::settings::BatchSettings;
use super::sources::{FoundRecording, name};
use crate::replay::jobs;

/// Why a recording is estimated.
#[derive(Clone, Copy, Debug, Eq, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Reason {
    /// There are no results of it.
    Missing,
    /// Some of its results are not there, such as after a run that was interrupted, or there are others.
    Incomplete,
    /// It has other bytes than before.
    InputChanged,
    /// It was estimated with other settings.
    OtherSettings,
    /// It was estimated by another version.
    OtherVersion,
    /// It now belongs to another robot, foot or day.
    OtherPlace,
    /// It could not be read before.
    WasUnreadable,
}

impl Reason {
    /// Returns the reason as a sentence.
    #[must_use]
    pub const fn sentence(self) -> &'static str {
        match self {
            Self::Missing => "there are no results",
            Self::Incomplete => "the results are not complete",
            Self::InputChanged => "the recording has changed",
            Self::OtherSettings => "the settings are others",
            Self::OtherVersion => "the version is another",
            Self::OtherPlace => "robot, foot or day are others",
            Self::WasUnreadable => "it could not be read before",
        }
    }
}

/// Outcome for a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum RecordingOutcome {
    /// Estimated or failed, as its rows state.
    Estimated(Reason, Vec<BatchRow>),
    /// Estimated or failed in an earlier run.
    UpToDate(Vec<BatchRow>),
    /// Due for estimation.
    ToDo(Reason),
}

impl RecordingOutcome {
    /// Returns the rows of the recording; none where it is due.
    #[must_use]
    pub fn rows(&self) -> &[BatchRow] {
        match self {
            Self::Estimated(_, rows) | Self::UpToDate(rows) => rows,
            Self::ToDo(_) => &[],
        }
    }

    /// Returns the error of a failed recording.
    #[must_use]
    pub fn error(&self) -> Option<&str> {
        let mut failed = self
            .rows()
            .iter()
            .filter(|row| row.origin.status == Status::Failed);
        failed
            .next()
            .map(|row| row.origin.error.as_deref().unwrap_or_default())
    }
}

/// Results folder in exclusive use by this process.
#[derive(Debug)]
pub struct Results {
    out: PathBuf,
    index: Index,
    /// Of the last run.
    notes: Notes,
    /// Folder, locked if the system supports it; the lock ends with the process.
    _lock: Option<File>,
}

impl Results {
    /// Opens a folder, which is created if missing, and removes the unfinished files of a killed run.
    ///
    /// # Errors
    /// The folder cannot be written, or another process uses it.
    pub fn open(out: &Path) -> Result<Self, BatchError> {
        fs::create_dir_all(out).map_err(BatchError::output(out))?;
        let results = Self {
            _lock: lock(out)?,
            ..Self::look(out)
        };
        results.index.remove_unfinished()?;
        Ok(results)
    }

    /// Reads a folder, which may be missing, without changing it.
    #[must_use]
    pub fn look(out: &Path) -> Self {
        Self {
            out: out.to_owned(),
            index: Index::of(out),
            notes: Notes::read(out),
            _lock: None,
        }
    }

    /// Estimates the recordings whose results are missing or outdated on up to `jobs` threads, longest first, and
    /// passes each outcome to [`Watch::done`] as it arrives.
    ///
    /// # Errors
    /// The first error that affects every recording; no further recording is started after it.
    pub fn estimate(
        &self,
        recordings: &[FoundRecording],
        settings: &BatchSettings,
        verify: Verify,
        jobs: NonZeroUsize,
        watch: &(dyn Watch + Sync),
    ) -> Result<(), BatchError> {
        let notes = Mutex::new(self.notes.clone());
        let mut order: Vec<&FoundRecording> = recordings.iter().collect();
        order.sort_by_key(|recording| std::cmp::Reverse(recording.bytes));
        let hash = settings.blake3();
        let results = jobs::run(&order, jobs, |recording| {
            let key = recording.identity.key();
            let before = listed(&recording.path);
            let outcome = match self.up_to_date(recording, &hash, verify) {
                Ok(rows) => RecordingOutcome::UpToDate(rows),
                Err(reason) => {
                    self.index.remove(&key)?;
                    let rows = estimate_recording(
                        &recording.path,
                        &recording.identity,
                        settings,
                        &self.out,
                        &watch.progress(recording),
                    )?;
                    RecordingOutcome::Estimated(reason, rows)
                }
            };
            let note = Note::of(&recording.path, before, outcome.rows(), &self.out);
            notes
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .set(key, note);
            watch.done(recording, outcome);
            Ok(())
        });
        remove_empty_folders(&self.out);
        let mut notes = notes.into_inner().unwrap_or_else(PoisonError::into_inner);
        let of_run: HashSet<String> = order
            .iter()
            .map(|recording| recording.identity.key())
            .collect();
        let known: HashSet<&String> = self.index.keys().chain(&of_run).collect();
        notes.retain(|key| known.contains(key));
        if notes != self.notes {
            let written = notes.write(&self.out);
            written.map_err(BatchError::output(&self.out))?;
        }
        results.into_iter().collect()
    }

    /// Reports to [`Watch::done`] which recordings [`Self::estimate`] would estimate, and why.
    pub fn plan(
        &self,
        recordings: &[FoundRecording],
        settings: &BatchSettings,
        verify: Verify,
        jobs: NonZeroUsize,
        watch: &(dyn Watch + Sync),
    ) {
        let hash = settings.blake3();
        jobs::run(recordings, jobs, |recording| {
            let outcome = match self.up_to_date(recording, &hash, verify) {
                Ok(rows) => RecordingOutcome::UpToDate(rows),
                Err(reason) => RecordingOutcome::ToDo(reason),
            };
            watch.done(recording, outcome);
            Ok::<(), ()>(())
        });
    }

    /// Returns the results of recordings that are not in `recordings`, though their names are those of `sources` or of
    /// something below one.
    #[must_use]
    pub fn stale(&self, recordings: &[FoundRecording], sources: &[PathBuf]) -> Vec<Stale> {
        let sources: Vec<String> = sources.iter().map(|source| name(source)).collect();
        let is_below = |recording: &Option<String>| {
            let Some(recording) = recording else {
                return false;
            };
            sources.iter().any(|source| {
                let below = recording.strip_prefix(source.as_str());
                source.is_empty()
                    || below.is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
            })
        };
        let wanted: HashSet<String> = recordings
            .iter()
            .map(|recording| recording.identity.key())
            .collect();
        let stale = self.index.keys().filter(|key| !wanted.contains(*key));
        stale
            .map(|key| self.index.about(key))
            .filter(|stale| is_below(&stale.recording))
            .collect()
    }

    /// Removes results.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn prune(&self, stale: &[Stale]) -> Result<(), BatchError> {
        let mut keys = stale.iter().map(|stale| &stale.key);
        keys.try_for_each(|key| self.index.remove(key))?;
        remove_empty_folders(&self.out);
        Ok(())
    }

    /// Returns the rows of a recording that is up to date, or the reason to estimate it. The recording is read
    /// only if everything else matches, and its listing does not suffice.
    fn up_to_date(
        &self,
        recording: &FoundRecording,
        settings: &str,
        verify: Verify,
    ) -> Result<Vec<BatchRow>, Reason> {
        let FoundRecording { path, identity, .. } = recording;
        let key = identity.key();
        let rows = self.index.complete_rows(&key, |file, below| match verify {
            Verify::Listing => self.notes.row(&key, file, below),
            Verify::Contents => None,
        });
        let rows = rows.map_err(|incomplete| match incomplete {
            Incomplete::Missing => Reason::Missing,
            Incomplete::Unfinished => Reason::Incomplete,
        })?;
        let all = |is_same: &dyn Fn(&BatchRow) -> bool| rows.iter().all(|(_, row)| is_same(row));
        if !all(&|row| row.origin.version == env!("CARGO_PKG_VERSION")) {
            return Err(Reason::OtherVersion);
        }
        if !all(&|row| row.origin.settings_blake3 == settings) {
            return Err(Reason::OtherSettings);
        }
        if !rows
            .iter()
            .all(|(below, row)| is_in_place(below, row, identity))
        {
            return Err(Reason::OtherPlace);
        }
        if !all(&|row| row.origin.input_blake3.is_some()) {
            return Err(Reason::WasUnreadable);
        }
        let noted = match verify {
            Verify::Listing => self.notes.hash_of(&key, path).map(str::to_owned),
            Verify::Contents => None,
        };
        let hash = match noted {
            Some(hash) => hash,
            None => {
                Fingerprint::of(path)
                    .map_err(|_| Reason::InputChanged)?
                    .blake3
            }
        };
        let is_same = |row: &BatchRow| row.origin.input_blake3.as_ref() == Some(&hash);
        if all(&is_same) {
            Ok(rows.into_iter().map(|(_, row)| row).collect())
        } else {
            Err(Reason::InputChanged)
        }
    }
}

/// Observes recordings while they are estimated, on any thread.
pub trait Watch {
    /// Returns the callback for the progress of a recording.
    fn progress(&self, _recording: &FoundRecording) -> Progress {
        Arc::new(|_| ())
    }

    /// Called when a recording is done.
    fn done(&self, recording: &FoundRecording, outcome: RecordingOutcome);
}

/// Returns whether this identity places a row where it is.
fn is_in_place(below: &Path, row: &BatchRow, identity: &Identity) -> bool {
    let clock = row.found.as_ref().map(|found| found.start_s * 1.0e6);
    let day = clock.and_then(|micros| Day::of_clock(micros.round() as i64));
    let place = FootFiles {
        robot: identity.robot.clone(),
        // A recording with several feet names them itself.
        foot: if row.origin.feet > 1 {
            row.foot.clone()
        } else {
            identity.only_foot()
        },
        day: day_or_unknown(day.or(identity.day)),
        key: identity.key(),
    };
    place.path() == below
}

/// Locks a folder.
fn lock(out: &Path) -> Result<Option<File>, BatchError> {
    // If a folder cannot be opened or locked, as on Windows or some network drives, the run continues unlocked.
    let Ok(folder) = File::open(out) else {
        return Ok(None);
    };
    match folder.try_lock() {
        Ok(()) => Ok(Some(folder)),
        Err(TryLockError::WouldBlock) => {
            let in_use = io::Error::other("another process writes there; wait until it is done");
            Err(BatchError::output(out)(in_use))
        }
        Err(TryLockError::Error(_)) => Ok(None),
    }
}
