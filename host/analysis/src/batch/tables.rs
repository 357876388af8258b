//! Tables of samples and events of one foot, and of its row.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use estimator_core::{ContactEstimate, Decision, Phase};
use recordings::events::{ContactEvent, EventKind};
use recordings::output::seconds;
use recordings::parquet_output::ParquetEstimates;
use recordings::parquet_rows::{Field, ParquetRows};
use samples::recording::RecordedSample;
use serde::Serialize;

use super::identity::FootFiles;
use super::row::{BatchRow, Column, columns};
use crate::replay::foot::Observer;
use crate::whole_file::WholeFile;

samples::named! {
    /// Tables, by the names of their folders.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(super) enum Table {
        Samples = "samples",
        Events = "events",
        Recordings = "recordings",
    }
}

impl Table {
    /// Returns the path of a foot's file.
    pub(super) fn path(self, out: &Path, place: &FootFiles) -> PathBuf {
        out.join(self.name()).join(place.path())
    }
}

/// Column of the recording's name in the table of samples, as the field of [`EventRow`] in that of events.
const RECORDING: &str = "recording";

columns! {
    /// A row of the table of events; the columns are those of [`recordings::events::HEADER`].
    #[derive(Serialize)]
    pub struct EventRow<'a> {
        recording: &'a str,
        t: f64,
        event: &'static str,
        duration: Option<f64>,
        p_peak: f32,
        distance: Option<f64>,
    }
}

/// Counters of a foot's estimation.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Counts {
    /// In the order of [`Phase::ALL`].
    pub(super) states: [u64; Phase::ALL.len()],
    pub(super) stable: u64,
    pub(super) steps: u64,
    pub(super) lift_offs: u64,
    pub(super) slips: u64,
    pub(super) slips_with_distance: u64,
    pub(super) slip_distance_m: f64,
    pub(super) unstable_stances: u64,
}

/// Writes the samples and events of a foot while it is estimated.
pub(super) struct Writer<'a> {
    recording: &'a str,
    start_us: i64,
    samples: ParquetEstimates<WholeFile>,
    events: ParquetRows<WholeFile>,
    /// The first failure; nothing is written after it.
    written: io::Result<()>,
    pub(super) counts: Counts,
    /// Called with the number of estimated samples.
    progress: &'a dyn Fn(u64),
    estimated: u64,
}

/// Samples between two reports of progress.
const REPORTED_EVERY: u64 = 10_000;

impl<'a> Writer<'a> {
    pub(super) fn new(
        out: &Path,
        place: &FootFiles,
        recording: &'a str,
        start_us: i64,
        progress: &'a dyn Fn(u64),
    ) -> io::Result<Self> {
        let samples = create(&Table::Samples.path(out, place))?;
        let events = create(&Table::Events.path(out, place))?;
        Ok(Self {
            recording,
            start_us,
            samples: ParquetEstimates::with_name(samples, Some(RECORDING))?,
            events: ParquetRows::new(events, EventRow::columns())?,
            written: Ok(()),
            counts: Counts::default(),
            progress,
            estimated: 0,
        })
    }

    /// Renames the files to their final names.
    pub(super) fn finish(self) -> io::Result<()> {
        self.written?;
        self.samples.finish()?.finish()?;
        self.events.finish()?.finish()
    }

    fn write_event(&mut self, event: &ContactEvent) -> io::Result<()> {
        self.events.add(&EventRow {
            recording: self.recording,
            t: seconds(event.time, self.start_us),
            event: event.kind.name(),
            duration: event.duration_us.map(|micros| micros as f64 / 1.0e6),
            p_peak: event.peak,
            distance: event.distance_m,
        })
    }
}

impl Observer for Writer<'_> {
    fn estimated(&mut self) {
        self.estimated += 1;
        if self.estimated.is_multiple_of(REPORTED_EVERY) {
            (self.progress)(self.estimated);
        }
    }

    fn add(&mut self, _: &RecordedSample, estimate: &ContactEstimate) {
        for (count, phase) in self.counts.states.iter_mut().zip(Phase::ALL) {
            *count += u64::from(estimate.phase == phase);
        }
        self.counts.stable += u64::from(estimate.decision == Decision::Stable);
        if self.written.is_ok() {
            let name = Some(self.recording);
            self.written = self.samples.add(name, estimate, self.start_us);
        }
    }

    fn add_event(&mut self, event: &ContactEvent) {
        let counts = &mut self.counts;
        match event.kind {
            EventKind::TouchDown => counts.steps += 1,
            EventKind::LiftOff => counts.lift_offs += 1,
            EventKind::SlipStart => {
                counts.slips += 1;
                if let Some(distance) = event.distance_m {
                    counts.slips_with_distance += 1;
                    counts.slip_distance_m += distance;
                }
            }
            EventKind::UnstableStart => counts.unstable_stances += 1,
            EventKind::SlipEnd | EventKind::UnstableEnd => {}
        }
        if self.written.is_ok() {
            self.written = self.write_event(event);
        }
    }
}

/// Writes the row of a foot.
pub(super) fn write_row(path: &Path, row: &BatchRow) -> io::Result<()> {
    let mut table = ParquetRows::new(create(path)?, BatchRow::columns())?;
    table.add(row)?;
    table.finish()?.finish()
}

/// Creates a file, and its folder if it is missing.
fn create(path: &Path) -> io::Result<WholeFile> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    WholeFile::create(path)
}

/// Removes a file if it exists.
pub(super) fn remove(path: &Path) -> io::Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}
