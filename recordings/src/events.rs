//! Events of a foot: touch-downs, lift-offs, and where slips begin and end.
//!
//! They follow from the estimates alone, sample by sample ([`Events`]). A stretch in which the decision is not
//! "stable" lies between two stances or within one; what was in it says which:
//!
//! | in the stretch | its beginning is | its end is |
//! |---|---|---|
//! | the foot left the ground, and the stretch lasts [`SHORTEST_SWING_US`] | a lift-off | a touch-down |
//! | before it left the ground or rolled, it slid for [`SHORTEST_SWING_US`] | a slip start; where it did are a slip end and a lift-off | a touch-down |
//! | the motion was unknown for [`SHORTEST_SWING_US`] | where the stance ended is not known | nor is where the next one began |
//! | it slid, and did not roll for [`SHORTEST_SWING_US`] | a slip start | a slip end |
//! | none of these: it sank, rocked or rolled | no event | no event |
//!
//! A foot has left the ground where its load is below the threshold ([`Phase::Swing`],
//! [`Phase::QuietSwing`]); without a load, where the probability that it neither lifts nor tilts has fallen
//! below [`LIFTED_BELOW`]. It slides where the probability that it does not move along the ground has fallen
//! below [`SLIDES_BELOW`], and before it rolls: is inclined by more than [`ROLLS_ABOVE`] against its stance. The heel of a
//! shoe moves along the ground in every roll-off, and the shoe turns about its toe. In simulated walks, trots and runs the former falls to at most
//! 0.03 in every swing, and in slips stays above 0.25, but for 2 ms at
//! the end of one recording (0.09); the latter stays above 0.9 in soft ground that gives
//! way.
//!
//! A slip begins from stable contact. So a landing, which counts as [`Phase::Slip`] until the foot is still, is
//! no slip; and of a foot that slides from its landing on until it is lifted there is no event at all, not
//! even its touch-down: it never stood. A foot that stands when its recording begins has not touched down.
//! A foot that sticks and slips may have several events in one slide.
//!
//! The distance of a slip is along the ground, from the last sample that was stable: the acceleration without
//! gravity, turned into the world, is summed up twice. Where the foot stands again afterwards, the speed that
//! is left there is an error, and is taken out as if it had grown evenly: so a constant error of the
//! acceleration, as of a bias or of a wrong inclination, does not matter there. What is left is what changes
//! during the slip, and what the foot moved before the decision turned. Over 560 simulated slips, with and without a load, of up to
//! 58 mm and 0.3 s the distance is wrong by 0.1 mm in the middle, by less than 1.2 mm in nine of ten and by less
//! than 5 mm in all (`host-tests/tests/events.rs`); the simulated sensor has noise, bias and temperature, but no
//! robot shakes it. Of a slip that ends in a lift-off, the speed at its end is not known: there an acceleration
//! that is wrong by 0.05 m/s², as by 0.3° of inclination, makes 2 mm in 0.3 s and 25 mm in a second. A slide at
//! steady speed has no acceleration: its end may be seen long before it is there, and its distance is then too
//! short.
//!
//! [`Phase::Swing`]: estimator_core::Phase::Swing
//! [`Phase::QuietSwing`]: estimator_core::Phase::QuietSwing
//! [`Phase::Slip`]: estimator_core::Phase::Slip

mod reckoning;
mod unstable;

use std::collections::VecDeque;
use std::io::{self, Write};

use estimator_core::{ContactEstimate, Decision, Timestamp};

use crate::output::{quoted, write_time};
use reckoning::Reckoning;
use unstable::{Unstable, Verdict};

pub use unstable::{LIFTED_BELOW, ROLLS_ABOVE, SHORTEST_SWING_US, SLIDES_BELOW};

/// The header of a table of events; one of several feet has the column `foot` before it.
///
/// | columns | meaning | unit |
/// |---|---|---|
/// | `t` | when it was, on the recording's clock, six decimals | s |
/// | `event` | name of the [`Kind`] | |
/// | `duration` | of the stance or the slip that begins or ends here; blank where the recording does not have its other end | s |
/// | `p_peak` | greatest probability of stable contact in that stance or slip | [0, 1] |
/// | `distance` | of the slip, along the ground; blank for stances, where the slip has not ended, and where a sample in it was missing or in doubt | m |
pub const HEADER: &str = "t,event,duration,p_peak,distance";

/// What happens to a foot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// It begins to stand: the decision turns "stable" after a swing.
    TouchDown,
    /// It leaves the ground: the decision turns "not stable" before a swing.
    LiftOff,
    /// It begins to slide.
    SlipStart,
    /// It stands again, or is lifted.
    SlipEnd,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 4] = [
        Self::TouchDown,
        Self::LiftOff,
        Self::SlipStart,
        Self::SlipEnd,
    ];

    /// The name in files: `touch_down` and so on.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::TouchDown => "touch_down",
            Self::LiftOff => "lift_off",
            Self::SlipStart => "slip_start",
            Self::SlipEnd => "slip_end",
        }
    }
}

