//! The newest second of a foot's contacts: how many come, how evenly, and whether one board alone sends them.
//!
//! Two boards with one id are a common mistake on a new robot: a board that has forgotten its settings is
//! FL, and so is the next. What they send says nothing about either foot.

use std::collections::VecDeque;

use estimator_core::Timestamp;

/// The time over which rate and jitter are taken, µs.
const SECOND_US: u64 = 1_000_000;

/// A foot that sends no contact for so long is silent, µs.
pub const SILENT_US: u64 = 500_000;

/// A board makes 1000 contacts a second, and its crystal is off by less than a thousandth: more than this are of
/// several boards, Hz.
const MOST_HZ: f32 = 1200.0;

/// The number of contacts from which on a rate is believed.
const FEWEST: usize = 200;

/// A board sends its contacts in order, and its clock does not run ahead of the receiver's. More contradictions
/// than this in a second mean several boards; losses in a stall of this machine cause a few.
const MOST_DISORDERED: usize = 50;

/// By how much sooner after it was made than any before a contact may come, µs.
const SOONER_US: i64 = 50_000;

/// A part of a time by which clocks drift at most: 250 ppm.
const DRIFT: i64 = 4096;

/// A board takes longer to start than a second divided by this: clocks that begin again more often are of several.
const MOST_STARTS: usize = 3;

/// The newest second of a foot's contacts.
#[derive(Clone, Debug, Default)]
pub struct NewestSecond {
    /// When each contact was made on the foot's clock, and received, µs.
    contacts: VecDeque<(u64, u64)>,
    /// How often the foot had started before the newest contact.
    segment: Option<u32>,
    /// The newest contact's time of reception, µs, and the least delay so far.
    least: Option<(u64, i64)>,
    /// When contacts were received that were made before the one before, or that came too soon, µs.
    disordered: VecDeque<u64>,
    /// When its clock began again, µs.
    starts: VecDeque<u64>,
    /// When contacts were last seen that one board alone does not send, µs.
    several_us: Option<u64>,
}

