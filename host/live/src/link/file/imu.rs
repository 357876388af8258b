//! Playback of a recording of an IMU; the estimates are computed here.

use std::iter::Peekable;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{IntoIter, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use decode::ContactRow;
use estimator_core::{ContactEstimate, Gravity, Timestamp};
use recordings::input::{Opened, Stored};
use recordings::plausible::{Check, Finding};
use recordings::replay::Replay;
use wire::Faults;
use wire::pdo::Status;

use crate::link::pace::Pace;
use crate::link::{Arrival, Arrived, Link, LinkError, Sending};
use crate::playback::Playback;

/// Number of estimates that a thread computes in advance.
const AHEAD: usize = 1024;

/// Recording with the state of its playback.
pub(super) struct Imu {
    name: String,
    feet: Vec<Peekable<IntoIter<Estimated>>>,
    pace: Pace,
}

/// Estimate or remark with its time on the recording's clock, or the error that ends the recording.
type Estimated = Result<Arrived, String>;

impl Imu {
    pub(super) fn open(path: &Path, pace: Pace, playback: &Playback) -> Result<Self, LinkError> {
        let Playback { hints, settings } = playback;
        let name = path.display().to_string();
        let opened = Opened::new(path, None).map_err(failed)?;
        let format = opened.format();
        let origins = settings.origins(&name);
        let of_all = settings.params(format);
        origins.check_effects(&of_all).map_err(failed)?;
        let stored = opened.store_all(hints).map_err(failed)?;
        let names: Vec<&str> = stored
            .iter()
            .flat_map(|stored| stored.about.names())
            .collect();
        settings.check_axes(&names).map_err(failed)?;
        let mut unused = settings.unused_feet(&names);
        let mut feet = Vec::new();
        for mut stored in stored {
            let about = &mut stored.about;
            let params = settings.params_of(&about.names(), format);
            let replay = Replay::new(about.sample_rate, about.gravity, &params);
            let replay = replay.map_err(|error| failed(origins.explain(&error, &params)))?;
            let (preset, foot) = (settings.preset, about.foot_or_name());
            let window = preset.window_notice(format, &params, foot, about.sample_rate);
            about
                .notices
                .extend(unused.take().into_iter().chain(window));
            let (sender, receiver) = sync_channel(AHEAD);
            let line: Arc<str> = name.as_str().into();
            // The thread ends with the recording, or when the receiver is dropped.
            thread::spawn(move || estimate(stored, replay, &line, &sender));
            feet.push(receiver.into_iter().peekable());
        }
        Ok(Self { name, feet, pace })
    }
}

/// Error of a file, with this sentence.
#[expect(
    clippy::needless_pass_by_value,
    reason = "it maps errors, which are passed by value"
)]
fn failed(sentence: impl ToString) -> LinkError {
    LinkError::File(sentence.to_string())
}

/// Failure of a thread that estimates.
enum Failure {
    /// The receiver was dropped.
    Left,
    /// The recording cannot be estimated.
    Broken(String),
}

/// Sends the remarks about a foot's recording and the rows of its estimates.
fn estimate(stored: Stored, replay: Replay, line: &Arc<str>, to: &SyncSender<Estimated>) {
    if let Err(Failure::Broken(error)) = send_estimates(stored, replay, line, to) {
        // The receiver may be dropped already.
        let _ = to.send(Err(error));
    }
}

