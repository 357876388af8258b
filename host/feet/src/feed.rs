//! Line that is read by its own thread, so that a slow consumer does not block it, and reopened when it breaks.
//!
//! A line in lock step is read by its consumer instead: its time passes only while the consumer waits.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, Sender, SyncSender, TryRecvError, TrySendError, channel,
    sync_channel,
};
use std::thread;
use std::time::Duration;

use crate::link::{
    Arrival, Arrived, LISTEN, LineClock, LineSource, Link, LinkError, Remark, Sending,
};

/// Capacity of the queue, arrivals: three seconds of four feet on CAN.
const WAITING: usize = 1 << 14;

/// Delay before a line is reopened.
const RETRY: Duration = Duration::from_millis(500);

/// Event of a feed.
#[derive(Debug)]
pub enum Fed {
    /// Something has arrived.
    Arrived(Arrived),
    /// Remark about a recording that is played, for people to read.
    Remark(Remark),
    /// The line is open.
    Opened,
    /// The line has broken or is unavailable; opening it is retried without limit.
    WaitsFor(LinkError),
    /// Something could not be sent.
    NotSent(LinkError),
    /// End of the feed: the playback has ended, or the file cannot be read.
    Ended(LinkError),
}

/// Line whose arrivals, and whose breaks, are events.
pub struct Feed {
    reader: LineReader,
    clock: LineClock,
}

/// Reader of a line.
enum LineReader {
    Thread { fed: Receiver<Fed>, sendings: Sender<Sending>, lost: Arc<AtomicU64> },
    Consumer(RefCell<ConsumedLine>),
}

impl Feed {
    /// Opens a source. If the queue is full, playback waits, and arrivals from a device are dropped and counted.
    #[must_use]
    pub fn open(source: impl LineSource + 'static) -> Self {
        if source.is_in_lock_step() {
            return Self::consumed(source.open());
        }
        let (to, fed) = sync_channel(WAITING);
        let (sendings, to_send) = channel();
        let lost = Arc::new(AtomicU64::new(0));
        let feeder = Feeder { source: Box::new(source), to, to_send, lost: Arc::clone(&lost) };
        // `serve` fails only when the feed is dropped; the thread notices at its next arrival or timeout.
        thread::spawn(move || feeder.serve());
        Self { reader: LineReader::Thread { fed, sendings, lost }, clock: LineClock::default() }
    }

    /// Feed of a line that its consumer reads.
    fn consumed(opened: Result<Box<dyn Link>, LinkError>) -> Self {
        let (link, first) = match opened {
            Ok(link) => (Some(link), Fed::Opened),
            Err(error) => (None, Fed::Ended(error)),
        };
        let clock = link.as_ref().map(|link| link.clock());
        let events = VecDeque::from([first]);
        Self {
            reader: LineReader::Consumer(ConsumedLine { link, events }.into()),
            clock: clock.unwrap_or_default(),
        }
    }

    /// Clock of the line.
    #[must_use]
    pub const fn clock(&self) -> &LineClock {
        &self.clock
    }

    /// Returns the next event, or `None` if there is none within `longest`.
    #[must_use]
    pub fn next(&self, longest: Duration) -> Option<Fed> {
        let fed = match &self.reader {
            LineReader::Thread { fed, .. } => fed,
            LineReader::Consumer(line) => return line.borrow_mut().next(longest),
        };
        match fed.recv_timeout(longest) {
            Ok(fed) => Some(fed),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                // The end was reported already; the sleep keeps a polling caller from spinning.
                thread::sleep(longest.min(LISTEN));
                None
            }
        }
    }

    /// Queues data for sending; a failure is reported as [`Fed::NotSent`].
    pub fn send(&self, sending: Sending) {
        match &self.reader {
            // If the line has ended, that was reported already.
            LineReader::Thread { sendings, .. } => drop(sendings.send(sending)),
            LineReader::Consumer(line) => line.borrow_mut().send(&sending),
        }
    }

    /// Number of arrivals dropped because the queue was full.
    #[must_use]
    pub fn lost(&self) -> u64 {
        match &self.reader {
            LineReader::Thread { lost, .. } => lost.load(Ordering::Relaxed),
            LineReader::Consumer(_) => 0,
        }
    }
}

