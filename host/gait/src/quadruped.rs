//! Simulated quadruped: its base, its four feet, and the joints of the legs between them.
//!
//! The base walks straight ahead and sways. The feet step to its future place. A foot that slips makes up for it with
//! its next step. The joints follow from base and feet by the geometry of the leg, so that the leg's kinematics give
//! the true position and velocity of the foot at any moment, even in a swing or a slip.
//!
//! As with a single foot, the motion is prescribed and not the result of forces.

use std::error::Error;
use std::fmt;

use estimator_core::ImuSample;
use samples::space::{Rotation, Vector};
use wire::Foot;

use crate::jet::{Jet, from_roll_pitch_yaw};
use crate::plan::{GaitName, Plan, PlannedStep, RobotParams, STANDING_BEFORE, StepSource};
use crate::record::{Sampler, Simulation, TICK_US, simulate};
use crate::sensor::{SensorParams, felt};
use crate::shape::{Quintic, Term, TermShape};
use crate::track::{FootState, Track};

/// Number of legs.
pub const LEGS: usize = 4;

/// Feet of the quadruped, in the order of its legs.
pub const FEET: [Foot; LEGS] = [Foot::FrontLeft, Foot::FrontRight, Foot::RearLeft, Foot::RearRight];

/// Height of the base above the feet while it stands, m.
const BASE_HEIGHT: f64 = 0.30;

/// Time in which the base reaches its speed, and in which it stops, s.
const SPEED_CHANGE_S: f64 = 1.0;

/// Standing time at the end, s.
const STANDING_AFTER: f64 = 1.0;

/// Largest step length, as a factor of the gait's, at which a leg reaches every foothold.
pub const LONGEST_STEP: f64 = 3.0;

/// Largest distance of a foothold from its place under the hip, along each horizontal axis, m.
const FOOTHOLD_SPREAD: f64 = 0.01;

/// Quadruped that follows a plan of all its feet.
#[derive(Clone, Debug)]
pub struct Quadruped {
    plans: [Plan; LEGS],
    feet: [Track; LEGS],
    base: BaseTrack,
    seed: u64,
    /// Duration of the plan, s.
    pub duration: f64,
}

/// Error of a robot whose walking time between pauses is too short to reach its speed and to stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortBout {
    /// Walking time between pauses, s.
    pub every: f64,
    /// Shortest walking time of the gait, s.
    pub shortest: f64,
}

impl fmt::Display for ShortBout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { every, shortest } = self;
        write!(
            f,
            "the walking time between pauses is {every} s, but at least {shortest} s is expected in this gait"
        )
    }
}

impl Error for ShortBout {}

/// Returns the seed of a leg's steps and sensor, or, for [`LEGS`], of the sensor of the base. Each part of each robot has
/// its own seed.
#[must_use]
pub const fn part_seed(seed: u64, part: usize) -> u64 {
    seed ^ ((part as u64 + 1) << 48)
}

impl Quadruped {
    /// Plans a robot for `seconds`, including the standing at the beginning and at the end. `seconds` is finite. Each
    /// seed gives different steps.
    ///
    /// # Errors
    /// The walking time between its pauses is too short.
    pub fn new(robot: &RobotParams, seconds: f64, seed: u64) -> Result<Self, ShortBout> {
        let stride = robot.gait.stride_s().unwrap_or(1.0);
        let bouts = bouts(robot, seconds, stride)?;
        let base = BaseTrack::new(&bouts, robot.gait.travel_m() * robot.step_length, stride);
        let plans = std::array::from_fn(|leg| {
            let steps = StepSource::new(robot, part_seed(seed, leg));
            let phase = phases(robot.gait)[leg] * stride;
            Plan {
                name: format!(
                    "{} of {} on {} ground, seed {seed}",
                    FEET[leg].name(),
                    robot.gait,
                    robot.ground
                ),
                duration: seconds,
                ..plan_foot(steps, &bouts, &base, phase, stride)
            }
        });
        let feet = [0, 1, 2, 3].map(|leg: usize| Track::new(&plans[leg]));
        Ok(Self { plans, feet, base, seed, duration: seconds })
    }

    /// Plan of a leg's foot, from where it stands at the beginning.
    #[must_use]
    pub const fn plan(&self, leg: usize) -> &Plan {
        &self.plans[leg]
    }

