//! Plans: the steps of a foot and the ground, with variation from a seed.
//!
//! A [`Plan`] is a list of [`PlannedStep`]s. Every number of a step can be set by hand, for a grid of slips or of
//! landings; [`RobotParams`] draws them for a gait.

use std::ops::Range;

use crate::random::{RandomUse, SeededRandom};

/// Seed of the walk that `footfall demo` shows, which is also one of the scored sets.
pub const DEMO_SEED: u64 = 1;

/// Standing time before the first step, s, in which an attitude filter aligns.
pub(crate) const STANDING_BEFORE: f64 = 2.0;

/// Standing time of the demo after its last touch-down, s.
const STANDING_AFTER: f64 = 1.2;

/// Plan of a foot: it stands, takes its steps, and stands again.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// Origin stated in a recording of the plan.
    pub name: String,
    /// Standing time at the beginning, s.
    pub standing: f64,
    /// Steps in order of time. After the last touch-down the foot stays in place.
    pub steps: Vec<PlannedStep>,
    /// Duration of the recording, s.
    pub duration: f64,
}

impl Plan {
    /// A walk of about 14 s: firm ground, a greased patch of three steps, a soft mat of three
    /// steps, and firm ground again.
    #[must_use]
    pub fn demo(seed: u64) -> Self {
        let steps = round(&mut SeededRandom::new(seed, RandomUse::Steps));
        let moving: f64 = steps.iter().map(PlannedStep::duration).sum();
        Self {
            name: format!("demo walk, seed {seed}"),
            standing: STANDING_BEFORE,
            steps,
            duration: STANDING_BEFORE + moving + STANDING_AFTER,
        }
    }

    /// Repeats the ground of [`Plan::demo`] with different steps for at least `seconds`, including the standing at
    /// the beginning. `seconds` is finite.
    #[must_use]
    pub fn rounds(seconds: f64, seed: u64) -> Self {
        let mut random = SeededRandom::new(seed, RandomUse::Steps);
        let mut steps = Vec::new();
        let mut end = STANDING_BEFORE;
        while end < seconds {
            let round = round(&mut random);
            end += round.iter().map(PlannedStep::duration).sum::<f64>();
            steps.extend(round);
        }
        Self {
            name: format!("rounds of the demo walk, seed {seed}"),
            standing: STANDING_BEFORE,
            steps,
            duration: end,
        }
    }

    /// Plans a gait on one kind of ground for `seconds`, including the standing at the beginning. The recording may end
    /// in any activity. `seconds` must be finite.
    #[must_use]
    pub fn steady(gait: GaitName, ground: Ground, seconds: f64, seed: u64) -> Self {
        let robot = RobotParams { gait, ground, ..RobotParams::default() };
        robot.plan(seconds, seed)
    }
}

/// Properties of a robot and of its ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotParams {
    /// Gait.
    pub gait: GaitName,
    /// Ground under its feet.
    pub ground: Ground,
    /// Share of steps that meet a greased patch, in [0, 1].
    pub greased: f64,
    /// Step length, as a factor of the gait's.
    pub step_length: f64,
    /// Shaking of the standing feet, as a factor of the gait's frequency and of its amplitudes of acceleration and angular
    /// rate. The amplitude of the velocity stays: raised by more than about 1.5, a foot would not count as stable.
    pub shaking: f64,
    /// Pauses in which it stands still, if any.
    pub rests: Option<Rests>,
}

/// Pauses in which a robot stands still.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rests {
    /// Walking time between pauses, s.
    pub every: f64,
    /// Duration of a pause, s.
    pub lasting: f64,
}

impl Default for RobotParams {
    /// Returns a robot that walks on a firm floor, with the usual values.
    fn default() -> Self {
        Self {
            gait: GaitName::Walk,
            ground: Ground::Hard,
            greased: 0.0,
            step_length: 1.0,
            shaking: 1.0,
            rests: None,
        }
    }
}

