//! Statistics of the newest second of a foot's contacts: rate, jitter, and whether only one board sends them.
//!
//! Two boards with the same id are a common mistake on a new robot: every board without stored settings is
//! FL. Their messages are valid for neither foot.

use std::collections::VecDeque;

use estimator_core::Timestamp;

/// Window of rate and jitter, µs.
const SECOND_US: u64 = 1_000_000;

/// Maximum contact rate of one board, Hz: 1000 Hz nominal, with a crystal error below 0.1 %. A higher rate
/// means several boards.
const MOST_HZ: f32 = 1200.0;

/// Number of contacts above which the rate is checked.
const FEWEST: usize = 200;

/// Maximum number of contacts of one board in a second that are out of order or too early. More mean several
/// boards; losses in a stall of this machine cause a few.
const MOST_DISORDERED: usize = 50;

/// Tolerance by which a contact's delay may fall below the least delay so far, µs.
const SOONER_US: i64 = 50_000;

/// Divisor of an interval for the maximum clock drift within it: 250 ppm.
const DRIFT: i64 = 4096;

/// Maximum number of starts of one board in a second; more mean several boards.
const MOST_STARTS: usize = 3;

/// Statistics of the newest second of a foot's contacts.
#[derive(Clone, Debug, Default)]
pub struct NewestSecond {
    /// Time of each contact on the foot's clock, and of its reception, µs.
    contacts: VecDeque<(u64, u64)>,
    /// Number of starts of the foot before the newest contact.
    segment: Option<u32>,
    /// Reception time of the newest contact, and least delay so far, µs.
    least: Option<(u64, i64)>,
    /// Reception times of contacts that were out of order or too early, µs.
    disordered: VecDeque<u64>,
    /// Reception times of the first contacts after a start, µs.
    starts: VecDeque<u64>,
    /// Time at which contacts of several boards were last detected, µs.
    several_us: Option<u64>,
}

impl NewestSecond {
    /// Adds a contact: its time on the foot's clock, the number of starts of the foot before it, and its
    /// reception time.
    pub fn take(&mut self, made: Timestamp, segment: u32, received: Timestamp) {
        let (made, received) = (made.as_micros(), received.as_micros());
        let last = self.segment.replace(segment);
        if last.is_some_and(|last| last != segment) {
            self.start_again();
            self.starts.push_back(received);
        }
        let last = self.contacts.back().map_or(made, |(last, _)| *last);
        let is_back = made < last;
        if self.is_too_soon(made, received) || is_back {
            self.disordered.push_back(received);
        }
        for times in [&mut self.disordered, &mut self.starts] {
            while let Some(first) = times.front()
                && received.saturating_sub(*first) > SECOND_US
            {
                times.pop_front();
            }
        }
        self.contacts.push_back((made, received));
        while let Some((first, _)) = self.contacts.front()
            && made.abs_diff(*first) > SECOND_US
        {
            self.contacts.pop_front();
        }
        let is_too_fast = self.rate_hz().is_some_and(|rate| rate > MOST_HZ);
        if self.disordered.len() > MOST_DISORDERED
            || self.starts.len() > MOST_STARTS
            || self.contacts.len() > FEWEST && is_too_fast
        {
            self.several_us = Some(received);
        }
    }

    /// Resets rate and jitter after a start of the foot.
    pub fn start_again(&mut self) {
        self.contacts.clear();
        self.least = None;
    }

    /// Returns whether a contact's delay is shorter than the foot's clock allows.
    fn is_too_soon(&mut self, made: u64, received: u64) -> bool {
        let delay = received.wrapping_sub(made).cast_signed();
        let Some((before, least)) = self.least.replace((received, delay)) else {
            return false;
        };
        let drift = received.saturating_sub(before).cast_signed() / DRIFT;
        let least = least.saturating_add(drift);
        self.least = Some((received, delay.min(least)));
        least.saturating_sub(delay) > SOONER_US
    }

    /// Rate of the contacts on the foot's clock, Hz.
    #[must_use]
    pub fn rate_hz(&self) -> Option<f32> {
        let ((first, _), (last, _)) = (self.contacts.front()?, self.contacts.back()?);
        let steps = self.contacts.len() - 1;
        let span = last.checked_sub(*first).filter(|span| *span > 0)?;
        Some(steps as f32 * 1.0e6 / span as f32)
    }

