//! The self-calibrating estimate: the paper's kernel mass on a logarithmic scale, with limits that are learnt from the
//! foot.
//!
//! The amplitude of the acceleration distinguishes a standing foot from a moving one, and so does that of the turn. The
//! estimate judges their logarithms, since robots differ by factors, and since a landing is one large sample among
//! small ones:
//!
//! ```text
//! u = ½ ln(|a|² + noise²)                    a: acceleration without gravity
//! v = ½ ln(|ω|² + noise_v²)                  ω: rate of turn without bias
//! z = (edge − u) + r·(edge_v − v)            each limited, and v weighted as it separates this foot's stances
//! m = Φ(z/(h √(1 + r²)))                     the kernel's mass below the edge, in closed form
//! M ← M + (m − M)·(1 − exp(−dt/τ))           mean over the last τ
//! P = M · S · E                              probability of stable contact
//! ```
//!
//! | factor | question | type |
//! |---|---|---|
//! | M | Does the foot move as little as in its stances? The edges lie between its stances and its swings. | `Classes`, `Turns` |
//! | S | Does it not slide? Accelerations along the ground that all point one way add up to a speed. | `Slide` |
//! | E | Has it rested or landed lately? A foot that hangs or is carried can move as little as in a stance. | `Evidence`, `Landing`, [`BriefRest`](crate::rest) |
//!
//! `constants` has the value of each constant, and the reason for it.
//!
//! The same edges judge parts of the motion: across up (tangential), along up (vertical), and along and about each axis
//! alone. No part is less probable than the whole.
//!
//! `docs/design/method.md` has all equations, `docs/design/parts.md` the reasons, and
//! `docs/design/estimate.md` the alternatives.

use crate::constants::Constants;
use crate::estimate::{PerAxis, Probabilities};
use crate::learnt::{LEAST_DISTANCE, Learning, Learnt};
use crate::math::{Order, erf, exp, inverse_root, ln, rounded};
use crate::rest::BriefRest;
use crate::sample::{AngularRate, LinearAcceleration};
use crate::units::STANDARD_GRAVITY;
use crate::vector::Vec3;

/// Least time constant of the mean mass, samples. With a smaller one, as 26 ms at 50 Hz, the mean would be the newest sample.
const LEAST_WINDOW: f32 = 2.0;

/// Longest gap that is counted, in windows of doubt, after which less than 5 % is left of any probability.
const GAP_WINDOWS: u32 = 3;

/// Probability above which the foot is more probably still than not.
const STILL: f32 = 0.5;

/// Factor of the probability without evidence: the foot may stand or hang.
const UNPROVEN: f32 = 0.5;

/// Share with which a stance counts in the classes before any landing, because a robot that stands with its motors
/// holding is quieter than in any stance of its walk.
const BEFORE_LANDING: f32 = 0.5;

/// Number of masses of the acceleration: of the whole, across up, along up, and along the three axes.
const PARTS: usize = 6;

/// Checked inputs of a self-calibrating estimate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SelfCalibratingConfig<'a> {
    constants: &'a Constants,
    learning: Learning,
    learnt: Option<Learnt>,
    sample_rate: f32,
}

impl<'a> SelfCalibratingConfig<'a> {
    /// Inputs that have been checked.
    pub const fn new(
        constants: &'a Constants,
        learning: Learning,
        learnt: Option<Learnt>,
        sample_rate: f32,
    ) -> Self {
        Self { constants, learning, learnt, sample_rate }
    }
}

/// Up, and whether it is estimated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Up {
    /// Unit vector, frame of the foot.
    pub direction: Vec3,
    /// Angle, rad, by which the newest sample corrected the direction; `None` if up is known without an estimate.
    pub correction: Option<f32>,
}

impl Up {
    /// z, known.
    pub const Z: Self = Self { direction: Vec3::new(0.0, 0.0, 1.0), correction: None };
}

/// The self-calibrating estimate and its learnt state.
#[derive(Clone, Debug)]
pub(crate) struct SelfCalibrating {
    constants: Constants,
    learning: Learning,
    /// Time between samples, s.
    period: f32,
    /// Share of the newest mass in its mean.
    newest_share: f32,
    /// Length of a window, samples.
    window: u32,
    /// Samples so far, up to a window.
    filled: u32,
    classes: Classes,
    turns: Turns,
    slide: Slide,
    evidence: Evidence,
    /// Samples missing before the next one, in a gap that is bridged.
    bridged: f32,
    /// Mean mass of each part of the acceleration.
    masses: [f32; PARTS],
    /// Mean mass of the turn about each axis.
    turn_masses: [f32; 3],
    /// Mean mass of acceleration and turn together.
    stillness: f32,
    /// Whether the foot is in a stance: the mean mass of the whole acceleration exceeds [`STILL`].
    in_stance: bool,
    /// Duration of the current stance or swing, s, limited to twice the shortest stance.
    phase_seconds: f32,
    /// Whether the foot was in a stance since the last landing.
    stood: bool,
    probabilities: Probabilities,
}

impl SelfCalibrating {
    #[cfg_attr(feature = "small-stack", inline(never))]
    pub fn new(config: &SelfCalibratingConfig<'_>) -> Self {
        let &SelfCalibratingConfig { constants, learning, learnt, sample_rate } = config;
        let constants = *constants;
        let period = 1.0 / sample_rate;
        let newest_share = 1.0 - exp(-1.0 / (constants.window * sample_rate).greater(LEAST_WINDOW));
        let learnt = learnt.unwrap_or_else(|| Learnt::unobserved(&constants)).at_start(&constants);
        Self {
            constants,
            learning,
            period,
            newest_share,
            window: rounded(constants.window * sample_rate).max(1),
            filled: 0,
            classes: Classes::new(&constants, &learnt),
            turns: Turns::new(),
            slide: Slide::new(&learnt),
            evidence: Evidence::new(&constants, period),
            bridged: 0.0,
            masses: [0.0; PARTS],
            turn_masses: [0.0; 3],
            stillness: 0.0,
            in_stance: true,
            phase_seconds: 0.0,
            stood: true,
            probabilities: Probabilities::default(),
        }
    }

    /// State learnt from the foot, in the ranges in which it can be stored.
    pub fn learnt(&self) -> Learnt {
        self.classes.learnt(self.slide.usual).limited()
    }

    /// Returns whether enough steps were observed.
    pub fn is_settled(&self) -> bool {
        self.classes.learnt(self.slide.usual).is_settled()
    }

    /// Returns whether the lack of evidence alone keeps the probability at or below a threshold.
    pub fn is_unproven(&self, threshold: f32) -> bool {
        !self.evidence.is_given && self.probabilities.stable > threshold * UNPROVEN
    }

    /// Returns whether the foot has stood since the last evidence that it stands.
    pub const fn stands(&self) -> bool {
        self.evidence.stands
    }