    /// Returns the state of the base at time `t` in s.
    #[must_use]
    pub fn base_at(&self, t: f64) -> BaseState {
        self.base.at(t)
    }

    /// Returns the state of a leg's foot at time `t` in s.
    #[must_use]
    pub fn foot_at(&self, leg: usize, t: f64) -> FootState {
        let mut foot = self.feet[leg].at(t);
        foot.position = foot.position + Leg::GO1[leg].stance();
        foot
    }

    /// Returns the joints of a leg at time `t` in s.
    ///
    /// # Panics
    /// When the foot is out of the leg's reach: not with steps up to [`LONGEST_STEP`].
    #[must_use]
    pub fn joints_at(&self, leg: usize, t: f64) -> Joints {
        self.joints(leg, t).expect("the foot is within reach")
    }

    fn joints(&self, leg: usize, t: f64) -> Option<Joints> {
        let (base, foot) = (self.base_at(t), self.foot_at(leg, t));
        let position = base.orientation.to_sensor(foot.position - base.position);
        let velocity = base.orientation.to_sensor(foot.velocity - base.velocity)
            - base.angular_rate.cross(position);
        Leg::GO1[leg].joints(position, velocity)
    }

    /// Records the foot of a leg. The true positions are in the world of the robot.
    #[must_use]
    pub fn record_foot(&self, leg: usize, sensor: &SensorParams) -> Simulation {
        let mut simulation = simulate(&self.plans[leg], sensor, part_seed(self.seed, leg));
        for foot in &mut simulation.truth {
            foot.position = foot.position + Leg::GO1[leg].stance();
        }
        simulation
    }

    /// Records an IMU at the origin of the base, along its axes, each millisecond: a sensor of the kind on the feet.
    ///
    /// # Panics
    /// Never: a simulated part without a fault starts.
    #[must_use]
    pub fn record_base(&self, sensor: &SensorParams) -> Vec<ImuSample> {
        let base = self.base.clone();
        let motion = move |t: f64, temperature: f64| {
            let state = base.at(t);
            felt(state.acceleration, state.orientation, state.angular_rate, temperature)
        };
        let seed = part_seed(self.seed, LEGS);
        let mut sampler = Sampler::new(|delay| sensor.mounted(motion, delay, seed));
        let ticks = libm::floor(self.duration * 1e6 / TICK_US as f64) as u64;
        (0..ticks).map(|tick| sampler.sample_after(tick * TICK_US).0).collect()
    }
}

/// True state of the base at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseState {
    /// World frame, m; x forward, y to the left, z up from the ground.
    pub position: Vector,
    /// World frame, m/s.
    pub velocity: Vector,
    /// World frame, m/s².
    pub acceleration: Vector,
    /// Base → world.
    pub orientation: Rotation,
    /// Base frame, rad/s.
    pub angular_rate: Vector,
}

/// Angles and rates of a leg's joints: abduction about x, hip and knee about y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joints {
    /// rad; all 0 is a leg that is stretched downwards.
    pub angles: [f64; 3],
    /// rad/s.
    pub rates: [f64; 3],
}

/// Geometry of a leg in the frame of the base.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// Axis of abduction, m from the origin of the base.
    pub hip: Vector,
    /// Distance along y from the axis of abduction to the plane of thigh and shank, m; negative on the right.
    pub offset: f64,
    /// Length of the thigh, m.
    pub thigh: f64,
    /// Length of the shank, m.
    pub shank: f64,
}

impl Leg {
    /// Legs of a Unitree GO1, in the order of [`FEET`]. Source: the manufacturer's `go1_description`.
    pub const GO1: [Self; LEGS] =
        [Self::go1(1.0, 1.0), Self::go1(1.0, -1.0), Self::go1(-1.0, 1.0), Self::go1(-1.0, -1.0)];

    const fn go1(forward: f64, left: f64) -> Self {
        Self {
            hip: Vector::new(0.1881 * forward, 0.04675 * left, 0.0),
            offset: 0.08 * left,
            thigh: 0.213,
            shank: 0.213,
        }
    }

    /// Position of the foot in the world while the robot stands at the beginning, m.
    fn stance(&self) -> Vector {
        Vector::new(self.hip.x, self.hip.y + self.offset, 0.0)
    }

