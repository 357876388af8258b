//! True motion of a foot that follows a plan.
//!
//! A [`Track`] consists of segments: each step of the plan becomes a peel, a swing and a stance, which
//! `stride` joins to the stance before. A segment has three positions and three angles, each a base path plus terms,
//! and the load during contact. All of them are closed forms, so that velocity and acceleration are exact at any moment.

use samples::space::{Rotation, Vector};

use crate::jet::{Jet, from_roll_pitch_yaw};
use crate::plan::{Plan, PlannedStep, Slip, Spring};
use crate::shape::{Quintic, Term, TermShape};

/// True state of a foot at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootState {
    /// World frame, m; x forward, y to the left, z up.
    pub position: Vector,
    /// World frame, m/s.
    pub velocity: Vector,
    /// World frame, m/s².
    pub acceleration: Vector,
    /// Sensor → world.
    pub orientation: Rotation,
    /// Sensor frame, rad/s.
    pub angular_rate: Vector,
    /// Vertical load, N; never negative.
    pub load: f64,
    /// Activity of the foot.
    pub activity: Activity,
    /// Distance slid since touch-down, along the path, m. Ringing and sinking do not count.
    pub slip: f64,
}

/// True motion of a foot that follows a plan.
#[derive(Clone, Debug)]
pub struct Track {
    standing: Segment,
    /// Segments in order of time; the last never ends.
    strides: Vec<Segment>,
}

impl Track {
    /// Computes the segments of a plan.
    #[must_use]
    pub fn new(plan: &Plan) -> Self {
        let standing = standing_still(plan.standing, plan.steps.first());
        let mut strides: Vec<Segment> = Vec::with_capacity(3 * plan.steps.len());
        let mut time = plan.standing;
        for (index, step) in plan.steps.iter().enumerate() {
            let before = strides.last().unwrap_or(&standing);
            let segments = stride(before, time, step, plan.steps.get(index + 1));
            strides.extend(segments);
            time += step.duration();
        }
        Self { standing, strides }
    }

    /// Returns the state at time `t` in s from the beginning. Earlier times give the initial state.
    #[must_use]
    pub fn at(&self, t: f64) -> FootState {
        let begun = self.strides.partition_point(|segment| segment.start <= t);
        let segment = self.strides[..begun].last().unwrap_or(&self.standing);
        let [x, y, z, roll, pitch, yaw] = segment.pose(t);
        let (orientation, angular_rate) = from_roll_pitch_yaw([roll, pitch, yaw]);
        FootState {
            position: Vector::new(x.value, y.value, z.value),
            velocity: Vector::new(x.rate, y.rate, z.rate),
            acceleration: Vector::new(x.acceleration, y.acceleration, z.acceleration),
            orientation,
            angular_rate,
            load: segment.load(t, z.acceleration),
            activity: segment.activity(t),
            slip: segment.slip(t),
        }
    }

    /// Returns the instants of touch-down in s, where the acceleration jumps, in order of time.
    pub fn impacts(&self) -> impl Iterator<Item = f64> {
        let stances = self.strides.iter().filter(|s| matches!(s.kind, SegmentKind::Stance { .. }));
        stances.map(|segment| segment.start)
    }
}

/// Activity of a foot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activity {
    /// Standing on the ground.
    Standing,
    /// Peeling off the ground, heel first, under the remaining load.
    Peeling,
    /// In the air.
    Swinging,
    /// Touched down, but not yet at rest.
    Landing,
    /// Sliding under load.
    Slipping,
}

/// x, y, z, roll, pitch, yaw.
const CHANNELS: usize = 6;
const X: usize = 0;
const Y: usize = 1;
const Z: usize = 2;
const ROLL: usize = 3;
const PITCH: usize = 4;
const YAW: usize = 5;

/// State of all channels.
type Pose = [Jet; CHANNELS];

/// Mass of foot and shank that an impact stops, kg.
const EFFECTIVE_MASS: f64 = 0.25;