    /// Length of the mean acceleration over a window, m/s².
    pub fn mean_acceleration(&self) -> f32 {
        self.evidence.rest.mean_acceleration()
    }

    /// Returns whether the means cover a whole window.
    pub const fn is_full(&self) -> bool {
        self.filled >= self.window
    }

    /// Processes one sample's motion, with gravity and bias removed.
    pub fn push(
        &mut self,
        acceleration: LinearAcceleration,
        rate: AngularRate,
        up: Up,
    ) -> Probabilities {
        let (a, w) = (acceleration.0, rate.0);
        let square = a.dot(a);
        let Up { direction, correction } = up;
        let upright = a.dot(direction);

        let edge = self.classes.edge(&self.constants);
        // Until the window has passed, the means cover the samples so far.
        let share = if self.filled < self.window {
            self.filled += 1;
            self.newest_share.greater(1.0 / self.filled as f32)
        } else {
            self.newest_share
        };
        // Rounding may leave a slightly negative square, which the noise covers.
        let parts = [
            square,
            square - upright * upright,
            upright * upright,
            a.x * a.x,
            a.y * a.y,
            a.z * a.z,
        ];
        let logarithms = parts.map(|part| self.amplitude(part));
        let inverse_scale = self.inverse_scale();
        for (mean, u) in self.masses.iter_mut().zip(logarithms) {
            *mean += (mass(edge, u, inverse_scale) - *mean) * share;
        }
        let [logarithm, ..] = logarithms;
        let [whole, ..] = self.masses;
        let turn_logarithm = if self.turns.are_judged(&self.constants) {
            self.judge_turn(w, logarithm, whole, share)
        } else {
            self.stillness = whole;
            0.0
        };

        let moving = self.classes.moving;
        // The estimate of up may be wrong by a tilt that leaves an acceleration as large as the noise.
        let tilt = if correction.is_some() { self.constants.noise } else { 0.0 };
        let level = a - direction * upright;
        let no_slide = self.slide.push(&self.constants, self.period, level, w, moving, tilt);
        let still = self.stillness * no_slide;
        if still > STILL {
            self.slide.learn_apparent(&self.constants, self.period, level);
        }
        let samples = 1.0 + core::mem::take(&mut self.bridged);
        self.evidence.push(
            &self.constants,
            &Reading {
                acceleration: a,
                logarithm,
                least: self.classes.lowest,
                rate: w,
                up: direction,
                correction: correction.unwrap_or(0.0),
                still,
                samples,
                seconds: self.period * samples,
                share: (self.newest_share * samples).lesser(1.0),
            },
        );
        self.probabilities = self.combine(no_slide);
        self.learn(logarithm, turn_logarithm, whole);
        self.probabilities
    }

    /// Judges the rate of turn beside the acceleration, whose logarithm is `logarithm` and whose mean mass is `whole`.
    /// `share` is the share of the newest sample in a mean. Returns the logarithm of the rate.
    fn judge_turn(&mut self, w: Vec3, logarithm: f32, whole: f32, share: f32) -> f32 {
        let edge = self.turns.edge(&self.constants);
        let inverse_scale = self.inverse_scale();
        for (mean, part) in self.turn_masses.iter_mut().zip([w.x * w.x, w.y * w.y, w.z * w.z]) {
            let v = Turns::logarithm(&self.constants, part);
            *mean += (mass(edge, v, inverse_scale) - *mean) * share;
        }
        let v = Turns::logarithm(&self.constants, w.dot(w));
        self.turns.settle(&self.constants, whole, self.stillness, v);
        let distance = self.turns.distance_below(&self.constants, &self.classes, logarithm, v);
        self.stillness += (mass(distance, 0.0, inverse_scale) - self.stillness) * share;
        v
    }

    /// Combines the masses, the slide and the evidence. Where turns are not judged, the probability about an axis is
    /// that of the evidence.
    fn combine(&self, no_slide: f32) -> Probabilities {
        let evidence = self.evidence.factor();
        let [_, tangential, vertical, x, y, z] = self.masses;
        let [about_x, about_y, about_z] =
            if self.turns.are_judged(&self.constants) { self.turn_masses } else { [1.0; 3] };
        let stable = self.stillness * no_slide * evidence;
        // Acceleration or turn alone judges a part, and could find it less probable than the whole. So the larger value counts.
        Probabilities {
            axes: PerAxis::from_array(
                [x, y, z, about_x, about_y, about_z].map(|p| (p * evidence).greater(stable)),
            ),
            tangential: (tangential * no_slide * evidence).greater(stable),
            vertical: (vertical * evidence).greater(stable),
            stable,
        }
    }

    /// Learns from a sample with these logarithms of its amplitude and its turn, and the mean mass `whole` of the
    /// acceleration.
    fn learn(&mut self, logarithm: f32, turn_logarithm: f32, whole: f32) {
        let in_stance = whole > STILL;
        self.phase_seconds = if in_stance == self.in_stance {
            (self.phase_seconds + self.period).lesser(2.0 * self.constants.stance)
        } else {
            0.0
        };
        self.in_stance = in_stance;
        let walks = self.evidence.walks(&self.constants);
        let may_learn = walks || self.evidence.is_given;
        if self.learning == Learning::Frozen || !may_learn {
            return;
        }
        self.stood |= in_stance;
        if self.evidence.has_just_landed {
            // If no stance followed the last landing, the limits belong to another gait or robot.
            if !self.stood {
                self.classes.doubt(&self.constants);
                self.turns.doubt(&self.constants);
                self.slide.doubt(&self.constants);
            }
            self.stood = false;
        }
        // A long stance does not teach the classes beyond its beginning, because a foot that stands for a minute would
        // forget its motion, and take its own quiet for that of all stances. There are two exceptions. After a landing the
        // stance counts for twice as long, so that limits of another robot are forgotten. And a foot that rests from time
        // to time but does not land may walk so slowly that its swings pass for stances. If it only turns, it may stand.
        let is_swing_or_begins = !in_stance || self.phase_seconds < self.constants.stance;
        let walks_slowly = !walks && self.evidence.is_accelerated(&self.constants);
        if is_swing_or_begins
            || walks_slowly
            || self.evidence.fell_within(2.0 * self.constants.stance)
        {
            let stands_first = in_stance && !self.evidence.has_landed;
            let share = if stands_first { BEFORE_LANDING } else { 1.0 };
            self.classes.learn(&self.constants, logarithm, self.period * share);
            if self.turns.are_judged(&self.constants) {
                self.turns.learn(
                    &self.constants,
                    &self.classes,
                    logarithm,
                    turn_logarithm,
                    whole,
                    self.period,
                );
            }
        }
        if is_swing_or_begins {
            // Slides teach the usual speed as stances do. Otherwise a foot whose stances all count as slides could
            // never correct it.
            self.slide.learn(&self.constants, whole * self.period);
        }
    }

