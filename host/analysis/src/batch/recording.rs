//! Estimation of one recording: all feet, with their results written to tables.

use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use estimator_core::{Flag, Method, Params, Phase};
use recordings::input::{Format, InputError, Opened, Stored};
use recordings::plausible::Finding;
use thiserror::Error;

use super::fingerprint::Fingerprint;
use super::identity::{Day, FootFiles, Identity, day_or_unknown};
use super::row::{BatchRow, Found, Origin, Status};
use super::settings::{BatchSettings, FeetWanted, Plausibility};
use super::tables::{self, Counts, Table, Writer};
use crate::config::{GRAVITIES, word_of};
use crate::parameters::{CorrectionReport, ParametersReport};
use crate::replay::foot::{ReplayError, Replayed, Wanted, replay};

/// Callback with the completed share of a recording, in [0, 1].
pub type Progress = Arc<dyn Fn(f64) + Send + Sync>;

/// Share of reading in the work on a recording, for progress.
const READING: f64 = 0.4;

/// Error that affects every recording, not only this one.
#[derive(Debug, Error)]
pub enum BatchError {
    /// A result cannot be written or removed.
    #[error("{} cannot be written: {source}", path.display())]
    Output {
        /// Path of the result.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Samples cannot be stored during the estimation.
    #[error("{name}: {source}")]
    Temporary {
        /// The recording's name.
        name: String,
        /// Cause of the error.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl BatchError {
    /// Returns the error of a result at this path, from that of the operating system.
    pub(super) fn output(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Output { path, source }
    }
}

/// Failure of a recording.
struct Failure {
    sentence: String,
    /// Whether the failure is permanent; a read error is not.
    for_good: bool,
}

/// Estimates all feet of a recording, or the selected one, and writes samples, events and the returned rows below
/// the folder `out`. A recording that cannot be estimated has a row with the reason.
///
/// An earlier row is removed first; the new one is written last. The share that is done is reported to `progress`.
///
/// # Errors
/// Results or temporary files cannot be written, which affects every recording.
pub fn estimate_recording(
    path: &Path,
    identity: &Identity,
    settings: &BatchSettings,
    out: &Path,
    progress: &Progress,
) -> Result<Vec<BatchRow>, BatchError> {
    let work = Work {
        path,
        identity,
        settings,
        out,
        progress,
        key: identity.key(),
        settings_blake3: settings.blake3(),
    };
    let fingerprint = match Fingerprint::of(path) {
        Ok(fingerprint) => fingerprint,
        Err(error) => {
            let sentence = format!("{} cannot be read: {error}", identity.name);
            let for_good = false;
            return work.failed(None, Failure { sentence, for_good });
        }
    };
    match work.estimate(&fingerprint)? {
        Ok(rows) => Ok(rows),
        Err(failure) => work.failed(Some(&fingerprint), failure),
    }
}

/// Recording being processed.
struct Work<'a> {
    path: &'a Path,
    identity: &'a Identity,
    settings: &'a BatchSettings,
    out: &'a Path,
    progress: &'a Progress,
    key: String,
    settings_blake3: String,
}

impl Work<'_> {
    /// Returns the rows of all feet, or the failure.
    fn estimate(
        &self,
        fingerprint: &Fingerprint,
    ) -> Result<Result<Vec<BatchRow>, Failure>, BatchError> {
        let file = self.path.display().to_string();
        let for_good = |sentence: String| Failure {
            sentence: self.by_name(&sentence),
            for_good: true,
        };
        let (format, mut stored) = match self.read() {
            Ok(read) => read,
            Err(error @ InputError::Spool { .. }) => return Err(self.temporary(error)),
            Err(error) => {
                let may_pass = match &error {
                    InputError::Unreadable { .. } => true,
                    InputError::Container(error) => error.is_of_this_machine(),
                    _ => false,
                };
                return Ok(Err(Failure {
                    for_good: !may_pass,
                    ..for_good(error.to_string())
                }));
            }
        };
        if !fingerprint.is_unchanged(self.path) {
            let sentence = format!("{} changed while it was read", self.identity.name);
            let for_good = false;
            return Ok(Err(Failure { sentence, for_good }));
        }
        let params = self.settings.resolved.params(format);
        let origins = self.settings.resolved.origins(&file);
        if let Err(refusal) = origins.check_effects(&params) {
            return Ok(Err(for_good(refusal.to_string())));
        }
        let feet = stored.len() as u64;
        if let FeetWanted::Named(wanted) = &self.settings.feet {
            let names: Vec<String> = stored.iter().map(|stored| self.foot(stored)).collect();
            stored.retain(|stored| self.foot(stored) == *wanted);
            if stored.is_empty() {
                let name = &self.identity.name;
                let names = names.join(", ");
                return Ok(Err(for_good(format!(
                    "{name} has no foot {wanted:?}; it has {names}"
                ))));
            }
        }
        let mut rows = Vec::new();
        let all = stored
            .iter()
            .map(|stored| stored.about.samples)
            .sum::<usize>();
        let mut before = 0;
        for mut foot in stored {
            let samples = foot.about.samples as u64;
            let progress = |estimated: u64| {
                let share = (before + estimated) as f64 / all.max(1) as f64;
                (self.progress)(READING + (1.0 - READING) * share);
            };
            let names = foot.about.names_with(self.identity.foot.as_deref());
            let params = self.settings.resolved.params_of(&names, format);
            let of = (format, feet, fingerprint);
            match self.estimate_foot(&mut foot, of, &params, &progress)? {
                Ok(row) => rows.push(row),
                Err(ReplayError::Params(error)) => {
                    return Ok(Err(for_good(origins.explain(&error, &params).to_string())));
                }
                Err(error @ ReplayError::Temporary { .. }) => return Err(self.temporary(error)),
            }
            before += samples;
        }
        for row in &rows {
            self.write_row(row)?;
        }
        Ok(Ok(rows))
    }