/// One event. What is said of a stance or a slip is the same at its beginning and at its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Event {
    /// When it was.
    pub time: Timestamp,
    /// What it was.
    pub kind: Kind,
    /// Of the stance or slip that begins or ends here, µs; `None` where its other end is not known.
    pub duration_us: Option<u64>,
    /// Greatest probability of stable contact in it, in [0, 1], as far as it is known.
    pub peak: f32,
    /// Of a slip that has ended, m; `None` where a sample was missing or in doubt.
    pub distance_m: Option<f64>,
}

/// Finds the events of a foot, estimate by estimate. What waits in it are those since the last touch-down.
#[derive(Clone, Debug, Default)]
pub struct Events {
    /// Those of which all is known.
    known: VecDeque<Event>,
    /// A touch-down of which the lift-off is not known yet, and what came after it.
    waiting: Vec<Event>,
    stance: Stance,
    state: State,
}

/// The stance that goes on or was the last.
#[derive(Clone, Copy, Debug, Default)]
struct Stance {
    /// `None` where it is not known.
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
    /// It is not.
    Unstable(Unstable),
}

impl Events {
    /// Takes in the next estimate.
    pub fn add(&mut self, estimate: &ContactEstimate) {
        let now = estimate.timestamp;
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
                self.end(&ended, now);
                self.state = State::Stable(Reckoning::from_rest(estimate));
            }
            (state, Decision::Stable) => *state = State::Stable(Reckoning::from_rest(estimate)),
        }
        if estimate.decision == Decision::Stable {
            self.stance.peak = self.stance.peak.max(estimate.probabilities.stable);
        }
    }

    /// The next event of which all is known; they come in order of time.
    pub fn pop(&mut self) -> Option<Event> {
        self.known.pop_front()
    }

    /// The recording ends here: the rest of the events.
    pub fn finish(mut self) -> impl Iterator<Item = Event> {
        if let State::Unstable(unstable) = self.state
            && unstable.stood()
        {
            match unstable.verdict() {
                Verdict::Swing { lift_off, slip } => self.lift(&unstable, lift_off, slip),
                Verdict::Slip => self.slip_starts(&unstable, None, None),
                Verdict::Unknown | Verdict::Neither => {}
            }
        }
        self.close(None);
        self.known.into_iter()
    }

    /// A stretch has ended: the decision is "stable" again at `now`.
    fn end(&mut self, unstable: &Unstable, now: Timestamp) {
        let stood = unstable.stood();
        match unstable.verdict() {
            Verdict::Swing { lift_off, slip } => {
                if stood {
                    self.lift(unstable, lift_off, slip);
                }
                self.stance = Stance {
                    touch_down: Some(now),
                    peak: 0.0,
                };
                self.waiting.push(Event::new(Kind::TouchDown, now));
            }
            Verdict::Unknown => {
                self.close(None);
                self.stance = Stance::default();
            }
            Verdict::Slip if stood => {
                self.slip_starts(unstable, Some(now), unstable.distance_to_rest());
            }
            Verdict::Slip | Verdict::Neither => {}
        }
    }

    /// The foot has left the ground, after a slip or not.
    fn lift(&mut self, unstable: &Unstable, lift_off: Timestamp, slip: bool) {
        if slip {
            self.slip_starts(unstable, Some(lift_off), unstable.distance_to_lift);
        }
        let begun = self.stance.touch_down;
        let duration_us = begun.and_then(|begun| lift_off.micros_since(begun));
        self.close(duration_us);
        self.known.push_back(Event {
            duration_us,
            peak: self.stance.peak,
            ..Event::new(Kind::LiftOff, lift_off)
        });
    }

    /// A slip, and its end where there is one.
    fn slip_starts(
        &mut self,
        unstable: &Unstable,
        end: Option<Timestamp>,
        distance_m: Option<f64>,
    ) {
        let of = |kind, time| Event {
            duration_us: end.and_then(|end| end.micros_since(unstable.start)),
            peak: unstable.peak,
            distance_m,
            ..Event::new(kind, time)
        };
        self.push(of(Kind::SlipStart, unstable.start));
        if let Some(end) = end {
            self.push(of(Kind::SlipEnd, end));
        }
    }

    /// An event within a stance.
    fn push(&mut self, event: Event) {
        if self.waiting.is_empty() {
            self.known.push_back(event);
        } else {
            self.waiting.push(event);
        }
    }

    /// All is known of the stance that has ended.
    fn close(&mut self, duration_us: Option<u64>) {
        if let Some(touch_down) = self.waiting.first_mut() {
            touch_down.duration_us = duration_us;
            touch_down.peak = self.stance.peak;
        }
        self.known.extend(self.waiting.drain(..));
    }
}

impl Event {
    const fn new(kind: Kind, time: Timestamp) -> Self {
        Self {
            time,
            kind,
            duration_us: None,
            peak: 0.0,
            distance_m: None,
        }
    }
}

/// Writes a row under [`HEADER`]. `foot` is there where the table has several feet; `start_us` is what the
/// recording's clock says at timestamp 0, µs.
///
/// # Errors
/// What the writer reports.
pub fn write_event(
    foot: Option<&str>,
    event: &Event,
    start_us: i64,
    to: &mut dyn Write,
) -> io::Result<()> {
    if let Some(foot) = foot {
        write!(to, "{},", quoted(foot))?;
    }
    write_time(event.time, start_us, to)?;
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
