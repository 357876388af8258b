//! Events of a foot: touch-downs, lift-offs, slip starts and slip ends.
//!
//! They are derived from the estimates alone, sample by sample ([`Events`]). A stretch in which the decision is
//! not "stable" lies between two stances or within one; the motion in it determines the events:
//!
//! | in the stretch | event at its start | event at its end |
//! |---|---|---|
//! | the foot left the ground, and the stretch lasts [`SHORTEST_SWING_US`] | lift-off | touch-down |
//! | before it left the ground or rolled, it slid for [`SHORTEST_SWING_US`] | slip start; slip end and lift-off where it left the ground or rolled | touch-down |
//! | the motion was unknown for [`SHORTEST_SWING_US`] | end of stance unknown | start of next stance unknown |
//! | it slid, and did not roll for [`SHORTEST_SWING_US`] | slip start | slip end |
//! | none of these: it sank, rocked or rolled | no event | no event |
//!
//! A foot has left the ground if its load is below the threshold ([`Phase::Swing`], [`Phase::QuietSwing`]);
//! without a load, if the probability that it neither lifts nor tilts has fallen below [`LIFTED_BELOW`]. It slides
//! if the probability that it does not move along the ground falls below [`SLIDES_BELOW`] before it rolls, i.e.
//! before it is inclined by more than [`ROLLS_ABOVE`] against its stance. In every roll-off the heel of a shoe
//! moves along the ground and the shoe turns about its toe. In simulated walks, trots and runs the former
//! probability falls to at most 0.03 in every swing; in slips it stays above 0.25, except for 2 ms at the end of
//! one recording (0.09). The latter stays above 0.9 in soft ground that yields.
//!
//! A slip starts from stable contact. A landing, which counts as [`Phase::Slip`] until the foot is still, is
//! therefore not a slip. A foot that is loaded for [`SHORTEST_SWING_US`] and not stable at any time of it, such as one
//! that slides from its landing until its lift-off, has neither touch-down nor slip but a start and an end of an
//! unstable stance. Without a load such a stance is not known from a swing. A foot that stands at the start of its recording has no touch-down. A foot that sticks and slips
//! may have several events in one slide.
//!
//! The distance of a slip is measured along the ground from the last stable sample: the acceleration without
//! gravity is rotated into the world frame and integrated twice. If the foot stands again afterwards, the
//! remaining speed is an error and is removed as if it had grown linearly, so a constant error of the
//! acceleration, such as a bias or a wrong inclination, cancels. Errors that change during the slip remain, as
//! does motion before the decision changed. Over 560 simulated slips of up to 58 mm and 0.3 s, with and without a
//! load, the median error is 0.1 mm, nine of ten errors are below 1.2 mm and all are below 5 mm
//! (`host-tests/tests/events.rs`); the simulated sensor has noise, bias and temperature, but no vibration of a
//! robot. If a slip ends in a lift-off, the speed at its end is unknown: an acceleration error of 0.05 m/s², as
//! from 0.3° of inclination, adds 2 mm in 0.3 s and 25 mm in 1 s. A slide at constant speed has no acceleration:
//! its end may be detected long before it occurs, and its distance is then too short.
//!
//! [`Phase::Swing`]: estimator_core::Phase::Swing
//! [`Phase::QuietSwing`]: estimator_core::Phase::QuietSwing
//! [`Phase::Slip`]: estimator_core::Phase::Slip

mod loaded;
mod reckoning;
mod unstable;

use std::collections::VecDeque;
use std::io::{self, Write};

use estimator_core::{ContactEstimate, Decision, Timestamp};

use crate::output::write_start;
use loaded::Loaded;
use reckoning::Reckoning;
use unstable::{Unstable, Verdict};

pub use unstable::{LIFTED_BELOW, ROLLS_ABOVE, SHORTEST_SWING_US, SLIDES_BELOW};