impl RobotParams {
    /// Plans one of its feet for `seconds`, including the standing at the beginning. The recording may end in any
    /// activity. `seconds` is finite.
    #[must_use]
    pub fn plan(&self, seconds: f64, seed: u64) -> Plan {
        let mut steps = Vec::new();
        let mut end = STANDING_BEFORE;
        let mut walking = 0.0;
        for mut step in StepSource::new(self, seed) {
            if end >= seconds {
                break;
            }
            walking += step.duration();
            if let Some(rests) = self.rests
                && walking >= rests.every
            {
                walking = 0.0;
                step.stance += rests.lasting;
                step.tremor.acceleration = 0.0;
                step.tremor.rate = 0.0;
            }
            end += step.duration();
            steps.push(step);
        }
        let Self { gait, ground, .. } = self;
        Plan {
            name: format!("{gait} on {ground} ground, seed {seed}"),
            standing: STANDING_BEFORE,
            steps,
            duration: seconds,
        }
    }
}

/// Steps of a robot's foot without end; no step for a robot that stands.
#[derive(Clone, Debug)]
pub(crate) struct StepSource {
    style: Option<Style>,
    robot: RobotParams,
    steps: SeededRandom,
    patches: SeededRandom,
}

impl StepSource {
    /// Creates the steps of a seed.
    pub fn new(robot: &RobotParams, seed: u64) -> Self {
        let style = robot.gait.style();
        let style = style.map(|usual| Style { length: usual.length * robot.step_length, ..usual });
        Self {
            style,
            robot: *robot,
            steps: SeededRandom::new(seed, RandomUse::Steps),
            patches: SeededRandom::new(seed, RandomUse::Patches),
        }
    }

    /// Draws a deviation uniformly from ± `limit`.
    pub fn spread(&mut self, limit: f64) -> f64 {
        self.steps.uniform(-limit..limit)
    }
}

impl Iterator for StepSource {
    type Item = PlannedStep;

    fn next(&mut self) -> Option<PlannedStep> {
        let style = self.style?;
        let greased = self.patches.uniform(0.0..1.0) < self.robot.greased;
        let ground = if greased { Ground::Greased } else { self.robot.ground };
        let mut step = style.step(ground, &mut self.steps);
        step.tremor.frequency *= self.robot.shaking;
        step.tremor.acceleration *= self.robot.shaking;
        step.tremor.rate *= self.robot.shaking;
        Some(step)
    }
}

samples::named! {
    /// Named gaits.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum GaitName {
        /// Standing still: no steps at all.
        Stand = "stand",
        /// A slow walk: a stride of 0.9 s, 62 % of it in stance.
        Walk = "walk",
        /// A trot: a stride of 0.52 s, 54 % of it in stance.
        Trot = "trot",
        /// A run: a stride of 0.42 s, 38 % of it in stance, with landings beyond ±16 g.
        Run = "run",
    } or |name| {
        let known = Self::ALL.map(Self::name).join(", ");
        format!("there is no gait `{name}`; known are {known}")
    }
}

impl GaitName {
    /// Duration of a stride, s; `None` for a robot that stands.
    pub(crate) fn stride_s(self) -> Option<f64> {
        self.style().map(|style| style.swing + style.contact)
    }

    /// Distance of a stride, m.
    pub(crate) fn travel_m(self) -> f64 {
        self.style().map_or(0.0, |style| style.length)
    }

    const fn style(self) -> Option<Style> {
        match self {
            Self::Stand => None,
            Self::Walk => Some(Style::WALK),
            Self::Trot => Some(Style::TROT),
            Self::Run => Some(Style::RUN),
        }
    }
}

samples::named! {
    /// Ground under the foot.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Ground {
        /// A firm floor with grip: a short, hard landing, then rest.
        Hard = "hard",
        /// The same floor without grip: the loaded foot slides.
        Greased = "greased",
        /// A mat or soil: a soft landing, then the foot sinks and rocks before it rests.
        Soft = "soft",
    }
}

/// A swing and the stance after it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedStep {
    /// Duration of the peel off the ground, s.
    pub peel: f64,
    /// Time in the air, s.
    pub swing: f64,
    /// Time from touch-down to the beginning of the next peel, s; extended to the end of the last slip.
    pub stance: f64,
    /// Forward (x) and to the left (y), m, from where the foot stood to where it lands.
    pub travel: [f64; 2],
    /// Height of the swing above a straight line, m.
    pub clearance: f64,
    /// Amplitude of the pitch swing, rad: toes down first, then up.
    pub pitch_swing: f64,
    /// Roll, pitch and yaw of the ground at the foothold, rad.
    pub tilt: [f64; 3],
    /// The landing.
    pub touch_down: TouchDown,
    /// Yielding of the ground, if any.
    pub sinking: Option<Sinking>,
    /// Slides during the stance, in order of time.
    pub slips: Vec<Slip>,
    /// Vibration of the standing foot under the moving robot.
    pub tremor: Tremor,
    /// Vertical load in mid-stance, N.
    pub load: f64,
    /// Time in which the load builds up, and in which it decreases before lift-off, s.
    pub load_change: f64,
}

