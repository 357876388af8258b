//! Lines of a robot. Each is read by its own thread, so that a slow consumer does not block the line, and is reopened when
//! it breaks.
//!
//! Lines in lock step are read by their consumer instead: their time passes only while the consumer waits. Playbacks are
//! merged in order of time.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::fmt;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, Weak};
use std::thread;
use std::time::Duration;

use crate::link::clock::PlaybackPace;
use crate::link::{
    Arrival, Arrived, LISTEN, LineClock, LineSource, Link, LinkError, Remark, Sending,
};
use crate::source::Speed;

/// Capacity of the queue, arrivals: three seconds of four feet on CAN.
const WAITING: usize = 1 << 14;

/// Time for which one of several lines in lock step is read.
const STEP: Duration = Duration::from_millis(1);

/// Delay before a line is reopened.
const RETRY: Duration = Duration::from_millis(500);

/// Event of a feed.
#[derive(Debug)]
pub enum FeedEvent {
    /// Something has arrived.
    Arrived(Arrived),
    /// Remark about a recording that is played, for people to read.
    Remark(Remark),
    /// A line is open.
    Opened,
    /// The line of this source has broken or was unavailable, and is open again.
    OpenedAgain(String),
    /// A line has broken or is unavailable; opening it is retried without limit.
    WaitsFor(LinkError),
    /// End of the feed: all playbacks have ended, or a file cannot be read.
    Ended(LinkError),
}

/// Lines whose arrivals, and whose breaks, are events.
pub struct Feed {
    reader: LineReader,
    clock: LineClock,
    /// Number of lines.
    lines: usize,
    /// Number of lines that have not ended.
    open: Cell<usize>,
}

/// Reader of the lines.
enum LineReader {
    Threads { events: Receiver<FeedEvent>, lost: Arc<AtomicU64> },
    Consumer(RefCell<ConsumedLines>),
}

impl Feed {
    /// Opens a source. If the queue is full, playback waits, and arrivals from a device are dropped and counted.
    #[must_use]
    pub fn open(source: impl LineSource + 'static) -> Self {
        Self::open_all(vec![Box::new(source)])
    }

    /// Opens sources as one feed. Playbacks are merged in order of time, and have the speed of the first.
    #[must_use]
    pub fn open_all(sources: Vec<Box<dyn LineSource>>) -> Self {
        if !sources.is_empty() && sources.iter().all(|source| source.is_in_lock_step()) {
            let is_alone = sources.len() == 1;
            return Self::consumed(is_alone, sources.iter().map(|source| source.open()));
        }
        let (played, mut sources): (Vec<_>, Vec<_>) =
            sources.into_iter().partition(|source| source.speed().is_some());
        match played.len() {
            0 | 1 => sources.extend(played),
            _ => sources.push(Box::new(MergedPlaybacks(played))),
        }
        let lines = sources.len();
        let (to, events) = sync_channel(WAITING);
        let lost = Arc::new(AtomicU64::new(0));
        for source in sources {
            let feeder = Feeder { source, to: to.clone(), lost: Arc::downgrade(&lost) };
            // `serve` fails only when the feed is dropped; the thread notices that at its next arrival or timeout.
            thread::spawn(move || feeder.serve());
        }
        let reader = LineReader::Threads { events, lost };
        Self { reader, clock: LineClock::default(), lines, open: Cell::new(lines) }
    }

    /// Creates a feed of lines that the consumer reads itself. `is_alone` tells whether there is only one line.
    fn consumed(
        is_alone: bool,
        opened: impl Iterator<Item = Result<Box<dyn Link>, LinkError>>,
    ) -> Self {
        let lines = opened.map(|mut opened| {
            // The next line cannot be opened while this one holds the boards' time.
            if !is_alone
                && let Ok(link) = &mut opened
                && let Err(error) = link.park()
            {
                opened = Err(error);
            }
            ConsumedLine::new(opened)
        });
        let lines: Vec<_> = lines.collect();
        let clocks = lines.iter().filter_map(|line| line.link.as_ref());
        let clock = clocks.map(|link| link.clock()).next();
        let count = lines.len();
        Self {
            reader: LineReader::Consumer(ConsumedLines { lines, next: 0, used: None }.into()),
            clock: clock.unwrap_or_default(),
            lines: count,
            open: Cell::new(count),
        }
    }

