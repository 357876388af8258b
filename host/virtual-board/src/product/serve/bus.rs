//! The bus that all feet share: frames of several nodes, one at a time, the lowest identifier first.
//!
//! Each board has its own model of the bus, on which the frames of the others arrive one time slice after they
//! were sent. This model puts all frames into the one order that an adapter receives.

use std::collections::VecDeque;

use crate::emulator::part::can::BusFrame;
use crate::emulator::time::cycle;

/// Maximum number of frames of a node that wait for the bus; beyond it the oldest is lost.
const MOST_WAITING: usize = 256;

/// A frame that waits for the bus, or was transmitted on it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Carried {
    /// Index of the sending node.
    pub node: usize,
    /// Time at which it began, or before which it does not begin while it waits, in units of
    /// [`time`](crate::emulator::time).
    pub start: u64,
    /// Bit rate, bit/s: nodes with another rate do not receive it.
    pub bit_rate: u32,
    /// The frame.
    pub frame: BusFrame,
}

/// The bus.
#[derive(Clone, Debug)]
pub struct BoardBus {
    /// Frames that wait, by node; each starts no earlier than its time.
    nodes: Vec<VecDeque<Carried>>,
    free_at: u64,
    /// Number of frames discarded because the queue was full.
    pub lost: u64,
}

impl BoardBus {
    /// Creates a bus with `nodes` nodes.
    #[must_use]
    pub fn new(nodes: usize) -> Self {
        Self { nodes: vec![VecDeque::new(); nodes], free_at: 0, lost: 0 }
    }

    /// Queues a frame of a node to be sent no earlier than `ready`. Frames of one node keep their order.
    pub fn send(&mut self, node: usize, frame: BusFrame, bit_rate: u32, ready: u64) {
        // A controller without a bit rate sends nothing.
        let Some(queue) = self.nodes.get_mut(node).filter(|_| bit_rate > 0) else {
            return;
        };
        if queue.len() == MOST_WAITING {
            queue.pop_front();
            self.lost += 1;
        }
        queue.push_back(Carried { node, start: ready, bit_rate, frame });
    }

    /// Number of frames of a node that wait.
    #[must_use]
    pub fn waiting(&self, node: usize) -> usize {
        self.nodes.get(node).map_or(0, VecDeque::len)
    }

    /// Returns the next frame that begins before `until`.
    pub fn next(&mut self, until: u64) -> Option<Carried> {
        let heads = || self.nodes.iter().filter_map(VecDeque::front);
        let first = heads().map(|waiting| waiting.start).min()?;
        let start = first.max(self.free_at);
        if start >= until {
            return None;
        }
        let ready = self.nodes.iter().enumerate().filter_map(|(node, queue)| {
            let head = queue.front().filter(|head| head.start <= start)?;
            Some((head.frame.id, node))
        });
        let (_, node) = ready.min()?;
        let mut carried = self.nodes.get_mut(node)?.pop_front()?;
        carried.start = start;
        self.free_at = start + carried.frame.bits() * cycle(carried.bit_rate);
        Some(carried)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RATE: u32 = 1_000_000;

    fn carried(bus: &mut BoardBus, until: u64) -> Vec<(usize, u32)> {
        std::iter::from_fn(|| bus.next(until))
            .map(|carried| (carried.node, carried.frame.id))
            .collect()
    }

    #[test]
    fn the_lowest_identifier_wins_and_a_node_keeps_its_order() {
        let mut bus = BoardBus::new(3);
        for (node, id) in [(0, 0x191), (0, 0x080), (1, 0x192), (2, 0x180)] {
            bus.send(node, BusFrame::new(id, &[]), RATE, 0);
        }
        let order = [(2, 0x180), (0, 0x191), (0, 0x080), (1, 0x192)];
        assert_eq!(carried(&mut bus, u64::MAX), order);
    }

    #[test]
    fn a_frame_takes_its_time_and_waits_until_ready() {
        let mut bus = BoardBus::new(2);
        let frame = BusFrame::new(0x200, &[0; 8]);
        let length = frame.bits() * cycle(RATE);
        bus.send(0, frame.clone(), RATE, 10);
        bus.send(0, frame, RATE, 10);
        bus.send(1, BusFrame::new(0x100, &[]), RATE, 11);
        let first = bus.next(u64::MAX).expect("a frame");
        assert_eq!((first.node, first.start), (0, 10));
        let second = bus.next(u64::MAX).expect("a frame");
        assert_eq!((second.node, second.start), (1, 10 + length));
        assert_eq!(bus.next(10 + length), None, "it begins later");
        assert_eq!(bus.waiting(0), 1);
    }

    #[test]
    fn frames_that_never_find_the_bus_free_are_counted_as_lost() {
        let mut bus = BoardBus::new(1);
        for _ in 0..MOST_WAITING + 3 {
            bus.send(0, BusFrame::new(1, &[]), RATE, 0);
        }
        assert_eq!((bus.waiting(0), bus.lost), (MOST_WAITING, 3));
        bus.send(0, BusFrame::new(1, &[]), 0, 0);
        assert_eq!(bus.lost, 3, "a controller without a rate sends nothing");
    }
}