/// Header of a table of events; a table of several feet has the column `foot` before it.
///
/// | columns | meaning | unit |
/// |---|---|---|
/// | `t` | time of the event on the recording's clock, six decimals | s |
/// | `event` | name of the [`EventKind`] | |
/// | `duration` | duration of the stance or slip that starts or ends here; blank if its other end is not in the recording | s |
/// | `p_peak` | greatest probability of stable contact in that stance or slip | [0, 1] |
/// | `distance` | distance of the slip along the ground; blank for stances, for slips that have not ended, and if a sample in it was missing or doubtful | m |
pub const HEADER: &str = "t,event,duration,p_peak,distance";

crate::named! {
    /// Kind of an event.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum EventKind {
        /// Start of a stance: the decision changes to "stable" after a swing.
        TouchDown = "touch_down",
        /// End of a stance: the decision changes to "not stable" before a swing.
        LiftOff = "lift_off",
        /// Start of a slide.
        SlipStart = "slip_start",
        /// End of a slide: the foot stands again or is lifted.
        SlipEnd = "slip_end",
        /// Start of a stance in which the foot is loaded and never stable.
        UnstableStart = "unstable_start",
        /// End of a stance in which the foot was loaded and never stable.
        UnstableEnd = "unstable_end",
    }
}

/// An event. The duration, peak and distance of a stance or slip are the same at its start and at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactEvent {
    /// Time of the event.
    pub time: Timestamp,
    /// Kind of the event.
    pub kind: EventKind,
    /// Duration of the stance or slip that starts or ends here, µs; `None` if its other end is unknown.
    pub duration_us: Option<u64>,
    /// Greatest probability of stable contact in it, in [0, 1], as far as known.
    pub peak: f32,
    /// Distance of a slip that has ended, m; `None` if a sample was missing or doubtful.
    pub distance_m: Option<f64>,
}

/// Finds the events of a foot, estimate by estimate. Holds back the events since the last touch-down.
#[derive(Clone, Debug, Default)]
pub struct Events {
    /// Complete events.
    known: VecDeque<ContactEvent>,
    /// Touch-down without a known lift-off, and the events after it.
    waiting: Vec<ContactEvent>,
    /// Stances since the last stable sample that were never stable.
    unstable: Vec<ContactEvent>,
    loaded: Loaded,
    stance: Stance,
    state: State,
}

/// The current or the last stance.
#[derive(Clone, Copy, Debug, Default)]
struct Stance {
    /// Time of the touch-down; `None` if unknown.
    touch_down: Option<Timestamp>,
    peak: f32,
}

#[derive(Clone, Copy, Debug, Default)]
enum State {
    /// Before the first estimate.
    #[default]
    Begun,
    /// The decision is "stable".
    Stable(Reckoning),
    /// The decision is "not stable".
    Unstable(Unstable),
}

impl Events {
    /// Processes the next estimate.
    pub fn add(&mut self, estimate: &ContactEstimate) {
        self.unstable.extend(self.loaded.add(estimate).into_iter().flatten());
        match (&mut self.state, estimate.decision) {
            (State::Unstable(unstable), Decision::NotStable) => unstable.add(estimate),
            (state, Decision::NotStable) => {
                let stood = match state {
                    State::Stable(reckoning) => Some(*reckoning),
                    _ => None,
                };
                *state = State::Unstable(Unstable::new(stood, estimate));
            }
            (State::Unstable(unstable), Decision::Stable) => {
                unstable.reckon(estimate);
                let ended = *unstable;
                self.end(&ended, Some(estimate.timestamp));
                self.state = State::Stable(Reckoning::from_rest(estimate));
            }
            (state, Decision::Stable) => *state = State::Stable(Reckoning::from_rest(estimate)),
        }
        if estimate.decision == Decision::Stable {
            self.stance.peak = self.stance.peak.max(estimate.probabilities.stable);
        }
    }

    /// Returns the next complete event, in order of time.
    pub fn pop(&mut self) -> Option<ContactEvent> {
        self.known.pop_front()
    }

