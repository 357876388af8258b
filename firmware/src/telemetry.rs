//! Frames on their way out: bounded queues in which the newest win.
//!
//! Each way out has four lanes. Notices are rare and go first. Then come estimates: nothing that
//! anybody asks for makes them late. Answers go before the stream, which goes when there is nothing
//! else. Where nobody takes anything any more, each lane drops its oldest, counts it, and goes on:
//! whoever puts something in never waits.

use core::cell::RefCell;
use core::future::poll_fn;
use core::task::Poll;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::waitqueue::WakerRegistration;

/// Which of four lanes something takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// What the foot says of itself now and then: that it is there, what is wrong. Goes first.
    Notice,
    /// What the foot is for, each tick.
    Estimate,
    /// What somebody asked for: as many as they like.
    Answer,
    /// What is sent again and again.
    Stream,
}

impl Lane {
    /// All of them, the one that goes first first.
    pub const ALL: [Self; 4] = [Self::Notice, Self::Estimate, Self::Answer, Self::Stream];
}

/// A way out with lanes of room for `NOTICES`, `ESTIMATES`, `ANSWERS` and `STREAM`.
#[derive(Debug)]
pub struct Outlet<
    M: RawMutex,
    T,
    const NOTICES: usize,
    const ESTIMATES: usize,
    const ANSWERS: usize,
    const STREAM: usize,
>(Mutex<M, RefCell<Lanes<T, NOTICES, ESTIMATES, ANSWERS, STREAM>>>);

#[derive(Debug)]
struct Lanes<
    T,
    const NOTICES: usize,
    const ESTIMATES: usize,
    const ANSWERS: usize,
    const STREAM: usize,
> {
    notices: [T; NOTICES],
    estimates: [T; ESTIMATES],
    answers: [T; ANSWERS],
    stream: [T; STREAM],
    orders: [Order; Lane::ALL.len()],
    /// Who takes things out is to look up, whether or not there is something.
    called: bool,
    waker: WakerRegistration,
}

/// Which places of a lane are taken.
#[derive(Clone, Copy, Debug)]
struct Order {
    first: usize,
    count: usize,
}

impl Order {
    /// The place that is `ahead` places after the first, the last one being followed by the first.
    const fn place(self, ahead: usize, room: usize) -> usize {
        let place = self.first + ahead;
        if place >= room { place - room } else { place }
    }

    const fn drop_first(&mut self, room: usize) {
        self.first = self.place(1, room);
        self.count = self.count.saturating_sub(1);
    }

    /// Has something put in; tells how many had to go for it.
    fn push<T>(&mut self, places: &mut [T], put: impl FnOnce(&mut T)) -> u32 {
        let full = self.count == places.len();
        if full {
            self.drop_first(places.len());
        }
        if let Some(place) = places.get_mut(self.place(self.count, places.len())) {
            put(place);
            self.count += 1;
        }
        u32::from(full)
    }
}

impl<
    T: Clone,
    const NOTICES: usize,
    const ESTIMATES: usize,
    const ANSWERS: usize,
    const STREAM: usize,
> Lanes<T, NOTICES, ESTIMATES, ANSWERS, STREAM>
{
    fn lane(&mut self, lane: Lane) -> (&mut Order, &mut [T]) {
        let [notices, estimates, answers, stream] = &mut self.orders;
        match lane {
            Lane::Notice => (notices, &mut self.notices),
            Lane::Estimate => (estimates, &mut self.estimates),
            Lane::Answer => (answers, &mut self.answers),
            Lane::Stream => (stream, &mut self.stream),
        }
    }

    fn push(&mut self, lane: Lane, put: impl FnOnce(&mut T)) -> u32 {
        let (order, places) = self.lane(lane);
        let dropped = order.push(places, put);
        self.waker.wake();
        dropped
    }

    fn is_empty(&self) -> bool {
        self.orders.iter().all(|order| order.count == 0)
    }

    fn take_all(&mut self, mut take: impl FnMut(Lane, &T) -> bool) {
        for lane in Lane::ALL {
            let (order, places) = self.lane(lane);
            while order.count > 0
                && let Some(item) = places.get(order.first)
                && take(lane, item)
            {
                order.drop_first(places.len());
            }
        }
    }

    fn take<R>(&mut self, mut take: impl FnMut(&T) -> Option<R>) -> Option<R> {
        for lane in Lane::ALL {
            let (order, places) = self.lane(lane);
            if order.count > 0
                && let Some(item) = places.get(order.first)
                && let Some(taken) = take(item)
            {
                order.drop_first(places.len());
                return Some(taken);
            }
        }
        None
    }
}

impl<
    M: RawMutex,
    T: Clone,
    const NOTICES: usize,
    const ESTIMATES: usize,
    const ANSWERS: usize,
    const STREAM: usize,