/// Transition from 0 to 1, with least jerk.
#[derive(Clone, Copy, Debug)]
struct Transition {
    /// s.
    pub start: f64,
    /// s, positive.
    pub duration: f64,
}

impl Transition {
    /// Transition that is always complete.
    pub const ALREADY: Self = Self { start: f64::NEG_INFINITY, duration: 1.0 };

    /// Transition that never begins.
    pub const NEVER: Self = Self { start: f64::INFINITY, duration: 1.0 };

    /// Returns the progress at time `t` in s.
    pub fn progress(self, t: f64) -> f64 {
        let shape = TermShape::Slide { distance: 1.0 };
        Term::new(self.start, self.duration, shape).at(t).value
    }
}

/// Vertical load over one contact: it builds up, stays, and decreases.
#[derive(Clone, Copy, Debug)]
struct LoadProfile {
    /// N.
    pub level: f64,
    pub rise: Transition,
    pub fall: Transition,
}

impl LoadProfile {
    fn at(&self, t: f64) -> f64 {
        self.level * self.rise.progress(t) * (1.0 - self.fall.progress(t))
    }
}

/// Contact of the foot.
#[derive(Clone, Debug)]
enum SegmentKind {
    /// The whole sole is on the ground.
    Stance {
        /// End of the landing, s.
        settled: f64,
        /// Slides; their onsets count from the segment's start.
        slips: Vec<Slip>,
    },
    /// The toes are on the ground.
    Peel,
    /// No contact.
    Swing,
}

/// Piece of a motion; it ends where the next one starts.
#[derive(Clone, Debug)]
struct Segment {
    pub kind: SegmentKind,
    /// s.
    pub start: f64,
    pub base: [Quintic; CHANNELS],
    /// Terms, each with its channel.
    pub terms: Vec<(usize, Term)>,
    /// Load; `None` in the air.
    pub load: Option<LoadProfile>,
}

impl Segment {
    /// Returns position and motion of the foot at time `t` in s.
    pub fn pose(&self, t: f64) -> Pose {
        let mut pose = self.base.map(|path| path.at(t));
        for (channel, term) in &self.terms {
            pose[*channel] += term.at(t);
        }
        pose
    }

    /// Returns the activity of the foot at time `t` in s.
    pub fn activity(&self, t: f64) -> Activity {
        match &self.kind {
            SegmentKind::Peel => Activity::Peeling,
            SegmentKind::Swing => Activity::Swinging,
            SegmentKind::Stance { slips, settled } => {
                let since_start = t - self.start;
                let slides =
                    |slip: &Slip| (slip.onset..slip.onset + slip.duration).contains(&since_start);
                if slips.iter().any(slides) {
                    Activity::Slipping
                } else if t < *settled {
                    Activity::Landing
                } else {
                    Activity::Standing
                }
            }
        }
    }

    /// Returns the vertical load in N at time `t` in s, while the foot accelerates upwards by
    /// `upward_acceleration` in m/s².
    pub fn load(&self, t: f64, upward_acceleration: f64) -> f64 {
        let profile = self.load.map_or(0.0, |profile| profile.at(t));
        match self.kind {
            // The ground also stops the foot itself; it cannot pull.
            SegmentKind::Stance { .. } => (profile + EFFECTIVE_MASS * upward_acceleration).max(0.0),
            SegmentKind::Peel | SegmentKind::Swing => profile,
        }
    }

    /// Returns the distance slid from the segment's start to time `t` in s, m.
    pub fn slip(&self, t: f64) -> f64 {
        match &self.kind {
            SegmentKind::Stance { slips, .. } => slips
                .iter()
                .map(|slip| {
                    let slide =
                        Transition { start: self.start + slip.onset, duration: slip.duration };
                    slip.distance * slide.progress(t)
                })
                .sum(),
            SegmentKind::Peel | SegmentKind::Swing => 0.0,
        }
    }
}

/// Time constants after which a ring has ended: e⁻¹⁰ of 25 g is 0.01 m/s², less than the noise.
const RING_TIME_CONSTANTS: f64 = 10.0;

