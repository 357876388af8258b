//! State that a foot keeps about itself: faults with hysteresis or a hold time, liveness for the watchdog, costs, the
//! LED's state, the depth of the stack, and the record of a crash.

use core::sync::atomic::{AtomicBool, AtomicU8, AtomicU16, Ordering};

use wire::node::{Costs, Crash};
use wire::{Fault, Faults, Stage};

/// Part of the program that must be alive for the watchdog to be fed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Worker {
    /// A tick gave a sample, or a fault that explains its absence. Reported by the foot.
    Sampling,
    /// The estimator has processed the sample of a tick. Reported by the foot.
    Estimator,
    /// The CAN task sent a frame, had none to send, or waited for the bus until its deadline. A bus without other nodes
    /// does not cause a restart.
    Can,
    /// The UART task sent a batch, or had none to send.
    Uart,
}

impl Worker {
    /// All workers.
    pub const ALL: [Self; 4] = [Self::Sampling, Self::Estimator, Self::Can, Self::Uart];
}

/// Workers that have reported since the watchdog was last fed.
///
/// The task of the lowest priority calls [`all_alive`](Self::all_alive) ten times in the watchdog's period, and feeds
/// the watchdog if all are alive. If this task runs, no other task blocks the processor.
#[derive(Debug, Default)]
pub struct Liveness([AtomicBool; Worker::ALL.len()]);

impl Liveness {
    /// Creates the state without any report.
    #[must_use]
    pub const fn new() -> Self {
        Self([const { AtomicBool::new(false) }; Worker::ALL.len()])
    }

    /// Reports that `worker` is alive.
    pub fn report(&self, worker: Worker) {
        if let Some(is_alive) = self.0.get(worker as usize) {
            is_alive.store(true, Ordering::Relaxed);
        }
    }

    /// Returns whether all workers have reported since the last call that returned true. If so, clears the reports, and
    /// the caller feeds the watchdog. Otherwise keeps the reports.
    #[must_use]
    pub fn all_alive(&self) -> bool {
        let alive = self.0.iter().all(|is_alive| is_alive.load(Ordering::Relaxed));
        if alive {
            for is_alive in &self.0 {
                is_alive.store(false, Ordering::Relaxed);
            }
        }
        alive
    }
}

/// Condition that becomes true after enough consecutive observations, and false after enough consecutive observations
/// of the opposite.
#[derive(Clone, Copy, Debug)]
pub struct Hysteresis {
    on_after: u16,
    off_after: u16,
    age: u16,
    is_on: bool,
}

impl Hysteresis {
    /// Condition that is false at first. It becomes true after `on_after` consecutive `true`s, and false after
    /// `off_after` consecutive `false`s.
    #[must_use]
    pub const fn new(on_after: u16, off_after: u16) -> Self {
        Self { on_after, off_after, age: 0, is_on: false }
    }

    /// Updates the condition; returns whether it holds.
    pub fn update(&mut self, now: bool) -> bool {
        self.age = if now == self.is_on { 0 } else { self.age.saturating_add(1) };
        let after = if self.is_on { self.off_after } else { self.on_after };
        if self.age >= after.max(1) {
            self.is_on = now;
            self.age = 0;
        }
        self.is_on
    }
}

/// Keeps faults that are events active for a while after their last occurrence.
#[derive(Clone, Copy, Debug, Default)]
pub struct FaultLatch {
    /// Ticks left, by fault number.
    left: [u16; Fault::ALL.len()],
}

impl FaultLatch {
    /// Keeps a fault active for this number of ticks.
    pub fn hold_for(&mut self, fault: Fault, ticks: u16) {
        if let Some(left) = self.left.get_mut(usize::from(fault.number())) {
            *left = ticks.max(1);
        }
    }

    /// Keeps a fault active without a limit, until [`hold_for`](Self::hold_for) sets one.
    pub fn keep(&mut self, fault: Fault) {
        if let Some(left) = self.left.get_mut(usize::from(fault.number())) {
            *left = 0;
        }
    }

    /// Advances by one tick. Returns the faults whose time is over.
    pub fn tick(&mut self) -> Faults {
        let mut over = Faults::NONE;
        for fault in Fault::ALL {
            if let Some(left @ 1..) = self.left.get_mut(usize::from(fault.number())) {
                *left -= 1;
                if *left == 0 {
                    over = over.with(fault);
                }
            }
        }
        over
    }
}

/// A cost of the running program, measured by the board. The times are those of ticks with a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Time from the data-ready edge to the contact in its mailbox, µs.
    Mailbox,
    /// Time from the data-ready edge to the end of the tick's work, µs.
    Work,
    /// Depth of the stack, bytes.
    Stack,
}

/// Largest value of each cost since the start.
#[derive(Debug, Default)]
pub struct CostMeter([AtomicU16; 3]);

impl CostMeter {
    pub(crate) const fn new() -> Self {
        Self([const { AtomicU16::new(0) }; 3])
    }