    /// Reads the recordings of all feet.
    fn read(&self) -> Result<(Format, Vec<Stored>), InputError> {
        let opened = Opened::through(self.path, self.settings.format, |file, bytes| {
            let progress = self.progress.clone();
            Box::new(Counted {
                file,
                progress,
                bytes,
                read: 0,
            })
        })?;
        let format = opened.format();
        // A tree may have tables and bags.
        let hints = self.settings.hints.clone().applying_to(format);
        Ok((
            format,
            opened.store_as(&hints, self.identity.foot.as_deref())?,
        ))
    }

    /// Returns the name of a foot.
    fn foot(&self, stored: &Stored) -> String {
        let named = stored.about.foot.clone();
        named.unwrap_or_else(|| self.identity.only_foot())
    }

    /// Estimates a foot and writes its samples and events. If the recording has to be plausible and is not, both
    /// are removed again.
    fn estimate_foot(
        &self,
        stored: &mut Stored,
        (format, feet, fingerprint): (Format, u64, &Fingerprint),
        params: &Params,
        progress: &dyn Fn(u64),
    ) -> Result<Result<BatchRow, ReplayError>, BatchError> {
        let about = stored.about.clone();
        let day = Day::of_clock(about.start_us).or(self.identity.day);
        let place = FootFiles {
            robot: self.identity.robot.clone(),
            foot: self.foot(stored),
            day: day_or_unknown(day),
            key: self.key.clone(),
        };
        self.change(Table::Recordings, &place, tables::remove)?;
        let name = &self.identity.name;
        let samples = Table::Samples.path(self.out, &place);
        let mut writer = Writer::new(self.out, &place, name, about.start_us, progress)
            .map_err(BatchError::output(&samples))?;
        let replayed = match replay(stored, params, &Wanted::default(), &mut writer) {
            Ok(replayed) => replayed,
            Err(error) => return Ok(Err(error)),
        };
        let counts = writer.counts;
        writer.finish().map_err(BatchError::output(&samples))?;
        let mounting = &about.correction.mounting;
        let findings = replayed.findings.iter();
        let findings: Vec<Finding> = findings.map(|f| f.with_mounting(mounting)).collect();
        let is_refused =
            self.settings.plausibility == Plausibility::Required && !findings.is_empty();
        let error = is_refused.then(|| {
            let count = findings.len();
            format!("{name}: --strict does not let {count} of its findings pass")
        });
        if is_refused {
            self.change(Table::Samples, &place, tables::remove)?;
            self.change(Table::Events, &place, tables::remove)?;
        }
        let found = self.found(stored, format, params, &replayed, &counts, &findings);
        let origin = self.origin(feet, Some(fingerprint), error);
        Ok(Ok(row(&place, origin, Some(found))))
    }