/// Line that its consumer reads. An error ends it.
struct ConsumedLine {
    link: Option<Box<dyn Link>>,
    /// Events that come before the next arrival.
    events: VecDeque<Fed>,
}

impl ConsumedLine {
    fn next(&mut self, longest: Duration) -> Option<Fed> {
        if let Some(event) = self.events.pop_front() {
            return Some(event);
        }
        let Some(link) = &mut self.link else {
            // The end was reported already; the sleep keeps a polling caller from spinning.
            thread::sleep(longest.min(LISTEN));
            return None;
        };
        match link.receive(longest) {
            Ok(arrived) => arrived.map(Fed::Arrived),
            Err(error) => {
                self.link = None;
                Some(Fed::Ended(error))
            }
        }
    }

    fn send(&mut self, sending: &Sending) {
        match self.link.as_mut().map(|link| link.send(sending)) {
            None | Some(Ok(())) => {}
            Some(Err(error)) if error.may_pass() => {
                self.link = None;
                self.events.push_back(Fed::Ended(error));
            }
            Some(Err(error)) => self.events.push_back(Fed::NotSent(error)),
        }
    }
}

/// The thread of a feed.
struct Feeder {
    source: Box<dyn LineSource>,
    to: SyncSender<Fed>,
    to_send: Receiver<Sending>,
    lost: Arc<AtomicU64>,
}

/// The feed was dropped.
struct Left;

impl Feeder {
    fn serve(&self) -> Result<(), Left> {
        let mut reported = false;
        loop {
            let error = match self.source.open() {
                Ok(mut link) => {
                    reported = false;
                    self.hand_on(Fed::Opened)?;
                    self.listen(link.as_mut())?
                }
                Err(error) => error,
            };
            if !error.may_pass() {
                return self.hand_on(Fed::Ended(error));
            }
            if !std::mem::replace(&mut reported, true) {
                self.hand_on(Fed::WaitsFor(error))?;
            } else if matches!(self.to_send.try_recv(), Err(TryRecvError::Disconnected)) {
                // The feed was dropped, which closes the channel of sendings.
                return Err(Left);
            }
            thread::sleep(RETRY);
        }
    }

    /// Listens until the line breaks.
    fn listen(&self, link: &mut dyn Link) -> Result<LinkError, Left> {
        loop {
            match self.to_send.try_recv().map(|sending| link.send(&sending)) {
                Ok(Ok(())) => continue,
                Ok(Err(error)) if error.may_pass() => return Ok(error),
                Ok(Err(error)) => {
                    self.hand_on(Fed::NotSent(error))?;
                    continue;
                }
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => return Err(Left),
            }
            match link.receive(LISTEN) {
                Ok(Some((_, Arrival::Remark(remark)))) => self.hand_on(Fed::Remark(remark))?,
                Ok(Some(arrived)) => self.hand_on(Fed::Arrived(arrived))?,
                Ok(None) => {}
                Err(error) => return Ok(error),
            }
        }
    }

    fn hand_on(&self, fed: Fed) -> Result<(), Left> {
        if self.source.is_played() || !matches!(fed, Fed::Arrived(_)) {
            return self.to.send(fed).map_err(|_| Left);
        }
        match self.to.try_send(fed) {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => {
                self.lost.fetch_add(1, Ordering::Relaxed);
                Ok(())
            }
            Err(TrySendError::Disconnected(_)) => Err(Left),
        }
    }
}

#[cfg(test)]
mod tests {
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
            Some(Fed::WaitsFor(error)) => {
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
            Some(Fed::Ended(error)) => {
                assert!(error.to_string().contains("there-is-none.log"), "{error}");
            }
            other => panic!("{other:?}"),
        }
    }
}
