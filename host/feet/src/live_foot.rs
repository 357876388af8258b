//! State of a foot that streams, as last received.

use std::borrow::Cow;
use std::sync::Arc;

use crate::decode::ContactRow;
use crate::decode::live::{FootKey, FootMessage, MessageBody};
use crate::decode::row::{ClockTurn, CommonClock};
use estimator_core::{Flag, Flags, Quaternion, Timestamp};
use wire::node::NmtState;
use wire::pdo::{Health, TEMPERATURE_STEP};
use wire::uart::HealthMessage;
use wire::{Counter, Emergency, Fault, Faults};

use crate::NewestSecond;
use crate::foot_clock::FootClock;

/// Time without a contact after which a foot is reported as silent, µs.
pub const SILENT_US: u64 = 500_000;

/// Longest time between a boot-up and the fault reported as its cause, µs.
const BOOT_US: u64 = 200_000;

/// State of a foot as last received. It is kept when the node id of a serial line becomes known.
#[derive(Clone, Debug, Default)]
pub struct LiveFoot {
    /// Line of reception; and node id, on a serial line from the first health message on.
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
    /// Last load sent to the foot, N, or that of the recording that is played.
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
        // On CAN, health frames carry the flags at 10 Hz.
        let saturated = Flags::NONE.with(Flag::Saturated).bits();
        let of_contact = if row.status.is_saturated() { saturated } else { 0 };
        let of_health = self.health.map(|health| health.flags | of_contact);
        row.flags = row.flags.or(of_health);
        self.missing = self.missing.saturating_add_signed(row.missing);
        self.second.take(row.timestamp, row.segment, at);
        self.stamp = match (row.turn, row.common) {
            (ClockTurn::NotYet, _) => self.clock.received(at),
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

    /// Returns whether the newest contact is more than half a second older than `now`, for display: a stall of
    /// this machine counts.
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