    /// Returns the results of a foot's recording.
    fn found(
        &self,
        stored: &Stored,
        format: Format,
        params: &Params,
        replayed: &Replayed,
        counts: &Counts,
        findings: &[Finding],
    ) -> Found {
        let about = &stored.about;
        let params = Params {
            sample_rate: about.sample_rate,
            gravity: about.gravity,
            ..*params
        };
        let summary = &replayed.summary;
        let rate = f64::from(about.sample_rate);
        let seconds = |state: Phase| {
            let states = Phase::ALL.into_iter().zip(counts.states);
            let count: u64 = states.filter(|(s, _)| *s == state).map(|(_, n)| n).sum();
            count as f64 / rate
        };
        let flagged =
            |flag: Flag| summary.flag_counts.get(flag.name()).copied().unwrap_or(0) as u64;
        let preset = self.settings.resolved.preset;
        // No parameter applies to contacts as they were recorded.
        let is_estimated = !stored.has_estimates();
        let name = &self.identity.name;
        let window = preset.window_notice(format, &params, name, about.sample_rate);
        let window = window.filter(|_| is_estimated);
        let notices = about.notices.iter().map(|notice| self.by_name(notice));
        let metrics = summary.metrics.as_ref();
        let learnt = match params.method {
            Method::SelfCalibrating if is_estimated => Some(replayed.learnt),
            Method::SelfCalibrating | Method::HalfWidths => None,
        };
        let edges = learnt.map(|learnt| learnt.edges(&params.stillness));
        let [start, end] = match replayed.gyro_bias {
            Some(biases) => biases.map(|bias| Some(bias.0)),
            None => [None; 2],
        };
        Found {
            format: format.name().to_owned(),
            preset: is_estimated.then(|| preset.name().to_owned()),
            parameters: is_estimated.then(|| json(&ParametersReport::of(&params))),
            correction: json(&CorrectionReport::from(&about.correction)),
            gravity: word_of(&GRAVITIES, about.gravity).to_owned(),
            start_s: about.start_us as f64 / 1.0e6,
            samples: summary.samples as u64,
            duration_s: summary.duration_s,
            sample_rate_hz: about.sample_rate,
            blank_rows: about.repairs.blank_rows as u64,
            dropped_rows: about.repairs.dropped_rows as u64,
            retimed_rows: about.repairs.retimed_rows as u64,
            notices: notices.chain(window).collect(),
            findings: findings.iter().map(|f| f.name().to_owned()).collect(),
            finding_messages: findings.iter().map(ToString::to_string).collect(),
            stance_s: seconds(Phase::Stance),
            slip_s: seconds(Phase::Slip),
            swing_s: seconds(Phase::Swing),
            quiet_swing_s: seconds(Phase::QuietSwing),
            unknown_s: seconds(Phase::Unknown),
            stable_s: counts.stable as f64 / rate,
            steps: counts.steps,
            lift_offs: counts.lift_offs,
            slips: counts.slips,
            slip_distance_m: counts.slip_distance_m,
            slips_without_distance: counts.slips - counts.slips_with_distance,
            unstable_stances: counts.unstable_stances,
            window_not_full_samples: flagged(Flag::WindowNotFull),
            attitude_not_initialised_samples: flagged(Flag::AttitudeNotInitialised),
            saturated_samples: flagged(Flag::Saturated),
            stale_samples: flagged(Flag::Stale),
            invalid_sample_samples: flagged(Flag::InvalidSample),
            time_gap_samples: flagged(Flag::TimeGap),
            settling_samples: flagged(Flag::Settling),
            labelled_samples: metrics.map_or(0, |metrics| metrics.labelled_samples as u64),
            rmse: metrics.map(|metrics| metrics.rmse),
            roc_auc: metrics.and_then(|metrics| metrics.roc_auc),
            calibration_error: metrics.map(|metrics| metrics.calibration_error),
            settled: learnt.map(|learnt| learnt.is_settled()),
            still_seconds: learnt.map(|learnt| learnt.still_seconds),
            moving_seconds: learnt.map(|learnt| learnt.moving_seconds),
            idle_seconds: learnt.map(|learnt| learnt.idle_seconds),
            acceleration_still: learnt.map(|learnt| learnt.acceleration.still),
            acceleration_moving: learnt.map(|learnt| learnt.acceleration.moving),
            acceleration_width: learnt.map(|learnt| learnt.acceleration.width),
            acceleration_half_width_m_s2: edges.map(|[acceleration, _, _]| acceleration),
            rate_still: learnt.map(|learnt| learnt.rate.still),
            rate_moving: learnt.map(|learnt| learnt.rate.moving),
            rate_width: learnt.map(|learnt| learnt.rate.width),
            rate_half_width_rad_s: edges.map(|[_, rate, _]| rate),
            velocity_still: learnt.map(|learnt| learnt.velocity.still),
            velocity_moving: learnt.map(|learnt| learnt.velocity.moving),
            velocity_width: learnt.map(|learnt| learnt.velocity.width),
            velocity_half_width_m_s2: edges.map(|[_, _, velocity]| velocity),
            gyro_bias_start_wx_rad_s: start.map(|bias| bias.x),
            gyro_bias_start_wy_rad_s: start.map(|bias| bias.y),
            gyro_bias_start_wz_rad_s: start.map(|bias| bias.z),
            gyro_bias_end_wx_rad_s: end.map(|bias| bias.x),
            gyro_bias_end_wy_rad_s: end.map(|bias| bias.y),
            gyro_bias_end_wz_rad_s: end.map(|bias| bias.z),
        }
    }