/// Damped spring, as of a landing foot against the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Natural frequency, Hz.
    pub frequency: f64,
    /// Damping ratio, in (0, 1).
    pub damping: f64,
}

/// Landing of a foot: its remaining speeds, and the springs that absorb them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchDown {
    /// Downward, m/s.
    pub speed: f64,
    /// Forward (x) and to the left (y), m/s.
    pub scuff: [f64; 2],
    /// Rates of roll and pitch, rad/s.
    pub turn: [f64; 2],
    /// Absorbs `speed`. At a damping of 0.3 the deceleration peaks at about 2π · frequency · speed.
    pub vertical: Spring,
    /// Absorbs `scuff`.
    pub tangential: Spring,
    /// Absorbs `turn`.
    pub rotational: Spring,
}

/// A slow yielding of soft ground under the load, after touch-down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sinking {
    /// m.
    pub depth: f64,
    /// s.
    pub duration: f64,
    /// Change of roll and pitch meanwhile, rad.
    pub lean: [f64; 2],
}

/// A slide under load: it starts from rest, speeds up, and is caught again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slip {
    /// Time from touch-down, s.
    pub onset: f64,
    /// s. The top speed is 1.875 · distance / duration.
    pub duration: f64,
    /// m.
    pub distance: f64,
    /// Counter-clockwise from forward, rad: π slides backwards.
    pub heading: f64,
    /// Turn about the vertical meanwhile, rad.
    pub twist: f64,
    /// Acceleration amplitude of stick-slip along the slide at half-time, m/s². A third of it
    /// acts vertically.
    pub chatter: f64,
    /// Frequency of stick-slip, Hz.
    pub chatter_frequency: f64,
}

/// Vibration of a foot standing under a moving robot, strongest in mid-stance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tremor {
    /// Hz.
    pub frequency: f64,
    /// Amplitude along each axis, m/s².
    pub acceleration: f64,
    /// Amplitude of pitch and roll rate, rad/s.
    pub rate: f64,
}

impl PlannedStep {
    /// Returns the time from touch-down to the beginning of the next peel, s, including all slips.
    #[must_use]
    pub fn standing(&self) -> f64 {
        let slips = self.slips.iter().map(|slip| slip.onset + slip.duration);
        slips.fold(self.stance, f64::max)
    }

    /// Returns the time from the beginning of the peel to the next one, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.peel + self.swing + self.standing()
    }
}

/// Typical values of a gait, for a foot of a Unitree GO1: a quadruped of 12 kg with legs of about 0.4 m.
#[derive(Clone, Copy, Debug)]
struct Style {
    /// s.
    swing: f64,
    /// Including the peel, s.
    contact: f64,
    /// s.
    peel: f64,
    /// m.
    length: f64,
    /// m.
    clearance: f64,
    /// rad.
    pitch_swing: f64,
    /// m/s.
    landing_speed: f64,
    /// Load in mid-stance, N: the weight of 118 N divided by the number of standing feet.
    load: f64,
    /// s.
    load_change: f64,
}

impl Style {
    const WALK: Self = Self {
        swing: 0.34,
        contact: 0.56,
        peel: 0.045,
        length: 0.12,
        clearance: 0.045,
        pitch_swing: 0.45,
        landing_speed: 0.40,
        load: 45.0,
        load_change: 0.09,
    };

    const TROT: Self = Self {
        swing: 0.24,
        contact: 0.28,
        peel: 0.035,
        length: 0.16,
        clearance: 0.05,
        pitch_swing: 0.42,
        landing_speed: 0.45,
        load: 60.0,
        load_change: 0.075,
    };

    const RUN: Self = Self {
        swing: 0.26,
        contact: 0.16,
        peel: 0.025,
        length: 0.25,
        clearance: 0.05,
        pitch_swing: 0.5,
        landing_speed: 0.65,
        load: 110.0,
        load_change: 0.06,
    };