/// Share of its rings after which a landing is over: e⁻⁵ and the shape's own fading leave a thousandth of the
/// landing's speed.
const LANDING_SHARE: f64 = 0.5;

/// Foot pitch in rad and its rate at the end of the peel: a heel that rolls off as the swing takes over.
const PEEL_PITCH: Jet = Jet::moving(0.04, 1.5);

/// Sensor height in m and its rate at the end of the peel.
const PEEL_HEIGHT: Jet = Jet::moving(0.003, 0.15);

/// Load on a foot while the robot stands on all four, N: a quarter of a GO1's 12 kg.
const STANDING_LOAD: f64 = 29.4;

/// Share of a ripple's amplitude that one period reaches under its envelope.
const ONE_PERIOD_PEAK: f64 = 0.56;

/// Share of stick-slip that acts vertically, because the contact force dips whenever the foot lets go.
const VERTICAL_CHATTER: f64 = 1.0 / 3.0;

/// Stands still at the origin and level, from time 0 until the step `next` begins at `until` in s.
fn standing_still(until: f64, next: Option<&PlannedStep>) -> Segment {
    Segment {
        kind: SegmentKind::Stance { settled: f64::NEG_INFINITY, slips: Vec::new() },
        start: 0.0,
        base: [Quintic::rest(0.0); CHANNELS],
        terms: Vec::new(),
        load: Some(LoadProfile {
            level: STANDING_LOAD,
            rise: Transition::ALREADY,
            fall: unloading(until, next),
        }),
    }
}

/// Returns the segments of `step` from time `start` in s on, after the stance `before`; the step `next` determines
/// how the load decreases at the end.
fn stride(
    before: &Segment,
    start: f64,
    step: &PlannedStep,
    next: Option<&PlannedStep>,
) -> [Segment; 3] {
    let stood_at = before.pose(start);
    let (peel, lifted) = peel(step, start, &stood_at, before.load);
    let lift_off = start + step.peel;
    let (swing, landed) = swing(step, lift_off, &lifted, &stood_at);
    let touch_down = lift_off + step.swing;
    [peel, swing, stance(step, touch_down, &landed, next)]
}

/// Returns the decrease of the load before the lift-off of the step `next`, whose peel begins at `peel_start`. Much of the
/// load is gone before the foot moves.
fn unloading(peel_start: f64, next: Option<&PlannedStep>) -> Transition {
    next.map_or(Transition::NEVER, |next| Transition {
        start: peel_start + next.peel - next.load_change,
        duration: next.load_change,
    })
}

fn peel(
    step: &PlannedStep,
    start: f64,
    stood_at: &Pose,
    load: Option<LoadProfile>,
) -> (Segment, Pose) {
    let mut lifted = *stood_at;
    lifted[PITCH] += PEEL_PITCH;
    lifted[Z] += PEEL_HEIGHT;
    let segment = Segment {
        kind: SegmentKind::Peel,
        start,
        base: paths(stood_at, &lifted, start, step.peel),
        terms: Vec::new(),
        load,
    };
    (segment, lifted)
}

fn swing(step: &PlannedStep, start: f64, lifted: &Pose, stood_at: &Pose) -> (Segment, Pose) {
    let duration = step.swing;
    let landing = &step.touch_down;
    let [roll, pitch, yaw] = step.tilt;
    let landed = [
        Jet::moving(stood_at[X].value + step.travel[0], landing.scuff[0]),
        Jet::moving(stood_at[Y].value + step.travel[1], landing.scuff[1]),
        // A foot that sank in leaves the hollow behind.
        Jet::moving(0.0, -landing.speed),
        Jet::moving(roll, landing.turn[0]),
        Jet::moving(pitch, landing.turn[1]),
        Jet::constant(yaw),
    ];
    let lift = TermShape::Pulse { height: step.clearance };
    let pitching = TermShape::Ripple {
        amplitude: step.pitch_swing / ONE_PERIOD_PEAK,
        angular_frequency: std::f64::consts::TAU / duration,
        phase: 0.0,
    };
    let segment = Segment {
        kind: SegmentKind::Swing,
        start,
        base: paths(lifted, &landed, start, duration),
        terms: vec![
            (Z, Term::new(start, duration, lift)),
            (PITCH, Term::new(start, duration, pitching)),
        ],
        load: None,
    };
    (segment, landed)
}

