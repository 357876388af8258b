//! Playback of a recording of an IMU; the estimates are computed here with the default preset.

use std::iter::Peekable;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{IntoIter, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use analysis::config::Preset;
use decode::Row;
use estimator_core::{ContactEstimate, Params, Timestamp};
use recordings::input::{Hints, Opened, Stored};
use recordings::replay::Replay;
use wire::Faults;
use wire::pdo::Status;

use crate::link::pace::Pace;
use crate::link::{Arrival, Arrived, Link, LinkError, Sending};

/// Number of estimates that a thread computes in advance.
const AHEAD: usize = 1024;

/// Recording with the state of its playback.
pub(super) struct Imu {
    name: String,
    feet: Vec<Peekable<IntoIter<Estimated>>>,
    pace: Pace,
}

/// Estimate with its time on the recording's clock, or the error that ends the recording.
type Estimated = Result<(Timestamp, Box<Row>), String>;

impl Imu {
    pub(super) fn open(path: &Path, pace: Pace) -> Result<Self, LinkError> {
        let name = path.display().to_string();
        let error = |error: recordings::input::InputError| LinkError::File(error.to_string());
        let opened = Opened::new(path, None).map_err(error)?;
        let params = Preset::Default.params(opened.format());
        let stored = opened.store_all(&Hints::default()).map_err(error)?;
        let feet = stored.into_iter().map(|stored| {
            let (sender, receiver) = sync_channel(AHEAD);
            let line: Arc<str> = name.as_str().into();
            // The thread ends with the recording, or when the receiver is dropped.
            thread::spawn(move || estimate(stored, &params, &line, &sender));
            receiver.into_iter().peekable()
        });
        let feet = feet.collect();
        Ok(Self { name, feet, pace })
    }
}

/// Computes the estimates of a foot, and sends their rows.
fn estimate(mut stored: Stored, params: &Params, line: &Arc<str>, to: &SyncSender<Estimated>) {
    let about = stored.about.clone();
    let foot: Arc<str> = about.foot.as_deref().unwrap_or(&about.name).into();
    let mut rows = || -> Result<(), String> {
        let mut replay =
            Replay::new(about.sample_rate, about.gravity, params).map_err(|e| e.to_string())?;
        for (number, sample) in stored.samples().map_err(|e| e.to_string())?.enumerate() {
            let estimate = replay.update(&sample.map_err(|e| e.to_string())?);
            let micros = estimate.timestamp.as_micros();
            let at = Timestamp::from_micros(micros.saturating_add_signed(about.start_us));
            let row = Row {
                received: Some(at),
                interface: Some(Arc::clone(line)),
                foot: Some(Arc::clone(&foot)),
                sequence: number as u16,
                ..row_of(&estimate)
            };
            if to.send(Ok((at, Box::new(row)))).is_err() {
                break;
            }
        }
        Ok(())
    };
    if let Err(error) = rows() {
        // The receiver may be dropped already.
        let _ = to.send(Err(error));
    }
}

fn row_of(estimate: &ContactEstimate) -> Row {
    Row {
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
        ..Row::default()
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
        let arrived = estimated.and_then(Result::ok);
        Ok(arrived.map(|(at, row)| (at, Arrival::Estimate(row))))
    }

    fn send(&mut self, _: &Sending) -> Result<(), LinkError> {
        Err(LinkError::ReadOnly(self.name.clone()))
    }
}
