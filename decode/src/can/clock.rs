//! The time of a contact, from its foot's short clock and from the log's.

use estimator_core::Timestamp;
use wire::pdo::{ShortTime, TIME_STEP_US};

/// Time between two frames from which the log's clock is taken to have been set, µs: one day.
pub(super) const LONGEST_BRIDGE_US: i64 = 86_400_000_000;

/// Largest step back of frames out of order, µs; a larger one means that the log's clock was set back.
pub(super) const LONGEST_RETURN_US: i64 = -1_000_000;

/// Limit of a step back if the log has no times, µs: a step that falls short of a full turn by less than
/// this is an overtaken frame.
pub(super) const OVERTAKEN_US: i64 = TURN_US / 8;

/// Permitted difference between the clocks of foot and log, µs: frames wait in adapters and queues.
const TOLERANCE_US: i64 = TURN_US / 4;

/// Step and turn of the foot's short clock, µs.
pub(super) const STEP_US: i64 = TIME_STEP_US as i64;
pub(super) const TURN_US: i64 = STEP_US << 16;

/// Time of a contact on the clocks of its foot and of the log.
#[derive(Clone, Copy)]
pub(super) struct Mark {
    /// Time on the foot's clock, with its turns counted, µs.
    pub(super) micros: u64,
    short: ShortTime,
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

impl Mark {
    /// The first contact of a foot; its short clock is assumed to be in its first turn.
    pub(super) fn first(short: ShortTime, at: Option<Timestamp>) -> Self {
        Self {
            micros: u64::from(short.0) * TIME_STEP_US,
            short,
            logged_us: at.map(Timestamp::as_micros),
        }
    }

    /// Returns the time to a contact at `short`, logged at `at`. The foot's clock wraps every 655.36 ms;
    /// the log's clock determines the turn, forwards or backwards. If the log has no times, the time is
    /// less than a turn.
    pub(super) fn elapsed(self, short: ShortTime, at: Option<Timestamp>) -> Elapsed {
        let steps = i64::from(short.0.wrapping_sub(self.short.0)) * STEP_US;
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
        if (elapsed - logged).abs() <= TOLERANCE_US {
            Elapsed::Agreed(elapsed)
        } else {
            Elapsed::Contradicted(elapsed)
        }
    }

    /// Corrects `elapsed` for a contact with the next sequence number: if the foot's clock advanced by about
    /// `usual_us`, the log's clock was set forwards and the foot did not pause. A pause matches by chance in
    /// one of several hundred cases, and hardly ever with the next number.
    pub(super) fn elapsed_to_next(
        self,
        elapsed: Elapsed,
        short: ShortTime,
        usual_us: i64,
    ) -> Elapsed {
        let steps = i64::from(short.0.wrapping_sub(self.short.0)) * STEP_US;
        match elapsed {
            Elapsed::Agreed(bridged)
                if bridged >= TURN_US && (steps - usual_us).abs() <= usual_us / 2 =>
            {
                Elapsed::Unbridged(steps)
            }
            elapsed => elapsed,
        }
    }

    /// Time of logging; the start of the log's clock if it has no times.
    pub(super) fn logged(self) -> Timestamp {
        Timestamp::from_micros(self.logged_us.unwrap_or_default())
    }

    /// A contact at `micros` on the foot's clock, logged at `at`.
    pub(super) const fn of(micros: u64, short: ShortTime, at: Timestamp) -> Self {
        Self {
            micros,
            short,
            logged_us: Some(at.as_micros()),
        }
    }

    /// A contact `elapsed` µs later.
    pub(super) fn after(self, elapsed: i64, short: ShortTime, at: Option<Timestamp>) -> Self {
        Self {
            micros: self.micros.saturating_add_signed(elapsed),
            short,
            logged_us: at.map(Timestamp::as_micros),
        }
    }
}
