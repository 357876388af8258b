//! A foot as it is now.

use std::collections::VecDeque;
use std::sync::Arc;

use decode::Row;
use decode::live::FootKey;
use estimator_core::{Quaternion, Timestamp};
use wire::node::State;
use wire::{Fault, Faults};

/// Probabilities that are kept for the curve: 16 s at 1 kHz.
const CURVE: usize = 1 << 14;

/// The time over which rate and jitter are taken, µs.
const SECOND_US: u64 = 1_000_000;

/// A fault that comes as soon after a boot-up was known before: it says why the foot has started, µs.
const BOOT_US: u64 = 200_000;

/// A foot that sends no contact for so long is silent, µs.
const SILENT_US: u64 = 500_000;

/// A board makes 1000 contacts a second, and its crystal is off by less than a thousandth: more than this are of
/// several boards, Hz.
const MOST_HZ: f32 = 1200.0;

/// The number of contacts from which on a rate is believed.
const FEWEST: usize = 200;

/// A board sends its contacts in order. So many in a second that are not are of several boards.
const MOST_DISORDERED: usize = 50;

/// A board takes longer to start than a second divided by this: clocks that begin again more often are of several.
const MOST_STARTS: usize = 3;

/// A foot.
#[derive(Clone, Debug)]
pub struct Foot {
    /// Where it is heard.
    pub key: FootKey,
    /// What it is called: its name, or its id, or its line.
    pub name: Arc<str>,
    /// Its newest contact.
    pub row: Option<Row>,
    /// When anything was last received of it.
    pub heard: Timestamp,
    /// Contacts that are missing between those that came.
    pub missing: u64,
    /// Frames that the foot itself has dropped, as far as it said so.
    pub dropped: u64,
    /// The newest load that it was told, N.
    pub load: Option<f32>,
    /// Its newest orientation as roll and pitch, °.
    pub tilt: Option<[f32; 2]>,
    /// Its sensor's temperature, °C.
    pub temperature: Option<f32>,
    /// Its NMT state.
    pub state: Option<State>,
    /// What the board is doing, where it says so.
    pub stage: Option<&'static str>,
    /// Its active faults.
    pub faults: Faults,
    /// When it has last started, and the fault that caused it, where one did.
    pub started: Option<(Timestamp, Option<Fault>)>,
    curve: VecDeque<f32>,
    /// The newest second: when each contact was made on the foot's clock, and received, µs.
    second: VecDeque<(u64, u64)>,
    /// When contacts of the newest second were received that were made before the one before, µs.
    disordered: VecDeque<u64>,
    /// When its clock began again in the newest second, µs.
    starts: VecDeque<u64>,
    /// When contacts were last seen that one board alone does not send, µs.
    several_us: Option<u64>,
    /// The counter of drops in the newest health frame, modulo 2⁸.
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
            faults: Faults::NONE,
            started: None,
            curve: VecDeque::new(),
            second: VecDeque::new(),
            disordered: VecDeque::new(),
            starts: VecDeque::new(),
            several_us: None,
            drops: None,
        }
    }

    pub(super) fn contact(&mut self, row: Row, at: Timestamp) {
        let (made, received) = (row.timestamp.as_micros(), at.as_micros());
        if self
            .row
            .as_ref()
            .is_some_and(|last| last.segment != row.segment)
        {
            self.second.clear();
            self.starts.push_back(received);
        }
        if let Some((last, _)) = self.second.back()
            && let Some(period) = self.period_us()
        {
            // A step of one period and a half has lost one; a step back was counted too far before.
            let step = made.wrapping_sub(*last) as i64;
            let period = period.cast_signed();
            let periods = step.saturating_add(period / 2).div_euclid(period);
            self.missing = self.missing.saturating_add_signed(periods - 1);
        }
        if self.second.back().is_some_and(|(last, _)| made < *last) {
            self.disordered.push_back(received);
        }
        for times in [&mut self.disordered, &mut self.starts] {
            while let Some(first) = times.front()
                && received.saturating_sub(*first) > SECOND_US
            {
                times.pop_front();
            }
        }
        self.second.push_back((made, received));
        while let Some((first, _)) = self.second.front()
            && made.saturating_sub(*first) > SECOND_US
        {
            self.second.pop_front();
        }
        let is_too_fast = self.rate_hz().is_some_and(|rate| rate > MOST_HZ);
        if self.disordered.len() > MOST_DISORDERED
            || self.starts.len() > MOST_STARTS
            || self.second.len() > FEWEST && is_too_fast
        {
            self.several_us = Some(received);
        }
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

    /// Takes in the counter of drops of a health frame.
    pub(super) fn count_drops(&mut self, counter: u8) {
        if let Some(before) = self.drops.replace(counter) {
            self.dropped += u64::from(counter.wrapping_sub(before));
        } else {
            self.dropped = u64::from(counter);
        }
    }

    pub(super) fn boot_up(&mut self, at: Timestamp) {
        self.started = Some((at, None));
        self.faults = Faults::NONE;
        self.second.clear();
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

    /// The time from one contact to the next, µs: the mean in the newest second of those that have lost
    /// none.
    fn period_us(&self) -> Option<u64> {
        let times = self.second.iter().zip(self.second.iter().skip(1));
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
        let ((first, _), (last, _)) = (self.second.front()?, self.second.back()?);
        let steps = self.second.len() - 1;
        let span = last.checked_sub(*first).filter(|span| *span > 0)?;
        Some(steps as f32 * 1.0e6 / span as f32)
    }

    /// By how much the delay from contact to reception varied in the newest second, ms.
    #[must_use]
    pub fn jitter_ms(&self) -> Option<f32> {
        let delays = self.second.iter();
        let delays = delays.map(|(made, received)| received.wrapping_sub(*made) as i64);
        let (least, most) = (delays.clone().min()?, delays.max()?);
        Some((most - least) as f32 / 1000.0)
    }

    /// Whether contacts of the newest second are those of several boards with one id: they say nothing about any.
    #[must_use]
    pub fn is_of_several_boards(&self, now: Timestamp) -> bool {
        let since = |seen| now.as_micros().saturating_sub(seen);
        self.several_us.is_some_and(|seen| since(seen) < SECOND_US)
    }

    /// Whether no contact has come for half a second.
    #[must_use]
    pub fn is_silent(&self, now: Timestamp) -> bool {
        now.as_micros().saturating_sub(self.heard.as_micros()) > SILENT_US
    }

    /// The curve of the probability as `columns` values, the newest last, each the least of its share:
    /// a short doubt shows.
    #[must_use]
    pub fn curve(&self, columns: usize) -> Vec<f32> {
        let share = CURVE.div_ceil(columns.max(1)).min(32);
        let skipped = self.curve.len().saturating_sub(share * columns);
        let newest: Vec<f32> = self.curve.iter().skip(skipped).copied().collect();
        let least = |share: &[f32]| share.iter().copied().fold(1.0, f32::min);
        newest.chunks(share).map(least).collect()
    }
}

/// Roll and pitch of an orientation, °.
fn tilt_deg(q: Quaternion) -> [f32; 2] {
    let Quaternion { w, x, y, z } = q;
    let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
    let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
    [roll.to_degrees(), pitch.to_degrees()]
}