    /// Ends the recording and returns the remaining events.
    pub fn finish(mut self) -> impl Iterator<Item = ContactEvent> {
        if let State::Unstable(unstable) = self.state {
            self.end(&unstable, None);
        }
        self.close(None);
        self.known.into_iter().chain(self.unstable)
    }

    /// Ends a stretch: the decision is "stable" again at `now`, or the recording ends.
    fn end(&mut self, unstable: &Unstable, now: Option<Timestamp>) {
        let stood = unstable.stood();
        match unstable.verdict() {
            Verdict::Swing { lift_off, slip } => {
                if stood {
                    self.lift(unstable, lift_off, slip);
                }
                if let Some(now) = now {
                    self.known.extend(self.unstable.drain(..));
                    self.stance = Stance { touch_down: Some(now), peak: 0.0 };
                    self.waiting.push(ContactEvent::new(EventKind::TouchDown, now));
                }
            }
            Verdict::Unknown => {
                self.close(None);
                self.stance = Stance::default();
            }
            Verdict::Slip if stood => {
                let distance_m = now.and_then(|_| unstable.distance_to_rest());
                self.slip_starts(unstable, now, distance_m);
            }
            Verdict::Slip | Verdict::Neither => {}
        }
    }

    /// Handles a lift-off, with or without a slip before it.
    fn lift(&mut self, unstable: &Unstable, lift_off: Timestamp, slip: bool) {
        if slip {
            self.slip_starts(unstable, Some(lift_off), unstable.distance_to_lift);
        }
        let begun = self.stance.touch_down;
        let duration_us = begun.and_then(|begun| lift_off.micros_since(begun));
        self.close(duration_us);
        self.known.push_back(ContactEvent {
            duration_us,
            peak: self.stance.peak,
            ..ContactEvent::new(EventKind::LiftOff, lift_off)
        });
    }

    /// Adds a slip start, and the slip end if there is one.
    fn slip_starts(
        &mut self,
        unstable: &Unstable,
        end: Option<Timestamp>,
        distance_m: Option<f64>,
    ) {
        let of = |kind, time| ContactEvent {
            duration_us: end.and_then(|end| end.micros_since(unstable.start)),
            peak: unstable.peak,
            distance_m,
            ..ContactEvent::new(kind, time)
        };
        self.push(of(EventKind::SlipStart, unstable.start));
        if let Some(end) = end {
            self.push(of(EventKind::SlipEnd, end));
        }
    }

    /// Adds an event within a stance.
    fn push(&mut self, event: ContactEvent) {
        if self.waiting.is_empty() {
            self.known.push_back(event);
        } else {
            self.waiting.push(event);
        }
    }

    /// Completes the stance that has ended.
    fn close(&mut self, duration_us: Option<u64>) {
        if let Some(touch_down) = self.waiting.first_mut() {
            touch_down.duration_us = duration_us;
            touch_down.peak = self.stance.peak;
        }
        self.known.extend(self.waiting.drain(..));
    }
}

impl ContactEvent {
    const fn new(kind: EventKind, time: Timestamp) -> Self {
        Self { time, kind, duration_us: None, peak: 0.0, distance_m: None }
    }
}

/// Writes a row under [`HEADER`]. `foot` is given if the table has several feet; `start_us` is the time of the
/// recording's clock at timestamp 0, µs.
///
/// # Errors
/// Any error of the writer.
pub fn write_event(
    foot: Option<&str>,
    event: &ContactEvent,
    start_us: i64,
    to: &mut dyn Write,
) -> io::Result<()> {
    write_start(foot, event.time, start_us, to)?;
    write!(to, ",{},", event.kind.name())?;
    if let Some(micros) = event.duration_us {
        write!(to, "{}.{:06}", micros / 1_000_000, micros % 1_000_000)?;
    }
    write!(to, ",{},", event.peak)?;
    if let Some(metres) = event.distance_m {
        write!(to, "{metres:.6}")?;
    }
    writeln!(to)
}

#[cfg(test)]
mod tests;