    /// Raises the largest value of a cost to `value`, at most 65 535, if it is larger.
    pub fn raise_to(&self, cost: Cost, value: u32) {
        let value = value.min(u32::from(u16::MAX)) as u16;
        if let Some(largest) = self.0.get(cost as usize)
            && value > largest.load(Ordering::Relaxed)
        {
            largest.store(value, Ordering::Relaxed);
        }
    }

    /// Largest values so far.
    pub fn largest(&self) -> Costs {
        let [mailbox_us, work_us, stack_bytes] =
            self.0.each_ref().map(|value| value.load(Ordering::Relaxed));
        Costs { mailbox_us, work_us, stack_bytes }
    }
}

/// State that the LED shows: the stage of the foot, and whether a fault is active.
#[derive(Debug)]
pub struct Light(AtomicU8);

impl Light {
    /// Bit of an active fault. The other bits are the stage's code.
    const FAULT: u8 = 0x80;

    pub(crate) const fn new() -> Self {
        Self(AtomicU8::new(Stage::Starting.code()))
    }

    /// Shows a stage and its faults.
    pub(crate) fn show(&self, stage: Stage, faults: Faults) {
        let fault = if faults.is_empty() { 0 } else { Self::FAULT };
        self.0.store(stage.code() | fault, Ordering::Relaxed);
    }

    /// Times for which the LED is on and then off, ms.
    #[must_use]
    pub fn on_off_ms(&self) -> (u32, u32) {
        let light = self.0.load(Ordering::Relaxed);
        match Stage::from_code(light & !Self::FAULT).unwrap_or(Stage::Starting) {
            Stage::Starting | Stage::SelfTest => (50, 50),
            Stage::HoldStill => (250, 250),
            Stage::Recovering => (50, 150),
            Stage::Running if light & Self::FAULT != 0 => (900, 100),
            Stage::Running => (50, 950),
        }
    }
}

/// Depth of the stack, as far as it was checked. Start-up code paints the stack with a pattern, so words that have lost
/// the pattern were used.
#[derive(Debug, Default)]
pub struct StackDepth {
    /// Number of words, counted from the far end of the stack, that were found still painted in this round.
    painted: usize,
    /// Maximum depth so far, words.
    deepest: usize,
}

impl StackDepth {
    /// Words checked per call. The stack is checked piece by piece, because all of it in each call would load the processor.
    const PIECE: usize = 128;

    /// Checks the next piece of a stack of `words`. Returns the maximum depth, bytes, if it has changed. Starts again
    /// at the far end when it reaches a part known to be used.
    ///
    /// `is_painted` returns whether the word of a number still has its paint. The numbers are below `words`, and count
    /// from the far end.
    pub fn look(&mut self, words: usize, is_painted: impl Fn(usize) -> bool) -> Option<usize> {
        let unknown = words.saturating_sub(self.deepest);
        let end = unknown.min(self.painted + Self::PIECE);
        if let Some(used) = (self.painted..end).find(|word| !is_painted(*word)) {
            self.painted = 0;
            self.deepest = words - used;
            return Some(self.deepest * size_of::<u32>());
        }
        self.painted = if end == unknown { 0 } else { end };
        None
    }
}

/// Size of a [`CrashRecord`] in memory, words.
pub const CRASH_WORDS: usize = 4;

/// Mark of a record, version 1.
const CRASH_MARK: u32 = u32::from_le_bytes(*b"fal\x01");

/// Cause and location of a crash. The record is in memory that a reset does not change. Such memory is random after
/// power-up, so the record is valid only if its checksum matches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CrashRecord {
    /// Cause.
    pub reason: CrashReason,
    /// Program counter.
    pub program_counter: u32,
}

/// Reason why the program stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrashReason {
    /// A panic.
    Panic = 1,
    /// A fault exception of the processor.
    HardFault = 2,
}

impl CrashRecord {
    /// Encodes the record as words. A valid record never has all words 0.
    #[must_use]
    pub fn to_words(self) -> [u32; CRASH_WORDS] {
        let (reason, counter) = (self.reason as u32, self.program_counter);
        [CRASH_MARK, reason, counter, check(reason, counter)]
    }

    /// Decodes the record; `None` if the words are invalid.
    #[must_use]
    pub fn from_words([mark, reason, counter, sum]: [u32; CRASH_WORDS]) -> Option<Self> {
        if mark != CRASH_MARK || sum != check(reason, counter) {
            return None;
        }
        let reason = match reason {
            1 => CrashReason::Panic,
            2 => CrashReason::HardFault,
            _ => return None,
        };
        Some(Self { reason, program_counter: counter })
    }
}

impl From<CrashRecord> for Crash {
    fn from(record: CrashRecord) -> Self {
        Self {
            fault: match record.reason {
                CrashReason::Panic => Fault::Panic,
                CrashReason::HardFault => Fault::HardFault,
            },
            program_counter: record.program_counter,
        }
    }
}