    fn step(&self, ground: Ground, random: &mut SeededRandom) -> PlannedStep {
        let vary = |value: f64, random: &mut SeededRandom| value * random.uniform(0.95..1.05);
        let stance = vary(self.contact - self.peel, random);
        PlannedStep {
            peel: vary(self.peel, random),
            swing: vary(self.swing, random),
            stance,
            travel: [self.length * random.uniform(0.85..1.15), random.uniform(-0.01..0.01)],
            clearance: self.clearance * random.uniform(0.9..1.1),
            pitch_swing: self.pitch_swing * random.uniform(0.9..1.1),
            // Floor and ankle are level to a degree or two.
            tilt: [0.03, 0.04, 0.03].map(|limit| random.uniform(-limit..limit)),
            touch_down: match ground {
                Ground::Hard | Ground::Greased => hard_landing(self.landing_speed, random),
                Ground::Soft => soft_landing(self.landing_speed, random),
            },
            sinking: match ground {
                Ground::Hard | Ground::Greased => None,
                Ground::Soft => Some(Sinking {
                    depth: random.uniform(0.006..0.012),
                    duration: random.uniform(0.18..0.24),
                    lean: [random.uniform(-0.04..0.04), random.uniform(-0.05..0.05)],
                }),
            },
            slips: match ground {
                Ground::Greased => vec![slip(0.25 * stance..0.8 * stance, random)],
                Ground::Hard | Ground::Soft => Vec::new(),
            },
            tremor: Tremor {
                frequency: random.uniform(7.0..14.0),
                acceleration: random.uniform(0.03..0.08),
                rate: random.uniform(0.003..0.008),
            },
            load: vary(self.load, random),
            load_change: self.load_change,
        }
    }
}

/// Draws a touch-down of a rubber foot on a floor. At walking and trotting speeds its deceleration peaks at 9 g to 25 g.
fn hard_landing(speed: f64, random: &mut SeededRandom) -> TouchDown {
    TouchDown {
        speed: speed * random.uniform(0.85..1.15),
        scuff: [random.uniform(-0.02..0.12), random.uniform(-0.03..0.03)],
        turn: [random.uniform(-0.6..0.6), random.uniform(-1.5..1.5)],
        vertical: spring(46.0..78.0, 0.28..0.38, random),
        tangential: spring(40.0..60.0, 0.4..0.5, random),
        rotational: spring(28.0..36.0, 0.45..0.55, random),
    }
}

/// Draws a touch-down on a mat: an impact of about 4 g, then a rocking by a few degrees that settles within a
/// quarter of a second.
fn soft_landing(speed: f64, random: &mut SeededRandom) -> TouchDown {
    TouchDown {
        speed: speed * random.uniform(0.75..1.0),
        scuff: [random.uniform(0.0..0.08), random.uniform(-0.03..0.03)],
        turn: [random.uniform(-0.5..0.5), random.uniform(-0.9..0.9)],
        vertical: spring(9.0..13.0, 0.5..0.6, random),
        tangential: spring(8.0..12.0, 0.5..0.6, random),
        rotational: spring(5.0..7.0, 0.4..0.5, random),
    }
}

/// Draws a spring from the ranges of its frequency, Hz, and its damping.
fn spring(frequency: Range<f64>, damping: Range<f64>, random: &mut SeededRandom) -> Spring {
    Spring { frequency: random.uniform(frequency), damping: random.uniform(damping) }
}

/// Draws a slide over the given time after touch-down. It is backwards, as when a foot that pushes off loses its grip,
/// with a top speed of 0.2 m/s to 0.5 m/s.
fn slip(when: Range<f64>, random: &mut SeededRandom) -> Slip {
    let duration = when.end - when.start;
    Slip {
        onset: when.start,
        duration,
        distance: duration * random.uniform(0.12..0.26),
        heading: std::f64::consts::PI + random.uniform(-0.7..0.7),
        twist: random.uniform(-0.15..0.15),
        chatter: random.uniform(3.0..8.0),
        chatter_frequency: random.uniform(35.0..70.0),
    }
}

