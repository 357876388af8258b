//! A line that a thread of its own reads, so that nothing waits for whoever uses what arrives; and that
//! is opened again when it breaks.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{
    Receiver, RecvTimeoutError, Sender, SyncSender, TryRecvError, TrySendError, channel,
    sync_channel,
};
use std::thread;
use std::time::Duration;

use crate::link::{self, Arrived, Link, LinkError, Sending};
use crate::source::Source;

/// Arrivals that wait at most: three seconds of four feet on CAN.
const WAITING: usize = 1 << 14;

/// How long the thread waits for an arrival before it looks for something to send.
const LISTEN: Duration = Duration::from_millis(5);

/// How long it waits before it opens a line again.
const RETRY: Duration = Duration::from_millis(500);

/// What comes from a feed.
#[derive(Debug)]
pub enum Fed {
    /// Something has arrived.
    Arrived(Arrived),
    /// The line is open.
    Opened,
    /// The line has broken, or is not there: it is tried again, without end.
    WaitsFor(LinkError),
    /// Something could not be sent.
    NotSent(LinkError),
    /// There is nothing more: what is played has ended, or cannot be read.
    Ended(LinkError),
}

/// A line that is read by a thread of its own.
pub struct Feed {
    fed: Receiver<Fed>,
    sendings: Sender<Sending>,
    lost: Arc<AtomicU64>,
}

impl Feed {
    /// Opens a source. What is played waits until it is taken; what a device sends is dropped, and counted,
    /// where too much of it waits.
    #[must_use]
    pub fn open(source: Source) -> Self {
        let (to, fed) = sync_channel(WAITING);
        let (sendings, to_send) = channel();
        let lost = Arc::new(AtomicU64::new(0));
        let feeder = Feeder {
            is_played: matches!(source, Source::File { .. } | Source::Demo(_)),
            source,
            to,
            to_send,
            lost: Arc::clone(&lost),
        };
        // It ends when the feed is dropped, at the next arrival or pause.
        thread::spawn(move || feeder.run());
        Self {
            fed,
            sendings,
            lost,
        }
    }

    /// The next, within `longest`; `None` where nothing comes.
    #[must_use]
    pub fn next(&self, longest: Duration) -> Option<Fed> {
        match self.fed.recv_timeout(longest) {
            Ok(fed) => Some(fed),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => {
                // The end was said before; whoever goes on asking need not spin.
                thread::sleep(longest.min(LISTEN));
                None
            }
        }
    }

    /// Sends something; what cannot be sent comes back as [`Fed::NotSent`].
    pub fn send(&self, sending: Sending) {
        // Where the line has ended, that was reported already.
        let _ = self.sendings.send(sending);
    }

    /// How many arrivals were lost because nobody took them in time.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost.load(Ordering::Relaxed)
    }
}

/// The thread of a feed.
struct Feeder {
    source: Source,
    is_played: bool,
    to: SyncSender<Fed>,
    to_send: Receiver<Sending>,
    lost: Arc<AtomicU64>,
}

/// Nobody listens any more.
struct Left;

impl Feeder {
    fn run(self) {
        // That nobody listens any more ends it.
        let _ = self.serve();
    }

    fn serve(&self) -> Result<(), Left> {
        let mut reported = false;
        loop {
            let error = match link::open(&self.source) {
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
            } else if self.is_left() {
                return Err(Left);
            }
            thread::sleep(RETRY);
        }
    }

    /// Whether the feed was dropped: its end of the sendings is gone.
    fn is_left(&self) -> bool {
        matches!(self.to_send.try_recv(), Err(TryRecvError::Disconnected))
    }

    /// Listens until the line breaks.
    fn listen(&self, link: &mut dyn Link) -> Result<LinkError, Left> {
        loop {
            loop {
                match self.to_send.try_recv() {
                    Ok(sending) => match link.send(&sending) {
                        Ok(()) => {}
                        Err(error) if error.may_pass() => return Ok(error),
                        Err(error) => self.hand_on(Fed::NotSent(error))?,
                    },
                    Err(TryRecvError::Empty) => break,
                    Err(TryRecvError::Disconnected) => return Err(Left),
                }
            }
            match link.receive(LISTEN) {
                Ok(Some(arrived)) => self.hand_on(Fed::Arrived(arrived))?,
                Ok(None) => {}
                Err(error) => return Ok(error),
            }
        }
    }

    fn hand_on(&self, fed: Fed) -> Result<(), Left> {
        if self.is_played || !matches!(fed, Fed::Arrived(_)) {
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
    use crate::link::Arrival;

    #[test]
    fn a_demo_without_pace_hands_on_every_frame_and_its_end() {
        let source = "demo:feet=2,speed=max,seconds=2".parse().expect("a source");
        let feed = Feed::open(source);
        let mut contacts = 0;
        loop {
            match feed.next(Duration::from_secs(5)).expect("it ends") {
                Fed::Arrived((_, Arrival::Frame { frame, .. })) => {
                    contacts += usize::from(frame.id() & 0x780 == 0x180);
                }
                Fed::Ended(error) => {
                    assert_eq!(error.to_string(), "the demo has ended");
                    break;
                }
                _ => {}
            }
        }
        assert_eq!((contacts, feed.lost()), (4000, 0));
    }

    #[test]
    fn a_device_that_is_not_there_is_waited_for_and_named() {
        let source = "uart:/dev/there-is-none".parse().expect("a source");
        let feed = Feed::open(source);
        match feed.next(Duration::from_secs(5)) {
            Some(Fed::WaitsFor(error)) => {
                assert!(
                    error.to_string().starts_with("/dev/there-is-none: "),
                    "{error}"
                );
            }
            other => panic!("{other:?}"),
        }
        assert!(
            feed.next(Duration::from_millis(50)).is_none(),
            "once is enough"
        );
    }

    #[test]
    fn a_file_that_is_not_there_ends_it() {
        let feed = Feed::open("file:there-is-none.log".parse().expect("a source"));
        match feed.next(Duration::from_secs(5)) {
            Some(Fed::Ended(error)) => {
                assert!(error.to_string().contains("there-is-none.log"), "{error}");
            }
            other => panic!("{other:?}"),
        }
    }
}
