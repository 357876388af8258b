//! The time of a contact on its foot's clock, from the short time of its frame.

use estimator_core::Timestamp;
use wire::pdo::{ClockReading, ShortTime, TIME_STEP_US};

use super::pace::Pace;

/// Time between two frames from which the log's clock is taken to have been set, µs: one day.
const LONGEST_BRIDGE_US: i64 = 86_400_000_000;

/// Largest step back of frames out of order, µs; a larger one means that the log's clock was set back.
const LONGEST_RETURN_US: i64 = -1_000_000;

/// Limit of a step back if the log has no times, µs: a step that falls short of a full turn by less than
/// this is an overtaken frame.
const OVERTAKEN_US: i64 = TURN_US / 8;

/// Permitted difference between the clocks of foot and log, µs: frames wait in adapters and queues.
const TOLERANCE_US: i64 = TURN_US / 4;

/// Step and turn of the foot's short clock, µs.
const STEP_US: i64 = TIME_STEP_US as i64;
const TURN_US: i64 = STEP_US << 16;

/// Time and number of a contact.
#[derive(Clone, Copy)]
pub(super) struct Mark {
    /// Time on the foot's clock, with its turns counted, µs.
    pub(super) micros: u64,
    pub(super) short: ShortTime,
    pub(super) sequence: u8,
    /// `None` if the log has no times.
    logged_us: Option<u64>,
}

/// Time between two contacts on the foot's clock, and whether the log's clock agrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Elapsed {
    /// Both clocks agree on this time, µs.
    Agreed(i64),
    /// The nearest time that the foot's clock allows, µs, is far from the log's.
    Contradicted(i64),
    /// The log's clock was set in between; time on the foot's clock alone, µs, less than a turn.
    Unbridged(i64),
}

impl Elapsed {
    /// Time on the foot's clock, µs.
    pub(super) const fn micros(self) -> i64 {
        let (Self::Agreed(elapsed) | Self::Contradicted(elapsed) | Self::Unbridged(elapsed)) = self;
        elapsed
    }

    /// Returns whether both clocks agree on a time forwards of less than half a turn.
    pub(super) fn is_within_a_turn(self) -> bool {
        matches!(self, Self::Agreed(elapsed) if (0..TURN_US / 2).contains(&elapsed))
    }

    /// The same time, or the next later one on the short clock that is not negative, as agreed.
    pub(super) fn forward(self) -> Self {
        Self::Agreed(match self.micros() {
            elapsed @ ..0 => elapsed.rem_euclid(TURN_US),
            elapsed => elapsed,
        })
    }
}

/// Difference of a foot's full clock from the counted time of a contact, in steps modulo 2³²: whole turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Ahead(u32);

impl Ahead {
    /// Difference from a time that counts from an assumed turn, µs: at least 0.
    pub(super) fn first_us(self) -> i64 {
        i64::from(self.0) * STEP_US
    }

    /// Difference from a time that is right but for some turns, µs: less than six hours.
    pub(super) fn nearest_us(self) -> i64 {
        i64::from(self.0 as i32) * STEP_US
    }
}

impl Mark {
    /// The first contact of a foot; its short clock is assumed to be in its first turn.
    pub(super) fn first(short: ShortTime, sequence: u8, at: Option<Timestamp>) -> Self {
        Self {
            micros: u64::from(short.0) * TIME_STEP_US,
            short,
            sequence,
            logged_us: at.map(Timestamp::as_micros),
        }
    }

    /// A contact `elapsed` µs later.
    pub(super) fn after(
        self,
        elapsed: i64,
        short: ShortTime,
        sequence: u8,
        at: Option<Timestamp>,
    ) -> Self {
        Self {
            micros: self.micros.saturating_add_signed(elapsed),
            ..Self::first(short, sequence, at)
        }
    }

    /// Time to a contact of this number at `short`, µs, negative if it is older, if its number agrees with its
    /// time at the foot's `pace`: no turn of the clock is missing in between. Another turn would need a loss
    /// of a multiple of 256 contacts that lasts whole turns, 16.384 s at 1 kHz.
    pub(super) fn by_number(self, short: ShortTime, sequence: u8, pace: Pace) -> Option<i64> {
        let contacts = i64::from(sequence.wrapping_sub(self.sequence) as i8);
        let steps = self.steps_us(short);
        let elapsed = if contacts < 0 { steps - TURN_US } else { steps };
        (contacts != 0 && pace.agrees(elapsed, contacts)).then_some(elapsed)
    }

    /// Time to a contact at `short`, logged at `at`. The foot's clock wraps every 655.36 ms; the log's clock
    /// determines the turn, forwards or backwards. If the log has no times, the time is less than a turn.
    pub(super) fn elapsed(self, short: ShortTime, at: Option<Timestamp>) -> Elapsed {
        let steps = self.steps_us(short);
        let (Some(at), Some(before)) = (at, self.logged_us) else {
            let turns = i64::from(steps > TURN_US - OVERTAKEN_US);
            return Elapsed::Agreed(steps - turns * TURN_US);
        };
        // Signed: a log may run backwards.
        let logged = at.as_micros().wrapping_sub(before) as i64;
        if !(LONGEST_RETURN_US..LONGEST_BRIDGE_US).contains(&logged) {
            return Elapsed::Unbridged(steps);
        }
        let turns = (logged - steps + TURN_US / 2).div_euclid(TURN_US);
        let elapsed = steps + turns * TURN_US;
        match (elapsed - logged).abs() <= TOLERANCE_US {
            true => Elapsed::Agreed(elapsed),
            false => Elapsed::Contradicted(elapsed),
        }
    }

    /// Returns whether the log's clock advanced by about `elapsed` to `at`, µs; true if the log has no times.
    pub(super) fn is_logged_after(self, elapsed: i64, at: Option<Timestamp>) -> bool {
        let (Some(at), Some(before)) = (at, self.logged_us) else {
            return true;
        };
        let logged = at.as_micros().wrapping_sub(before) as i64;
        logged.abs_diff(elapsed) <= TOLERANCE_US.unsigned_abs()
    }

    /// Difference of the full clock in `reading`, less than half a turn from this contact, from its counted time.
    pub(super) const fn behind(self, reading: ClockReading) -> Ahead {
        let since = self.short.0.wrapping_sub(reading.time.short().0) as i16;
        let full = reading.time.0.wrapping_add_signed(since as i32);
        Ahead(full.wrapping_sub((self.micros / TIME_STEP_US) as u32))
    }

    /// Moves the counted time by whole turns, µs.
    pub(super) const fn shift(&mut self, shift_us: i64) {
        self.micros = self.micros.saturating_add_signed(shift_us);
    }

    /// Counted time of `reading`, µs, which is less than half a turn from this contact.
    pub(super) fn time_of(self, reading: ClockReading) -> Option<u64> {
        let since = reading.time.short().0.wrapping_sub(self.short.0) as i16;
        self.micros.checked_add_signed(i64::from(since) * STEP_US)
    }

    /// Time to `short` within a turn of the short clock, µs.
    fn steps_us(self, short: ShortTime) -> i64 {
        i64::from(short.0.wrapping_sub(self.short.0)) * STEP_US
    }
}