fn stance(step: &PlannedStep, start: f64, landed: &Pose, next: Option<&PlannedStep>) -> Segment {
    let standing = step.standing();
    let landing = &step.touch_down;
    let springs = [
        (X, landing.tangential),
        (Y, landing.tangential),
        (Z, landing.vertical),
        (ROLL, landing.rotational),
        (PITCH, landing.rotational),
    ];
    let mut settled = start;
    let mut terms = Vec::new();
    for (channel, spring) in springs {
        let ring = ring(landed[channel].rate, spring, start, standing);
        settled = settled.max(start + LANDING_SHARE * ring.duration);
        terms.push((channel, ring));
    }
    if let Some(sinking) = step.sinking {
        let duration = sinking.duration.min(standing);
        settled = settled.max(start + duration);
        let [roll, pitch] = sinking.lean;
        for (channel, distance) in [(Z, -sinking.depth), (ROLL, roll), (PITCH, pitch)] {
            let shape = TermShape::Slide { distance };
            terms.push((channel, Term::new(start, duration, shape)));
        }
    }
    terms.extend(tremor(step, start, standing));
    for slip in &step.slips {
        terms.extend(slide(slip, start));
    }
    Segment {
        kind: SegmentKind::Stance { settled, slips: step.slips.clone() },
        start,
        base: landed.map(|channel| Quintic::rest(channel.value)),
        terms,
        load: Some(LoadProfile {
            level: step.load,
            rise: Transition { start, duration: step.load_change },
            fall: unloading(start + standing, next),
        }),
    }
}

fn paths(from: &Pose, to: &Pose, start: f64, duration: f64) -> [Quintic; CHANNELS] {
    std::array::from_fn(|channel| Quintic::between(from[channel], to[channel], start, duration))
}

fn ring(speed: f64, spring: Spring, start: f64, at_most: f64) -> Term {
    let natural = std::f64::consts::TAU * spring.frequency;
    let decay = spring.damping * natural;
    Term {
        start,
        duration: at_most.min(RING_TIME_CONSTANTS / decay),
        shape: TermShape::Ring {
            speed,
            angular_frequency: natural * libm::sqrt(1.0 - spring.damping * spring.damping),
            decay,
        },
    }
}

/// Returns a sine with its own phase for every axis that trembles.
fn tremor(step: &PlannedStep, start: f64, duration: f64) -> [(usize, Term); 5] {
    let angular_frequency = std::f64::consts::TAU * step.tremor.frequency;
    // A tremor without a frequency moves nothing.
    let over = |amplitude: f64, divisor: f64| if divisor > 0.0 { amplitude / divisor } else { 0.0 };
    let length = over(step.tremor.acceleration, angular_frequency * angular_frequency);
    let angle = over(step.tremor.rate, angular_frequency);
    let parts = [
        (X, length, 0.0),
        (Y, length, 1.3),
        (Z, length, 2.6),
        (ROLL, angle, 0.7),
        (PITCH, angle, 2.0),
    ];
    parts.map(|(channel, amplitude, phase)| {
        let shape = TermShape::Ripple { amplitude, angular_frequency, phase };
        (channel, Term::new(start, duration, shape))
    })
}