    /// Processes a sample that is unreliable, at the end of the sensor's range, or without a known up. It counts as a
    /// sample in motion, and is not learnt from.
    pub fn push_doubt(&mut self) -> Probabilities {
        self.fade(self.newest_share);
        let samples = 1.0 + core::mem::take(&mut self.bridged);
        self.evidence.pass(self.period * samples);
        self.probabilities
    }

    /// Accounts for missing samples, and returns the probabilities after them. A gap of up to half a window is bridged:
    /// it takes nothing from the probabilities.
    pub fn account_for(&mut self, missing: u64) -> Probabilities {
        // A gap with more samples than 32 bits can count lasts days, and leaves no probability. From 64 bits the
        // conversion would need a library of double precision on a processor without floating point.
        let missing = u32::try_from(missing).unwrap_or(u32::MAX);
        if missing > (self.window / 2).max(1) {
            for _ in 0..missing.min(GAP_WINDOWS * self.window) {
                self.fade(self.newest_share);
            }
            self.evidence.pass(missing as f32 * self.period);
            self.evidence.landing.forget_speed();
        } else {
            self.bridged = missing as f32;
        }
        self.probabilities
    }

    /// Takes a share of all probabilities away.
    fn fade(&mut self, share: f32) {
        let rest = 1.0 - share;
        self.masses = self.masses.map(|mass| mass * rest);
        self.turn_masses = self.turn_masses.map(|mass| mass * rest);
        self.stillness *= rest;
        self.probabilities = self.probabilities.scaled(rest);
    }

    /// 1/(h√2) for the kernel's bandwidth h.
    fn inverse_scale(&self) -> f32 {
        core::f32::consts::FRAC_1_SQRT_2 / self.constants.bandwidth
    }

    /// Logarithm of an amplitude given as its square.
    fn amplitude(&self, square: f32) -> f32 {
        0.5 * ln(square + self.constants.noise * self.constants.noise)
    }
}

/// Returns the kernel's mass below the edge at the logarithm of an amplitude, for 1/(h√2) of its bandwidth h.
fn mass(edge: f32, u: f32, inverse_scale: f32) -> f32 {
    0.5 + 0.5 * erf((edge - u) * inverse_scale)
}

/// The two classes of one foot, stillness and motion, and the amplitudes that they were learnt from.
///
/// The amplitudes of stances and swings differ from robot to robot by a factor of a hundred. While the foot walks, the
/// time at each logarithm u is counted, and what is older than the memory is forgotten. The counts are split where the
/// two parts lie farthest apart for their seconds (Otsu, 1979), whatever the parts were before:
///
/// ```text
/// s(k)  seconds at lowest + k·step, each u shared between the two nearest k
/// split = the k with the largest w₀ w₁ (moving − still)²    still, moving: means below and above; w₀, w₁: seconds
/// edge  = still + part · (moving − still)
/// ```
#[derive(Clone, Copy, Debug)]
struct Classes {
    /// Logarithm of the first count.
    lowest: f32,
    /// Seconds at each logarithm.
    counts: [f32; Self::COUNTS],
    /// Sum of the counts, s.
    seconds: f32,
    /// Sum of the counts, each times its place, s.
    moment: f32,
    /// Mean logarithm of the amplitude in stillness, of m/s².
    still: f32,
    /// Mean logarithm of the amplitude in motion.
    moving: f32,
    /// Time for which stillness was observed, s, up to the memory.
    still_seconds: f32,
    /// Time for which motion was observed, s.
    moving_seconds: f32,
}

impl Classes {
    /// Number of logarithms that are counted. With [`Self::STEP`] they reach from the noise to 220 times the noise.
    const COUNTS: usize = 13;

    /// Distance of the logarithms that are counted: amplitudes that differ by a factor of 1.6.
    const STEP: f32 = 0.45;

    /// Share of the counts that is kept when they exceed the memory. At 1 kHz that happens at one sample in a hundred,
    /// which is not counted, so that no sample takes longer than the others.
    const KEPT: f32 = 15.0 / 16.0;

    /// Least product of the seconds of two parts, s². A smaller one is a rounding error.
    const LEAST_PRODUCT: f32 = 1.0e-5;

    /// The classes of a state from [`Learnt::at_start`].
    fn new(constants: &Constants, learnt: &Learnt) -> Self {
        let mut classes = Self {
            lowest: ln(constants.noise),
            counts: [0.0; Self::COUNTS],
            seconds: 0.0,
            moment: 0.0,
            still: learnt.still,
            moving: learnt.moving,
            still_seconds: learnt.still_seconds,
            moving_seconds: learnt.moving_seconds,
        };
        classes.count(classes.still, classes.still_seconds + constants.prior);
        classes.count(classes.moving, classes.moving_seconds + constants.prior);
        classes
    }

    /// The classes, with the usual speed of the slide, as they are stored.
    const fn learnt(&self, speed: f32) -> Learnt {
        Learnt {
            still: self.still,
            moving: self.moving,
            speed,
            still_seconds: self.still_seconds,
            moving_seconds: self.moving_seconds,
        }
    }

    /// Upper end of stillness.
    fn edge(&self, constants: &Constants) -> f32 {
        constants.edge(self.still, self.moving)
    }

    /// Learns from the logarithm of an amplitude that lasted for some seconds.
    fn learn(&mut self, constants: &Constants, u: f32, seconds: f32) {
        let observed = if u < self.edge(constants) {
            &mut self.still_seconds
        } else {
            &mut self.moving_seconds
        };
        *observed = (*observed + seconds).lesser(constants.memory);
        if self.seconds > constants.memory {
            self.forget(Self::KEPT);
        } else {
            self.count(u, seconds);
            self.split();
        }
    }

    /// Lets the learnt state count as no more than one stance and one swing.
    fn doubt(&mut self, constants: &Constants) {
        self.still_seconds = self.still_seconds.lesser(constants.stance);
        self.moving_seconds = self.moving_seconds.lesser(constants.stance);
        let most = 2.0 * constants.stance;
        if self.seconds > most {
            self.forget(most / self.seconds);
        }
    }

    /// Reduces all counts to a share.
    fn forget(&mut self, left: f32) {
        for count in &mut self.counts {
            *count *= left;
        }
        self.seconds *= left;
        self.moment *= left;
    }

    /// Counts seconds at a logarithm.
    fn count(&mut self, u: f32, seconds: f32) {
        const LAST: f32 = (Classes::COUNTS - 1) as f32;
        let place = ((u - self.lowest) * (1.0 / Self::STEP)).greater(0.0).lesser(LAST);
        let before = place as usize;
        let share = place - before as f32;
        if let Some(count) = self.counts.get_mut(before) {
            *count += seconds * (1.0 - share);
        }
        if let Some(count) = self.counts.get_mut(before + 1) {
            *count += seconds * share;
        }
        self.seconds += seconds;
        self.moment += seconds * place;
    }