impl NewestSecond {
    /// Takes in a contact: when it was made on the foot's clock, how often the foot had started before,
    /// and when it was received.
    pub fn take(&mut self, made: Timestamp, segment: u32, received: Timestamp) {
        let (made, received) = (made.as_micros(), received.as_micros());
        if self
            .segment
            .replace(segment)
            .is_some_and(|last| last != segment)
        {
            self.start_again();
            self.starts.push_back(received);
        }
        let is_back = self.contacts.back().is_some_and(|(last, _)| made < *last);
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

    /// The foot has started: its rate and jitter begin again.
    pub fn start_again(&mut self) {
        self.contacts.clear();
        self.least = None;
    }

    /// Whether a contact comes sooner after it was made than its foot's clock allows.
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

    /// How many contacts are missing before one that was made at `made`; less than 0 where it is older than
    /// the newest. `None` before there are two. It looks at all contacts of the second.
    #[must_use]
    pub fn missing_before(&self, made: Timestamp) -> Option<i64> {
        let (last, _) = self.contacts.back()?;
        let period = self.period_us()?.cast_signed();
        // A step of one period and a half has lost one; a step back was counted too far before.
        let step = made.as_micros().wrapping_sub(*last) as i64;
        let periods = step.saturating_add(period / 2).div_euclid(period);
        Some(periods.saturating_sub(1))
    }

    /// The time from one contact to the next, µs: the mean of those that have lost none.
    fn period_us(&self) -> Option<u64> {
        let times = self.contacts.iter().zip(self.contacts.iter().skip(1));
        let steps = times.map(|((from, _), (to, _))| to.saturating_sub(*from));
        let steps = steps.filter(|step| *step > 0);
        // The time of a sample is that of its data-ready edge: a step varies by a sixth.
        let longest = steps.clone().min()?.saturating_mul(3) / 2;
        let (sum, count) = steps
            .filter(|step| *step <= longest)
            .fold((0_u64, 0_u64), |(sum, count), step| (sum + step, count + 1));
        sum.checked_div(count)
    }

    /// Contacts in a second, on the foot's clock.
    #[must_use]
    pub fn rate_hz(&self) -> Option<f32> {
        let ((first, _), (last, _)) = (self.contacts.front()?, self.contacts.back()?);
        let steps = self.contacts.len() - 1;
        let span = last.checked_sub(*first).filter(|span| *span > 0)?;
        Some(steps as f32 * 1.0e6 / span as f32)
    }

    /// By how much the delay from contact to reception varied, ms.
    #[must_use]
    pub fn jitter_ms(&self) -> Option<f32> {
        let delays = self.contacts.iter();
        let delays = delays.map(|(made, received)| received.wrapping_sub(*made) as i64);
        let (least, most) = (delays.clone().min()?, delays.max()?);
        Some((most - least) as f32 / 1000.0)
    }

    /// Whether its contacts are those of several boards with one id: they say nothing about any.
    #[must_use]
    pub fn is_of_several_boards(&self, now: Timestamp) -> bool {
        let since = |seen| now.as_micros().saturating_sub(seen);
        self.several_us.is_some_and(|seen| since(seen) < SECOND_US)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Contacts of a board at 1 kHz whose clock is ahead of the receiver's: when made, and when received.
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
    fn two_boards_in_turns_are_seen_within_a_tenth_of_a_second_and_one_never_is() {
        let two = |ahead_us| {
            let pairs = board(0, 3000).zip(board(ahead_us, 3000));
            pairs.flat_map(|(one, other)| [one, other])
        };
        for ahead_us in [7, 400, 70_000, 9_000_000] {
            let index = seen(two(ahead_us));
            assert!(
                index.is_some_and(|index| index <= 200),
                "{ahead_us}: {index:?}"
            );
        }
        assert_eq!(seen(board(0, 10_000)), None);
        // One that was reset once, and one of which half is missing.
        assert_eq!(seen(board(5_000_000, 2000).chain(board(0, 2000))), None);
        assert_eq!(seen(board(0, 5000).step_by(2)), None);
    }

    #[test]
    fn two_boards_that_a_decoder_takes_for_a_fast_clock_are_seen() {
        // Their times modulo 0.66 s, counted as if each followed the one before.
        let contacts = board(0, 3000).flat_map(|(made, received)| {
            let turns = made.as_micros() / 1000 * 655_360;
            [0, 137_000].map(|ahead| {
                (
                    Timestamp::from_micros(made.as_micros() + turns + ahead),
                    received,
                )
            })
        });
        let index = seen(contacts);
        assert!(index.is_some_and(|index| index <= 200), "{index:?}");
    }

    #[test]
    fn what_a_stalled_machine_has_kept_is_of_one_board() {
        // Every third second stands still: its first half comes at its end, the rest is lost.
        let contacts = board(0, 30_000).filter_map(|(made, received)| {
            let (since, in_stall) = (
                made.as_micros() % 1_000_000,
                made.as_micros() / 1_000_000 % 3 == 1,
            );
            match in_stall {
                true if since >= 500_000 => None,
                true => Some((
                    made,
                    Timestamp::from_micros(received.as_micros() + 1_000_000 - since),
                )),
                false => Some((made, received)),
            }
        });
        assert_eq!(seen(contacts), None);
    }

    #[test]
    fn after_a_second_of_one_board_alone_it_is_believed() {
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
    fn rate_jitter_and_what_is_missing_are_those_of_the_newest_second() {
        let mut second = NewestSecond::default();
        for (made, received) in board(0, 3000).step_by(2) {
            second.take(made, 0, received);
        }
        assert_eq!(second.rate_hz(), Some(500.0));
        assert_eq!(second.jitter_ms(), Some(0.0));
        let after = |second: &NewestSecond, ms: u64| {
            second.missing_before(Timestamp::from_micros(2_998_000 + 1000 * ms))
        };
        let missing = [2, 4, 8].map(|ms| after(&second, ms));
        assert_eq!(missing, [Some(0), Some(1), Some(3)]);
        second.start_again();
        assert_eq!((second.rate_hz(), after(&second, 2)), (None, None));
    }
}
