//! State of a foot that streams, as last received.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::sync::Arc;

use estimator_core::{Flag, Flags, Quaternion, Timestamp};
use wire::node::NmtState;
use wire::pdo::{Health, TEMPERATURE_STEP};
use wire::uart::HealthMessage;
use wire::{Counter, Emergency, Fault, Faults};

use crate::decode::ContactRow;
use crate::decode::live::{FootKey, FootMessage, MessageBody};
use crate::decode::row::{ClockTurn, CommonClock};
use crate::foot_clock::FootClock;

/// Time without a contact after which a foot is reported as silent, µs.
pub const SILENT_US: u64 = 500_000;

/// Longest time between a boot-up and the fault reported as its cause, µs.
const BOOT_US: u64 = 200_000;

/// State of a foot as last received. It is kept when the node id of a serial line becomes known.
#[derive(Clone, Debug, Default)]
pub struct LiveFoot {
    /// Line on which the foot is received, and its node id. On a serial line the id is known from the first health
    /// message on.
    pub key: FootKey,
    /// Name of the node id or in the recording, if any.
    pub name: Option<Arc<str>>,
    /// Newest contact; on CAN with the flags of the newest health frame.
    pub row: Option<ContactRow>,
    /// Time of reception of the newest contact, and listening time at it, µs.
    pub contact: Option<(Timestamp, u64)>,
    /// Time of the newest contact or raw sample on the receiver's clock.
    pub stamp: Timestamp,
    /// Number of frames that did not arrive, by their sequence numbers; on CAN contacts.
    pub missing: u64,
    /// Number of frames dropped by the foot, as far as reported.
    pub dropped: u64,
    /// Last load sent to the foot, N, or the load in the recording that is played.
    pub load: Option<f32>,
    /// Newest orientation.
    pub orientation: Option<Quaternion>,
    /// Sensor temperature, °C.
    pub temperature: Option<f32>,
    /// NMT state.
    pub state: Option<NmtState>,
    /// Newest health frame; CAN only.
    pub health: Option<Health>,
    /// Newest state of the board; serial line only.
    pub board: Option<Box<HealthMessage>>,
    /// Active faults.
    pub faults: Faults,
    /// Time of the last start, and the fault that caused it, if any.
    pub started: Option<(Timestamp, Option<Fault>)>,
    /// Newest second of contacts.
    pub second: NewestSecond,
    clock: FootClock,
    /// Drop counter of the newest health frame since the last start, modulo 2⁸.
    drops: Option<u8>,
}

impl LiveFoot {
    pub(crate) fn new(key: FootKey, name: Option<Arc<str>>) -> Self {
        Self { key, name, ..Self::default() }
    }

    /// Applies a message received at `listened_us` of the listening time.
    pub(crate) fn apply(&mut self, FootMessage { at, body, .. }: &FootMessage, listened_us: u64) {
        match body {
            MessageBody::Contact(row) => {
                self.contact = Some((*at, listened_us));
                self.take_contact((**row).clone(), *at);
            }
            MessageBody::Raw(raw) => self.stamp = self.clock.time(raw.timestamp, *at),
            MessageBody::Board(board) => {
                self.state = Some(board.state);
                self.faults = board.faults;
                let celsius = board.temperature.value(TEMPERATURE_STEP);
                self.temperature = celsius.is_finite().then_some(celsius);
                let dropped = [Counter::CanDropped, Counter::UartDropped];
                let dropped = dropped.map(|counter| board.counters.get(counter));
                self.dropped = dropped.map(u64::from).iter().sum();
                self.board = Some(board.clone());
            }
            MessageBody::Health(health) => {
                let before = self.drops.replace(health.dropped);
                self.dropped = match before {
                    Some(before) => self.dropped + u64::from(health.dropped.wrapping_sub(before)),
                    None => u64::from(health.dropped),
                };
                self.health = Some(*health);
            }
            MessageBody::Emergency(emergency) => self.take_emergency(*emergency, *at),
            MessageBody::BootUp(faults) => {
                self.started = Some((*at, faults.iter().next()));
                self.faults = *faults;
                self.second.start_again();
                self.drops = None;
            }
            MessageBody::Heartbeat(state) => self.state = Some(*state),
            MessageBody::Load(newtons) => self.load = Some(*newtons),
            MessageBody::Log(_) | MessageBody::Answer(_) | MessageBody::Sdo(_) => {}
        }
    }