    /// Splits the counts into the classes.
    ///
    /// The best split has the largest d²/(s · rest): s are the seconds below the split, rest those above it, and d is the
    /// sum over the seconds below of their distance from the mean of all. Distances are in steps times all seconds, so
    /// one pass without a division finds the split.
    fn split(&mut self) {
        let all = self.seconds;
        let (mut s, mut d, mut distance) = (0.0, 0.0, -self.moment);
        let (mut best_s, mut best_d, mut best_square, mut best_w) = (0.0, 0.0, 0.0, 1.0);
        for &count in &self.counts {
            s += count;
            d += count * distance;
            distance += all;
            let w = s * (all - s);
            let square = d * d;
            if w > Self::LEAST_PRODUCT && square * best_w > best_square * w {
                (best_s, best_d, best_square, best_w) = (s, d, square, w);
            }
        }
        if best_s > 0.0 {
            let at = |steps: f32| self.lowest + Self::STEP * steps / all;
            self.still = at(self.moment + best_d / best_s);
            let moving = at(self.moment - best_d / (all - best_s));
            self.moving = moving.greater(self.still + LEAST_DISTANCE);
        }
    }
}

/// The second witness: the rate at which the foot turns in its stances and in its swings, and its weight.
///
/// A foot that trembles after a landing accelerates as in a swing, but does not turn. A heel that rises slowly turns,
/// but hardly accelerates. The logarithm v of the rate has two classes as that of the acceleration, u, has. The mass A
/// of the acceleration alone teaches them, so that the turn cannot confirm itself:
///
/// ```text
/// still_v  += (v − still_v)  · A dt/(seconds of stillness + prior)
/// moving_v += (v − moving_v) · (1 − A) dt/(seconds of motion + prior)
/// D, D_v   = moving − still, and that of the turn, at least 0
/// σ², σ_v² = mean squares of u and v about their classes, stillness where A > ½
/// r        = weight · (D_v/σ_v²)/(D/σ²)
/// z        = limited(edge − u, clip · D) + r · limited(edge_v − v, clip · D_v)
/// ```
///
/// r is Fisher's linear discriminant for uncorrelated u and v: each counts as much as it separates this foot's stances
/// from its swings. Where the turn separates nothing, as with a gyroscope that always reads 0 or a foot whose stances
/// roll as fast as its swings, `D_v` is 0, and the acceleration decides alone. With a weight of 0 turns are not judged.
///
/// A quiet turn excuses a large acceleration only while the foot settles after a landing. If a foot has stood firmly and
/// then chatters, it slides. So from A > `turn_settled` until the foot swings, a quiet turn, v < `edge_v`, does not
/// count. The foot swings if M < ½ and v > `edge_v`.
#[derive(Clone, Copy, Debug)]
struct Turns {
    /// Mean logarithm of the rate in stillness, of rad/s.
    still: f32,
    /// Mean logarithm of the rate in motion.
    moving: f32,
    /// Time for which stillness was observed, s, up to the memory.
    still_seconds: f32,
    /// Time for which motion was observed, s.
    moving_seconds: f32,
    /// Mean square of the logarithm of the acceleration about its class.
    acceleration_variance: f32,
    /// Mean square of the logarithm of the rate about its class.
    variance: f32,
    /// Whether the foot has stood firmly since its last swing.
    has_stood_firmly: bool,
}

impl Turns {
    /// Logarithm of the rate in stances before any is observed: 0.3 rad/s.
    const STILL: f32 = ln(0.3);

    /// Logarithm of the rate in swings before any is observed: 2 rad/s.
    const MOVING: f32 = ln(2.0);

    /// Variances before any observation. Their standard deviation is a factor of 1.9.
    const VARIANCE: f32 = 0.4;

    /// Least variance that counts. Its standard deviation is a factor of 1.4. Without it, constant readings would
    /// separate perfectly.
    const LEAST_VARIANCE: f32 = 0.1;

    const fn new() -> Self {
        Self {
            still: Self::STILL,
            moving: Self::MOVING,
            still_seconds: 0.0,
            moving_seconds: 0.0,
            acceleration_variance: Self::VARIANCE,
            variance: Self::VARIANCE,
            has_stood_firmly: false,
        }
    }

    /// Returns whether turns are judged at all.
    fn are_judged(&self, constants: &Constants) -> bool {
        constants.turn_weight > 0.0
    }

    /// Logarithm of a rate given as its square.
    fn logarithm(constants: &Constants, square: f32) -> f32 {
        0.5 * ln(square + constants.turn_noise * constants.turn_noise)
    }

    /// Distance of the classes. It is 0 where the foot turns no faster in its swings than in its stances.
    fn separation(&self) -> f32 {
        (self.moving - self.still).greater(0.0)
    }

    /// Upper end of the turns in stances.
    fn edge(&self, constants: &Constants) -> f32 {
        self.still + constants.part_of_the_way * self.separation().greater(LEAST_DISTANCE)
    }

    /// Distance of a sample with the logarithms `u` of its acceleration and `v` of its rate below the edges of both,
    /// in units in which the kernel has the bandwidth h.
    fn distance_below(&self, constants: &Constants, classes: &Classes, u: f32, v: f32) -> f32 {
        let limited = |x: f32, most: f32| x.greater(-most).lesser(most);
        let acceleration_separation = classes.moving - classes.still;
        let separation = self.separation();
        let acceleration_variance = self.acceleration_variance.greater(Self::LEAST_VARIANCE);
        let variance = self.variance.greater(Self::LEAST_VARIANCE);
        let weight = constants.turn_weight * (separation * acceleration_variance)
            / (acceleration_separation * variance);
        let below =
            limited(classes.edge(constants) - u, constants.turn_clip * acceleration_separation);
        let turn_below = limited(self.edge(constants) - v, constants.turn_clip * separation);
        let is_excuse = self.has_stood_firmly && turn_below > 0.0;
        let weight = if is_excuse { 0.0 } else { weight };
        (below + weight * turn_below) * inverse_root(1.0 + weight * weight)
    }

    /// Notes whether the foot has settled, by the mean mass of the acceleration (`whole`), the mean mass of acceleration
    /// and turn (`stillness`), and the logarithm of the newest rate (`v`).
    fn settle(&mut self, constants: &Constants, whole: f32, stillness: f32, v: f32) {
        if stillness < STILL && v > self.edge(constants) {
            self.has_stood_firmly = false;
        } else if whole > constants.turn_settled {
            self.has_stood_firmly = true;
        }
    }

