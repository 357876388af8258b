//! Frames on their way out: bounded queues in which the newest win.
//!
//! Each way out has two lanes. Answers, emergencies and heartbeats are rare and go first; the
//! stream goes when there are none. Where nobody takes anything any more, each lane drops its
//! oldest, counts it, and goes on: whoever puts something in never waits.

use core::future::poll_fn;
use core::task::Poll;

use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_sync::channel::Channel;

/// Which of two lanes something takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lane {
    /// Rare, and goes first.
    Answer,
    /// Each tick.
    Stream,
}

/// A way out with two lanes of room for `ANSWERS` and `STREAM`.
#[derive(Debug)]
pub struct Outlet<M: RawMutex, T, const ANSWERS: usize, const STREAM: usize> {
    answers: Channel<M, T, ANSWERS>,
    stream: Channel<M, T, STREAM>,
}

impl<M: RawMutex, T, const ANSWERS: usize, const STREAM: usize> Default
    for Outlet<M, T, ANSWERS, STREAM>
{
    fn default() -> Self {
        Self::new()
    }
}

impl<M: RawMutex, T, const ANSWERS: usize, const STREAM: usize> Outlet<M, T, ANSWERS, STREAM> {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            answers: Channel::new(),
            stream: Channel::new(),
        }
    }

    /// Puts something in, at once; tells how many had to go for it.
    pub fn push(&self, lane: Lane, item: T) -> u32 {
        match lane {
            Lane::Answer => push(&self.answers, item),
            Lane::Stream => push(&self.stream, item),
        }
    }

    /// Waits for the next to go out.
    pub async fn next(&self) -> T {
        poll_fn(|context| match self.answers.poll_receive(context) {
            Poll::Ready(item) => Poll::Ready(item),
            Poll::Pending => self.stream.poll_receive(context),
        })
        .await
    }

    /// The next to go out, if there is one.
    pub fn try_next(&self) -> Option<T> {
        let answer = self.answers.try_receive();
        answer.or_else(|_| self.stream.try_receive()).ok()
    }
}

fn push<M: RawMutex, T, const N: usize>(channel: &Channel<M, T, N>, item: T) -> u32 {
    let mut dropped = 0;
    let mut item = item;
    loop {
        match channel.try_send(item) {
            Ok(()) => return dropped,
            Err(embassy_sync::channel::TrySendError::Full(back)) => item = back,
        }
        // Between the two somebody may have taken it, or put one more in: another round then.
        dropped += u32::from(channel.try_receive().is_ok());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use embassy_sync::blocking_mutex::raw::NoopRawMutex;
    use std::vec::Vec;

    fn drained(outlet: &Outlet<NoopRawMutex, u32, 2, 3>) -> Vec<u32> {
        core::iter::from_fn(|| outlet.try_next()).collect()
    }

    #[test]
    fn a_full_lane_drops_its_oldest_and_says_so() {
        let outlet = Outlet::new();
        let dropped: u32 = (0..10).map(|i| outlet.push(Lane::Stream, i)).sum();
        assert_eq!(dropped, 7);
        assert_eq!(drained(&outlet), [7, 8, 9]);
    }

    #[test]
    fn answers_go_before_the_stream_and_are_not_pushed_out_by_it() {
        let outlet = Outlet::new();
        assert_eq!(outlet.push(Lane::Stream, 1), 0);
        assert_eq!(outlet.push(Lane::Answer, 100), 0);
        for i in 2..50 {
            outlet.push(Lane::Stream, i);
        }
        assert_eq!(drained(&outlet), [100, 47, 48, 49]);
    }
}
