//! Events of a foot: touch-downs, lift-offs, slip starts and slip ends.
//!
//! They are derived only from the estimates, sample by sample ([`Events`]). A stretch in which the decision is not
//! "stable" is between two stances or within one. The motion in it determines the events:
//!
//! | in the stretch | event at its start | event at its end |
//! |---|---|---|
//! | the foot left the ground, and the stretch lasts [`SHORTEST_SWING_US`] | lift-off | touch-down |
//! | before it left the ground or rolled, it slid for [`SHORTEST_SWING_US`] | slip start; slip end and lift-off where it left the ground or rolled | touch-down |
//! | the motion was unknown for [`SHORTEST_SWING_US`] | end of stance unknown | start of next stance unknown |
//! | it slid, and did not roll for [`SHORTEST_SWING_US`] | slip start | slip end |
//! | none of these: it rose, sank, rocked or rolled | no event | no event |
//!
//! A foot has left the ground if its load is below the threshold ([`Phase::Swing`], [`Phase::QuietSwing`]);
//! without a load, if the probability that it neither lifts nor tilts has fallen below [`LIFTED_BELOW`]. It slides
//! if the probability that it does not move along the ground falls below [`SLIDES_BELOW`] before it rolls, i.e.
//! before it is inclined by more than [`ROLLS_ABOVE`] against its stance. In every roll-off the heel of a shoe
//! moves along the ground and the shoe turns about its toe, which is no slip.
//!
//! A slide moves along the ground. Without a load, a foot that rises or sinks by more than [`RISES_ABOVE_M`] therefore
//! has not slid. The swing of a robot that walks slowly is so smooth that it does not count as lifting, and would be a slip
//! otherwise.
//!
//! A foot that comes to rest has not slid if its turn explains the speed at which it moved along the ground. A turn at
//! the rate ω moves a sensor at `LEVER_M` · ω if it is [`LEVER_M`] away from the point about which the foot turns. The
//! shoe of a person who stands and sways moves that way, and so does the sensor on a shank that leans over its foot.
//!
//! A slip starts from stable contact, so a landing is not a slip. A foot may be loaded for [`SHORTEST_SWING_US`]
//! without being stable at any time, for example if it slides from its landing until its lift-off. Then it has neither
//! touch-down nor slip, but a start and an end of an unstable stance. Without a load such a stance cannot be
//! distinguished from a swing. A foot that stands at the start of its recording has no touch-down. A foot that sticks
//! and slips may have several events in one slide, but a time with the decision "stable" that is shorter than
//! [`SHORTEST_REST_US`] does not divide it.
//!
//! The distance of a slip is measured along the ground from the last stable sample: the acceleration without gravity is
//! rotated into the world frame and integrated twice. If the foot stands again afterwards, the remaining speed is an
//! error. It is removed as if it had grown linearly, so a constant error of the acceleration, such as a bias or a wrong
//! inclination, cancels. Errors that change during the slip remain, as does motion before the decision changed.
//!
//! Over 1,120 simulated slips of up to 58 mm and 0.3 s, with and without a load, the median error is below 1.3 mm,
//! nine of ten errors are below 6.7 mm and all are below 8.9 mm (`host-tests/tests/events.rs`). The simulated sensor
//! has noise, bias and temperature, but no vibration of a robot.
//!
//! If a slip ends in a lift-off, the speed at its end is unknown. An acceleration error of 0.05 m/s², as from 0.3° of
//! inclination, then adds 2 mm in 0.3 s and 25 mm in 1 s. A slide at constant speed has no acceleration. Its end may be
//! detected long before it occurs, and its distance is then too short.
//!
//! [`Phase::Swing`]: estimator_core::Phase::Swing
//! [`Phase::QuietSwing`]: estimator_core::Phase::QuietSwing

use std::collections::VecDeque;
use std::io::{self, Write};

use estimator_core::velocity::VelocityParams;
use estimator_core::{ContactEstimate, Decision, Flag, Phase, Timestamp};

use samples::space::{Rotation, Vector};
use tables::output::write_start;

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

samples::named! {
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
    /// The last slip, if it has ended so recently that it may continue.
    paused: Option<Paused>,
}