    /// Returns the position of the foot in the frame of the base, m.
    #[must_use]
    pub fn foot_position(&self, [abduction, hip, knee]: [f64; 3]) -> Vector {
        let (sin_hip, cos_hip) = libm::sincos(hip);
        let (sin_both, cos_both) = libm::sincos(hip + knee);
        let along = -self.thigh * sin_hip - self.shank * sin_both;
        let down = self.thigh * cos_hip + self.shank * cos_both;
        let (sin, cos) = libm::sincos(abduction);
        let turned =
            Vector::new(along, self.offset * cos + down * sin, self.offset * sin - down * cos);
        self.hip + turned
    }

    /// Returns the change of the foot's position with each angle, m/rad.
    #[must_use]
    pub fn jacobian(&self, [abduction, hip, knee]: [f64; 3]) -> [Vector; 3] {
        let foot = self.foot_position([abduction, hip, knee]) - self.hip;
        let (sin, cos) = libm::sincos(abduction);
        // Hip and knee turn about the base's y, as the abduction has turned it.
        let axis = Vector::new(0.0, cos, sin);
        let (sin_hip, cos_hip) = libm::sincos(hip);
        let above = Vector::new(-self.thigh * sin_hip, 0.0, 0.0)
            + Vector::new(0.0, sin, -cos) * (self.thigh * cos_hip)
            + axis * self.offset;
        [Vector::new(1.0, 0.0, 0.0).cross(foot), axis.cross(foot), axis.cross(foot - above)]
    }

    /// Returns the joints that give the foot a position, m, and a velocity, m/s, in the frame of the base; `None` if
    /// the foot is out of reach. The knee points backwards.
    #[must_use]
    pub fn joints(&self, position: Vector, velocity: Vector) -> Option<Joints> {
        let foot = position - self.hip;
        let squared = foot.y * foot.y + foot.z * foot.z - self.offset * self.offset;
        if squared <= 0.0 {
            return None;
        }
        let down = libm::sqrt(squared);
        let abduction = libm::atan2(foot.z, foot.y) - libm::atan2(-down, self.offset);
        let length = foot.x * foot.x + squared;
        let cos_knee = (length - self.thigh * self.thigh - self.shank * self.shank)
            / (2.0 * self.thigh * self.shank);
        if !(-1.0..1.0).contains(&cos_knee) {
            return None;
        }
        let knee = -libm::acos(cos_knee);
        let hip = libm::atan2(-foot.x, down)
            - libm::atan2(self.shank * libm::sin(knee), self.thigh + self.shank * cos_knee);
        let angles = [wrapped(abduction), hip, knee];
        Some(Joints { angles, rates: solve(self.jacobian(angles), velocity) })
    }
}

/// Returns an angle in [−π, π).
fn wrapped(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    angle - TAU * libm::floor((angle + PI) / TAU)
}

/// Returns the factors of three columns whose sum is `sum`.
fn solve([a, b, c]: [Vector; 3], sum: Vector) -> [f64; 3] {
    let scale = 1.0 / a.dot(b.cross(c));
    [sum.dot(b.cross(c)), a.dot(sum.cross(c)), a.dot(b.cross(sum))].map(|part| part * scale)
}

/// Time in which the robot walks without a pause, s.
#[derive(Clone, Copy, Debug)]
struct Bout {
    start: f64,
    end: f64,
}

/// Returns the longest time of whole strides in a time, s; `None` if it is too short to reach the speed and to stop.
fn whole_strides(time: f64, stride: f64) -> Option<f64> {
    let walking = libm::floor(time / stride) * stride;
    (walking >= 2.0 * SPEED_CHANGE_S).then_some(walking)
}

/// Shortest time of a bout of walking, s, rounded up to a millisecond.
fn shortest_bout(stride: f64) -> f64 {
    let seconds = |ms: u32| f64::from(ms) / 1e3;
    let mut ms = 0;
    while whole_strides(seconds(ms), stride).is_none() {
        ms += 1;
    }
    seconds(ms)
}

