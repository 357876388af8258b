//! Feet that stream, as messages: what `footfall record` writes, `footfall ros2` publishes and `footfall
//! view` serves.

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

/// How long nothing arrives before [`Sink::idle`] is called.
const QUIET: Duration = Duration::from_millis(200);

/// How long nothing arrives before it is looked whether feet are silent.
const LOOK: Duration = Duration::from_millis(20);

/// Where messages go.
pub trait Sink {
    /// Takes a message.
    ///
    /// # Errors
    /// It cannot be written.
    fn publish(&mut self, published: Published) -> Result<(), Error>;

    /// Nothing has come for a while.
    ///
    /// # Errors
    /// What waits cannot be written.
    fn idle(&mut self) -> Result<(), Error>;
}

/// The longest time that can be given, s: thirty years.
const LONGEST_S: f64 = 1.0e9;

/// Reads after how many seconds a stream is to end.
///
/// # Errors
/// A sentence that says how to write it.
pub fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok();
    seconds
        .filter(|seconds| (0.0..=LONGEST_S).contains(seconds))
        .ok_or_else(|| format!("write seconds from 0 to {LONGEST_S}"))
}

/// When a stream ends before its source does; an interruption always ends it.
#[must_use]
pub fn deadline(seconds: Option<f64>) -> Option<Instant> {
    let time = Duration::try_from_secs_f64(seconds?).ok()?;
    Instant::now().checked_add(time)
}

/// Whether that is now.
#[must_use]
pub fn is_over(deadline: Option<Instant>) -> bool {
    is_interrupted() || deadline.is_some_and(|deadline| Instant::now() >= deadline)
}

/// Feet that stream.
pub struct Stream {
    feed: Feed,
    listener: Listener,
    bridge: Bridge,
    /// The newest arrival: its time, and when that was.
    newest: Option<(Timestamp, Instant)>,
    unreadable: u64,
    has_spoken: bool,
    /// Feet that several boards are, as it was last said.
    shared: BTreeSet<String>,
    /// Whether there were any: numbers of several boards do not say what is missing.
    was_shared: bool,
}

impl Stream {
    /// Opens a source with these feet.
    #[must_use]
    pub fn open(source: Source, feet: Feet) -> Self {
        Self::with_bridge(source, feet, Bridge::default())
    }

    /// Opens a source, whose messages a bridge of its own makes.
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

    /// Waits until the source is open, or is waited for: what is played can be read from then on.
    ///
    /// # Errors
    /// It cannot.
    pub fn wait_until_open(&mut self) -> Result<(), LinkError> {
        while !is_interrupted() {
            match self.feed.next(QUIET) {
                Some(Fed::Ended(error)) => return Err(error),
                Some(Fed::WaitsFor(error)) => {
                    warn_of_waiting(&error);
                    return Ok(());
                }
                Some(Fed::Opened) => return Ok(()),
                // Neither comes before those above.
                Some(Fed::Arrived(_) | Fed::NotSent(_)) | None => {}
            }
        }
        Ok(())
    }

    /// Hands on all messages until the source ends, which is returned, or the time is over.
    ///
    /// # Errors
    /// Those of the sink.
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

    /// Hands on that all feet are silent: nothing will come any more.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn end(&mut self, sink: &mut impl Sink) -> Result<(), Error> {
        let mut last = self.bridge.end().into_iter();
        last.try_for_each(|published| sink.publish(published))
    }

    /// Nothing has come for a while: time goes on without it.
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

    /// Says where several boards have one id, once for each time that they begin.
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

    /// Says what was lost or could not be read.
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

/// Says how much this machine has lost, where it has.
pub fn warn_of_lost(feed: &Feed) {
    if feed.lost() > 0 {
        warn(format!(
            "{} arrivals were lost: this machine did not keep up",
            feed.lost()
        ));
    }
}
