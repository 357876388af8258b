//! Messages of streaming feet, for `footfall record`, `footfall ros2` and `footfall view`.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use decode::Feet;
use decode::live::{Listener, Said};
use estimator_core::Timestamp;
use live::feed::Fed;
use live::{Arrival, Feed, LinkError, Source};
use ros::bridge::SEVERAL_BOARDS;
use ros::{Bridge, Published};

use crate::error::Error;
use crate::files::is_interrupted;
use crate::messages::warn;

/// Time without arrivals after which [`Sink::idle`] is called.
const QUIET: Duration = Duration::from_millis(200);

/// Time without arrivals after which feet are checked for silence.
const LOOK: Duration = Duration::from_millis(20);

/// Destination of messages.
pub trait Sink {
    /// Publishes a message.
    ///
    /// # Errors
    /// The message cannot be written.
    fn publish(&mut self, published: Published) -> Result<(), Error>;

    /// Called when nothing has arrived for a while.
    ///
    /// # Errors
    /// Pending messages cannot be written.
    fn idle(&mut self) -> Result<(), Error>;
}

/// Maximum duration of a stream, s: about thirty years.
const LONGEST_S: f64 = 1.0e9;

/// Parses the duration of a stream, s.
///
/// # Errors
/// A sentence that states the accepted values.
pub fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok();
    seconds
        .filter(|seconds| (0.0..=LONGEST_S).contains(seconds))
        .ok_or_else(|| format!("write seconds from 0 to {LONGEST_S}"))
}

/// Returns the deadline of a stream; an interruption always ends it.
#[must_use]
pub fn deadline(seconds: Option<f64>) -> Option<Instant> {
    let time = Duration::try_from_secs_f64(seconds?).ok()?;
    Instant::now().checked_add(time)
}

/// Returns whether the deadline has passed or an interruption was requested.
#[must_use]
pub fn is_over(deadline: Option<Instant>) -> bool {
    is_interrupted() || deadline.is_some_and(|deadline| Instant::now() >= deadline)
}

/// A stream of messages from the feet.
pub struct Stream {
    feed: Feed,
    listener: Listener,
    bridge: Bridge,
    /// Timestamp of the newest arrival, and the local time at which it arrived.
    newest: Option<(Timestamp, Instant)>,
    unreadable: u64,
    has_spoken: bool,
    /// Feet whose id is used by several boards, as last reported.
    shared: BTreeSet<String>,
    /// Whether any id was shared; sequence numbers then do not show losses.
    was_shared: bool,
}

impl Stream {
    /// Opens a source with the given feet.
    #[must_use]
    pub fn open(source: Source, feet: Feet) -> Self {
        Self::with_bridge(source, feet, Bridge::default())
    }

    /// Opens a source with the given bridge.
    #[must_use]
    pub fn with_bridge(source: Source, feet: Feet, bridge: Bridge) -> Self {
        Self {
            feed: Feed::open(source),
            listener: Listener::new(feet),
            bridge,
            newest: None,
            unreadable: 0,
            has_spoken: false,
            shared: BTreeSet::new(),
            was_shared: false,
        }
    }

    /// Waits until the source is open or is being waited for. Recorded sources can be read from then on.
    ///
    /// # Errors
    /// The source cannot be opened.
    pub fn wait_until_open(&mut self) -> Result<(), LinkError> {
        while !is_interrupted() {
            match self.feed.next(QUIET) {
                Some(Fed::Ended(error)) => return Err(error),
                Some(Fed::WaitsFor(error)) => {
                    warn_of_waiting(&error);
                    return Ok(());
                }
                Some(Fed::Opened) => return Ok(()),
                // These do not occur before the source is open.
                Some(Fed::Arrived(_) | Fed::Remark(_) | Fed::NotSent(_)) | None => {}
            }
        }
        Ok(())
    }