/// Returns the bouts of walking of a robot, each of whole strides.
fn bouts(robot: &RobotParams, seconds: f64, stride: f64) -> Result<Vec<Bout>, ShortBout> {
    let mut bouts = Vec::new();
    if robot.gait == GaitName::Stand {
        return Ok(bouts);
    }
    let longest = robot.rests.map_or(f64::INFINITY, |rests| rests.every);
    if whole_strides(longest, stride).is_none() {
        return Err(ShortBout { every: longest, shortest: shortest_bout(stride) });
    }
    let mut start = STANDING_BEFORE;
    loop {
        let left = seconds - STANDING_AFTER - stride - start;
        let Some(walking) = whole_strides(left.min(longest), stride) else {
            return Ok(bouts);
        };
        bouts.push(Bout { start, end: start + walking });
        // The last step of a foot ends up to a stride after the base has stopped.
        start += walking + stride + robot.rests.map_or(0.0, |rests| rests.lasting);
    }
}

/// Returns the phases of the legs in a gait, in strides.
const fn phases(gait: GaitName) -> [f64; LEGS] {
    match gait {
        // A lateral sequence: rear left, front left, rear right, front right.
        GaitName::Stand | GaitName::Walk => [0.25, 0.75, 0.0, 0.5],
        GaitName::Trot | GaitName::Run => [0.0, 0.5, 0.5, 0.0],
    }
}

/// Plans the steps of a foot that follows the base, without name and duration.
fn plan_foot(
    mut source: StepSource,
    bouts: &[Bout],
    base: &BaseTrack,
    phase: f64,
    stride: f64,
) -> Plan {
    let mut plan =
        Plan { name: String::new(), standing: f64::INFINITY, steps: Vec::new(), duration: 0.0 };
    let mut foot = [0.0, 0.0];
    let mut begun: Option<f64> = None;
    for bout in bouts {
        let strides = libm::round((bout.end - bout.start) / stride) as u32;
        for index in 0..strides {
            let start = bout.start + phase + f64::from(index) * stride;
            match begun {
                None => plan.standing = start,
                // The foot stands until its next step begins.
                Some(begun) => extend(&mut plan.steps, start - begun),
            }
            begun = Some(start);
            let Some(mut step) = source.next() else { break };
            let touch_down = start + step.peel + step.swing;
            step.stance = stride - step.peel - step.swing;
            let under = base.at(touch_down + 0.5 * step.stance).position;
            let [x, y] = [under.x, 0.0].map(|at| at + source.spread(FOOTHOLD_SPREAD));
            step.travel = [x - foot[0], y - foot[1]];
            let slid = |part: fn(f64) -> f64| {
                step.slips.iter().map(|slip| slip.distance * part(slip.heading)).sum::<f64>()
            };
            foot = [x + slid(libm::cos), y + slid(libm::sin)];
            if index + 1 == strides {
                step.tremor.acceleration = 0.0;
                step.tremor.rate = 0.0;
            }
            plan.steps.push(step);
        }
    }
    plan
}

/// Makes the last step end `duration` after it began, s.
fn extend(steps: &mut [PlannedStep], duration: f64) {
    if let Some(step) = steps.last_mut() {
        step.stance = duration - step.peel - step.swing;
    }
}

/// Amplitude of the base's sway along or about an axis, and its course.
#[derive(Clone, Copy, Debug)]
struct Sway {
    channel: usize,
    /// m or rad.
    amplitude: f64,
    /// Periods in a stride.
    harmonic: f64,
    /// rad.
    phase: f64,
}

/// Sway of a GO1 in a walk or trot, of the order that its own IMU shows: a centimetre and a degree.
const SWAYS: [Sway; 6] = [
    Sway { channel: 0, amplitude: 0.004, harmonic: 2.0, phase: 0.4 },
    Sway { channel: 1, amplitude: 0.008, harmonic: 1.0, phase: 0.0 },
    Sway { channel: 2, amplitude: 0.004, harmonic: 2.0, phase: 1.1 },
    Sway { channel: 3, amplitude: 0.02, harmonic: 1.0, phase: 0.7 },
    Sway { channel: 4, amplitude: 0.015, harmonic: 2.0, phase: 2.0 },
    Sway { channel: 5, amplitude: 0.01, harmonic: 1.0, phase: 1.6 },
];

/// True motion of the base.
#[derive(Clone, Debug)]
struct BaseTrack {
    /// Forward paths with their starts, s, in order of time.
    forward: Vec<(f64, Quintic)>,
    /// Changes of the sway's strength: up to 1, and down again.
    strengths: Vec<Term>,
    /// Angular frequency of the stride, rad/s.
    stride_rate: f64,
}

