//! Taps, steps and loads, as the foot reports them, and the faults that it reports while its sensor is unplugged.

use std::time::Duration;

use crate::decode::ContactRow;
use estimator_core::{Decision, Phase, Timestamp};
use wire::dictionary::index;
use wire::node::CalibrationState;
use wire::{Fault, Faults};

use super::motion::{Moment, watch};
use super::{AcceptStep, Person, StepFigures, board, figure};
use crate::foot::calibration;
use crate::foot::{Client, RequestError};

/// Number of requested taps, steps and loads.
const TAPS: usize = 5;
const STEPS: usize = 10;
const LOADS: usize = 3;

/// Probability below which a tap is detected. It is above 0.99 at rest. A tap is shorter than the window of the mean, so
/// that the probability does not fall to 0.
const TAPPED: f32 = 0.9;

/// Probability below which a sample counts as motion.
const MOTION: f32 = 0.5;

/// Shortest contact and shortest lift of a step, µs.
const STEP_US: u64 = 100_000;

/// Timeout for the first valid contact of a foot with a sensor.
const HEALTHY: Duration = Duration::from_secs(2);

/// Time for which a foot without a sensor is watched.
const UNPLUGGED: Duration = Duration::from_secs(2);

/// Time of valid contacts after which a sensor that was plugged in again counts as recovered, µs.
const RECOVERED_US: u64 = 500_000;

/// Listens to the contacts of the foot until `is_complete`, at most `patience`.
fn listen(
    client: &mut Client,
    has_left: &dyn Fn() -> bool,
    patience: Duration,
    mut is_complete: impl FnMut(&ContactRow) -> bool,
) -> Result<(), RequestError> {
    watch(client, has_left, patience, |moment| match moment {
        Moment::Contact(row) => is_complete(row).then_some(()),
        _ => None,
    })?;
    Ok(())
}

/// Listens until `take` has counted `wanted` events of this name. Shows the person each event.
fn count(
    client: &mut Client,
    person: &mut Person,
    (name, wanted): (&str, usize),
    mut take: impl FnMut(&ContactRow) -> usize,
) -> Result<(), RequestError> {
    let (patience, tell, has_left) = person.parts();
    let mut told = 0;
    listen(client, has_left, patience, |row| {
        let count = take(row);
        if count > told {
            tell(&format!("{name} {count} of {wanted}"));
        }
        told = count;
        count >= wanted
    })
}

/// Taps, detected in the contacts.
#[derive(Default)]
struct TapCounter {
    /// Start of a tap from which the foot has not recovered, µs.
    since: Option<u64>,
    count: usize,
    longest_us: u64,
    clipped: usize,
}

impl TapCounter {
    fn take(&mut self, row: &ContactRow) {
        let at = row.timestamp.as_micros();
        self.clipped += usize::from(row.status.is_saturated());
        let is_stable = row.status.decision() == Decision::Stable && row.stable >= TAPPED;
        match self.since {
            None if row.stable < TAPPED => self.since = Some(at),
            Some(since) if is_stable => {
                self.count += 1;
                self.longest_us = self.longest_us.max(at.saturating_sub(since));
                self.since = None;
            }
            _ => {}
        }
    }
}

/// Measures taps on the sole.
pub(super) fn taps(client: &mut Client, person: &mut Person) -> StepFigures {
    let (patience, tell, has_left) = person.parts();
    tell("put the foot down, let it rest, then tap its sole five times, two seconds apart");
    let mut is_ready = false;
    listen(client, has_left, patience, |row| {
        is_ready = row.status.decision() == Decision::Stable;
        is_ready
    })?;
    if !is_ready {
        return Ok(AcceptStep::Taps.failed("the foot was not stable before the first tap"));
    }
    tell("now");
    let mut taps = TapCounter::default();
    count(client, person, ("tap", TAPS), |row| {
        taps.take(row);
        taps.count
    })?;
    let recovery = match taps.count {
        0 => figure::TAP_RECOVERY.failed("no tap was seen"),
        _ => figure::TAP_RECOVERY.measured(taps.longest_us as f64 / 1000.0),
    };
    Ok(vec![figure::TAPS.counted(taps.count), recovery, figure::CLIPPED.counted(taps.clipped)])
}

/// Contacts that follow a lift.
#[derive(Default)]
struct StepCounter {
    /// Decision of the newest contact, and since when, µs.
    now: Option<(Decision, u64)>,
    was_lifted: bool,
    count: usize,
}

