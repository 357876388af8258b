//! Many recordings on the threads of one machine. What is done already is not done again.

use std::collections::HashSet;
use std::fs::{self, File, TryLockError};
use std::io;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use schemars::JsonSchema;
use serde::Serialize;

use super::fingerprint::Fingerprint;
use super::identity::{Day, Identity, Place, day_or_unknown};
use super::index::{Incomplete, Index, remove_empty_folders};
use super::recording::{BatchError, Progress, estimate_recording_watched};
use super::row::{Row, Status};
use super::settings::Settings;
use super::sources::Recording;
use crate::replay::jobs;

/// Why a recording is estimated.
#[derive(Clone, Copy, Debug, Eq, JsonSchema, PartialEq, Serialize)]
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
    /// What is said of it.
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

/// What became of a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// It was estimated, or has failed, as its rows say.
    Estimated(Reason, Vec<Row>),
    /// It was estimated, or has failed, before.
    UpToDate(Vec<Row>),
    /// It would be estimated.
    ToDo(Reason),
}

impl Outcome {
    /// Why it has failed, where it has.
    #[must_use]
    pub fn error(&self) -> Option<&str> {
        let rows = match self {
            Self::Estimated(_, rows) | Self::UpToDate(rows) => rows,
            Self::ToDo(_) => return None,
        };
        let mut failed = rows
            .iter()
            .filter(|row| row.origin.status == Status::Failed);
        failed
            .next()
            .map(|row| row.origin.error.as_deref().unwrap_or_default())
    }
}

/// Results of a recording that was not found any more.
#[derive(Clone, Debug, Eq, JsonSchema, PartialEq, Serialize)]
pub struct Stale {
    /// Its name; `null` where no row of it is left.
    pub recording: Option<String>,
    /// The name of its files, without extension.
    pub key: String,
    /// How many there are.
    pub files: usize,
}

/// A folder of results on which this process alone works.
#[derive(Debug)]
pub struct Results {
    out: PathBuf,
    index: Index,
    /// The folder, locked where the system can; the lock ends with the process.
    _lock: Option<File>,
}

impl Results {
    /// Opens a folder and makes it where it is not there; removes what a run that was killed has left.
    ///
    /// # Errors
    /// The folder cannot be written, or another process works on it.
    pub fn open(out: &Path) -> Result<Self, BatchError> {
        let output = |path: &Path, source| BatchError::Output {
            path: path.to_owned(),
            source,
        };
        fs::create_dir_all(out).map_err(|source| output(out, source))?;
        let lock = lock(out)?;
        let index = Index::of(out);
        index
            .remove_unfinished()
            .map_err(|(path, source)| output(&path, source))?;
        Ok(Self {
            out: out.to_owned(),
            index,
            _lock: lock,
        })
    }

    /// Looks at a folder, which need not be there, and changes nothing.
    #[must_use]
    pub fn look(out: &Path) -> Self {
        Self {
            out: out.to_owned(),
            index: Index::of(out),
            _lock: None,
        }
    }

    /// Estimates those of `recordings` whose results are missing or of something else, on up to `jobs`
    /// threads, and hands what became of each to `done` as it comes. Long ones are begun first.
    ///
    /// # Errors
    /// The first thing that stands in the way of any recording; no further one is begun then.
    pub fn estimate(
        &self,
        recordings: &[Recording],
        settings: &Settings,
        jobs: NonZeroUsize,
        watch: &(dyn Watch + Sync),
    ) -> Result<(), BatchError> {
        let mut order: Vec<&Recording> = recordings.iter().collect();
        order.sort_by_key(|recording| std::cmp::Reverse(recording.bytes));
        let hash = settings.blake3();
        let results = jobs::run(&order, jobs, |recording| {
            let outcome = match self.up_to_date(recording, &hash) {
                Ok(rows) => Outcome::UpToDate(rows),
                Err(reason) => {
                    let key = recording.identity.key();
                    self.remove(&key)?;
                    let rows = estimate_recording_watched(
                        &recording.path,
                        &recording.identity,
                        settings,
                        &self.out,
                        &watch.progress(recording),
                    )?;
                    Outcome::Estimated(reason, rows)
                }
            };
            watch.done(recording, outcome);
            Ok(())
        });
        remove_empty_folders(&self.out);
        results.into_iter().collect()
    }