/// Returns firm ground, a greased patch, a soft mat and firm ground again, of three steps each.
fn round(random: &mut SeededRandom) -> Vec<PlannedStep> {
    let grounds = [Ground::Hard, Ground::Greased, Ground::Soft, Ground::Hard];
    let mut steps: Vec<PlannedStep> = grounds
        .into_iter()
        .flat_map(|ground| [ground; 3])
        .map(|ground| Style::WALK.step(ground, random))
        .collect();
    // Times of the slips on the patch, as shares of the stance: one slip from a good stance that is caught again, two
    // such slips, and a slip from the landing until the foot is lifted.
    let ways: [&[Range<f64>]; 3] = [&[0.42..0.78], &[0.15..0.45, 0.60..0.85], &[0.10..1.0]];
    for (step, ways) in steps[3..6].iter_mut().zip(ways) {
        let share = |way: &Range<f64>| way.start * step.stance..way.end * step.stance;
        step.slips = ways.iter().map(|way| slip(share(way), random)).collect();
    }
    steps
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robot_settings_change_rests_slips_and_steps() {
        let usual = Plan::steady(GaitName::Trot, Ground::Hard, 300.0, 5);
        let robot = RobotParams {
            gait: GaitName::Trot,
            greased: 0.2,
            step_length: 1.5,
            shaking: 2.0,
            rests: Some(Rests { every: 20.0, lasting: 3.0 }),
            ..RobotParams::default()
        };
        let plan = robot.plan(300.0, 5);
        let rests = plan.steps.iter().filter(|step| step.stance > 3.0);
        assert_eq!(rests.count(), 12);
        let slips = plan.steps.iter().filter(|step| !step.slips.is_empty());
        let share = slips.count() as f64 / plan.steps.len() as f64;
        assert!((0.15..0.25).contains(&share), "{share}");
        let (first, usual) = (&plan.steps[0], &usual.steps[0]);
        assert!((first.travel[0] - 1.5 * usual.travel[0]).abs() < 1e-12);
        assert_eq!(first.tremor.frequency, 2.0 * usual.tremor.frequency);
        assert_eq!(first.swing, usual.swing);
    }

    #[test]
    fn every_gait_parses_from_its_name() {
        for gait in GaitName::ALL {
            assert_eq!(gait.to_string().parse(), Ok(gait));
        }
    }

    #[test]
    fn unknown_gait_error_lists_the_known_ones() {
        let error = "gallop".parse::<GaitName>().expect_err("not a gait");
        assert_eq!(
            error.to_string(),
            "there is no gait `gallop`; known are stand, walk, trot, run"
        );
    }

    #[test]
    fn demo_visits_all_grounds_in_12_to_15_seconds() {
        for seed in 0..20 {
            let plan = Plan::demo(seed);
            assert!((12.0..15.5).contains(&plan.duration), "{}", plan.duration);
            assert!(plan.standing >= 1.5);
            let slips: Vec<usize> = plan.steps.iter().map(|step| step.slips.len()).collect();
            assert_eq!(slips, [0, 0, 0, 1, 2, 1, 0, 0, 0, 0, 0, 0]);
            let soft = plan.steps.iter().map(|step| step.sinking.is_some());
            assert_eq!(soft.clone().filter(|soft| *soft).count(), 3);
            assert!(soft.skip(6).take(3).all(|soft| soft));
        }
    }

    #[test]
    fn steps_differ_and_a_seed_repeats_them() {
        let plan = Plan::steady(GaitName::Trot, Ground::Hard, 10.0, 3);
        for (one, next) in plan.steps.iter().zip(&plan.steps[1..]) {
            assert_ne!(one, next);
        }
        assert_eq!(plan, Plan::steady(GaitName::Trot, Ground::Hard, 10.0, 3));
        assert_ne!(plan, Plan::steady(GaitName::Trot, Ground::Hard, 10.0, 4));
    }

    #[test]
    fn rounds_begin_as_the_demo_and_then_differ() {
        let (demo, rounds) = (Plan::demo(5), Plan::rounds(60.0, 5));
        assert_eq!(rounds.steps[..12], demo.steps);
        assert_ne!(rounds.steps[12..24], demo.steps);
        assert!((60.0..75.0).contains(&rounds.duration), "{}", rounds.duration);
    }

    #[test]
    fn a_steady_gait_walks_until_the_recording_ends() {
        let plan = Plan::steady(GaitName::Run, Ground::Soft, 30.0, 1);
        let walked: f64 = plan.steps.iter().map(PlannedStep::duration).sum();
        assert!(plan.standing + walked >= 30.0);
        assert_eq!(plan.duration, 30.0);
        assert_eq!(plan.name, "run on soft ground, seed 1");
    }

    #[test]
    fn standing_takes_no_steps() {
        assert!(Plan::steady(GaitName::Stand, Ground::Hard, 60.0, 1).steps.is_empty());
    }
}