impl StepCounter {
    fn take(&mut self, row: &ContactRow) {
        let (decision, at) = (row.status.decision(), row.timestamp.as_micros());
        let since = match self.now {
            Some((last, since)) if last == decision => since,
            _ => {
                self.now = Some((decision, at));
                at
            }
        };
        if at.saturating_sub(since) < STEP_US {
            return;
        }
        if decision == Decision::NotStable {
            self.was_lifted = true;
        } else if self.was_lifted {
            self.was_lifted = false;
            self.count += 1;
        }
    }
}

/// Measures ten steps.
pub(super) fn steps(client: &mut Client, person: &mut Person) -> StepFigures {
    (person.tell)(
        "let the foot take ten steps: lift it, swing it, put it down and leave it for half a second",
    );
    let mut steps = StepCounter::default();
    let (mut contacts, mut valid) = (0, 0);
    count(client, person, ("step", STEPS), |row| {
        contacts += 1;
        valid += usize::from(row.status.is_valid());
        steps.take(row);
        steps.count
    })?;
    let settled = match calibration::state(client)? {
        CalibrationState::Settling => figure::SETTLED.measured(0.0),
        CalibrationState::Settled => figure::SETTLED.measured(1.0),
        CalibrationState::Frozen => figure::SETTLED.not_tested("the foot does not learn"),
    };
    let percent = 100.0 * f64::from(u32::try_from(valid).unwrap_or(u32::MAX)) / f64::from(contacts);
    Ok(vec![figure::STEPS.counted(steps.count), figure::STEPS_VALID.measured(percent), settled])
}

/// Measures loads, if the foot has a source of them.
pub(super) fn load(client: &mut Client, person: &mut Person) -> StepFigures {
    if client.read_number(index::LOAD_INPUT, 1)? == 0 {
        return Ok(AcceptStep::Load.not_tested("the foot has no load input (load_input.source)"));
    }
    (person.tell)("load and unload the foot three times, a second each");
    let (mut contacts, mut known, mut loads) = (0_usize, 0_usize, 0);
    let mut was_loaded = None;
    count(client, person, ("load", LOADS), |row| {
        contacts += 1;
        let is_loaded = match row.status.phase() {
            Phase::Stance | Phase::Slip | Phase::Landing => Some(true),
            Phase::Swing | Phase::QuietSwing => Some(false),
            Phase::Unknown => None,
        };
        known += usize::from(is_loaded.is_some());
        loads += usize::from(is_loaded == Some(true) && was_loaded == Some(false));
        was_loaded = is_loaded.or(was_loaded);
        loads
    })?;
    Ok(vec![
        figure::LOADS.counted(loads),
        figure::LOAD_KNOWN.measured(100.0 * known as f64 / contacts as f64),
    ])
}

/// Contacts and faults of a foot while its sensor is unplugged and plugged in again.
#[derive(Default)]
struct Unplugged {
    last_valid: Timestamp,
    first_fault: Option<Timestamp>,
    /// Number of contacts that report "stable" without a sensor.
    stable: usize,
    valid_since: Option<u64>,
    faults: Faults,
}

impl Unplugged {
    /// Begins after a contact of a foot with a sensor.
    fn after(last_valid: Timestamp) -> Self {
        Self { last_valid, ..Self::default() }
    }

    /// Takes a contact; returns whether the foot has recovered.
    fn take(&mut self, row: &ContactRow) -> bool {
        let (is_valid, at) = (row.status.is_valid(), row.timestamp);
        if self.first_fault.is_none() {
            if row.status.has_fault() {
                self.first_fault = Some(at);
            } else if is_valid {
                self.last_valid = at;
            }
            return false;
        }
        if !is_valid {
            self.valid_since = None;
            return false;
        }
        let since = *self.valid_since.get_or_insert(at.as_micros());
        at.as_micros().saturating_sub(since) >= RECOVERED_US
    }
}

/// Returns whether a contact of a foot without a sensor reports "stable".
fn reports_stable(row: &ContactRow) -> bool {
    let is_doubtful = !row.status.is_valid() && !row.status.has_fault();
    row.status.decision() == Decision::Stable || row.stable > MOTION && !is_doubtful
}