impl BaseTrack {
    /// Plans a base that travels `travel` m in a stride, s, of each bout.
    fn new(bouts: &[Bout], travel: f64, stride: f64) -> Self {
        let speed = travel / stride;
        let mut forward = vec![(0.0, Quintic::rest(0.0))];
        let mut strengths = Vec::new();
        let mut x = 0.0;
        for bout in bouts {
            let cruise_s = bout.end - bout.start - 2.0 * SPEED_CHANGE_S;
            let mut go_on = |from: f64, to: f64, start: f64, duration: f64| {
                let begin = Jet::moving(x, from);
                x += 0.5 * (from + to) * duration;
                let path = Quintic::between(begin, Jet::moving(x, to), start, duration);
                forward.push((start, path));
            };
            go_on(0.0, speed, bout.start, SPEED_CHANGE_S);
            if cruise_s > 0.0 {
                go_on(speed, speed, bout.start + SPEED_CHANGE_S, cruise_s);
            }
            go_on(speed, 0.0, bout.end - SPEED_CHANGE_S, SPEED_CHANGE_S);
            forward.push((bout.end, Quintic::rest(x)));
            let change = |start: f64, distance: f64| {
                Term::new(start, SPEED_CHANGE_S, TermShape::Slide { distance })
            };
            strengths.push(change(bout.start, 1.0));
            strengths.push(change(bout.end - SPEED_CHANGE_S, -1.0));
        }
        Self { forward, strengths, stride_rate: std::f64::consts::TAU / stride }
    }