    /// What [`Self::estimate`] would do.
    pub fn plan(
        &self,
        recordings: &[Recording],
        settings: &Settings,
        jobs: NonZeroUsize,
        watch: &(dyn Watch + Sync),
    ) {
        let hash = settings.blake3();
        jobs::run(recordings, jobs, |recording| {
            let outcome = match self.up_to_date(recording, &hash) {
                Ok(rows) => Outcome::UpToDate(rows),
                Err(reason) => Outcome::ToDo(reason),
            };
            watch.done(recording, outcome);
            Ok::<(), ()>(())
        });
    }

    /// The results of recordings that are none of these.
    #[must_use]
    pub fn stale(&self, recordings: &[Recording]) -> Vec<Stale> {
        let wanted: HashSet<String> = recordings
            .iter()
            .map(|recording| recording.identity.key())
            .collect();
        let stale = self.index.keys().filter(|key| !wanted.contains(*key));
        stale
            .map(|key| {
                let (recording, files) = self.index.about(key);
                Stale {
                    recording,
                    key: key.clone(),
                    files,
                }
            })
            .collect()
    }

    /// Removes results.
    ///
    /// # Errors
    /// A file cannot be removed.
    pub fn prune(&self, stale: &[Stale]) -> Result<(), BatchError> {
        stale.iter().try_for_each(|stale| self.remove(&stale.key))?;
        remove_empty_folders(&self.out);
        Ok(())
    }

    fn remove(&self, key: &str) -> Result<(), BatchError> {
        let removed = self.index.remove(key);
        removed.map_err(|(path, source)| BatchError::Output { path, source })
    }

    /// The rows of a recording that need not be estimated; or why it must be. The recording is read only
    /// where nothing else says it.
    fn up_to_date(&self, recording: &Recording, settings: &str) -> Result<Vec<Row>, Reason> {
        let Recording { path, identity, .. } = recording;
        let rows = self.index.complete_rows(&identity.key());
        let rows = rows.map_err(|incomplete| match incomplete {
            Incomplete::Missing => Reason::Missing,
            Incomplete::Unfinished => Reason::Incomplete,
        })?;
        let all = |is_same: &dyn Fn(&Row) -> bool| rows.iter().all(|(_, row)| is_same(row));
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
        let fingerprint = Fingerprint::of(path).map_err(|_| Reason::InputChanged)?;
        let is_same = |row: &Row| row.origin.input_blake3.as_ref() == Some(&fingerprint.blake3);
        if all(&is_same) {
            Ok(rows.into_iter().map(|(_, row)| row).collect())
        } else {
            Err(Reason::InputChanged)
        }
    }
}

/// Watches recordings while they are estimated, on any thread.
pub trait Watch {
    /// Something that is told how much of a recording is done.
    fn progress(&self, _recording: &Recording) -> Progress {
        Arc::new(|_| ())
    }

    /// A recording is done.
    fn done(&self, recording: &Recording, outcome: Outcome);
}

/// Whether a row is where it would be with this identity.
fn is_in_place(below: &Path, row: &Row, identity: &Identity) -> bool {
    let clock = row.found.as_ref().map(|found| found.start_s * 1.0e6);
    let day = clock.and_then(|micros| Day::of_clock(micros.round() as i64));
    let place = Place {
        robot: identity.robot.clone(),
        // The feet of a recording that has several are named by it.
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
    let in_use = || BatchError::Output {
        path: out.to_owned(),
        source: io::Error::other("another process writes there; wait until it is done"),
    };
    // Where a folder cannot be opened or locked, as on Windows or some network's, all goes on without.
    let Ok(folder) = File::open(out) else {
        return Ok(None);
    };
    match folder.try_lock() {
        Ok(()) => Ok(Some(folder)),
        Err(TryLockError::WouldBlock) => Err(in_use()),
        Err(TryLockError::Error(_)) => Ok(None),
    }
}