fn send_estimates(
    mut stored: Stored,
    mut replay: Replay,
    line: &Arc<str>,
    to: &SyncSender<Estimated>,
) -> Result<(), Failure> {
    let about = stored.about.clone();
    let name: Arc<str> = about.foot_or_name().into();
    let mut at = Timestamp::from_micros(0u64.saturating_add_signed(about.start_us));
    let send = |at, arrival| to.send(Ok((at, arrival))).map_err(|_| Failure::Left);
    let remark = |at, text| send(at, Arrival::Remark(text));
    for notice in &about.notices {
        remark(at, notice.clone())?;
    }
    if about.gravity == Gravity::Removed {
        remark(
            at,
            format!(
                "{name}: gravity was removed from its accelerations, so that messages of an IMU are computed, with \
                 gravity by the estimated orientation"
            ),
        )?;
    }
    // Units are doubted before the first estimate is shown, because a recording may be long.
    let check = || Check::new(about.sample_rate, about.gravity).with_units(about.units);
    let mut before = check();
    for sample in stored.samples().map_err(broken)? {
        before.add(&sample.map_err(broken)?);
    }
    let before = before.findings();
    for finding in &before {
        remark(at, doubt(&name, finding))?;
    }
    let mut check = check();
    for (number, sample) in stored.samples().map_err(broken)?.enumerate() {
        let sample = sample.map_err(broken)?;
        let estimate = replay.update(&sample);
        check.add(&sample);
        check.add_estimate(&sample, &estimate);
        let micros = estimate.timestamp.as_micros();
        at = Timestamp::from_micros(micros.saturating_add_signed(about.start_us));
        let row = ContactRow {
            received: Some(at),
            interface: Some(Arc::clone(line)),
            foot: Some(Arc::clone(&name)),
            sequence: number as u16,
            measured: (about.gravity == Gravity::Included).then_some(sample.imu),
            ..row_of(&estimate)
        };
        send(at, Arrival::Estimate(Box::new(row)))?;
    }
    let is_new = |finding: &Finding| before.iter().all(|known| known.name() != finding.name());
    for finding in check.findings().into_iter().filter(is_new) {
        remark(at, doubt(&name, &finding))?;
    }
    Ok(())
}

/// Sentence about an implausible property. Commands that play take the options that it advises, but for `--gravity`.
fn doubt(name: &str, finding: &Finding) -> String {
    let text = finding.to_string();
    let advice = if text.contains("--gravity") {
        ", in footfall convert"
    } else {
        ""
    };
    format!("{name}: {text}{advice}")
}

#[expect(
    clippy::needless_pass_by_value,
    reason = "it maps errors, which are passed by value"
)]
fn broken(error: impl ToString) -> Failure {
    Failure::Broken(error.to_string())
}

fn row_of(estimate: &ContactEstimate) -> ContactRow {
    ContactRow {
        timestamp: estimate.timestamp,
        stable: estimate.probabilities.stable,
        tangential: estimate.probabilities.tangential,
        vertical: estimate.probabilities.vertical,
        axes: Some(estimate.probabilities.axes),
        orientation: Some(estimate.orientation),
        acceleration: Some(estimate.linear_acceleration.0),
        rate: Some(estimate.angular_rate.0),
        bias: Some(estimate.gyro_bias.0),
        status: Status::new(
            estimate.decision,
            estimate.phase,
            estimate.flags,
            Faults::NONE,
        ),
        flags: Some(estimate.flags.bits()),
        ..ContactRow::default()
    }
}

impl Link for Imu {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        let mut first: Option<(Timestamp, usize)> = None;
        for (index, foot) in self.feet.iter_mut().enumerate() {
            let at = match foot.peek() {
                None => continue,
                Some(Err(error)) => {
                    return Err(LinkError::File(format!("{}: {error}", self.name)));
                }
                Some(Ok((at, _))) => *at,
            };
            if first.is_none_or(|(earliest, _)| at.as_micros() < earliest.as_micros()) {
                first = Some((at, index));
            }
        }
        let Some((at, index)) = first else {
            return Err(LinkError::Ended(self.name.clone()));
        };
        if !self.pace.wait(at.as_micros(), longest) {
            return Ok(None);
        }
        let estimated = self.feet.get_mut(index).and_then(Iterator::next);
        Ok(estimated.and_then(Result::ok))
    }

    fn send(&mut self, _: &Sending) -> Result<(), LinkError> {
        Err(LinkError::ReadOnly(self.name.clone()))
    }
}