    /// Clock of the lines.
    #[must_use]
    pub const fn clock(&self) -> &LineClock {
        &self.clock
    }

    /// Number of lines; merged playbacks are one.
    #[must_use]
    pub const fn lines(&self) -> usize {
        self.lines
    }

    /// Returns the next event, or `None` if there is none within `longest`.
    #[must_use]
    pub fn next(&self, longest: Duration) -> Option<FeedEvent> {
        let event = match &self.reader {
            LineReader::Threads { events, .. } => match events.recv_timeout(longest) {
                Ok(event) => Some(event),
                Err(RecvTimeoutError::Timeout) => None,
                Err(RecvTimeoutError::Disconnected) => {
                    // The end was reported already; the sleep keeps a polling caller from spinning.
                    thread::sleep(longest.min(LISTEN));
                    None
                }
            },
            LineReader::Consumer(lines) => lines.borrow_mut().next(&self.clock, longest),
        };
        match event {
            Some(FeedEvent::Ended(LinkError::Ended(_))) if self.open.get() > 1 => {
                self.open.set(self.open.get() - 1);
                None
            }
            event => event,
        }
    }

    /// Number of arrivals dropped because the queue was full.
    #[must_use]
    pub fn lost(&self) -> u64 {
        match &self.reader {
            LineReader::Threads { lost, .. } => lost.load(Ordering::Relaxed),
            LineReader::Consumer(_) => 0,
        }
    }
}

/// Lines that their consumer reads, one after the other.
struct ConsumedLines {
    lines: Vec<ConsumedLine>,
    /// Line that is read next.
    next: usize,
    /// Line that is not parked.
    used: Option<usize>,
}

impl ConsumedLines {
    fn next(&mut self, clock: &LineClock, longest: Duration) -> Option<FeedEvent> {
        let end = clock.now() + longest;
        // Lines in lock step are read in short turns, because the boards share their time, which passes for all of them
        // while one line is read.
        let piece = if self.lines.len() == 1 { longest } else { STEP.min(longest) };
        loop {
            for _ in 0..self.lines.len() {
                let index = self.next % self.lines.len();
                self.next = index + 1;
                self.use_line(index);
                if let Some(event) = self.lines[index].next(piece) {
                    return Some(event);
                }
            }
            if self.lines.len() == 1 || clock.now() >= end {
                return None;
            }
            if self.lines.iter().all(|line| line.link.is_none()) {
                return None;
            }
        }
    }

    /// Parks the line that was used before another one.
    fn use_line(&mut self, index: usize) {
        if let Some(before) = self.used.replace(index)
            && before != index
        {
            self.lines[before].park();
        }
    }
}

/// Line that its consumer reads. An error ends it.
struct ConsumedLine {
    link: Option<Box<dyn Link>>,
    /// Events that come before the next arrival.
    events: VecDeque<FeedEvent>,
}

impl ConsumedLine {
    fn new(opened: Result<Box<dyn Link>, LinkError>) -> Self {
        let (link, first) = match opened {
            Ok(link) => (Some(link), FeedEvent::Opened),
            Err(error) => (None, FeedEvent::Ended(error)),
        };
        Self { link, events: VecDeque::from([first]) }
    }

    fn next(&mut self, longest: Duration) -> Option<FeedEvent> {
        if let Some(event) = self.events.pop_front() {
            return Some(event);
        }
        let Some(link) = &mut self.link else {
            // The end was reported already; the sleep keeps a polling caller from spinning.
            thread::sleep(longest.min(LISTEN));
            return None;
        };
        match link.receive(longest) {
            Ok(arrived) => arrived.map(FeedEvent::Arrived),
            Err(error) => {
                self.link = None;
                Some(FeedEvent::Ended(error))
            }
        }
    }