    /// Peak-to-peak variation of the delay from contact to reception, ms.
    #[must_use]
    pub fn jitter_ms(&self) -> Option<f32> {
        let delays = self.contacts.iter();
        let delays = delays.map(|(made, received)| received.wrapping_sub(*made) as i64);
        let (least, most) = (delays.clone().min()?, delays.max()?);
        Some((most - least) as f32 / 1000.0)
    }

    /// Returns whether several boards with this id sent the contacts, which are then valid for none of them.
    #[must_use]
    pub fn is_of_several_boards(&self, now: Timestamp) -> bool {
        let since = |seen| now.as_micros().saturating_sub(seen);
        self.several_us.is_some_and(|seen| since(seen) < SECOND_US)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contacts of a board at 1 kHz, as times on its clock, offset by `ahead_us`, and of reception.
    fn board(ahead_us: u64, count: u64) -> impl Iterator<Item = (Timestamp, Timestamp)> {
        let micros = Timestamp::from_micros;
        (0..count).map(move |k| (micros(1000 * k + ahead_us), micros(1000 * k + 9_000_300)))
    }

    fn seen(contacts: impl Iterator<Item = (Timestamp, Timestamp)>) -> Option<usize> {
        let mut second = NewestSecond::default();
        contacts.enumerate().find_map(|(index, (made, received))| {
            second.take(made, 0, received);
            second.is_of_several_boards(received).then_some(index)
        })
    }

    #[test]
    fn two_alternating_boards_are_detected_within_100_ms() {
        let two = |ahead_us| {
            let pairs = board(0, 3000).zip(board(ahead_us, 3000));
            pairs.flat_map(|(one, other)| [one, other])
        };
        for ahead_us in [7, 400, 70_000, 9_000_000] {
            let index = seen(two(ahead_us));
            assert!(index.is_some_and(|index| index <= 200), "{ahead_us}: {index:?}");
        }
        assert_eq!(seen(board(0, 10_000)), None);
        // A board that was reset once, and one that lost every second contact.
        assert_eq!(seen(board(5_000_000, 2000).chain(board(0, 2000))), None);
        assert_eq!(seen(board(0, 5000).step_by(2)), None);
    }

    #[test]
    fn two_boards_decoded_as_a_fast_clock_are_detected() {
        // Times modulo 0.66 s, unwrapped as if each followed the one before.
        let contacts = board(0, 3000).flat_map(|(made, received)| {
            let turns = made.as_micros() / 1000 * 655_360;
            [0, 137_000]
                .map(|ahead| (Timestamp::from_micros(made.as_micros() + turns + ahead), received))
        });
        let index = seen(contacts);
        assert!(index.is_some_and(|index| index <= 200), "{index:?}");
    }

    #[test]
    fn stalled_receiver_is_not_taken_for_several_boards() {
        // The receiver stalls every third second: the first half is received when it ends, and the rest is lost.
        let contacts = board(0, 30_000).filter_map(|(made, received)| {
            let (since, in_stall) =
                (made.as_micros() % 1_000_000, made.as_micros() / 1_000_000 % 3 == 1);
            if !in_stall {
                return Some((made, received));
            }
            let end_us = received.as_micros() + 1_000_000 - since;
            (since < 500_000).then_some((made, Timestamp::from_micros(end_us)))
        });
        assert_eq!(seen(contacts), None);
    }

    #[test]
    fn warning_ends_after_a_second_of_one_board_alone() {
        let mut second = NewestSecond::default();
        for ((one, at), (other, _)) in board(0, 500).zip(board(70_000, 500)) {
            second.take(one, 0, at);
            second.take(other, 0, at);
        }
        let mut still = 0;
        for (made, at) in board(0, 5000).skip(500) {
            second.take(made, 0, at);
            still += usize::from(second.is_of_several_boards(at));
        }
        assert!((1000..2100).contains(&still), "{still}");
    }

    #[test]
    fn rate_and_jitter_cover_the_newest_second() {
        let mut second = NewestSecond::default();
        for (made, received) in board(0, 3000).step_by(2) {
            second.take(made, 0, received);
        }
        assert_eq!(second.rate_hz(), Some(500.0));
        assert_eq!(second.jitter_ms(), Some(0.0));
        second.start_again();
        assert_eq!(second.rate_hz(), None);
    }
}
