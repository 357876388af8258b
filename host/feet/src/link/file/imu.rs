//! Playback of a recording of an IMU.
//!
//! If the recording has contacts of its feet, and they are used, the contacts are the estimates. Otherwise the
//! estimates are computed here.

use std::io;
use std::iter::Peekable;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{IntoIter, SyncSender, sync_channel};
use std::thread;

use config::{NoSuchFoot, ParameterRefusal};
use estimator_core::{ContactEstimate, Flags, Gravity, ImuSample, Load, Timestamp};
use options::hint::Notice;
use options::without_effect;
use plausible::Finding;
use recordings::Opened;
use replay::{Span, check_samples, findings_beside_contacts};
use samples::estimate::Estimator;
use stored::error::InputError;
use stored::{About, Stored};
use thiserror::Error;
use wire::Faults;
use wire::pdo::Status;

use crate::decode::ContactRow;
use crate::link::{Arrival, Arrived, Remark};
use crate::source::Playback;

/// Number of estimates that a thread computes in advance.
const AHEAD: usize = 1024;

/// Recording of feet, each read by a thread.
pub(super) struct PlayedImu(Vec<Peekable<IntoIter<PlayedItem>>>);

/// Estimate or remark with its time on the recording's clock, or the error that ends the recording.
type PlayedItem = io::Result<Arrived>;

/// Reason why the recording of an IMU cannot be played.
#[derive(Debug, Error)]
pub enum RecordingError {
    /// The file cannot be read as a recording.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The parameters of its estimates are invalid.
    #[error(transparent)]
    Parameters(#[from] ParameterRefusal),
    /// Settings are given for a foot that it does not have.
    #[error(transparent)]
    NoSuchFoot(#[from] NoSuchFoot),
}

impl PlayedImu {
    pub(super) fn open(path: &Path, playback: &Playback) -> Result<Self, RecordingError> {
        let (input_options, settings) = (&playback.input_options, &playback.settings);
        let name = path.display().to_string();
        let opened = Opened::new(path, None)?;
        let format = opened.format();
        let origins = settings.origins(&name);
        let of_all = settings.params(format);
        origins.check_effects(&of_all)?;
        let stored = opened.store_all(input_options)?;
        let names = stored.iter().flat_map(|stored| stored.about.names());
        let names: Vec<&str> = names.collect();
        settings.check_axes(&names)?;
        let mut unused = settings.unused_feet(&names);
        let mut ineffective = without_effect(&name, &playback.estimator_options);
        let mut feet = Vec::new();
        for mut stored in stored {
            let is_recorded = stored.has_estimates();
            let about = &mut stored.about;
            let params = settings.params_of(&about.names(), format);
            let (estimator, notice) = if is_recorded {
                (None, ineffective.take())
            } else {
                let estimator = Estimator::new(about.sample_rate, about.gravity, &params);
                let estimator = estimator.map_err(|error| origins.explain(&error))?;
                let (preset, foot) = (settings.preset, about.foot_or_name());
                let window = preset.window_notice(format, &params, foot, about.sample_rate);
                (Some(estimator), window)
            };
            let unused = unused.take().map(Notice::from);
            let notices = unused.into_iter().chain(notice);
            about.notices.extend(notices);
            let (sender, receiver) = sync_channel(AHEAD);
            let line: Arc<str> = name.as_str().into();
            // The thread ends with the recording, or when the receiver is dropped.
            thread::spawn(move || play(stored, estimator, &line, &sender));
            feet.push(receiver.into_iter().peekable());
        }
        Ok(Self(feet))
    }

    /// Returns the earliest of the feet's next estimates; an error comes before all of them.
    pub(super) fn next(&mut self) -> io::Result<Option<Arrived>> {
        let feet = self.0.iter_mut().enumerate();
        let times = feet.filter_map(|(index, foot)| {
            let next = foot.peek()?.as_ref().ok();
            Some((next.map(|(at, _)| *at), index))
        });
        let first = times.min();
        first.and_then(|(_, index)| self.0[index].next()).transpose()
    }
}

/// Reason why a thread that plays a recording ends early.
enum PlayEnd {
    /// The receiver was dropped.
    Left,
    /// The recording cannot be read or estimated.
    Broken(io::Error),
}

impl From<io::Error> for PlayEnd {
    fn from(error: io::Error) -> Self {
        Self::Broken(error)
    }
}

/// Sends the remarks about a foot's recording and the rows of its estimates, which `estimator` computes or which were
/// recorded.
fn play(
    stored: Stored,
    estimator: Option<Estimator>,
    line: &Arc<str>,
    to: &SyncSender<PlayedItem>,
) {
    let sender = sender_of(&stored.about).filter(|_| estimator.is_none());
    let name = sender.unwrap_or_else(|| stored.about.foot_or_name());
    let mut rows = RowSender::new(&stored.about, name, line, to);
    let sent = rows.introduce().and_then(|()| match estimator {
        Some(estimator) => rows.estimate(stored, estimator),
        None => rows.repeat(stored),
    });
    if let Err(PlayEnd::Broken(error)) = sent {
        // The receiver may be dropped already.
        let _ = to.send(Err(error));
    }
}

/// Name of the foot that sent recorded contacts: the second-to-last part of their topics, such as `FL` in
/// `/footfall/FL/imu`. The name in a recording of several feet takes precedence.
fn sender_of(about: &About) -> Option<&str> {
    let of_topic = || about.address.as_deref()?.rsplit('/').nth(1);
    about.foot.as_deref().or_else(of_topic)
}

/// Sender of the rows of a foot.
struct RowSender<'a> {
    about: About,
    name: Arc<str>,
    line: &'a Arc<str>,
    to: &'a SyncSender<PlayedItem>,
    /// Time of the newest row.
    at: Timestamp,
    number: u16,
    /// Whether the load of the newest sample is known.
    has_load: bool,
}

impl<'a> RowSender<'a> {
    fn new(about: &About, name: &str, line: &'a Arc<str>, to: &'a SyncSender<PlayedItem>) -> Self {
        Self {
            name: name.into(),
            at: Timestamp::from_micros(0u64.saturating_add_signed(about.start_us)),
            about: about.clone(),
            line,
            to,
            number: 0,
            has_load: false,
        }
    }