    fn take_contact(&mut self, mut row: ContactRow, at: Timestamp) {
        // A contact on CAN has no flags but `saturated`. The other flags come from the newest health frame, at 10 Hz.
        let saturated = Flags::NONE.with(Flag::Saturated).bits();
        let of_contact = if row.status.is_saturated() { saturated } else { 0 };
        let of_health = self.health.map(|health| health.flags | of_contact);
        row.flags = row.flags.or(of_health);
        self.missing = self.missing.saturating_add_signed(row.missing);
        if row.velocity_sigma.is_some() {
            // Only estimates of a host have a sigma. Their rate depends on the sensor.
            self.second.take_of_host(row.timestamp, row.segment, at);
        } else {
            self.second.take(row.timestamp, row.segment, at);
        }
        self.stamp = match (row.turn, row.common) {
            (ClockTurn::NotYet, _) => self.clock.received(at),
            // The time of the header is kept unchanged, because consumers match contacts with samples by it.
            (ClockTurn::Known, Some((time, CommonClock::Header))) => time,
            (ClockTurn::Known, Some((time, CommonClock::Sync))) => {
                self.clock.synchronised(row.timestamp, at, time)
            }
            (ClockTurn::Known, _) => self.clock.time(row.timestamp, at),
        };
        self.orientation = row.orientation.or(self.orientation);
        self.temperature = row.temperature.or(self.temperature);
        if let Some(load) = row.load {
            self.load = load.is_finite().then_some(load);
        }
        self.row = Some(row);
    }

    fn take_emergency(&mut self, Emergency { code, fault, .. }: Emergency, at: Timestamp) {
        let Some(fault) = fault else {
            return;
        };
        if code == 0 {
            self.faults = self.faults.without(fault);
            return;
        }
        self.faults = self.faults.with(fault);
        if let Some((started, reason @ None)) = &mut self.started
            && at.as_micros().saturating_sub(started.as_micros()) <= BOOT_US
        {
            *reason = Some(fault);
        }
    }

    /// Returns the name; without one the node id after `prefix`, or else the line.
    #[must_use]
    pub fn name_or(&self, prefix: &str) -> Cow<'_, str> {
        match (&self.name, self.key.node) {
            (Some(name), _) => Cow::Borrowed(name),
            (None, Some(node)) => Cow::Owned(format!("{prefix}{node}")),
            (None, None) => Cow::Borrowed(&self.key.line),
        }
    }

    /// Returns whether the newest contact came from several boards with one id.
    #[must_use]
    pub fn is_of_several_boards(&self) -> bool {
        let (newest, _) = self.contact.unwrap_or_default();
        self.second.is_of_several_boards(newest)
    }

    /// Returns whether the newest contact is more than half a second older than `now`, for display. A stall of this
    /// machine counts as silence.
    #[must_use]
    pub fn is_silent(&self, now: Timestamp) -> bool {
        let (newest, _) = self.contact.unwrap_or_default();
        now.as_micros().saturating_sub(newest.as_micros()) > SILENT_US
    }

    /// Returns whether no contact was received in half a second of listening until `listened_us`, for other
    /// programs. A stall of this machine does not count. A foot without a first contact is not silent.
    #[must_use]
    pub fn has_fallen_silent(&self, listened_us: u64) -> bool {
        let since_us = |(_, newest_us)| listened_us.saturating_sub(newest_us);
        self.contact.map(since_us) >= Some(SILENT_US)
    }

    /// Returns roll and pitch of the newest orientation, °.
    #[must_use]
    pub fn tilt_deg(&self) -> Option<[f32; 2]> {
        let Quaternion { w, x, y, z } = self.orientation?;
        let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
        let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
        Some([roll.to_degrees(), pitch.to_degrees()])
    }
}

/// Statistics of the newest second of a foot's contacts: rate, jitter, and whether only one board sends them.
///
/// Two boards with the same id are a common mistake on a new robot: every board without stored settings is
/// FL. Their messages are valid for neither foot.
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

    /// Adds a contact that was estimated on a host, whose rate may be higher than a board's.
    pub fn take_of_host(&mut self, made: Timestamp, segment: u32, received: Timestamp) {
        self.take(made, segment, received);
        self.several_us = None;
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
        // Both boards count modulo 0.66 s. The times are unwrapped as if each contact followed the one before it.
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