    /// Writes and returns the row of a recording that failed as a whole.
    fn failed(
        &self,
        fingerprint: Option<&Fingerprint>,
        Failure { sentence, for_good }: Failure,
    ) -> Result<Vec<BatchRow>, BatchError> {
        let place = FootFiles {
            robot: self.identity.robot.clone(),
            foot: match &self.settings.feet {
                FeetWanted::All => self.identity.only_foot(),
                FeetWanted::Named(foot) => foot.clone(),
            },
            day: day_or_unknown(self.identity.day),
            key: self.key.clone(),
        };
        let fingerprint = fingerprint.filter(|_| for_good);
        let row = row(&place, self.origin(1, fingerprint, Some(sentence)), None);
        self.write_row(&row)?;
        Ok(vec![row])
    }

    fn origin(
        &self,
        feet: u64,
        fingerprint: Option<&Fingerprint>,
        error: Option<String>,
    ) -> Origin {
        Origin {
            recording: self.identity.name.clone(),
            key: self.key.clone(),
            feet,
            status: if error.is_some() {
                Status::Failed
            } else {
                Status::Done
            },
            error,
            input_blake3: fingerprint.map(|fingerprint| fingerprint.blake3.clone()),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            settings_blake3: self.settings_blake3.clone(),
        }
    }

    fn write_row(&self, row: &BatchRow) -> Result<(), BatchError> {
        self.change(Table::Recordings, &row.place(), |path| {
            tables::write_row(path, row)
        })
    }

    fn change(
        &self,
        table: Table,
        place: &FootFiles,
        how: impl FnOnce(&Path) -> io::Result<()>,
    ) -> Result<(), BatchError> {
        let path = table.path(self.out, place);
        how(&path).map_err(BatchError::output(&path))
    }

    fn temporary(&self, source: impl std::error::Error + Send + Sync + 'static) -> BatchError {
        BatchError::Temporary {
            name: self.identity.name.clone(),
            source: Box::new(source),
        }
    }

    /// Replaces the file's path in a sentence by the recording's name.
    fn by_name(&self, sentence: &str) -> String {
        let file = self.path.display().to_string();
        if file.is_empty() {
            sentence.to_owned()
        } else {
            sentence.replace(&file, &self.identity.name)
        }
    }
}

fn row(place: &FootFiles, origin: Origin, found: Option<Found>) -> BatchRow {
    BatchRow {
        robot: place.robot.clone(),
        foot: place.foot.clone(),
        day: place.day.clone(),
        origin,
        found,
    }
}

fn json(what: &impl serde::Serialize) -> String {
    // Names and numbers always serialise to JSON.
    serde_json::to_string(what).unwrap_or_default()
}

/// File that reports the share that has been read.
struct Counted {
    file: File,
    progress: Progress,
    bytes: u64,
    read: u64,
}

impl Read for Counted {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.read += count as u64;
        (self.progress)(READING * (self.read as f64 / self.bytes.max(1) as f64).min(1.0));
        Ok(count)
    }
}