    fn park(&mut self) {
        if let Some(link) = &mut self.link
            && let Err(error) = link.park()
        {
            self.link = None;
            self.events.push_back(FeedEvent::Ended(error));
        }
    }
}

/// The thread of a feed.
struct Feeder {
    source: Box<dyn LineSource>,
    to: SyncSender<FeedEvent>,
    /// Number of arrivals dropped. The feed owns it, so it is gone once the feed was dropped.
    lost: Weak<AtomicU64>,
}

/// The feed was dropped.
struct Left;

impl Feeder {
    fn serve(&self) -> Result<(), Left> {
        let mut reported = false;
        loop {
            let error = match self.source.open() {
                Ok(mut link) => {
                    self.hand_on(if std::mem::take(&mut reported) {
                        FeedEvent::OpenedAgain(self.source.to_string())
                    } else {
                        FeedEvent::Opened
                    })?;
                    self.listen(link.as_mut())?
                }
                Err(error) => error,
            };
            if !error.may_pass() {
                return self.hand_on(FeedEvent::Ended(error));
            }
            if !std::mem::replace(&mut reported, true) {
                self.hand_on(FeedEvent::WaitsFor(error))?;
            }
            self.check_feed()?;
            thread::sleep(RETRY);
        }
    }

    /// Fails if the feed was dropped. While nothing arrives on the line, the thread notices that only here.
    fn check_feed(&self) -> Result<(), Left> {
        if self.lost.strong_count() == 0 { Err(Left) } else { Ok(()) }
    }

    /// Listens until the line breaks.
    fn listen(&self, link: &mut dyn Link) -> Result<LinkError, Left> {
        loop {
            self.check_feed()?;
            match link.receive(LISTEN) {
                Ok(Some((_, Arrival::Remark(remark)))) => {
                    self.hand_on(FeedEvent::Remark(remark))?;
                }
                Ok(Some(arrived)) => self.hand_on(FeedEvent::Arrived(arrived))?,
                Ok(None) => {}
                Err(error) => return Ok(error),
            }
        }
    }

    fn hand_on(&self, event: FeedEvent) -> Result<(), Left> {
        if self.source.speed().is_some() || !matches!(event, FeedEvent::Arrived(_)) {
            return self.to.send(event).map_err(|_| Left);
        }
        match self.to.try_send(event) {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => {
                let lost = self.lost.upgrade().ok_or(Left)?;
                lost.fetch_add(1, Ordering::Relaxed);
                Ok(())
            }
            Err(TrySendError::Disconnected(_)) => Err(Left),
        }
    }
}

/// Sources that are played together, at the speed of the first.
struct MergedPlaybacks(Vec<Box<dyn LineSource>>);

impl fmt::Display for MergedPlaybacks {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self.0.iter().map(ToString::to_string);
        f.write_str(&names.collect::<Vec<_>>().join(" "))
    }
}

impl LineSource for MergedPlaybacks {
    fn open(&self) -> Result<Box<dyn Link>, LinkError> {
        let lines = self.0.iter().map(|source| {
            let link = source.open_unpaced()?;
            Ok(PlayedLine { link, next: None })
        });
        Ok(Box::new(MergedLine {
            lines: lines.collect::<Result<_, LinkError>>()?,
            pace: PlaybackPace::new(self.speed().unwrap_or(Speed::REAL)),
        }))
    }

    fn speed(&self) -> Option<Speed> {
        self.0.first().and_then(|source| source.speed())
    }
}

/// Several playbacks.
struct MergedLine {
    /// Playbacks that have not ended.
    lines: Vec<PlayedLine>,
    pace: PlaybackPace,
}

/// A playback with its next data.
struct PlayedLine {
    link: Box<dyn Link>,
    next: Option<Arrived>,
}

