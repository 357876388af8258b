//! Outgoing frames: bounded queues in which the newest item wins.
//!
//! Each outlet has four lanes. Notices are rare and go first. Then come estimates: no request delays
//! them. Responses go before the stream, which goes when nothing else waits. A full lane drops its
//! oldest item and counts it: the sender never waits.

use core::cell::RefCell;
use core::future::poll_fn;
use core::task::Poll;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::waitqueue::WakerRegistration;
use heapless::deque::{Deque, DequeView};

/// Lane of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// Rare reports of the foot itself: boot-up, heartbeat, faults. Goes first.
    Notice,
    /// The contact, each tick.
    Estimate,
    /// Responses to requests, of which there can be any number.
    Answer,
    /// Periodic data.
    Stream,
}

impl Lane {
    /// All lanes, in the order in which they are sent.
    pub const ALL: [Self; 4] = [Self::Notice, Self::Estimate, Self::Answer, Self::Stream];
}

/// Queue with room for `ESTIMATES` estimates, and `OTHERS` items in each other lane.
#[derive(Debug)]
pub(crate) struct Outlet<T, const ESTIMATES: usize, const OTHERS: usize>(
    Mutex<CriticalSectionRawMutex, RefCell<Lanes<T, ESTIMATES, OTHERS>>>,
);

#[derive(Debug)]
struct Lanes<T, const ESTIMATES: usize, const OTHERS: usize> {
    notices: Deque<T, OTHERS>,
    estimates: Deque<T, ESTIMATES>,
    answers: Deque<T, OTHERS>,
    stream: Deque<T, OTHERS>,
    /// Sends items without queuing them.
    sink: Option<Sink<T>>,
    /// Whether the task that empties the queue must wake up, even if it is empty.
    called: bool,
    waker: WakerRegistration,
}

/// Sends an item at once, or returns `false` if it cannot. It is called with the queue locked, so never
/// twice at the same time.
pub type Sink<T> = fn(&T) -> bool;

impl<T, const ESTIMATES: usize, const OTHERS: usize> Lanes<T, ESTIMATES, OTHERS> {
    fn lane(&mut self, lane: Lane) -> &mut DequeView<T> {
        match lane {
            Lane::Notice => &mut self.notices,
            Lane::Estimate => &mut self.estimates,
            Lane::Answer => &mut self.answers,
            Lane::Stream => &mut self.stream,
        }
    }

    fn is_empty(&mut self) -> bool {
        Lane::ALL.iter().all(|lane| self.lane(*lane).is_empty())
    }

    fn take_all(&mut self, mut take: impl FnMut(Lane, &T) -> bool) {
        for lane in Lane::ALL {
            let queue = self.lane(lane);
            while queue.front().is_some_and(|item| take(lane, item)) {
                queue.pop_front();
            }
        }
    }
}

impl<T, const ESTIMATES: usize, const OTHERS: usize> Outlet<T, ESTIMATES, OTHERS> {
    /// Creates an empty queue without a sink.
    #[must_use]
    pub const fn new() -> Self {
        Self(Mutex::new(RefCell::new(Lanes {
            notices: Deque::new(),
            estimates: Deque::new(),
            answers: Deque::new(),
            stream: Deque::new(),
            sink: None,
            called: false,
            waker: WakerRegistration::new(),
        })))
    }

    fn with<R>(&self, use_lanes: impl FnOnce(&mut Lanes<T, ESTIMATES, OTHERS>) -> R) -> R {
        self.0.lock(|lanes| use_lanes(&mut lanes.borrow_mut()))
    }

    /// Connects the `sink`, which is offered each item first.
    pub fn connect(&self, sink: Sink<T>) {
        self.with(|lanes| lanes.sink = Some(sink));
    }

    /// Sends an item at once, if the sink takes it and its lane is empty; otherwise queues it.
    /// Returns the number of items dropped for it.
    pub fn push(&self, lane: Lane, item: T) -> u32 {
        self.with(|lanes| {
            let sink = lanes.sink;
            let queue = lanes.lane(lane);
            if queue.is_empty() && sink.is_some_and(|sink| sink(&item)) {
                return 0;
            }
            let dropped = queue.is_full() && queue.pop_front().is_some();
            // There is room now.
            let _ = queue.push_back(item);
            lanes.waker.wake();
            u32::from(dropped)
        })
    }

    /// Offers the queued items to the sink: of each lane, in the order of [`Lane::ALL`], until it refuses
    /// one.
    pub fn flush(&self) {
        self.with(|lanes| {
            if let Some(sink) = lanes.sink {
                lanes.take_all(|_, item| sink(item));
            }
        });
    }

    /// Offers the queued items to `take`: of each lane, in the order of [`Lane::ALL`], until it refuses
    /// one.
    pub fn take_all(&self, take: impl FnMut(Lane, &T) -> bool) {
        self.with(|lanes| lanes.take_all(take));
    }