/// FNV-1a over both words. It is short, and every flipped bit changes it.
fn check(reason: u32, counter: u32) -> u32 {
    let bytes = reason.to_le_bytes().into_iter().chain(counter.to_le_bytes());
    bytes.fold(0x811C_9DC5, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_watchdog_is_fed_only_when_all_workers_are_alive() {
        for stuck in Worker::ALL {
            let liveness = Liveness::new();
            for worker in Worker::ALL.into_iter().filter(|worker| *worker != stuck) {
                liveness.report(worker);
            }
            for _ in 0..3 {
                assert!(!liveness.all_alive(), "{stuck:?} did not report");
            }
            liveness.report(stuck);
            assert!(liveness.all_alive());
            assert!(!liveness.all_alive(), "no report since");
        }
    }

    #[test]
    fn hysteresis_needs_a_run_in_either_direction() {
        let mut hysteresis = Hysteresis::new(3, 2);
        let inputs = [1, 1, 0, 1, 1, 1, 0, 1, 0, 0, 1];
        let outputs = inputs.map(|now| u8::from(hysteresis.update(now == 1)));
        assert_eq!(outputs, [0, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0]);
    }

    #[test]
    fn a_fault_is_cleared_some_time_after_the_last_event() {
        let mut latch = FaultLatch::default();
        latch.hold_for(Fault::LateTick, 3);
        let mut cleared = Vec::new();
        for tick in 0..10 {
            if tick == 2 {
                latch.hold_for(Fault::LateTick, 3);
            }
            cleared.extend(latch.tick().iter().map(|fault| (tick, fault)));
        }
        assert_eq!(cleared, [(4, Fault::LateTick)]);
    }

    #[test]
    fn a_kept_fault_is_not_cleared() {
        let mut latch = FaultLatch::default();
        let cleared_within =
            |latch: &mut FaultLatch, ticks: u32| (0..ticks).any(|_| !latch.tick().is_empty());
        latch.hold_for(Fault::CanBusOff, 3);
        latch.keep(Fault::CanBusOff);
        assert!(!cleared_within(&mut latch, 10));
        latch.hold_for(Fault::CanBusOff, 3);
        assert!(!cleared_within(&mut latch, 2));
        assert!(cleared_within(&mut latch, 1));
    }

    #[test]
    fn each_fault_has_its_own_time_of_at_least_one_tick() {
        let mut latch = FaultLatch::default();
        latch.hold_for(Fault::LateTick, 0);
        latch.hold_for(Fault::UartOverrun, 2);
        latch.hold_for(Fault::CanOverrun, 4);
        latch.keep(Fault::GyroBias);
        let mut cleared = Vec::new();
        for tick in 1..10 {
            cleared.extend(latch.tick().iter().map(|fault| (tick, fault)));
        }
        let expected = [(1, Fault::LateTick), (2, Fault::UartOverrun), (4, Fault::CanOverrun)];
        assert_eq!(cleared, expected);
    }

    #[test]
    fn costs_keep_their_largest_value() {
        let costs = CostMeter::new();
        for (cost, value) in [
            (Cost::Mailbox, 75),
            (Cost::Mailbox, 74),
            (Cost::Stack, 1_000_000),
            (Cost::Work, 120),
            (Cost::Work, 121),
        ] {
            costs.raise_to(cost, value);
        }
        let largest = Costs { mailbox_us: 75, work_us: 121, stack_bytes: u16::MAX };
        assert_eq!(costs.largest(), largest);
    }

    #[test]
    fn stack_depth_is_that_of_the_farthest_word_used() {
        const WORDS: usize = 1_000;
        let mut depth = StackDepth::default();
        let mut looked = |used: usize| {
            let rounds = (0..20).filter_map(|_| depth.look(WORDS, |word| word < WORDS - used));
            rounds.last()
        };
        assert_eq!(looked(10), Some(40));
        assert_eq!(looked(10), None, "it has not changed");
        assert_eq!(looked(700), Some(2_800));
        assert_eq!(looked(300), None, "it is the maximum");
        assert_eq!(looked(WORDS), Some(4_000));
        assert_eq!(looked(WORDS), None);
    }

    #[test]
    fn a_crash_record_round_trips_and_damage_is_detected() {
        for reason in [CrashReason::Panic, CrashReason::HardFault] {
            let record = CrashRecord { reason, program_counter: 0x0800_1234 };
            let words = record.to_words();
            assert_eq!(CrashRecord::from_words(words), Some(record));
            for bit in 0..128 {
                let mut damaged = words;
                damaged[bit / 32] ^= 1 << (bit % 32);
                assert_eq!(CrashRecord::from_words(damaged), None, "bit {bit}");
            }
        }
        for blank in [[0; CRASH_WORDS], [u32::MAX; CRASH_WORDS]] {
            assert_eq!(CrashRecord::from_words(blank), None);
        }
    }
}