/// Slide of a foot in contact since touch-down at `touch_down`.
fn slide(slip: &Slip, touch_down: f64) -> [(usize, Term); 6] {
    let (sin, cos) = libm::sincos(slip.heading);
    let angular_frequency = std::f64::consts::TAU * slip.chatter_frequency;
    let chatter = slip.chatter / (angular_frequency * angular_frequency);
    let ripple = |amplitude| TermShape::Ripple { amplitude, angular_frequency, phase: 0.0 };
    let along = |distance| TermShape::Slide { distance };
    let parts = [
        (X, along(slip.distance * cos)),
        (Y, along(slip.distance * sin)),
        (YAW, along(slip.twist)),
        (X, ripple(chatter * cos)),
        (Y, ripple(chatter * sin)),
        (Z, ripple(chatter * VERTICAL_CHATTER)),
    ];
    parts.map(|(channel, shape)| {
        let start = touch_down + slip.onset;
        (channel, Term::new(start, slip.duration, shape))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{GaitName, Ground};

    /// Half the step of a difference quotient, s. It is wide enough for rounding, and short enough
    /// for the fastest ring, so that the tests find errors below 1e-5.
    const HALF_STEP: f64 = 2e-6;

    /// Returns moments of a motion, every 0.37 ms, without an impact within the difference quotient.
    fn moments(plan: &Plan, motion: &Track) -> Vec<f64> {
        let impacts: Vec<f64> = motion.impacts().collect();
        (1..)
            .map(|k| f64::from(k) * 3.7e-4)
            .take_while(|t| *t < plan.duration)
            .filter(|t| impacts.iter().all(|impact| (impact - t).abs() > 2.0 * HALF_STEP))
            .collect()
    }

    fn plans() -> Vec<Plan> {
        let steady = |gait, ground| Plan::steady(gait, ground, 8.0, 5);
        vec![
            Plan::demo(1),
            steady(GaitName::Trot, Ground::Hard),
            steady(GaitName::Run, Ground::Greased),
            steady(GaitName::Trot, Ground::Soft),
        ]
    }

    #[test]
    fn velocity_and_acceleration_are_the_derivatives_of_position() {
        for plan in plans() {
            let motion = Track::new(&plan);
            for t in moments(&plan, &motion) {
                let (a, b) = (motion.at(t - HALF_STEP), motion.at(t + HALF_STEP));
                let now = motion.at(t);
                let slope = |from: Vector, to: Vector| (to - from) * (0.5 / HALF_STEP);
                let velocity_error = slope(a.position, b.position) - now.velocity;
                let acceleration_error = slope(a.velocity, b.velocity) - now.acceleration;
                assert!(velocity_error.length() < 1e-5, "{t}: {velocity_error:?}");
                assert!(acceleration_error.length() < 1e-2, "{t}: {acceleration_error:?}");
            }
        }
    }

    #[test]
    fn angular_rate_matches_the_change_of_orientation() {
        for plan in plans() {
            let motion = Track::new(&plan);
            for t in moments(&plan, &motion) {
                let (a, b) = (motion.at(t - HALF_STEP), motion.at(t + HALF_STEP));
                let now = motion.at(t);
                assert!(
                    (now.orientation.w.powi(2) + now.orientation.v.length().powi(2) - 1.0).abs()
                        < 1e-12
                );
                for axis in [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 0.6, 0.8)] {
                    let moved = b.orientation.to_world(axis) - a.orientation.to_world(axis);
                    // d/dt (R u) = R (ω × u).
                    let omega = now.angular_rate;
                    let turning = Vector::new(
                        omega.y * axis.z - omega.z * axis.y,
                        omega.z * axis.x - omega.x * axis.z,
                        omega.x * axis.y - omega.y * axis.x,
                    );
                    let error = moved * (0.5 / HALF_STEP) - now.orientation.to_world(turning);
                    assert!(error.length() < 1e-5, "{t}: {error:?}");
                }
            }
        }
    }

    #[test]
    fn only_the_acceleration_jumps_at_impacts() {
        let motion = Track::new(&Plan::demo(1));
        assert_eq!(motion.impacts().count(), 12);
        for impact in motion.impacts() {
            let (before, after) = (motion.at(impact - 1e-9), motion.at(impact + 1e-9));
            assert!((after.position - before.position).length() < 1e-8);
            assert!((after.velocity - before.velocity).length() < 1e-6);
            assert!((after.angular_rate - before.angular_rate).length() < 1e-5);
            assert!((after.acceleration - before.acceleration).length() > 5.0);
            assert_eq!(before.activity, Activity::Swinging);
            assert_eq!(after.activity, Activity::Landing);
        }
    }

    #[test]
    fn swing_is_6_to_9_cm_high_and_pitches_by_30_degrees() {
        let plan = Plan::steady(GaitName::Walk, Ground::Hard, 12.0, 2);
        let motion = Track::new(&plan);
        let states: Vec<FootState> =
            (0..12_000).map(|ms| motion.at(f64::from(ms) * 1e-3)).collect();
        let highest = states.iter().map(|s| s.position.z).fold(0.0, f64::max);
        assert!((0.06..0.09).contains(&highest), "{highest}");
        let lowest = states.iter().map(|s| s.position.z).fold(0.0, f64::min);
        assert!(lowest > -0.004, "{lowest}");
        // World height of the sensor's x axis: positive where the toes are up.
        let toes = states.iter().map(|s| s.orientation.to_world(Vector::new(1.0, 0.0, 0.0)).z);
        let up = toes.clone().fold(0.0, f64::max);
        let down = toes.fold(0.0, f64::min);
        let sine = 0.35..0.65;
        assert!(sine.contains(&up), "{up}");
        assert!(sine.contains(&-down), "{down}");
    }

    #[test]
    fn hard_landings_pass_eight_g_and_soft_ones_stay_below_five() {
        let peak = |ground| {
            let plan = Plan::steady(GaitName::Walk, ground, 30.0, 2);
            let motion = Track::new(&plan);
            let landing = |impact: f64| {
                let after = (0..500).map(|k| impact + f64::from(k) * 1e-4);
                let peaks = after.map(|t| motion.at(t).acceleration.length() / 9.81);
                peaks.fold(0.0, f64::max)
            };
            motion.impacts().map(landing).collect::<Vec<f64>>()
        };
        assert!(peak(Ground::Hard).iter().all(|g| (8.0..30.0).contains(g)));
        assert!(peak(Ground::Soft).iter().all(|g| (1.0..5.0).contains(g)));
    }

    #[test]
    fn slides_go_as_far_as_planned_under_load() {
        let plan = Plan::demo(1);
        let motion = Track::new(&plan);
        let impacts: Vec<f64> = motion.impacts().collect();
        for (step, impact) in plan.steps.iter().zip(impacts) {
            let end = motion.at(impact + step.standing() - 1e-6);
            let planned: f64 = step.slips.iter().map(|slip| slip.distance).sum();
            assert!((end.slip - planned).abs() < 1e-6);
            for slip in &step.slips {
                let middle = motion.at(impact + slip.onset + 0.5 * slip.duration);
                assert_eq!(middle.activity, Activity::Slipping);
                assert!(middle.velocity.length() > 0.1);
                assert!(middle.load > 20.0);
            }
        }
    }

    #[test]
    fn swinging_foot_has_neither_load_nor_slip() {
        let plan = Plan::steady(GaitName::Trot, Ground::Greased, 8.0, 2);
        let motion = Track::new(&plan);
        let states = moments(&plan, &motion).into_iter().map(|t| motion.at(t));
        let in_the_air: Vec<FootState> =
            states.filter(|state| state.activity == Activity::Swinging).collect();
        assert!(in_the_air.len() > 1000);
        for state in in_the_air {
            assert_eq!((state.load, state.slip), (0.0, 0.0));
        }
    }

    #[test]
    fn the_foot_stands_before_the_beginning_and_after_the_end() {
        let plan = Plan::demo(1);
        let motion = Track::new(&plan);
        for t in [-5.0, 0.0, 1.9, plan.duration, 1e6] {
            let state = motion.at(t);
            assert_eq!(state.activity, Activity::Standing);
            assert_eq!(state.velocity.length(), 0.0, "{t}");
            assert!(state.load > 20.0);
        }
    }
}