    /// Takes the next item, if there is one.
    pub fn try_next(&self) -> Option<T> {
        self.with(|lanes| {
            let mut queues = Lane::ALL.into_iter();
            queues.find_map(|lane| lanes.lane(lane).pop_front())
        })
    }

    /// Returns whether the queue is empty.
    pub fn is_empty(&self) -> bool {
        self.with(Lanes::is_empty)
    }

    /// Waits for an item, or for [`call`](Self::call).
    pub async fn ready(&self) {
        poll_fn(|context| {
            self.with(|lanes| {
                if core::mem::take(&mut lanes.called) || !lanes.is_empty() {
                    return Poll::Ready(());
                }
                lanes.waker.register(context.waker());
                Poll::Pending
            })
        })
        .await;
    }

    /// Ends the wait in [`ready`](Self::ready), even if the queue is empty.
    pub fn call(&self) {
        self.with(|lanes| {
            lanes.called = true;
            lanes.waker.wake();
        });
    }

    /// Empties a lane; returns the number of items dropped.
    pub fn clear(&self, lane: Lane) -> u32 {
        self.with(|lanes| {
            let queue = lanes.lane(lane);
            let dropped = queue.iter().count();
            queue.clear();
            dropped as u32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    type Small = Outlet<u32, 2, 3>;

    fn queued(outlet: &Small, lane: Lane, item: u32) -> u32 {
        outlet.push(lane, item)
    }

    fn drained(outlet: &Small) -> Vec<u32> {
        core::iter::from_fn(|| outlet.try_next()).collect()
    }

    #[test]
    fn a_full_lane_drops_and_counts_its_oldest_items() {
        let outlet = Small::new();
        let dropped: u32 = (0..10).map(|i| queued(&outlet, Lane::Stream, i)).sum();
        assert_eq!(dropped, 7);
        assert_eq!(drained(&outlet), [7, 8, 9]);
    }

    #[test]
    fn answers_go_before_the_stream_and_are_not_dropped_for_it() {
        let outlet = Small::new();
        assert_eq!(queued(&outlet, Lane::Stream, 1), 0);
        assert_eq!(queued(&outlet, Lane::Answer, 100), 0);
        for i in 2..50 {
            queued(&outlet, Lane::Stream, i);
        }
        assert_eq!(drained(&outlet), [100, 47, 48, 49]);
    }

    #[test]
    fn estimates_go_before_any_number_of_answers() {
        let outlet = Small::new();
        for answer in 100..150 {
            queued(&outlet, Lane::Answer, answer);
        }
        queued(&outlet, Lane::Estimate, 1);
        queued(&outlet, Lane::Notice, 7);
        assert_eq!(drained(&outlet), [7, 1, 147, 148, 149]);
    }

    #[test]
    fn an_item_taken_by_the_sink_never_overtakes_its_own_lane() {
        let outlet = Small::new();
        queued(&outlet, Lane::Stream, 2);
        outlet.connect(|_| true);
        assert_eq!(outlet.push(Lane::Stream, 3), 0);
        assert_eq!(outlet.push(Lane::Answer, 4), 0);
        assert_eq!(drained(&outlet), [2, 3]);
        assert_eq!(outlet.push(Lane::Stream, 1), 0);
        assert_eq!(drained(&outlet), []);
    }

    #[test]
    fn an_item_refused_by_the_sink_lets_the_next_lane_pass() {
        let outlet = Small::new();
        outlet.connect(|item| *item >= 100);
        assert_eq!(queued(&outlet, Lane::Estimate, 1), 0);
        assert_eq!(queued(&outlet, Lane::Estimate, 200), 0);
        queued(&outlet, Lane::Stream, 7);
        outlet.flush();
        assert_eq!(drained(&outlet), [1, 200, 7]);
        let outlet = Small::new();
        queued(&outlet, Lane::Estimate, 1);
        queued(&outlet, Lane::Answer, 100);
        queued(&outlet, Lane::Stream, 101);
        outlet.flush();
        outlet.connect(|item| *item >= 100);
        outlet.flush();
        assert_eq!(drained(&outlet), [1]);
    }

    #[test]
    fn the_wait_ends_with_an_item_or_once_with_a_call() {
        use core::pin::pin;
        use core::task::{Context, Waker};
        let outlet = Small::new();
        let is_ready = || {
            let mut context = Context::from_waker(Waker::noop());
            pin!(outlet.ready()).poll(&mut context).is_ready()
        };
        assert!(!is_ready());
        outlet.call();
        assert!(is_ready());
        assert!(!is_ready());
        queued(&outlet, Lane::Stream, 1);
        assert!(is_ready() && is_ready() && !outlet.is_empty());
    }

    #[test]
    fn a_cleared_lane_is_counted_and_the_others_stay() {
        let outlet = Small::new();
        for i in 0..5 {
            queued(&outlet, Lane::Stream, i);
        }
        queued(&outlet, Lane::Answer, 100);
        assert_eq!(outlet.clear(Lane::Stream), 3);
        queued(&outlet, Lane::Stream, 9);
        assert_eq!(drained(&outlet), [100, 9]);
    }
}
