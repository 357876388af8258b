//! The time of a contact, from its foot's short clock and from the log's.

use estimator_core::Timestamp;
use wire::pdo::{ShortTime, TIME_STEP_US};

/// Beyond this time between two frames the log's own clock was set, µs: a day.
pub(super) const LONGEST_BRIDGE_US: i64 = 86_400_000_000;

/// Lines of a log are never this far out of order, µs: its own clock was set back.
pub(super) const LONGEST_RETURN_US: i64 = -1_000_000;

/// Where the log has no times, less than this before a turn is full is a step back, µs: a frame
/// that others have overtaken.
pub(super) const OVERTAKEN_US: i64 = TURN_US / 8;

/// By how much the clocks of foot and log may differ, µs: frames wait in adapters and in queues.
const TOLERANCE_US: i64 = TURN_US / 4;

/// A step and a turn of the foot's short clock, µs.
pub(super) const STEP_US: i64 = TIME_STEP_US as i64;
pub(super) const TURN_US: i64 = STEP_US << 16;

/// A contact, by its foot's clock and by the log's.
#[derive(Clone, Copy)]
pub(super) struct Mark {
    /// On the foot's clock, with its turns counted, µs.
    pub(super) micros: u64,
    short: ShortTime,
    /// `None` where the log has no times.
    logged_us: Option<u64>,
}

/// The time from one contact to another by the foot's clock, and whether the log's agrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Elapsed {
    /// Both clocks agree on this time, µs.
    Agreed(i64),
    /// The nearest that the foot's clock allows, µs, is far from what the log's says.
    Contradicted(i64),
    /// The log's clock was set in between; µs by the foot's clock alone, less than a turn.
    Unbridged(i64),
}

impl Mark {
    /// The first contact of a foot: its short clock is taken to be in its first turn.
    pub(super) fn first(short: ShortTime, at: Option<Timestamp>) -> Self {
        Self {
            micros: u64::from(short.0) * TIME_STEP_US,
            short,
            logged_us: at.map(Timestamp::as_micros),
        }
    }

    /// The time to a contact at `short`, logged at `at`. The foot's own clock wraps every
    /// 655.36 ms; which turn it is, forwards or backwards, the log's clock decides. Without one, it
    /// is less than a turn.
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

    /// The same where the next contact by number came: after a step of the foot's clock like the
    /// `usual_us` before it was the log's clock that was set forth, and the foot did not pause. A
    /// pause ends like that in one of some hundred cases, and hardly ever at the next number.
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

    /// When it was logged; the start of the log's clock where it has no times.
    pub(super) fn logged(self) -> Timestamp {
        Timestamp::from_micros(self.logged_us.unwrap_or_default())
    }

    /// A contact that is `micros` on the foot's clock, logged at `at`.
    pub(super) const fn of(micros: u64, short: ShortTime, at: Timestamp) -> Self {
        Self {
            micros,
            short,
            logged_us: Some(at.as_micros()),
        }
    }

    /// The contact that came `elapsed` µs later.
    pub(super) fn after(self, elapsed: i64, short: ShortTime, at: Option<Timestamp>) -> Self {
        Self {
            micros: self.micros.saturating_add_signed(elapsed),
            short,
            logged_us: at.map(Timestamp::as_micros),
        }
    }
}