    /// Learns from the logarithms `u` of the acceleration and `v` of the rate of a sample that lasted for some seconds,
    /// where the mean mass of the acceleration is `whole`.
    fn learn(
        &mut self,
        constants: &Constants,
        classes: &Classes,
        u: f32,
        v: f32,
        whole: f32,
        seconds: f32,
    ) {
        let (still, moving) = (whole * seconds, (1.0 - whole) * seconds);
        self.still_seconds = (self.still_seconds + still).lesser(constants.memory);
        self.moving_seconds = (self.moving_seconds + moving).lesser(constants.memory);
        self.still += (v - self.still) * still / (self.still_seconds + constants.prior);
        self.moving += (v - self.moving) * moving / (self.moving_seconds + constants.prior);

        let (u_class, v_class) =
            if whole > STILL { (classes.still, self.still) } else { (classes.moving, self.moving) };
        let share = seconds / (self.still_seconds + self.moving_seconds + constants.prior);
        let (u, v) = (u - u_class, v - v_class);
        self.acceleration_variance += (u * u - self.acceleration_variance) * share;
        self.variance += (v * v - self.variance) * share;
    }

    /// Lets the learnt state count as no more than one stance and one swing.
    fn doubt(&mut self, constants: &Constants) {
        self.still_seconds = self.still_seconds.lesser(constants.stance);
        self.moving_seconds = self.moving_seconds.lesser(constants.stance);
    }
}

/// Detection of slides without shaking, by the speed gained along the ground.
///
/// On a slick floor a foot can slide off at a tenth of the acceleration that its stances show. But these accelerations
/// all point one way, and add up. The component across up is summed into a speed that decays:
///
/// ```text
/// v ← v·τ/(τ + dt) + clip(a − apparent)·dt
/// S = 1 / (1 + (|v|/limit)⁴)
/// limit² = (factor · usual · √(usual / (quiet · swing)))² + (lever · turn)² + (noise · τ)²
/// apparent = mean over a stance of a where the foot stands, limited to offset · |lean|
/// ```
///
/// *usual* is the speed that the foot's own stances leave in the sum: 0.5 mm/s on a noise-free simulated robot, 4 to
/// 12 mm/s on real feet, where slower slides look like stances. *swing* is the acceleration of the foot's swings, so
/// that the result does not depend on a robot's size. *turn* is the angular rate: the IMU above the sole of a foot that
/// rolls moves, and the foot does not slide. The last term is what a false idea of up adds to the sum.
///
/// *apparent* is the acceleration that a standing foot seems to have, because an accelerometer's unknown *offset* turns
/// with a shank that leans by the angle *lean* within a second. The apparent acceleration changes as slowly as the shank
/// leans, whereas a slide begins at once. A leg that hangs accelerates by g times its inclination, fourteen times as much
/// as an offset explains.
///
/// Two slides are not detected: at a steady acceleration below limit/τ, and at a constant speed.
#[derive(Clone, Copy, Debug)]
struct Slide {
    /// Speed along the ground, m/s, frame of the foot.
    speed: Vec3,
    /// Turn within [`Self::LEAN_TIME`], rad, frame of the foot.
    lean: Vec3,
    /// Mean acceleration along the ground while the foot stands, m/s², frame of the foot.
    apparent: Vec3,
    /// Mean angular rate, rad/s.
    turn: f32,
    /// Usual speed in stances, natural logarithm of m/s.
    usual: f32,
    /// Duration of the stances that it was learnt from, s.
    observed: f32,
}

impl Slide {
    /// Logarithm of the ratio of the speed in stances to the acceleration in swings, s, of a robot without noise: ln 0.1 ms.
    const QUIET: f32 = ln(1.0e-4);

    /// Square of the least speed, m²/s²: slower speeds look the same.
    const LEAST_SQUARE: f32 = 1.0e-8;

    /// Largest offset of an accelerometer, m/s²: 40 mg on each axis.
    const OFFSET: f32 = 0.7;

    /// Time in which the estimate of up follows the force of a quiet foot, and forgets its lean, s.
    const LEAN_TIME: f32 = 1.0;

    /// A foot that stands.
    const fn new(learnt: &Learnt) -> Self {
        Self {
            speed: Vec3::ZERO,
            lean: Vec3::ZERO,
            apparent: Vec3::ZERO,
            turn: 0.0,
            usual: learnt.speed,
            observed: learnt.still_seconds,
        }
    }

    /// Adds an acceleration along the ground, m/s², of a foot that turns at `rate` rad/s for a `period` in s, and has
    /// swings of the logarithm `swing`. `tilt` is the acceleration that a false idea of up may leave, m/s², or 0 if up is
    /// known. Returns the probability that the foot does not slide.
    fn push(
        &mut self,
        constants: &Constants,
        period: f32,
        level: Vec3,
        rate: Vec3,
        swing: f32,
        tilt: f32,
    ) -> f32 {
        let share = period / (constants.window + period);
        self.lean = self.lean * (1.0 - period / Self::LEAN_TIME) + rate * period;
        let explained = if tilt > 0.0 { Self::OFFSET * self.lean.length() } else { 0.0 };
        let level = level - self.apparent.clipped(explained);
        self.speed =
            self.speed * (1.0 - share) + level.clipped(constants.slide_acceleration) * period;
        self.turn += (rate.length() - self.turn) * share;
        let louder = 0.5 * (self.usual - swing - Self::QUIET);
        let standing = constants.slide_factor * exp(self.usual + louder);
        let rolling = constants.slide_lever * self.turn;
        let tilted = tilt * constants.window;
        let limit = standing * standing + rolling * rolling + tilted * tilted;
        let ratio = self.speed.dot(self.speed) / limit;
        1.0 / (1.0 + ratio * ratio)
    }

    /// Learns the apparent acceleration of a standing foot from its acceleration along the ground, m/s², in a `period`, s.
    fn learn_apparent(&mut self, constants: &Constants, period: f32, level: Vec3) {
        let share = period / (constants.stance + period);
        self.apparent = self.apparent + (level - self.apparent) * share;
    }

    /// Learns the usual speed from the newest sample, for a time in s times the probability of stillness.
    fn learn(&mut self, constants: &Constants, seconds: f32) {
        self.observed = (self.observed + seconds).lesser(constants.memory);
        let difference = 0.5 * ln(self.speed.dot(self.speed) + Self::LEAST_SQUARE) - self.usual;
        self.usual += difference * seconds / (self.observed + constants.prior);
    }

    /// Lets the learnt speed count as no more than one stance.
    fn doubt(&mut self, constants: &Constants) {
        self.observed = self.observed.lesser(constants.stance);
    }
}