    fn at(&self, t: f64) -> BaseState {
        let begun = self.forward.partition_point(|(start, _)| *start <= t).max(1);
        let mut channels = [Jet::default(); 6];
        channels[0] = self.forward[begun - 1].1.at(t);
        channels[2] = Jet::constant(BASE_HEIGHT);
        let strength = self.strengths.iter().fold(Jet::default(), |sum, change| sum + change.at(t));
        for sway in SWAYS {
            let rate = self.stride_rate * sway.harmonic;
            let angle = Jet::moving(rate * t + sway.phase, rate);
            channels[sway.channel] += strength * angle.sin_cos().0 * sway.amplitude;
        }
        let [x, y, z, roll, pitch, yaw] = channels;
        let (orientation, angular_rate) = from_roll_pitch_yaw([roll, pitch, yaw]);
        BaseState {
            position: Vector::new(x.value, y.value, z.value),
            velocity: Vector::new(x.rate, y.rate, z.rate),
            acceleration: Vector::new(x.acceleration, y.acceleration, z.acceleration),
            orientation,
            angular_rate,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Ground, Rests};
    use crate::track::Activity;

    fn trot(greased: f64) -> Quadruped {
        let robot = RobotParams { gait: GaitName::Trot, greased, ..RobotParams::default() };
        Quadruped::new(&robot, 20.0, 3).expect("a robot without pauses")
    }

    fn times(robot: &Quadruped) -> impl Iterator<Item = f64> {
        (0..(robot.duration * 500.0) as u32).map(|k| f64::from(k) * 0.002)
    }

    #[test]
    fn joints_give_the_feet_their_true_motion() {
        let robot = trot(0.3);
        for t in times(&robot) {
            let base = robot.base_at(t);
            for (leg, geometry) in Leg::GO1.iter().enumerate() {
                let foot = robot.foot_at(leg, t);
                let Joints { angles, rates } = robot.joints_at(leg, t);
                let in_base = geometry.foot_position(angles);
                let position = base.position + base.orientation.to_world(in_base);
                assert!((position - foot.position).length() < 1e-9, "{t} s");
                let [a, b, c] = geometry.jacobian(angles);
                let moved = a * rates[0] + b * rates[1] + c * rates[2];
                let velocity = base.velocity
                    + base.orientation.to_world(moved + base.angular_rate.cross(in_base));
                assert!((velocity - foot.velocity).length() < 1e-7, "{t} s");
            }
        }
    }

    #[test]
    fn base_velocity_is_the_change_of_its_position() {
        let robot = trot(0.0);
        for t in times(&robot) {
            let [before, now, after] = [t - 1e-5, t, t + 1e-5].map(|t| robot.base_at(t));
            let change = (after.position - before.position) * (0.5 / 1e-5);
            assert!((change - now.velocity).length() < 1e-6, "{t} s");
            let change = (after.velocity - before.velocity) * (0.5 / 1e-5);
            assert!((change - now.acceleration).length() < 1e-4, "{t} s");
        }
    }

    #[test]
    fn feet_keep_up_with_the_base_though_they_slip() {
        let robot = trot(0.3);
        let slips = |leg: usize| robot.plan(leg).steps.iter().any(|step| !step.slips.is_empty());
        assert!((0..LEGS).all(slips));
        let end = robot.base_at(robot.duration);
        assert!(end.position.x > 4.0, "{}", end.position.x);
        for leg in 0..LEGS {
            let foot = robot.foot_at(leg, robot.duration);
            assert_eq!(foot.activity, Activity::Standing);
            let place = end.position.x + Leg::GO1[leg].hip.x;
            // The last step of a foot may slip.
            assert!((foot.position.x - place).abs() < 0.05, "{} {place}", foot.position.x);
        }
    }

    #[test]
    fn trotting_legs_stand_in_diagonal_pairs() {
        let robot = trot(0.0);
        let stands = |leg: usize, t: f64| robot.foot_at(leg, t).load > 10.0;
        let cruise = times(&robot).filter(|t| (4.0..16.0).contains(t));
        let (mut pairs, mut all) = (0, 0);
        for t in cruise {
            all += 1;
            pairs += usize::from(stands(0, t) == stands(3, t) && stands(1, t) == stands(2, t));
        }
        assert!(pairs * 10 > all * 8, "{pairs} of {all}");
    }

    #[test]
    fn a_robot_that_rests_stands_between_its_bouts() {
        let rests = Some(Rests { every: 6.0, lasting: 4.0 });
        let robot = RobotParams { rests, ..RobotParams::default() };
        let robot = Quadruped::new(&robot, 30.0, 1).expect("long bouts");
        let still =
            times(&robot).filter(|t| *t > 3.0 && robot.base_at(*t).velocity.length() == 0.0);
        let still = still.count() as f64 * 0.002;
        assert!((8.0..16.0).contains(&still), "{still} s");
    }

    #[test]
    fn bouts_too_short_for_the_gait_are_refused() {
        for (gait, shortest) in
            [(GaitName::Walk, 2.701), (GaitName::Trot, 2.08), (GaitName::Run, 2.1)]
        {
            let robot = |every: f64| {
                let rests = Some(Rests { every, lasting: 1.0 });
                Quadruped::new(&RobotParams { gait, rests, ..RobotParams::default() }, 20.0, 1)
            };
            let every = shortest - 0.01;
            assert_eq!(robot(every).err(), Some(ShortBout { every, shortest }), "{gait}");
            let walked = robot(shortest).expect("the shortest bout").base_at(20.0).position.x;
            assert!(walked > 0.5, "{gait}: {walked} m");
        }
        let rests = Some(Rests { every: 0.1, lasting: 1.0 });
        let standing = RobotParams { gait: GaitName::Stand, rests, ..RobotParams::default() };
        assert!(Quadruped::new(&standing, 5.0, 1).is_ok());
    }

    #[test]
    fn every_gait_is_within_reach_at_the_longest_step() {
        for gait in [GaitName::Stand, GaitName::Walk, GaitName::Trot, GaitName::Run] {
            for ground in [Ground::Hard, Ground::Greased, Ground::Soft] {
                let robot = RobotParams {
                    gait,
                    ground,
                    step_length: LONGEST_STEP,
                    ..RobotParams::default()
                };
                let robot = Quadruped::new(&robot, 15.0, 1).expect("a robot without pauses");
                let reached = |t: f64| (0..LEGS).all(|leg| robot.joints(leg, t).is_some());
                assert!(times(&robot).all(reached), "{gait} on {ground} ground");
            }
        }
    }

    #[test]
    fn base_imu_reads_gravity_while_the_robot_stands() {
        let samples = trot(0.0).record_base(&SensorParams::LSM6DSOX);
        assert_eq!(samples.len(), 20_000);
        let up = samples[..1000].iter().map(|sample| f64::from(sample.specific_force.0.z));
        let up = up.sum::<f64>() / 1000.0;
        assert!((up - 9.81).abs() < 0.25, "{up}");
    }
}