/// A slip that has ended at rest, and may continue.
#[derive(Clone, Copy, Debug)]
struct Paused {
    /// The stretch up to its end.
    slip: Unstable,
    /// Time of its end.
    end: Timestamp,
    /// The stretch with all estimates since its end.
    so_far: Unstable,
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

impl Paused {
    /// Returns whether the foot has rested since the end of the slip.
    fn has_rested(&self, now: Timestamp) -> bool {
        now.micros_since(self.end).is_some_and(|us| us >= SHORTEST_REST_US)
    }
}

impl Events {
    /// Processes the next estimate.
    pub fn add(&mut self, estimate: &ContactEstimate) {
        self.unstable.extend(self.loaded.add(estimate).into_iter().flatten());
        if let Some(paused) = &mut self.paused {
            paused.so_far.add(estimate);
        }
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
            (state, Decision::Stable) => {
                *state = State::Stable(Reckoning::from_rest(estimate));
                let now = estimate.timestamp;
                if let Some(paused) = self.paused.take_if(|paused| paused.has_rested(now)) {
                    self.slip_ends(&paused);
                }
            }
        }
        if estimate.decision == Decision::Stable {
            self.stance.peak = self.stance.peak.max(estimate.probabilities.stable);
        }
    }

    /// Returns the next complete event, in order of time.
    pub fn pop(&mut self) -> Option<ContactEvent> {
        self.known.pop_front()
    }

    /// Releases the events that are held back, so that a touch-down is known at once. Its duration is then unknown,
    /// and its peak is the peak so far; the lift-off has the final values.
    pub fn release(&mut self) {
        if let Some(touch_down) = self.waiting.first_mut() {
            touch_down.peak = self.stance.peak;
        }
        self.known.extend(self.waiting.drain(..));
    }

    /// Ends the recording and returns the remaining events.
    pub fn finish(mut self) -> impl Iterator<Item = ContactEvent> {
        if let State::Unstable(unstable) = self.state {
            self.end(&unstable, None);
        }
        if let Some(paused) = self.paused.take() {
            self.slip_ends(&paused);
        }
        self.close(None);
        self.known.into_iter().chain(self.unstable)
    }