/// One sample, in the form in which the evidence is judged.
#[derive(Clone, Copy, Debug)]
struct Reading {
    /// m/s².
    acceleration: Vec3,
    /// Logarithm of its amplitude, as the classes judge it.
    logarithm: f32,
    /// Least logarithm that an amplitude can have.
    least: f32,
    /// rad/s.
    rate: Vec3,
    /// Unit vector.
    up: Vec3,
    /// Angle by which up was corrected, rad.
    correction: f32,
    /// Probability of stillness without evidence.
    still: f32,
    /// Samples since the previous one; more than one after a bridged gap.
    samples: f32,
    /// Time since the previous sample, s.
    seconds: f32,
    /// Share of the sample in a mean over a window.
    share: f32,
}

/// Evidence that a foot stands: it has rested, or it has landed.
///
/// Learnt limits leave room for stances that shake. A foot that hangs, is carried or is shaken moves within that room
/// for minutes. It lacks the evidence of a walk, which is a landing in each stride, and that of a standing foot, which is
/// rest.
///
/// The evidence lasts as long as the foot stands. A foot that has stood and has not moved since still stands, even if its
/// shank turns about it so that it does not rest. It has moved if for [`Self::MOVED`] the probability of stillness
/// was below one half, or if it rose or sank. Without evidence for [`Constants::evidence`] the probability is then at
/// most one half, however little the foot moves, and nothing is learnt.
#[derive(Clone, Copy, Debug)]
struct Evidence {
    rest: BriefRest,
    landing: Landing,
    /// Time since the foot moved, s.
    since_motion: f32,
    /// Time since it landed, s.
    since_landing: f32,
    /// Time since the acceleration fell as in a landing, s.
    since_fall: f32,
    /// Time since the last evidence, s.
    since_evidence: f32,
    /// Whether the foot has stood since the last evidence.
    stands: bool,
    /// Duration of the motion that contradicts `stands`, s.
    moves_for: f32,
    /// Whether the foot stands, or has rested or landed lately. It is updated with each reliable sample.
    is_given: bool,
    /// Whether it has ever landed.
    has_landed: bool,
    /// Whether the foot has landed with this sample, after a swing that counted as motion.
    has_just_landed: bool,
}

impl Evidence {
    /// Duration of motion that ends a stand, s. Shorter motion is a jolt, or the trembling after a landing.
    const MOVED: f32 = 0.06;

    /// The state before the first sample, for samples every `period` seconds.
    fn new(constants: &Constants, period: f32) -> Self {
        Self {
            rest: BriefRest::NONE,
            landing: Landing::new(constants, period),
            since_motion: f32::INFINITY,
            since_landing: f32::INFINITY,
            since_fall: f32::INFINITY,
            since_evidence: f32::INFINITY,
            stands: false,
            moves_for: 0.0,
            is_given: false,
            has_landed: false,
            has_just_landed: false,
        }
    }

    /// Processes a sample.
    fn push(&mut self, constants: &Constants, reading: &Reading) {
        let since =
            |happens: bool, before: f32| if happens { 0.0 } else { before + reading.seconds };
        let has_rested = self.rest.push(
            constants,
            reading.acceleration,
            reading.rate,
            reading.seconds,
            reading.share,
        );
        let fall = self.landing.push(constants, reading, has_rested);
        self.since_motion = since(reading.still < STILL, self.since_motion);
        self.since_fall = since(fall.begins, self.since_fall);
        let has_moved = self.since_motion < constants.evidence;
        self.has_just_landed = fall.begins && has_moved;
        let lands = fall.lands && has_moved;
        self.has_landed |= lands;
        self.since_landing = since(lands, self.since_landing);

        self.since_evidence = since(lands || has_rested, self.since_evidence);
        let moves = reading.still < STILL || self.rest.rises(constants, reading.up);
        self.moves_for = if moves { self.moves_for + reading.seconds } else { 0.0 };
        self.stands = (self.stands || lands || has_rested) && self.moves_for < Self::MOVED;
        self.is_given = self.stands || self.since_evidence < constants.evidence;
    }

    /// Factor of the probability: 1 while there is evidence, [`UNPROVEN`] without.
    const fn factor(&self) -> f32 {
        if self.is_given { 1.0 } else { UNPROVEN }
    }

    /// Lets a time in s pass without a reliable sample.
    fn pass(&mut self, seconds: f32) {
        self.rest.pass(seconds);
        self.moves_for += seconds;
        self.stands &= self.moves_for < Self::MOVED;
        self.since_motion += seconds;
        self.since_landing += seconds;
        self.since_fall += seconds;
        self.since_evidence += seconds;
    }

    /// Returns whether the foot has landed within [`Constants::evidence`], or has never landed yet.
    fn walks(&self, constants: &Constants) -> bool {
        !self.has_landed || self.since_landing < constants.evidence
    }

    /// Returns whether the acceleration is too large for rest.
    fn is_accelerated(&self, constants: &Constants) -> bool {
        self.rest.is_accelerated(constants)
    }

    /// Returns whether the acceleration has fallen as in a landing within the last `seconds`. The swing before need
    /// not have counted as motion.
    fn fell_within(&self, seconds: f32) -> bool {
        self.since_fall < seconds
    }
}

/// Detection of landings: the acceleration falls from the level of a swing to the level of a stance, and the swing has
/// lost the speed that it gained. A foot that is shaken, by contrast, is fastest when its acceleration falls.
#[derive(Clone, Copy, Debug)]
struct Landing {
    /// Share of the newest sample in the mean over a stance.
    stance_share: f32,
    /// Mean of the logarithm of the acceleration over a window.
    window_mean: f32,
    /// Mean of the logarithm of the acceleration over a stance.
    stance_mean: f32,
    /// Recent maximum of `stance_mean`. It falls by one in [`Constants::evidence`].
    strongest: f32,
    /// e to the power of `strongest`, m/s².
    strongest_acceleration: f32,
    /// Acceleration that corrections of up have removed since the maximum, m/s². Where a pendulum turns, its force
    /// points along the rod, and the apparent swing was a false idea of up.
    corrected: f32,
    /// Sum of the accelerations since the last fall or gap: the change of speed, in m/s² times samples.
    gained: Vec3,
    /// Sum of the magnitudes of these accelerations: the largest change of speed that they could have caused.
    gained_at_most: f32,
    /// Whether the acceleration is far below the level of the swing.
    is_below: bool,
    /// Whether the swing had lost its speed when the acceleration fell below that level.
    has_landed: bool,
}

/// Acceleration of the newest sample, compared with the swing before.
#[derive(Clone, Copy, Debug)]
struct Fall {
    /// The acceleration has just fallen far below the level of the swing.
    begins: bool,
    /// The acceleration is far below the level of the swing, and the swing has lost the speed that it gained.
    lands: bool,
}

impl Landing {
    /// Logarithm of a swing weaker than any.
    const WEAKEST: f32 = -3.0;