    /// Publishes all messages until the deadline or until the source ends, whose error is returned.
    ///
    /// # Errors
    /// Errors of the sink.
    pub fn run(
        &mut self,
        deadline: Option<Instant>,
        sink: &mut impl Sink,
    ) -> Result<Option<LinkError>, Error> {
        let mut ended = None;
        while ended.is_none() && !is_over(deadline) {
            match self.feed.next(LOOK) {
                Some(Fed::Arrived((at, arrival))) => self.take(at, arrival),
                Some(Fed::WaitsFor(error)) => warn_of_waiting(&error),
                Some(Fed::Remark(text)) => warn(text),
                Some(Fed::NotSent(error)) => warn(error),
                Some(Fed::Opened) => {}
                Some(Fed::Ended(error)) => ended = Some(error),
                None => {
                    self.idle(sink)?;
                    continue;
                }
            }
            self.hand_on(sink)?;
        }
        self.listener.finish();
        self.hand_on(sink)?;
        Ok(ended)
    }

    /// Reports all feet as silent at the end of the stream.
    ///
    /// # Errors
    /// Errors of the sink.
    pub fn end(&mut self, sink: &mut impl Sink) -> Result<(), Error> {
        let mut last = self.bridge.end().into_iter();
        last.try_for_each(|published| sink.publish(published))
    }

    /// Advances the time while nothing arrives.
    fn idle(&mut self, sink: &mut impl Sink) -> Result<(), Error> {
        let Some((at, arrived)) = self.newest else {
            return Ok(());
        };
        let quiet = arrived.elapsed();
        let now_us = at.as_micros().saturating_add(quiet.as_micros() as u64);
        let now = Timestamp::from_micros(now_us);
        self.listener.idle(now);
        self.hand_on(sink)?;
        let mut silent = self.bridge.idle(now).into_iter();
        silent.try_for_each(|published| sink.publish(published))?;
        if quiet >= QUIET { sink.idle() } else { Ok(()) }
    }

    fn take(&mut self, at: Timestamp, arrival: Arrival) {
        self.newest = Some((at, Instant::now()));
        if arrival.hand_to(&mut self.listener, at).is_some() {
            self.unreadable += 1;
        }
    }

    fn hand_on(&mut self, sink: &mut impl Sink) -> Result<(), Error> {
        while let Some(heard) = self.listener.next_heard() {
            let name = self.listener.name(&heard.foot);
            for published in self.bridge.messages(&heard, name.as_deref()) {
                self.has_spoken = true;
                sink.publish(published)?;
            }
            if matches!(heard.said, Said::Contact(_)) {
                self.warn_of_shared_ids();
            }
        }
        Ok(())
    }

    /// Warns about ids used by several boards, once each time it begins.
    fn warn_of_shared_ids(&mut self) {
        if self.shared.is_empty() && self.bridge.shared_ids().next().is_none() {
            return;
        }
        let now: BTreeSet<_> = self.bridge.shared_ids().map(str::to_owned).collect();
        for foot in now.difference(&self.shared) {
            warn(format!(
                "{foot}: {SEVERAL_BOARDS}, no contact of it is valid; connect one at a time, \
                 and give it an id of its own with footfall foot SOURCE id"
            ));
        }
        self.shared = now;
        self.was_shared = true;
    }

    /// Warns about lost and unreadable data.
    pub fn report(&self) {
        let reports = self.listener.reports();
        let missing: u64 = reports.iter().map(|(_, report)| report.missing).sum();
        let problems = reports.iter().flat_map(|(_, report)| &report.problems);
        let problems: Vec<_> = problems
            .map(|(name, count)| format!("{name} {count}"))
            .collect();
        if !self.has_spoken {
            let unknown = self.listener.unknown_foot();
            let hint = unknown.map(|id| format!(", but node {id} may be one: --node {id}"));
            warn(format!("no foot was heard{}", hint.unwrap_or_default()));
        }
        if missing > 0 && !self.was_shared {
            warn(format!("{missing} frames are missing, by their numbers"));
        }
        if !problems.is_empty() || self.unreadable > 0 {
            let lines = format!("{} lines unreadable", self.unreadable);
            warn(format!("{lines}; {}", problems.join(", ")));
        }
        warn_of_lost(&self.feed);
    }
}

fn warn_of_waiting(error: &LinkError) {
    warn(format!("{error}; waiting for it"));
}

/// Warns about arrivals lost on this machine, if any.
pub fn warn_of_lost(feed: &Feed) {
    if feed.lost() > 0 {
        warn(format!(
            "{} arrivals were lost: this machine did not keep up",
            feed.lost()
        ));
    }
}