/// Measures a foot whose sensor is unplugged and plugged in again.
pub(super) fn unplug(client: &mut Client, person: &mut Person) -> StepFigures {
    let (patience, tell, has_left) = person.parts();
    let hardware = board::hardware(client)?;
    if hardware.contains(board::NANO) || hardware == "simulated" {
        return Ok(AcceptStep::Unplug.not_tested("it cannot be unplugged"));
    }
    // A foot without a sensor sends no contact until it reports the fault. The last contact with a sensor must
    // therefore be received before the person is asked to unplug it.
    let mut last_valid = None;
    listen(client, has_left, HEALTHY, |row| {
        if row.status.is_valid() && !row.status.has_fault() {
            last_valid = Some(row.timestamp);
        }
        last_valid.is_some()
    })?;
    let Some(last_valid) = last_valid else {
        let reason = "the foot had a fault before the sensor was unplugged";
        return Ok(AcceptStep::Unplug.failed(reason));
    };
    tell("unplug the sensor while the board runs, or pull its wire DO (SDO)");
    let mut unplugged = Unplugged::after(last_valid);
    listen(client, has_left, patience, |row| {
        unplugged.take(row);
        unplugged.first_fault.is_some()
    })?;
    let Some(first) = unplugged.first_fault else {
        let reason = format!("no fault within {} s", patience.as_secs());
        return Ok(AcceptStep::Unplug.failed(&reason));
    };
    tell("the foot has detected it; wait for two seconds");
    listen(client, has_left, UNPLUGGED, |row| {
        unplugged.stable += usize::from(reports_stable(row));
        false
    })?;
    tell("plug it in again");
    let recovered = watch(client, has_left, patience, |moment| match moment {
        Moment::Contact(row) => unplugged.take(row).then_some(()),
        Moment::Faults(faults) => {
            let of = &mut unplugged.faults;
            faults.iter().for_each(|fault| *of = of.with(fault));
            None
        }
        Moment::Motion(_) => None,
    })?;
    let names: Vec<_> = unplugged.faults.iter().map(Fault::name).collect();
    let last_us = unplugged.last_valid.as_micros();
    let delay_ms = first.as_micros().saturating_sub(last_us) as f64 / 1000.0;
    Ok(vec![
        figure::DETECTED.measured(delay_ms).with(names.join(", ")),
        figure::STABLE_UNPLUGGED.counted(unplugged.stable),
        figure::RECOVERED.counted(usize::from(recovered.is_some())),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{Flag, Flags};
    use wire::pdo::Status;

    fn row(ms: u64, decision: Decision, faults: Faults) -> ContactRow {
        ContactRow {
            timestamp: Timestamp::from_micros(1000 * ms),
            stable: if decision == Decision::Stable { 0.9 } else { 0.1 },
            status: Status::new(decision, Phase::Unknown, Flags::NONE, faults),
            ..ContactRow::default()
        }
    }

    fn alternating(stable_ms: u64, not_ms: u64, rounds: u64) -> impl Iterator<Item = ContactRow> {
        let period = stable_ms + not_ms;
        (0..rounds * period).map(move |ms| {
            let is_stable = ms % period >= not_ms;
            let decision = if is_stable { Decision::Stable } else { Decision::NotStable };
            row(ms, decision, Faults::NONE)
        })
    }

    #[test]
    fn steps_count_where_lift_and_contact_last_long_enough() {
        for (stable_ms, not_ms, expected) in [(500, 300, 8), (90, 300, 0), (500, 90, 0)] {
            let mut steps = StepCounter::default();
            alternating(stable_ms, not_ms, 8).for_each(|row| steps.take(&row));
            assert_eq!(steps.count, expected, "{stable_ms} {not_ms}");
        }
    }

    #[test]
    fn tap_lasts_until_the_foot_is_stable_again() {
        let mut taps = TapCounter::default();
        alternating(800, 200, 5).for_each(|row| taps.take(&row));
        assert_eq!((taps.count, taps.longest_us), (5, 200_000));
    }

    #[test]
    fn unplugged_foot_has_recovered_after_valid_contacts() {
        let fault = Faults::NONE.with(Fault::SensorSilent);
        let mut unplugged = Unplugged::after(Timestamp::default());
        unplugged.take(&row(1, Decision::Stable, Faults::NONE));
        unplugged.take(&row(5, Decision::NotStable, fault));
        assert_eq!(unplugged.last_valid, Timestamp::from_micros(1000));
        assert_eq!(unplugged.first_fault, Some(Timestamp::from_micros(5000)));
        let recovered =
            (7..1000).find(|ms| unplugged.take(&row(*ms, Decision::Stable, Faults::NONE)));
        assert_eq!(recovered, Some(507));
    }

    #[test]
    fn contact_reports_stable_unless_it_is_flagged() {
        let fault = Faults::NONE.with(Fault::SensorSilent);
        let mut believed = row(6, Decision::NotStable, fault);
        assert!(!reports_stable(&believed));
        believed.stable = 0.9;
        assert!(reports_stable(&believed));
        believed.status = Status::new(
            Decision::NotStable,
            Phase::Unknown,
            Flags::NONE.with(Flag::WindowNotFull),
            Faults::NONE,
        );
        assert!(!reports_stable(&believed));
        assert!(reports_stable(&row(7, Decision::Stable, Faults::NONE)));
    }
}