> Outlet<M, T, NOTICES, ESTIMATES, ANSWERS, STREAM>
{
    /// An empty one; what `filler` is does not matter.
    #[must_use]
    pub const fn new(filler: T) -> Self
    where
        T: Copy,
    {
        Self(Mutex::new(RefCell::new(Lanes {
            notices: [filler; NOTICES],
            estimates: [filler; ESTIMATES],
            answers: [filler; ANSWERS],
            stream: [filler; STREAM],
            orders: [Order { first: 0, count: 0 }; Lane::ALL.len()],
            called: false,
            waker: WakerRegistration::new(),
        })))
    }

    fn with<R>(
        &self,
        use_lanes: impl FnOnce(&mut Lanes<T, NOTICES, ESTIMATES, ANSWERS, STREAM>) -> R,
    ) -> R {
        self.0.lock(|lanes| use_lanes(&mut lanes.borrow_mut()))
    }

    /// Puts something in, at once; tells how many had to go for it. Where nothing of its lane waits,
    /// `send` may take it past the queue: true where it has.
    pub fn push(&self, lane: Lane, item: &T, send: impl FnOnce(&T) -> bool) -> u32 {
        self.with(|lanes| {
            let (order, _) = lanes.lane(lane);
            if order.count == 0 && send(item) {
                return 0;
            }
            lanes.push(lane, |place| place.clone_from(item))
        })
    }

    /// The same for something large, which `put` makes in its place, of whatever was there.
    pub fn push_in_place(&self, lane: Lane, put: impl FnOnce(&mut T)) -> u32 {
        self.with(|lanes| lanes.push(lane, put))
    }

    /// Offers the first of each lane to `take`, the lane that goes first first, until it takes one.
    pub fn take<R>(&self, take: impl FnMut(&T) -> Option<R>) -> Option<R> {
        self.with(|lanes| lanes.take(take))
    }

    /// Offers each lane's frames to `take`, the lane that goes first first, and of each until it
    /// takes one no more.
    pub fn take_all(&self, take: impl FnMut(Lane, &T) -> bool) {
        self.with(|lanes| lanes.take_all(take));
    }

    /// The next to go out, if there is one.
    pub fn try_next(&self) -> Option<T> {
        self.take(|item| Some(item.clone()))
    }

    /// Whether nothing waits.
    pub fn is_empty(&self) -> bool {
        self.with(|lanes| lanes.is_empty())
    }

    /// Waits until there is something, or for [`call`](Self::call).
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

    /// Has whoever waits for something look up.
    pub fn call(&self) {
        self.with(|lanes| {
            lanes.called = true;
            lanes.waker.wake();
        });
    }

    /// Forgets what is in a lane; tells how many those were.
    pub fn clear(&self, lane: Lane) -> u32 {
        self.with(|lanes| {
            let (order, _) = lanes.lane(lane);
            core::mem::take(&mut order.count) as u32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_sync::blocking_mutex::raw::NoopRawMutex;
    use std::vec::Vec;

    type Small = Outlet<NoopRawMutex, u32, 1, 2, 2, 3>;

    fn queued(outlet: &Small, lane: Lane, item: u32) -> u32 {
        outlet.push(lane, &item, |_| false)
    }

    fn drained(outlet: &Small) -> Vec<u32> {
        core::iter::from_fn(|| outlet.try_next()).collect()
    }

    #[test]
    fn a_full_lane_drops_its_oldest_and_says_so() {
        let outlet = Small::new(0);
        let dropped: u32 = (0..10).map(|i| queued(&outlet, Lane::Stream, i)).sum();
        assert_eq!(dropped, 7);
        assert_eq!(drained(&outlet), [7, 8, 9]);
    }

    #[test]
    fn answers_go_before_the_stream_and_are_not_pushed_out_by_it() {
        let outlet = Small::new(0);
        assert_eq!(queued(&outlet, Lane::Stream, 1), 0);
        assert_eq!(queued(&outlet, Lane::Answer, 100), 0);
        for i in 2..50 {
            queued(&outlet, Lane::Stream, i);
        }
        assert_eq!(drained(&outlet), [100, 47, 48, 49]);
    }

    #[test]
    fn estimates_go_before_answers_however_many_of_those_there_are() {
        let outlet = Small::new(0);
        for answer in 100..150 {
            queued(&outlet, Lane::Answer, answer);
        }
        queued(&outlet, Lane::Estimate, 1);
        queued(&outlet, Lane::Notice, 7);
        assert_eq!(drained(&outlet), [7, 1, 148, 149]);
    }

    #[test]
    fn what_is_sent_at_once_is_not_queued_and_never_overtakes_its_own_lane() {
        let outlet = Small::new(0);
        assert_eq!(outlet.push(Lane::Stream, &1, |_| true), 0);
        assert_eq!(drained(&outlet), []);
        queued(&outlet, Lane::Stream, 2);
        outlet.push(Lane::Stream, &3, |_| true);
        outlet.push(Lane::Answer, &4, |_| true);
        assert_eq!(drained(&outlet), [2, 3]);
    }

    #[test]
    fn what_cannot_go_now_lets_the_next_lane_pass() {
        let outlet = Small::new(0);
        queued(&outlet, Lane::Estimate, 1);
        queued(&outlet, Lane::Answer, 100);
        let taken = outlet.take(|item| (*item >= 100).then_some(*item));
        assert_eq!(taken, Some(100));
        assert_eq!(drained(&outlet), [1]);
    }

    #[test]
    fn a_lane_is_forgotten_and_counted() {
        let outlet = Small::new(0);
        for i in 0..5 {
            queued(&outlet, Lane::Stream, i);
        }
        queued(&outlet, Lane::Answer, 100);
        assert_eq!(outlet.clear(Lane::Stream), 3);
        queued(&outlet, Lane::Stream, 9);
        assert_eq!(drained(&outlet), [100, 9]);
    }
}
