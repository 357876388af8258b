//! Faults that come and go, the watchdog's food, and what a crash leaves behind.

use core::sync::atomic::{AtomicU8, Ordering};

use wire::Fault;
use wire::node::Crash;

/// Somebody who has to get on for the watchdog to be fed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Worker {
    /// A tick gave a sample, or a fault that says why not. Reported by the foot.
    Sampling,
    /// The estimator has taken it in. Reported by the foot.
    Estimator,
    /// The CAN task: it sent something, had nothing to send, or gave up waiting for the bus. Not
    /// whether anybody listens: a bus without other nodes is no reason to restart.
    Can,
    /// The UART task, likewise.
    Uart,
}

impl Worker {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Sampling, Self::Estimator, Self::Can, Self::Uart];

    const fn bit(self) -> u8 {
        1 << self as u8
    }
}

/// Who has got on since the watchdog was last fed.
///
/// The lowest task of all looks at [`all_got_on`](Self::all_got_on) some ten times as often as the
/// watchdog bites, and feeds it where it says so. That it runs at all shows that nothing above it
/// hogs the processor.
#[derive(Debug, Default)]
pub struct Progress(AtomicU8);

impl Progress {
    /// Nobody has got on yet.
    #[must_use]
    pub const fn new() -> Self {
        Self(AtomicU8::new(0))
    }

    /// `worker` has got on.
    pub fn report(&self, worker: Worker) {
        self.0.fetch_or(worker.bit(), Ordering::Relaxed);
    }

    /// Whether all have got on since this last said so: feed the watchdog. While it says no,
    /// what has been reported is kept.
    #[must_use]
    pub fn all_got_on(&self) -> bool {
        let all = Worker::ALL.into_iter().fold(0, |all, w| all | w.bit());
        let fed = self.0.load(Ordering::Relaxed) & all == all;
        if fed {
            self.0.store(0, Ordering::Relaxed);
        }
        fed
    }

    /// Those who have not got on: what a log can say before the watchdog bites.
    pub fn missing(&self) -> impl Iterator<Item = Worker> {
        let reported = self.0.load(Ordering::Relaxed);
        let missing = move |worker: &Worker| reported & worker.bit() == 0;
        Worker::ALL.into_iter().filter(missing)
    }
}

/// Says when something has been so for long enough, and when it has not been for long enough.
#[derive(Clone, Copy, Debug)]
pub struct Hysteresis {
    on_after: u16,
    off_after: u16,
    age: u16,
    is_on: bool,
}

impl Hysteresis {
    /// On after `on_after` times in a row, off after `off_after` times in a row without.
    #[must_use]
    pub const fn new(on_after: u16, off_after: u16) -> Self {
        Self {
            on_after,
            off_after,
            age: 0,
            is_on: false,
        }
    }

    /// Takes in how it is now; tells whether it is on.
    pub fn update(&mut self, now: bool) -> bool {
        self.age = if now == self.is_on {
            0
        } else {
            self.age.saturating_add(1)
        };
        let after = if self.is_on {
            self.off_after
        } else {
            self.on_after
        };
        if self.age >= after.max(1) {
            self.is_on = now;
            self.age = 0;
        }
        self.is_on
    }
}

/// Faults that are events, not states: each is kept up for a while after it last happened.
#[derive(Clone, Copy, Debug)]
pub struct Fading {
    /// By the faults' numbers.
    left: [u16; Fault::NUMBERS],
    /// How many are kept up: mostly none, which is to cost nothing.
    held: usize,
}

impl Default for Fading {
    fn default() -> Self {
        Self {
            left: [0; Fault::NUMBERS],
            held: 0,
        }
    }
}

impl Fading {
    /// It has happened: keep it up for this many ticks.
    pub fn hold(&mut self, fault: Fault, ticks: u16) {
        if let Some(left) = self.left.get_mut(usize::from(fault.number())) {
            self.held += usize::from(*left == 0);
            *left = ticks.max(1);
        }
    }