    fn send(&self, arrival: Arrival) -> Result<(), PlayEnd> {
        let sent = self.to.send(Ok((self.at, arrival)));
        sent.map_err(|_| PlayEnd::Left)
    }

    /// Sends the remarks about how the recording was read.
    fn introduce(&self) -> Result<(), PlayEnd> {
        for notice in &self.about.notices {
            self.send(Arrival::Remark(Remark::Read(notice.clone())))?;
        }
        if self.about.gravity == Gravity::Removed {
            self.send(Arrival::Remark(Remark::NoGravity(Arc::clone(&self.name))))?;
        }
        Ok(())
    }

    /// Sends the remarks about implausible properties.
    fn doubt(&self, findings: Vec<Finding>) -> Result<(), PlayEnd> {
        findings.into_iter().try_for_each(|finding| {
            self.send(Arrival::Remark(Remark::Implausible(Arc::clone(&self.name), finding)))
        })
    }

    /// Sends the estimates of all samples.
    fn estimate(&mut self, mut stored: Stored, mut estimator: Estimator) -> Result<(), PlayEnd> {
        // Findings, such as a wrong unit, are reported before the first estimate, because a recording may be long.
        let check = check_samples(&mut stored, Span::default())?;
        self.doubt(check.findings())?;
        for sample in stored.samples()? {
            let sample = sample?;
            let estimate = estimator.update(&sample);
            let load = self.load(sample.load);
            let row = ContactRow { load, ..ContactRow::of_estimate(&estimate) };
            self.row(row, sample.imu)?;
        }
        Ok(())
    }

    /// Sends the recorded estimates. Each sample is sent with the first estimate that is not earlier than the sample.
    fn repeat(&mut self, mut stored: Stored) -> Result<(), PlayEnd> {
        let check = check_samples(&mut stored, Span::default())?;
        self.doubt(findings_beside_contacts(&check))?;
        let recorded = stored.estimates()?;
        for recorded in recorded.into_iter().flatten() {
            let recorded = recorded?;
            let (sample, estimate) = (recorded.sample, recorded.estimate);
            let axes = estimate.probabilities.axes;
            let are_known = axes.to_array().iter().all(|p| p.is_finite());
            let orientation = recorded.with_motion.orientation;
            let sigma = estimate.velocity_sigma.0;
            let row = ContactRow {
                axes: are_known.then_some(axes),
                orientation: orientation.w.is_finite().then_some(orientation),
                velocity_sigma: sigma.is_finite().then_some(sigma),
                load: recorded.new_age_us.and_then(|_| self.load(sample.load)),
                status: if recorded.is_valid {
                    status_of(&estimate, Flags::NONE)
                } else {
                    status_of(&estimate, estimate.flags)
                },
                ..row_of(&estimate)
            };
            // A sample whose time would be negative on the clock of the rows is not sent.
            let made_us = estimate.timestamp.as_micros();
            let age_us = recorded.new_age_us;
            match age_us.and_then(|age_us| made_us.checked_sub(age_us)) {
                Some(taken_us) => {
                    let mut sample = sample.imu;
                    sample.timestamp = Timestamp::from_micros(taken_us);
                    self.row(row, sample)?;
                }
                None => self.row_alone(row)?,
            }
        }
        Ok(())
    }

    /// Load of the next sample in its row: NaN once, after the last known load.
    fn load(&mut self, load: Option<Load>) -> Option<f32> {
        let load = load.map(|Load(load)| load).filter(|load| load.is_finite());
        let had_load = std::mem::replace(&mut self.has_load, load.is_some());
        load.or(had_load.then_some(f32::NAN))
    }

    /// Sends a row with its sample.
    fn row(&mut self, row: ContactRow, sample: ImuSample) -> Result<(), PlayEnd> {
        let measured = (self.about.gravity == Gravity::Included).then_some(sample);
        self.row_alone(ContactRow { measured, ..row })
    }

    fn row_alone(&mut self, mut row: ContactRow) -> Result<(), PlayEnd> {
        let micros = row.timestamp.as_micros();
        self.at = Timestamp::from_micros(micros.saturating_add_signed(self.about.start_us));
        row.received = Some(self.at);
        row.interface = Some(Arc::clone(self.line));
        row.foot = Some(Arc::clone(&self.name));
        row.sequence = self.number;
        self.number = self.number.wrapping_add(1);
        self.send(Arrival::Estimate(Box::new(row)))
    }
}

/// Status of an estimate with these reasons for doubt.
fn status_of(estimate: &ContactEstimate, flags: Flags) -> Status {
    Status::new(estimate.decision, estimate.phase, flags, Faults::NONE)
}

/// Returns a row with the values of an estimate that a recorded contact also has.
fn row_of(estimate: &ContactEstimate) -> ContactRow {
    ContactRow {
        timestamp: estimate.timestamp,
        stable: estimate.probabilities.stable,
        tangential: estimate.probabilities.tangential,
        vertical: estimate.probabilities.vertical,
        status: status_of(estimate, estimate.flags),
        flags: Some(estimate.flags.bits()),
        ..ContactRow::default()
    }
}