impl MergedLine {
    /// Reads the next data of each playback, and removes playbacks that have ended.
    fn read(&mut self, longest: Duration) -> Result<(), LinkError> {
        let mut index = 0;
        while let Some(line) = self.lines.get_mut(index) {
            if line.next.is_none() {
                match line.link.receive(longest) {
                    Ok(next) => line.next = next,
                    Err(LinkError::Ended(_)) if self.lines.len() > 1 => {
                        self.lines.remove(index);
                        continue;
                    }
                    Err(error) => return Err(error),
                }
            }
            index += 1;
        }
        Ok(())
    }
}

impl Link for MergedLine {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        self.read(longest)?;
        let is_read = |line: &&mut PlayedLine| line.next.is_some();
        let lines = self.lines.iter_mut().filter(is_read);
        let first = lines.min_by_key(|line| line.next.as_ref().map(|(at, _)| *at));
        let Some(line) = first else {
            return Ok(None);
        };
        let at_us = line.next.as_ref().map_or(0, |(at, _)| at.as_micros());
        Ok(if self.pace.wait(at_us, longest) { line.next.take() } else { None })
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        self.lines.iter_mut().try_for_each(|line| line.link.send(sending))
    }
}

#[cfg(test)]
mod tests {
    use estimator_core::Timestamp;

    use super::*;
    use crate::Source;

    /// Timeout that ends a hang.
    const LONGEST: Duration = Duration::from_secs(120);

    fn source(text: &str) -> Source {
        text.parse().expect("a source")
    }

    #[test]
    fn missing_device_is_named_once() {
        let feed = Feed::open(source("uart:/dev/there-is-none"));
        match feed.next(LONGEST) {
            Some(FeedEvent::WaitsFor(error)) => {
                assert!(error.to_string().starts_with("/dev/there-is-none: "), "{error}");
            }
            other => panic!("{other:?}"),
        }
        assert!(feed.next(3 * RETRY).is_none(), "once is enough");
    }

    #[test]
    fn missing_file_ends_the_feed() {
        let feed = Feed::open(source("file:there-is-none.log"));
        match feed.next(LONGEST) {
            Some(FeedEvent::Ended(error)) => {
                assert!(error.to_string().contains("there-is-none.log"), "{error}");
            }
            other => panic!("{other:?}"),
        }
    }

    /// Playback of texts at these times, µs.
    struct Times(Vec<u64>);

    impl fmt::Display for Times {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("times")
        }
    }

    impl LineSource for Times {
        fn open(&self) -> Result<Box<dyn Link>, LinkError> {
            Ok(Box::new(Self(self.0.iter().rev().copied().collect())))
        }

        fn speed(&self) -> Option<Speed> {
            Some(Speed::Max)
        }
    }

    impl Link for Times {
        fn receive(&mut self, _: Duration) -> Result<Option<Arrived>, LinkError> {
            let us = self.0.pop().ok_or_else(|| LinkError::Ended("times".to_owned()))?;
            Ok(Some((Timestamp::from_micros(us), Arrival::Unreadable(us.to_string()))))
        }

        fn send(&mut self, _: &Sending) -> Result<(), LinkError> {
            Ok(())
        }
    }

    #[test]
    fn playbacks_are_merged_in_order_of_time() {
        let sources = [vec![1, 4, 5], vec![2, 3, 9], vec![]];
        let sources = sources.map(|times| Box::new(Times(times)) as Box<dyn LineSource>);
        let mut line = MergedPlaybacks(sources.into()).open().expect("times");
        let mut times = Vec::new();
        let ended = loop {
            match line.receive(Duration::ZERO) {
                Ok(Some((at, _))) => times.push(at.as_micros()),
                Ok(None) => {}
                Err(error) => break error,
            }
        };
        assert_eq!(times, [1, 2, 3, 4, 5, 9]);
        assert_eq!(ended.to_string(), "times has ended");
    }
}