    /// No swing so far, with samples each `period` seconds.
    fn new(constants: &Constants, period: f32) -> Self {
        Self {
            stance_share: 1.0 - exp(-period / constants.stance),
            window_mean: 0.0,
            stance_mean: Self::WEAKEST,
            strongest: Self::WEAKEST,
            strongest_acceleration: exp(Self::WEAKEST),
            corrected: 0.0,
            gained: Vec3::ZERO,
            gained_at_most: 0.0,
            is_below: false,
            has_landed: false,
        }
    }

    /// Processes a sample. A foot that `has_rested` has no speed.
    fn push(&mut self, constants: &Constants, reading: &Reading, has_rested: bool) -> Fall {
        self.window_mean += (reading.logarithm - self.window_mean) * reading.share;
        let share = (self.stance_share * reading.samples).lesser(1.0);
        self.stance_mean += (reading.logarithm - self.stance_mean) * share;
        self.corrected += STANDARD_GRAVITY * reading.correction;
        let falls_by = reading.seconds / constants.evidence;
        self.strongest -= falls_by;
        let swing = if self.stance_mean > self.strongest {
            self.strongest = self.stance_mean;
            self.strongest_acceleration = exp(self.stance_mean);
            self.corrected = 0.0;
            self.stance_mean
        } else {
            self.strongest_acceleration *= 1.0 - falls_by;
            ln((self.strongest_acceleration - self.corrected).greater(f32::MIN_POSITIVE))
        };
        let gained = reading.acceleration * reading.samples;
        self.gained += gained;
        self.gained_at_most += sum_of_magnitudes(gained);
        let has_lost_speed =
            sum_of_magnitudes(self.gained) < constants.leftover * self.gained_at_most;

        let is_below = self.window_mean < swing.greater(reading.least) - constants.landing;
        let begins = is_below && !self.is_below;
        self.is_below = is_below;
        self.has_landed = is_below && (self.has_landed || begins && has_lost_speed);
        if begins || has_rested {
            self.forget_speed();
        }
        Fall { begins, lands: self.has_landed }
    }

    /// Starts the sums again, because the foot has no speed, or because its speed after a gap is unknown. If a gap kept
    /// the sums, a shaken foot would seem to have lost its speed.
    const fn forget_speed(&mut self) {
        self.gained = Vec3::ZERO;
        self.gained_at_most = 0.0;
    }
}