    /// Ends a stretch, because the decision is "stable" again at `now`, or because the recording ends.
    fn end(&mut self, unstable: &Unstable, now: Option<Timestamp>) {
        let stood = unstable.stood();
        let verdict = unstable.verdict(now.is_some());
        let slides = matches!(verdict, Verdict::Slip | Verdict::Swing { slip: true, .. });
        let before = self.paused.take();
        // A slide that continues is one slip. Any other motion does not change the previous slip.
        let before = match before {
            Some(paused) if !slides => {
                self.slip_ends(&paused);
                None
            }
            before => before,
        };
        match verdict {
            Verdict::Swing { lift_off, slip } => {
                if stood {
                    self.lift(before.as_ref(), unstable, lift_off, slip);
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
                let slip = before.map_or(*unstable, |paused| paused.so_far);
                match now {
                    Some(end) => self.paused = Some(Paused { slip, end, so_far: slip }),
                    None if slip.has_load || slip.lasts() => self.slip_starts(&slip, None, None),
                    // Without a load, a stretch that the end of the recording cuts short may be a lift-off as well.
                    None => before.iter().for_each(|paused| self.slip_ends(paused)),
                }
            }
            Verdict::Slip | Verdict::Neither => {}
        }
    }

    /// Adds a slip that has ended at rest.
    fn slip_ends(&mut self, Paused { slip, end, .. }: &Paused) {
        self.slip_starts(slip, Some(*end), slip.distance_to_rest());
    }

    /// Handles a lift-off. With `slip`, a slip precedes the lift-off, and may continue the paused slip `before`.
    fn lift(
        &mut self,
        before: Option<&Paused>,
        unstable: &Unstable,
        lift_off: Timestamp,
        slip: bool,
    ) {
        if slip {
            let slip = before.map_or(unstable, |paused| &paused.so_far);
            // A foot that rolled in the first part has no distance up to the lift-off.
            let is_known = before.is_none_or(|paused| paused.slip.left_ground().is_none());
            let distance_m = slip.distance_to_lift.filter(|_| is_known);
            self.slip_starts(slip, Some(lift_off), distance_m);
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

/// Shortest swing, µs: the swing of a run takes 260 ms. A foot that only peels off the ground slides for less.
pub const SHORTEST_SWING_US: u64 = 100_000;

/// Shortest time with the decision "stable" between two slips, µs. With a shorter time they are one
/// slip, because P rises for some tens of ms where the speed of a slide is steady, while the foot slides
/// on.
pub const SHORTEST_REST_US: u64 = 30_000;

/// A foot of unknown load has left the ground if [`vertical`](estimator_core::Probabilities::vertical) is below
/// this.
pub const LIFTED_BELOW: f32 = 0.1;

/// A foot on the ground slides if [`tangential`](estimator_core::Probabilities::tangential) is below this.
pub const SLIDES_BELOW: f32 = 0.5;

/// Inclination against its stance above which a foot rolls, rad (1°). Simulated slides tilt by up to 0.3° until
/// the foot peels off; roll-offs of a shoe tilt by 1° within 50 ms.
pub const ROLLS_ABOVE: f64 = 0.0175;

/// Distance between the IMU and the point about which a standing foot turns, m, as the default of
/// [`VelocityParams::lever`].
pub const LEVER_M: f64 = VelocityParams::DEFAULT.lever as f64;

/// Height by which a foot of unknown load rises or sinks if it does not slide, m. Simulated slides rise by 0.7 mm at
/// most until the foot peels off, whereas swings of a TALOS and a NAO rise by 3 to 50 mm.
pub const RISES_ABOVE_M: f64 = 0.002;

/// Peak of a slide's speed over its root mean square, if the foot begins and ends at rest with the least jerk.
const PEAK: f64 = 1.57;

/// Largest acceleration along the ground that can be an error, m/s²: the sum of an offset of 40 mg on each axis and of an
/// inclination error of 8°. Any value from 1.5 to 2.5 reports the same slips of real robots.
const LARGEST_ERROR: f64 = 2.0;

/// Flags of samples in which the motion of the foot is unknown.
const MOTION_UNKNOWN: [Flag; 5] = [
    Flag::WindowNotFull,
    Flag::AttitudeNotInitialised,
    Flag::Stale,
    Flag::InvalidSample,
    Flag::TimeGap,
];

/// Time for which a sample with such a flag lowers the probabilities, µs: the longest window of a preset.
const RECOVERY_US: u64 = 50_000;

/// Returns whether the motion of the foot in a sample is unknown.
fn is_motion_unknown(estimate: &ContactEstimate) -> bool {
    let mut flags = MOTION_UNKNOWN.into_iter();
    flags.any(|flag| estimate.flags.contains(flag))
}

/// State of the stretch up to its newest sample.
#[derive(Clone, Copy, Debug, Default)]
struct Unstable {
    /// Time of its first sample.
    start: Timestamp,
    /// Greatest probability of stable contact.
    peak: f32,
    /// Distance along the ground at lift-off, m.
    distance_to_lift: Option<f64>,
    newest: Timestamp,
    has_load: bool,
    /// Start of the time without load, and of lifting or tilting.
    unloaded: Option<Timestamp>,
    lifted: Option<Timestamp>,
    /// Start of rising or sinking by more than [`RISES_ABOVE_M`].
    rose: Option<Timestamp>,
    /// Start of rolling about the toe or heel.
    rolled: Option<Timestamp>,
    /// Whether it slid before it rolled.
    slid: bool,
    unknown_us: u64,
    last_unknown: Option<Timestamp>,
    /// Motion since the last stable sample; `None` if there was none.
    reckoning: Option<Reckoning>,
}

/// Verdict on a stretch.
enum Verdict {
    /// The foot left the ground at `lift_off`; with `slip`, it slid from the start until then.
    Swing {
        /// Time of the lift-off.
        lift_off: Timestamp,
        /// Whether the foot slid before.
        slip: bool,
    },
    /// The motion of the foot is unknown.
    Unknown,
    /// The foot slid.
    Slip,
    /// The foot stayed in place.
    Neither,
}

impl Unstable {
    /// Starts a stretch with this estimate; `stood` is the motion since the last stable one.
    fn new(stood: Option<Reckoning>, estimate: &ContactEstimate) -> Self {
        let mut unstable = Self {
            start: estimate.timestamp,
            newest: stood.map_or(estimate.timestamp, |reckoning| reckoning.now),
            reckoning: stood,
            ..Self::default()
        };
        unstable.add(estimate);
        unstable
    }

    /// Processes the next estimate.
    fn add(&mut self, estimate: &ContactEstimate) {
        let now = estimate.timestamp;
        self.reckon(estimate);
        self.peak = self.peak.max(estimate.probabilities.stable);
        if is_motion_unknown(estimate) {
            self.unknown_us += now.micros_since(self.newest).unwrap_or(0);
            self.last_unknown = Some(now);
        }
        self.newest = now;
        let was_on_ground = self.left_ground().is_none();
        match estimate.phase {
            Phase::Unknown => {}
            Phase::Stance | Phase::Slip | Phase::Landing => self.has_load = true,
            Phase::Swing | Phase::QuietSwing => {
                self.has_load = true;
                self.unloaded.get_or_insert(now);
            }
        }
        let has_recovered = |unknown| now.micros_since(unknown).is_some_and(|us| us > RECOVERY_US);
        if self.last_unknown.is_none_or(has_recovered) {
            if estimate.probabilities.vertical < LIFTED_BELOW {
                self.lifted.get_or_insert(now);
            }
            if let Some(reckoning) = self.reckoning {
                if reckoning.tilt(estimate) > ROLLS_ABOVE {
                    self.rolled.get_or_insert(now);
                }
                if reckoning.rise() > RISES_ABOVE_M {
                    self.rose.get_or_insert(now);
                }
            }
            self.slid |=
                self.left_ground().is_none() && estimate.probabilities.tangential < SLIDES_BELOW;
        }
        if was_on_ground && self.left_ground().is_some() {
            self.distance_to_lift = self.reckoning.and_then(|reckoning| reckoning.distance());
        }
    }

    /// Integrates the motion up to this estimate, which may be the first after the stretch.
    fn reckon(&mut self, estimate: &ContactEstimate) {
        if let Some(reckoning) = &mut self.reckoning {
            reckoning.add(estimate);
        }
    }

    /// Returns whether the foot stood before.
    const fn stood(&self) -> bool {
        self.reckoning.is_some()
    }

    /// Distance along the ground, m, of a foot that now stands again.
    fn distance_to_rest(&self) -> Option<f64> {
        self.reckoning?.distance_to_rest()
    }

    /// Time at which it lost its load, lifted, rose or began to roll, whichever was first.
    fn left_ground(&self) -> Option<Timestamp> {
        let times = [self.unloaded, self.lifted, self.risen(), self.rolled].into_iter();
        times.flatten().min_by_key(|time| time.as_micros())
    }

    /// Returns whether it lasts as long as a swing.
    fn lasts(&self) -> bool {
        self.lasts_until(self.newest)
    }

    /// Returns whether it lasts until then as long as a swing.
    fn lasts_until(&self, end: Timestamp) -> bool {
        end.micros_since(self.start).is_some_and(|us| us >= SHORTEST_SWING_US)
    }

    /// Start of rising or sinking. With a load it is not needed, because the load shows whether the foot is on the ground.
    fn risen(&self) -> Option<Timestamp> {
        self.rose.filter(|_| !self.has_load)
    }

    /// Returns whether the turn of the foot explains its speed. `rests` tells whether the stretch ends at rest. The speed is
    /// unknown if samples are missing, or if the acceleration is unknown, as in recorded contacts.
    fn only_turned(&self, rests: bool) -> bool {
        self.reckoning.is_some_and(|reckoning| reckoning.only_turned(rests))
    }

    /// Returns the verdict on the stretch if it ends here. `rests` tells whether it ends at rest.
    fn verdict(&self, rests: bool) -> Verdict {
        let has_swung = if self.has_load { self.unloaded.is_some() } else { self.lifted.is_some() };
        let slid_until = |end: Timestamp| self.slid && self.lasts_until(end);
        match self.left_ground().filter(|_| has_swung) {
            Some(left) if self.lasts() => {
                let slip = slid_until(left);
                Verdict::Swing { lift_off: if slip { left } else { self.start }, slip }
            }
            _ if self.unknown_us >= SHORTEST_SWING_US => Verdict::Unknown,
            _ if self.risen().is_some() => Verdict::Neither,
            _ if self.rolled.map_or(self.slid, slid_until) && !self.only_turned(rests) => {
                Verdict::Slip
            }
            _ => Verdict::Neither,
        }
    }
}

/// Stance of a foot with a load, as long as it has not been stable.
#[derive(Clone, Copy, Debug, Default)]
enum Loaded {
    /// The foot is stable or its load is unknown.
    #[default]
    Otherwise,
    /// The foot is not loaded.
    Unloaded,
    /// The foot has been loaded since then, with this greatest probability.
    Since(Timestamp, f32),
}

impl Loaded {
    /// Processes the next estimate; returns start and end of a stance that ends here and was never stable.
    fn add(&mut self, estimate: &ContactEstimate) -> Option<[ContactEvent; 2]> {
        let now = estimate.timestamp;
        let before = *self;
        *self = match (estimate.phase, before) {
            (Phase::Swing, _) => Self::Unloaded,
            // The decision is "stable" in a quiet swing.
            (Phase::Stance | Phase::QuietSwing | Phase::Unknown, _) => Self::Otherwise,
            // Without data the foot may have been stable.
            (Phase::Slip | Phase::Landing, _) if is_motion_unknown(estimate) => Self::Otherwise,
            (Phase::Slip | Phase::Landing, Self::Unloaded) => {
                Self::Since(now, estimate.probabilities.stable)
            }
            (Phase::Slip | Phase::Landing, Self::Since(start, peak)) => {
                Self::Since(start, peak.max(estimate.probabilities.stable))
            }
            (Phase::Slip | Phase::Landing, Self::Otherwise) => Self::Otherwise,
        };
        let (Self::Unloaded, Self::Since(start, peak)) = (*self, before) else {
            return None;
        };
        let duration_us = now.micros_since(start).filter(|us| *us >= SHORTEST_SWING_US)?;
        let of = |kind, time| ContactEvent {
            duration_us: Some(duration_us),
            peak,
            ..ContactEvent::new(kind, time)
        };
        Some([of(EventKind::UnstableStart, start), of(EventKind::UnstableEnd, now)])
    }
}

/// Longest step between samples, µs; the motion within longer steps is unknown.
const LONGEST_STEP_US: u64 = 20_000;

/// Flags of samples that cannot be integrated.
const UNSOUND: [Flag; 4] =
    [Flag::AttitudeNotInitialised, Flag::Saturated, Flag::Stale, Flag::InvalidSample];

/// Motion since the foot last stood: its acceleration without gravity, rotated into the world frame and integrated
/// twice with the trapezoidal rule.
#[derive(Clone, Copy, Debug)]
struct Reckoning {
    start: Timestamp,
    /// Time of the newest estimate.
    now: Timestamp,
    /// Up in the frame of the foot during its stance.
    up: Vector,
    /// Acceleration in the world frame, m/s².
    acceleration: Vector,
    /// Velocity, m/s.
    velocity: Vector,
    /// Position, m.
    position: Vector,
    /// Integral of the square of the speed along the ground, m²/s.
    squares: f64,
    /// Integral of the time since the start times the velocity, m.
    moment: Vector,
    /// Integral of the rate of turn, rad.
    turned: f64,
    is_sound: bool,
}

impl Reckoning {
    /// Starts from a foot at rest; this is the last stable estimate.
    fn from_rest(estimate: &ContactEstimate) -> Self {
        Self {
            start: estimate.timestamp,
            now: estimate.timestamp,
            up: up(estimate),
            acceleration: in_world(estimate),
            velocity: Vector::default(),
            position: Vector::default(),
            squares: 0.0,
            moment: Vector::default(),
            turned: 0.0,
            is_sound: true,
        }
    }

    /// Processes the next estimate.
    fn add(&mut self, estimate: &ContactEstimate) {
        let step = estimate.timestamp.micros_since(self.now);
        let acceleration = in_world(estimate);
        self.now = estimate.timestamp;
        match step {
            Some(micros) if micros <= LONGEST_STEP_US => {
                let seconds = micros as f64 / 1.0e6;
                let change = (self.acceleration + acceleration) * (0.5 * seconds);
                self.position = self.position + self.velocity * seconds + change * (0.5 * seconds);
                self.velocity = self.velocity + change;
                let Vector { x, y, .. } = self.velocity;
                self.squares += (x * x + y * y) * seconds;
                self.moment = self.moment + self.velocity * (self.seconds() * seconds);
                self.turned += f64::from(estimate.angular_rate.0.length()) * seconds;
            }
            _ => self.is_sound = false,
        }
        self.is_sound &= !UNSOUND.iter().any(|flag| estimate.flags.contains(*flag));
        self.acceleration = acceleration;
    }

    /// Inclination of the foot against its stance, rad; 0 to π.
    fn tilt(&self, estimate: &ContactEstimate) -> f64 {
        self.up.angle_to(up(estimate))
    }

    /// Distance along the ground of a foot that now stands again, m. The remaining speed is an error that is assumed to
    /// have grown linearly, and is removed. `None` if a sample was missing or doubtful.
    fn distance_to_rest(&self) -> Option<f64> {
        self.along_ground(self.position - self.velocity * (0.5 * self.seconds()))
    }

    /// Distance along the ground of a foot that still moves, m.
    fn distance(&self) -> Option<f64> {
        self.along_ground(self.position)
    }

    /// Returns the height by which the foot has risen or sunk, m; 0 if it is unknown. This is the smaller of two heights: of a
    /// foot that stands now, and of a foot that still moves. So a constant error of the acceleration does not count.
    fn rise(&self) -> f64 {
        let moving = self.position.z.abs();
        let standing = (self.position.z - self.velocity.z * (0.5 * self.seconds())).abs();
        if self.is_sound { moving.min(standing) } else { 0.0 }
    }

    /// Returns whether the turn explains the speed along the ground. If the foot rests now, the remaining speed is an error
    /// and is removed, as for the distance, up to that of [`LARGEST_ERROR`]. `false` if the speed is unknown.
    fn only_turned(&self, rests: bool) -> bool {
        let seconds = self.seconds();
        let Vector { x, y, .. } = self.velocity;
        let speed = Vector::new(x, y, 0.0);
        let error = speed * (LARGEST_ERROR * seconds / speed.length()).min(1.0);
        // ∫ |v − error · t/T|² dt
        let removed = error.dot(error) * (seconds / 3.0) - error.dot(self.moment) * (2.0 / seconds);
        let squares = self.squares + if rests { removed } else { 0.0 };
        let turn = LEVER_M * self.turned / seconds;
        let is_known = self.is_sound && squares.is_finite();
        // Rounding may leave a slightly negative square.
        is_known && PEAK * PEAK * squares.max(0.0) < turn * turn * seconds
    }

    /// Time since the start, s.
    fn seconds(&self) -> f64 {
        self.now.micros_since(self.start).unwrap_or(0) as f64 / 1.0e6
    }

    fn along_ground(&self, Vector { x, y, .. }: Vector) -> Option<f64> {
        let distance = Vector::new(x, y, 0.0).length();
        (self.is_sound && distance.is_finite()).then_some(distance)
    }
}

/// Acceleration without gravity in the world frame, m/s².
fn in_world(estimate: &ContactEstimate) -> Vector {
    rotation(estimate).to_world(estimate.linear_acceleration.0.into())
}

/// Up in the frame of the foot.
fn up(estimate: &ContactEstimate) -> Vector {
    rotation(estimate).to_sensor(Vector::new(0.0, 0.0, 1.0))
}

fn rotation(estimate: &ContactEstimate) -> Rotation {
    let q = estimate.orientation;
    Rotation { w: q.w.into(), v: Vector::new(q.x.into(), q.y.into(), q.z.into()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{
        AngularRate, Flag, Flags, LinearAcceleration, Phase, Probabilities, Quaternion, Vec3,
    };

    /// Estimate of a foot that does this:
    ///
    /// | letter | it |
    /// |---|---|
    /// | `s` | stands |
    /// | `f`, `F` | swings; with a load signal |
    /// | `a`, `b`, `+`, `-`, `L` | slides with 1, 2, 2.5 or −1.5 m/s², with 1 m/s² and a load |
    /// | `c` | slides with −2 m/s² |
    /// | `w`, `W` | sways: the sensor moves along the ground with 1 or −1 m/s², and the foot turns at 0.3 rad/s |
    /// | `u` | the same, with an unknown acceleration |
    /// | `k` | the same with 4 m/s² |
    /// | `^`, `_` | slides and rises with 1 m/s² each; with −1 m/s² each |
    /// | `r` | rolls about its toe: the sensor moves along the ground, and the foot is inclined by 5° |
    /// | `v` | moves up and down on the spot |
    /// | `h`, `H` | moves unseen: the samples are unusable; with a load |
    fn estimate(does: char, ms: u64) -> ContactEstimate {
        let (phase, [stable, tangential, vertical], along) = match does {
            's' => (Phase::Unknown, [0.95, 1.0, 1.0], 0.0),
            'f' => (Phase::Unknown, [0.0; 3], 5.0),
            'F' => (Phase::Swing, [0.0; 3], 5.0),
            'a' | 'r' | 'w' | '^' => (Phase::Unknown, [0.1, 0.1, 0.9], 1.0),
            'W' | '_' => (Phase::Unknown, [0.1, 0.1, 0.9], -1.0),
            'u' => (Phase::Unknown, [0.1, 0.1, 0.9], f32::NAN),
            'k' => (Phase::Unknown, [0.1, 0.1, 0.9], 4.0),
            'b' => (Phase::Unknown, [0.1, 0.1, 0.9], 2.0),
            'c' => (Phase::Unknown, [0.1, 0.1, 0.9], -2.0),
            '+' => (Phase::Unknown, [0.1, 0.1, 0.9], 2.5),
            '-' => (Phase::Unknown, [0.1, 0.1, 0.9], -1.5),
            'L' => (Phase::Slip, [0.1, 0.1, 0.9], 1.0),
            'v' => (Phase::Slip, [0.3, 0.95, 0.3], 0.0),
            'h' => (Phase::Unknown, [0.0; 3], 0.0),
            'H' => (Phase::Slip, [0.0; 3], 0.0),
            _ => panic!("{does}"),
        };
        let rise = match does {
            '^' => 1.0,
            '_' => -1.0,
            _ => 0.3,
        };
        let turn = if matches!(does, 'k' | 'u' | 'w' | 'W') { 0.3 } else { 0.0 };
        ContactEstimate {
            timestamp: Timestamp::from_micros(1000 * ms),
            probabilities: Probabilities {
                stable,
                tangential,
                vertical,
                ..Probabilities::default()
            },
            decision: match does {
                's' => Decision::Stable,
                _ => Decision::NotStable,
            },
            phase,
            flags: match does {
                'h' | 'H' => Flags::NONE.with(Flag::InvalidSample),
                _ => Flags::NONE,
            },
            orientation: match does {
                'r' => Quaternion { w: 0.99905, x: 0.0, y: 0.04362, z: 0.0 },
                _ => Quaternion::IDENTITY,
            },
            linear_acceleration: LinearAcceleration(Vec3::new(0.6 * along, 0.8 * along, rise)),
            angular_rate: AngularRate(Vec3::new(0.0, turn, 0.0)),
            ..ContactEstimate::default()
        }
    }

    /// Returns the events of a sequence such as `300f 500s`: durations in ms, and what the foot does.
    fn events(of: &str) -> Vec<ContactEvent> {
        let each = of.split_whitespace().flat_map(|part| {
            let (ms, does) = part.split_at(part.len() - 1);
            (0..ms.parse().expect(part)).flat_map(move |_: u64| does.chars())
        });
        let mut events = Events::default();
        let mut found = Vec::new();
        for (ms, does) in (0..).zip(each) {
            events.add(&estimate(does, ms));
            found.extend(std::iter::from_fn(|| events.pop()));
        }
        found.extend(events.finish());
        found
    }

    /// Returns name, time in ms, and duration in ms of each event.
    fn described(of: &str) -> String {
        let say = |event: &ContactEvent| {
            let (name, ms) = (event.kind.name(), event.time.as_micros() / 1000);
            let duration = event.duration_us.map(|us| format!(" {}", us / 1000));
            format!("{name} {ms}{}", duration.unwrap_or_default())
        };
        let described: Vec<String> = events(of).iter().map(say).collect();
        described.join(", ")
    }

    #[test]
    fn motions_yield_events() {
        const STEP: &str = "touch_down 300 500, lift_off 800 500, touch_down 1100";
        const SLIPPERY: &str = "lift_off 500, unstable_start 700 250, unstable_end 950 250, \
        unstable_start 1150 150, unstable_end 1300 150, touch_down 1910";
        for (why, motions, expected) in [
            ("a step", "300F 500s 300F 400s", STEP),
            ("a step without a load", "300f 500s 300f 400s", STEP),
            (
                "two stances that slide throughout, a bounce, a landing",
                "200L 300s 200F 250L 200F 150L 200F 60L 200F 150L 400s",
                SLIPPERY,
            ),
            (
                "unusable samples make no unstable stance",
                "300s 200F 100L 1H 100L 200F",
                "lift_off 300",
            ),
            ("it stands at the start", "180h 500s 300f", "lift_off 680"),
            (
                "a slip within a stance",
                "300f 100s 100b 100c 200s 300f",
                "touch_down 300 500, slip_start 400 200, slip_end 600 200, lift_off 800 500",
            ),
            (
                "a slip ends at the lift-off",
                "100s 200L 300F 50s",
                "slip_start 100 200, slip_end 300 200, lift_off 300, touch_down 600",
            ),
            ("a short one is the lift-off", "100s 60L 300F 50s", "lift_off 100, touch_down 460"),
            (
                "P rises within a slide",
                "100s 50a 15s 50a 29s 50a 100s",
                "slip_start 100 194, slip_end 294 194",
            ),
            (
                "the foot rests between two slides",
                "100s 50a 31s 50a 100s",
                "slip_start 100 50, slip_end 150 50, slip_start 181 50, slip_end 231 50",
            ),
            (
                "it slides, and turns on the spot",
                "100s 50a 20s 15w 15W 100s",
                "slip_start 100 50, slip_end 150 50",
            ),
            (
                "a slide with a rise of P ends at the lift-off",
                "100s 80L 20s 120L 300F 50s",
                "slip_start 100 220, slip_end 320 220, lift_off 320, touch_down 620",
            ),
            (
                "it slides, and swings soon",
                "100s 80a 10s 300f 50s",
                "slip_start 100 80, slip_end 180 80, lift_off 190, touch_down 490",
            ),
            ("the recording ends in a slide", "100s 50a 20s 50a", "slip_start 100"),
            ("the recording ends in a slide or a lift-off", "100s 50a", ""),
            ("the recording ends in a short slide under load", "100s 50L", "slip_start 100"),
            (
                "the recording ends after a slide, in another or a lift-off",
                "100s 30a 20s 30a",
                "slip_start 100 30, slip_end 130 30",
            ),
            (
                "the recording ends after a slide",
                "100s 50a 20s",
                "slip_start 100 50, slip_end 150 50",
            ),
            ("a short slide", "100s 40a 100s", "slip_start 100 40, slip_end 140 40"),
            ("it sways on the spot", "100s 20w 20W 100s", ""),
            ("it sways with an offset of the acceleration", "100s 40w 100s", ""),
            (
                "it slides to a stop at once, and turns",
                "100s 40k 100s",
                "slip_start 100 40, slip_end 140 40",
            ),
            ("it rises and sinks, as in a smooth swing", "100s 80^ 80_ 100s", ""),
            ("it slides, rises and sinks", "100s 100a 100c 80^ 80_ 100s", ""),
            ("it moves an unknown distance", "100s 40u 100s", "slip_start 100 40, slip_end 140 40"),
            ("it slides and sways", "100s 60w 60W 100s", "slip_start 100 120, slip_end 220 120"),
            ("it rocks about its toe", "100s 30a 120r 100s", ""),
            (
                "it rolls off about its toe",
                "100s 30a 120r 300f 50s",
                "lift_off 100, touch_down 550",
            ),
            ("a slide before a roll", "100s 150a 50r 100s", "slip_start 100 200, slip_end 300 200"),
            ("it sinks", "100s 200v 100s", ""),
            (
                "the end of the stance is unseen",
                "300f 300s 400h 300s 200f 9s",
                "touch_down 300, lift_off 1300, touch_down 1500",
            ),
            (
                "a short gap is bridged",
                "300f 300s 20h 300s 200f 9s",
                "touch_down 300 620, lift_off 920 620, touch_down 1120",
            ),
        ] {
            assert_eq!(described(motions), expected, "{why}");
        }
        // A short shock in the stance is not a swing.
        let knocked = events("200s 50f 200s");
        assert!(knocked.iter().all(|event| event.kind.name().starts_with("slip")));
    }

    #[test]
    fn slip_has_a_distance_and_a_peak() {
        // Up to 0.2 m/s and back to rest in 0.2 s; then with a constant error of 0.5 m/s².
        for slip in ["100s 100b 100c 200s", "100s 100+ 100- 100s"] {
            let found = events(slip);
            let [Some(start), Some(end)] = [found[0].distance_m, found[1].distance_m] else {
                panic!("{found:?}");
            };
            assert!(start == end && (start - 0.02).abs() < 5e-4, "{start}");
        }
        // Over a rise of P, with 0.2 m/s throughout.
        let joined = events("100s 100b 20s 100c 200s");
        let distance = joined[0].distance_m.expect("a distance");
        assert!(joined.len() == 2 && (distance - 0.024).abs() < 5e-4, "{joined:?}");
        assert_eq!(joined[0].peak, 0.95);
        let hidden = events("100s 100b 1h 100c 100s");
        assert_eq!(hidden.len(), 2);
        assert_eq!((hidden[0].distance_m, hidden[0].duration_us), (None, Some(201_000)));
        let stance = events("300f 100s 100b 100s 300f");
        let of = stance.iter().map(|event| (event.peak, event.distance_m.is_some()));
        let of: Vec<_> = of.collect();
        assert_eq!(of, [(0.95, false), (0.1, true), (0.1, true), (0.95, false)]);
    }

    #[test]
    fn row_has_a_cell_for_every_header_name() {
        let event = ContactEvent {
            time: Timestamp::from_micros(1_500_000),
            kind: EventKind::SlipEnd,
            duration_us: Some(1_000_020),
            peak: 0.25,
            distance_m: Some(0.0123),
        };
        let row = |foot, event: &ContactEvent, start_us| {
            let mut bytes = Vec::new();
            write_event(foot, event, start_us, &mut bytes).unwrap();
            String::from_utf8(bytes).unwrap()
        };
        assert_eq!(row(None, &event, -2_000_000), "-0.500000,slip_end,1.000020,0.25,0.012300\n");
        let blank = ContactEvent {
            kind: EventKind::TouchDown,
            duration_us: None,
            distance_m: None,
            ..event
        };
        assert_eq!(row(Some("a,b"), &blank, 0), "\"a,b\",1.500000,touch_down,,0.25,\n");
        assert_eq!(row(None, &blank, 0).matches(',').count(), HEADER.matches(',').count());
    }
}
