//! State of one foot.

use std::collections::VecDeque;
use std::sync::Arc;

use decode::Row;
use decode::live::FootKey;
use estimator_core::{Flag, Flags, Quaternion, Timestamp};
use live::NewestSecond;
use live::newest_second::SILENT_US;
use wire::node::State;
use wire::{Fault, Faults};

/// Number of probabilities kept for the curve: 16 s at 1 kHz.
const CURVE: usize = 1 << 14;

/// Longest time between a boot-up and the fault reported as its cause, µs.
const BOOT_US: u64 = 200_000;

/// State of one foot as last received.
#[derive(Clone, Debug)]
pub struct Foot {
    /// Line and node id on which the foot is received.
    pub key: FootKey,
    /// Display name: the name, else the node id, else the line.
    pub name: Arc<str>,
    /// Newest contact.
    pub row: Option<Row>,
    /// Time of the last arrival from the foot.
    pub heard: Timestamp,
    /// Number of contacts missing from the sequence.
    pub missing: u64,
    /// Number of frames dropped by the foot, as far as reported.
    pub dropped: u64,
    /// Last load sent to the foot, N.
    pub load: Option<f32>,
    /// Roll and pitch of the newest orientation, °.
    pub tilt: Option<[f32; 2]>,
    /// Sensor temperature, °C.
    pub temperature: Option<f32>,
    /// NMT state.
    pub state: Option<State>,
    /// Stage of the board, if reported.
    pub stage: Option<&'static str>,
    /// Flags of the estimate in the newest health frame, as bits.
    pub flags: Option<u8>,
    /// Active faults.
    pub faults: Faults,
    /// Time of the last start, and the fault that caused it, if any.
    pub started: Option<(Timestamp, Option<Fault>)>,
    curve: VecDeque<f32>,
    second: NewestSecond,
    /// Drop counter of the newest health frame, modulo 2⁸.
    drops: Option<u8>,
}

impl Foot {
    pub(super) fn new(key: FootKey, name: Arc<str>) -> Self {
        Self {
            key,
            name,
            row: None,
            heard: Timestamp::default(),
            missing: 0,
            dropped: 0,
            load: None,
            tilt: None,
            temperature: None,
            state: None,
            stage: None,
            flags: None,
            faults: Faults::NONE,
            started: None,
            curve: VecDeque::new(),
            second: NewestSecond::default(),
            drops: None,
        }
    }

    pub(super) fn contact(&mut self, mut row: Row, at: Timestamp) {
        // On CAN, health frames carry the flags at 10 Hz.
        let saturated = match row.status.is_saturated() {
            true => Flags::NONE.with(Flag::Saturated).bits(),
            false => 0,
        };
        row.flags = row.flags.or(self.flags.map(|flags| flags | saturated));
        if let Some(last) = &self.row
            && last.segment == row.segment
            && let Some(missing) = self.second.missing_before(row.timestamp)
        {
            self.missing = self.missing.saturating_add_signed(missing);
        }
        self.second.take(row.timestamp, row.segment, at);
        if self.curve.len() == CURVE {
            self.curve.pop_front();
        }
        self.curve.push_back(row.stable);
        if let Some(q) = row.orientation {
            self.tilt = Some(tilt_deg(q));
        }
        self.temperature = row.temperature.or(self.temperature);
        self.row = Some(row);
    }

    /// Updates the drop count from the counter of a health frame.
    pub(super) fn count_drops(&mut self, counter: u8) {
        if let Some(before) = self.drops.replace(counter) {
            self.dropped += u64::from(counter.wrapping_sub(before));
        } else {
            self.dropped = u64::from(counter);
        }
    }

    pub(super) fn boot_up(&mut self, at: Timestamp, faults: Faults) {
        self.started = Some((at, faults.iter().next()));
        self.faults = faults;
        self.second.start_again();
        self.drops = None;
    }

    pub(super) fn raise(&mut self, fault: Fault, at: Timestamp) {
        self.faults = self.faults.with(fault);
        if let Some((started, reason @ None)) = &mut self.started
            && at.as_micros().saturating_sub(started.as_micros()) <= BOOT_US
        {
            *reason = Some(fault);
        }
    }

    /// Returns the newest second of contacts.
    #[must_use]
    pub const fn second(&self) -> &NewestSecond {
        &self.second
    }

    /// Returns whether no contact has arrived for half a second.
    #[must_use]
    pub fn is_silent(&self, now: Timestamp) -> bool {
        now.as_micros().saturating_sub(self.heard.as_micros()) > SILENT_US
    }

    /// Returns the curve of the probability as `columns` values, newest last. Each value is the minimum of its
    /// share, so that short dips stay visible.
    #[must_use]
    pub fn curve(&self, columns: usize) -> Vec<f32> {
        let share = CURVE.div_ceil(columns.max(1)).min(32);
        let skipped = self.curve.len().saturating_sub(share * columns);
        let newest: Vec<f32> = self.curve.iter().skip(skipped).copied().collect();
        let least = |share: &[f32]| share.iter().copied().fold(1.0, f32::min);
        newest.chunks(share).map(least).collect()
    }
}

/// Returns roll and pitch of an orientation, °.
fn tilt_deg(q: Quaternion) -> [f32; 2] {
    let Quaternion { w, x, y, z } = q;
    let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
    let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
    [roll.to_degrees(), pitch.to_degrees()]
}