/// Sum of the magnitudes of a vector's components. It obeys the triangle inequality, as the length does, and needs no
/// root.
const fn sum_of_magnitudes(vector: Vec3) -> f32 {
    vector.x.abs() + vector.y.abs() + vector.z.abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::sqrt;
    use std::vec::Vec;

    const CONSTANTS: Constants = Constants::DEFAULT;
    const DT: f32 = 0.001;

    fn classes() -> Classes {
        Classes::new(&CONSTANTS, &Learnt::unobserved(&CONSTANTS).at_start(&CONSTANTS))
    }

    /// Lets a foot walk with strides of stance and swing, 0.3 s each, of these amplitudes, m/s².
    fn walk(classes: &mut Classes, stance: f32, swing: f32, strides: usize) {
        for _ in 0..strides {
            for amplitude in [stance, swing] {
                (0..300).for_each(|_| classes.learn(&CONSTANTS, ln(amplitude), DT));
            }
        }
    }

    fn assert_near(found: f32, expected: f32, tolerance: f32) {
        assert!((found - expected).abs() < tolerance, "{found} instead of {expected}");
    }

    #[test]
    fn classes_are_the_amplitudes_of_stances_and_swings() {
        for (stance, swing) in [(0.3, 2.7), (0.5, 8.0), (3.0, 23.0)] {
            let mut classes = classes();
            walk(&mut classes, stance, swing, 10);
            // A count is shared between the two nearest logarithms.
            assert_near(classes.still, ln(stance), 0.25);
            assert_near(classes.moving, ln(swing), 0.25);
        }
    }

    #[test]
    fn limits_of_another_robot_are_forgotten_in_ten_strides() {
        let [mut first, mut second] = [classes(), classes()];
        walk(&mut first, 3.0, 23.0, 50);
        walk(&mut first, 0.3, 2.7, 10);
        walk(&mut second, 0.3, 2.7, 10);
        assert_near(first.edge(&CONSTANTS), second.edge(&CONSTANTS), 0.1);
    }

    #[test]
    fn classes_of_a_single_amplitude_stay_apart() {
        let mut classes = classes();
        walk(&mut classes, 1.0, 1.0, 20);
        assert!(classes.moving >= classes.still + LEAST_DISTANCE, "{classes:?}");
    }

    /// A foot that walks in place without gravity: strides of a swing and a stance, 0.3 s each, at 1 kHz.
    struct Walker {
        model: SelfCalibrating,
        random: u32,
    }

    impl Walker {
        /// Rates of turn of an ordinary stance and swing, rad/s.
        const TURNS: [f32; 2] = [0.05, 4.0];

        fn new(constants: Constants) -> Self {
            let config = SelfCalibratingConfig::new(&constants, Learning::On, None, 1.0 / DT);
            let mut walker = Self { model: SelfCalibrating::new(&config), random: 1 };
            walker.move_for(600, |_| 0.0, 0.0);
            walker
        }

        /// Moves up and down and turns about x with these amplitudes, each scattered by a factor of up to 2; returns P
        /// after each ms.
        fn move_for(&mut self, ms: usize, up: impl Fn(usize) -> f32, turn: f32) -> Vec<f32> {
            let push = |ms| {
                let acceleration = Vec3::new(0.0, 0.0, up(ms) * self.scatter());
                let rate = Vec3::new(turn * self.scatter(), 0.0, 0.0);
                let (acceleration, rate) = (LinearAcceleration(acceleration), AngularRate(rate));
                self.model.push(acceleration, rate, Up::Z).stable
            };
            (0..ms).map(push).collect()
        }

        fn scatter(&mut self) -> f32 {
            self.random = self.random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            exp((self.random >> 8) as f32 / 16_777_216.0 * 1.4 - 0.7)
        }

        fn swing(&mut self, turn: f32) -> Vec<f32> {
            self.move_for(300, |ms| if ms < 150 { 6.0 } else { -6.0 }, turn)
        }

        fn stand(&mut self, turn: f32) -> Vec<f32> {
            self.move_for(300, trembling(0.6), turn)
        }

        /// A foot that has walked for ten strides and lands.
        fn landing(constants: Constants, [stance, swing]: [f32; 2]) -> Self {
            let mut walker = Self::new(constants);
            for _ in 0..10 {
                walker.swing(swing);
                walker.stand(stance);
            }
            walker.swing(swing);
            walker
        }
    }

    /// Acceleration that alternates each 5 ms.
    fn trembling(amplitude: f32) -> impl Fn(usize) -> f32 {
        move |ms| if ms / 5 % 2 == 0 { amplitude } else { -amplitude }
    }

    /// The acceleration decides alone.
    const WITHOUT_TURN: Constants = Constants { turn_weight: 0.0, ..CONSTANTS };

    #[test]
    fn stance_that_trembles_without_a_turn_is_found() {
        let [both, alone] = [CONSTANTS, WITHOUT_TURN].map(|constants| {
            let mut walker = Walker::landing(constants, Walker::TURNS);
            *walker.move_for(100, trembling(6.0), 0.05).last().expect("P")
        });
        assert!(alone < 0.2, "{alone}");
        assert!(both > 0.8, "{both}");
    }

    #[test]
    fn heel_that_rises_slowly_is_not_stable() {
        let [both, alone] = [CONSTANTS, WITHOUT_TURN].map(|constants| {
            let mut walker = Walker::landing(constants, Walker::TURNS);
            // Twice as long as a stance, so that the turn is not learnt from.
            walker.stand(0.05);
            walker.stand(0.05);
            *walker.move_for(100, trembling(1.2), 8.0).last().expect("P")
        });
        assert!(alone > 0.8, "{alone}");
        assert!(both < 0.5, "{both}");
    }

    #[test]
    fn foot_that_stood_firmly_and_chatters_is_not_excused() {
        let mut walker = Walker::landing(CONSTANTS, Walker::TURNS);
        let stood = *walker.stand(0.05).last().expect("P");
        let chatters = walker.move_for(200, trembling(6.0), 0.05);
        assert!(stood > 0.9, "{stood}");
        assert!(chatters[100..].iter().all(|p| *p < 0.2), "{chatters:?}");
    }

    #[test]
    fn turn_that_separates_nothing_changes_no_probability() {
        // A gyroscope that always reads 0, one that reads one value, and a foot whose stances roll as its swings do.
        for turn in [0.0, 0.4, 4.0] {
            let [both, alone] = [CONSTANTS, WITHOUT_TURN].map(|constants| {
                let mut walker = Walker::landing(constants, [turn, turn]);
                let mut stride = walker.stand(turn);
                stride.extend(walker.swing(turn));
                stride
            });
            let squares =
                both.iter().zip(&alone).map(|(both, alone)| (both - alone) * (both - alone));
            let difference = sqrt(squares.sum::<f32>() / both.len() as f32);
            assert!(difference < 0.01, "{turn} rad/s: {difference}");
        }
    }

    #[test]
    fn probability_about_an_axis_falls_with_the_turn_about_it_alone() {
        let mut walker = Walker::landing(CONSTANTS, Walker::TURNS);
        walker.stand(0.05);
        walker.move_for(100, trembling(1.2), 8.0);
        let axes = walker.model.probabilities.axes;
        assert!(axes.wx < 0.6, "{axes:?}");
        assert!(axes.wy > 0.9 && axes.wz > 0.9, "{axes:?}");
    }

    #[test]
    fn acceleration_along_the_ground_is_a_slide_only_if_it_adds_up() {
        let no_slide = |acceleration: fn(usize) -> f32| {
            let learnt = Learnt { speed: ln(1.0e-3), ..Learnt::unobserved(&CONSTANTS) };
            let mut slide = Slide::new(&learnt);
            let swing = ln(9.5);
            (0..100).fold(1.0, |_, ms| {
                let level = Vec3::new(acceleration(ms), 0.0, 0.0);
                slide.push(&CONSTANTS, DT, level, Vec3::ZERO, swing, 0.0)
            })
        };
        let slides = no_slide(|_| 0.3);
        let shakes = no_slide(|ms| if ms % 2 == 0 { 0.3 } else { -0.3 });
        assert!(slides < 0.1, "{slides}");
        assert!(shakes > 0.9, "{shakes}");
    }

    #[test]
    fn offset_of_a_leaning_shank_is_no_slide_but_a_push_is() {
        let learnt = Learnt { speed: ln(1.0e-3), ..Learnt::unobserved(&CONSTANTS) };
        let mut slide = Slide::new(&learnt);
        let mut no_slide = |acceleration: f32, rate: f32| {
            let (level, rate) = (Vec3::new(acceleration, 0.0, 0.0), Vec3::new(0.0, rate, 0.0));
            let p = slide.push(&CONSTANTS, DT, level, rate, ln(9.5), CONSTANTS.noise);
            if p > STILL {
                slide.learn_apparent(&CONSTANTS, DT, level);
            }
            p
        };
        // The shank leans by 0.3 rad within 0.6 s, and then stays. The offset is 0.6 m/s².
        let leans = (0..900_u16).map(|ms| {
            let turned = 0.5 * DT * f32::from(ms.min(600));
            no_slide(0.6 * turned, if ms < 600 { 0.5 } else { 0.0 })
        });
        let least = leans.fold(1.0, Order::lesser);
        let pushed = (0..60).map(|_| no_slide(0.18 + 0.3, 0.0)).last().expect("a push");
        assert!(least > 0.8, "{least}");
        assert!(pushed < 0.2, "{pushed}");
    }

    /// Feeds a swing of half a second with these accelerations along x, then a stance; returns whether it ended with a
    /// landing.
    fn lands(acceleration: fn(f32) -> f32) -> bool {
        let mut landing = Landing::new(&CONSTANTS, DT);
        (0..800).any(|ms| {
            let a = if ms < 500 { acceleration(ms as f32 * DT) } else { 0.0 };
            let reading = Reading {
                acceleration: Vec3::new(a, 0.0, 0.0),
                logarithm: 0.5 * ln(a * a + CONSTANTS.noise * CONSTANTS.noise),
                least: ln(CONSTANTS.noise),
                rate: Vec3::ZERO,
                up: Vec3::new(0.0, 0.0, 1.0),
                correction: 0.0,
                still: 0.0,
                samples: 1.0,
                seconds: DT,
                share: DT / CONSTANTS.window,
            };
            landing.push(&CONSTANTS, &reading, false).lands
        })
    }

    #[test]
    fn swing_lands_only_if_it_has_lost_its_speed() {
        assert!(lands(|seconds| if seconds < 0.25 { 10.0 } else { -10.0 }));
        assert!(!lands(|_| 10.0));
    }

    #[test]
    fn probability_without_evidence_is_at_most_a_half() {
        let config = SelfCalibratingConfig::new(&CONSTANTS, Learning::On, None, 1000.0);
        let mut model = SelfCalibrating::new(&config);
        // A sway that is too weak for a swing and too strong for rest.
        for ms in 0..5_000_u32 {
            let a = if ms / 100 % 2 == 0 { 0.5 } else { -0.5 };
            let acceleration = LinearAcceleration(Vec3::new(0.0, 0.0, a));
            let p = model.push(acceleration, AngularRate::default(), Up::Z);
            assert!(p.stable <= 0.5, "{p:?} after {ms} ms");
        }
        assert!(model.is_unproven(0.5));
    }
}