    /// It has not just happened but lasts: it is kept up until it is held anew.
    pub fn stay(&mut self, fault: Fault) {
        if let Some(left) = self.left.get_mut(usize::from(fault.number())) {
            self.held -= usize::from(*left > 0);
            *left = 0;
        }
    }

    /// One tick: hands those whose time is over to `clear`.
    pub fn tick(&mut self, mut clear: impl FnMut(Fault)) {
        if self.held == 0 {
            return;
        }
        for fault in Fault::ALL {
            let left = self.left.get_mut(usize::from(fault.number()));
            if let Some(left) = left.filter(|left| **left > 0) {
                *left -= 1;
                if *left == 0 {
                    self.held -= 1;
                    clear(fault);
                }
            }
        }
    }
}

/// Words of a [`CrashRecord`] in memory.
pub const CRASH_WORDS: usize = 4;

/// Marks a record, version 1.
const CRASH_MARK: u32 = u32::from_le_bytes(*b"fal\x01");

/// Why and where the program stopped: kept in memory that a reset leaves alone, and believed
/// afterwards only where its checksum fits, since such memory holds anything after power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CrashRecord {
    /// Why.
    pub reason: CrashReason,
    /// The program counter.
    pub program_counter: u32,
}

/// Why the program stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrashReason {
    /// It panicked.
    Panic = 1,
    /// The processor took a fault exception.
    HardFault = 2,
}

impl CrashRecord {
    /// The record as words; 0 in all of them is none.
    #[must_use]
    pub fn to_words(self) -> [u32; CRASH_WORDS] {
        let (reason, counter) = (self.reason as u32, self.program_counter);
        [CRASH_MARK, reason, counter, check(reason, counter)]
    }

    /// The record in these words, where they are one.
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
        Some(Self {
            reason,
            program_counter: counter,
        })
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

/// FNV-1a over both words: short, and every single flipped bit changes it.
fn check(reason: u32, counter: u32) -> u32 {
    let bytes = reason
        .to_le_bytes()
        .into_iter()
        .chain(counter.to_le_bytes());
    bytes.fold(0x811C_9DC5, |hash, byte| {
        (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_watchdog_is_fed_only_when_everybody_has_got_on() {
        for lazy in Worker::ALL {
            let progress = Progress::new();
            for worker in Worker::ALL.into_iter().filter(|worker| *worker != lazy) {
                progress.report(worker);
            }
            for _ in 0..3 {
                assert!(!progress.all_got_on(), "{lazy:?} did nothing");
            }
            assert_eq!(progress.missing().collect::<Vec<_>>(), [lazy]);
            progress.report(lazy);
            assert!(progress.all_got_on());
            assert!(!progress.all_got_on(), "nobody did anything since");
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
    fn a_fault_fades_some_time_after_it_last_happened() {
        let mut fading = Fading::default();
        fading.hold(Fault::LateTick, 3);
        let mut cleared = Vec::new();
        for tick in 0..10 {
            if tick == 2 {
                fading.hold(Fault::LateTick, 3);
            }
            fading.tick(|fault| cleared.push((tick, fault)));
        }
        assert_eq!(cleared, [(4, Fault::LateTick)]);
    }

    #[test]
    fn a_fault_that_lasts_does_not_fade() {
        let mut fading = Fading::default();
        let cleared_within = |fading: &mut Fading, ticks: u32| {
            let mut cleared = false;
            (0..ticks).for_each(|_| fading.tick(|_| cleared = true));
            cleared
        };
        fading.hold(Fault::CanBusOff, 3);
        fading.stay(Fault::CanBusOff);
        assert!(!cleared_within(&mut fading, 10));
        fading.hold(Fault::CanBusOff, 3);
        assert!(!cleared_within(&mut fading, 2));
        assert!(cleared_within(&mut fading, 1));
    }

    #[test]
    fn a_crash_record_survives_and_no_damaged_one_is_believed() {
        for reason in [CrashReason::Panic, CrashReason::HardFault] {
            let record = CrashRecord {
                reason,
                program_counter: 0x0800_1234,
            };
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
