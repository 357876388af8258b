//! A foot that hangs, is carried, lies on a mattress or is shaken is not stable: from power-up, after a restart with
//! learnt values, and when it has been lifted after a walk, or after a walk and a minute of standing. When it walks again,
//! its stances are found as before. A foot that was not lifted still stands, if its shank leans to and fro over it.
//!
//! These motions were not recorded on a robot: they are sums of sines with the noise of the sensor.
//! `docs/guide/limits.md` lists motions that no IMU can distinguish from rest.

use std::f64::consts::TAU;

use estimator_core::{
    AngularRate, ContactEstimator, ImuSample, Learnt, Params, SpecificForce, Stream, Timestamp,
    Vec3,
};
use gait::{GaitName, Ground, Plan, SensorParams, simulate};
use host_tests::changed::Chance;
use samples::{Label, Recording};

const GRAVITY: f64 = 9.806_65;

/// Duration of the walk before a motion, s.
const WALK: f64 = 30.0;

/// Duration of standing after it, s.
const STANDING: f64 = 60.0;

/// Duration of each motion, s.
const LASTS: f64 = 120.0;

/// Largest share of the frames of a foot in motion that may have P > 0.5. After a walk the last landing is evidence for
/// up to 3.5 s.
const CALLED_STABLE: f64 = 0.03;

/// Largest share for a foot that is carried by hand. It is higher because lulls of the hand look like landings.
const CARRIED: f64 = 0.27;

/// Height and duration of the gentle lift that precedes a motion after a walk, m and s: 0.9 m/s² at most.
const LIFT: (f64, f64) = (0.15, 1.0);

/// Least share of the time for which a standing foot is stable while its shank leans to and fro.
const STANDS: f64 = 0.95;

/// Largest decrease of the share of stable samples with P > 0.5, from the walk before to the walk after; the first
/// ten seconds of both are left out.
const LOST: f64 = 0.02;

/// Duration of each motion with gaps in the samples, s.
const LASTS_WITH_GAPS: f64 = 60.0;

/// Noise of the sensor, m/s² and rad/s.
const NOISE: (f32, f32) = (0.02, 0.0012);

/// Motion of a foot: acceleration along world axes, m/s², angle about y, rad, its rate, rad/s, and speed, m/s.
#[derive(Clone, Copy, Default)]
struct Motion {
    acceleration: [f64; 3],
    angle: f64,
    rate: f64,
    speed: f64,
}

impl Motion {
    /// Readings of the sensor.
    fn measured(&self) -> (Vec3, Vec3) {
        let [x, y, z] = self.acceleration;
        let (sin, cos) = self.angle.sin_cos();
        let z = z + GRAVITY;
        let [x, y, z] = [cos * x - sin * z, y, sin * x + cos * z].map(|component| component as f32);
        (Vec3::new(x, y, z), Vec3::new(0.0, self.rate as f32, 0.0))
    }

    /// Returns whether the motion is so fast that it must not be called stable.
    fn is_fast(&self) -> bool {
        self.speed > 0.05 || self.rate.abs() > 0.1
    }
}

/// A sum of sines of these frequencies, Hz, with phases of their own; its derivative, and its integral.
fn sines(t: f64, frequencies: &[f64], amplitude: f64) -> [f64; 3] {
    let share = amplitude / (frequencies.len() as f64).sqrt();
    let terms = frequencies.iter().enumerate().map(|(k, frequency)| {
        let omega = TAU * frequency;
        let (sin, cos) = (omega * t + 2.0 * k as f64).sin_cos();
        [share * sin, share * omega * cos, -share / omega * cos]
    });
    terms.fold([0.0; 3], |sum, term| [0, 1, 2].map(|i| sum[i] + term[i]))
}

/// Frequencies of a sum of sines, Hz, and its amplitude.
type Sum = (&'static [f64], f64);

/// Motions along x, y and z, m/s², and about y, rad.
const SWAYING: [(&str, [Sum; 3], Sum); 9] = [
    ("carried", CARRYING, (&[0.3, 0.7, 1.1], 0.12)),
    ("mattress", MATTRESS, (&[2.1, 3.3], 0.03)),
    ("van", VAN, (&[0.9, 1.7], 0.01)),
    ("shaken up and down", [NONE, NONE, (&[0.5], 3.0)], NONE),
    ("shaken to and fro", [(&[1.0], 5.0), NONE, NONE], NONE),
    ("platform at 1 Hz", [(&[1.0], 1.0), NONE, NONE], NONE),
    ("platform at 0.5 Hz", [(&[0.5], 0.5), NONE, NONE], NONE),
    ("bob at 0.7 Hz", [NONE, NONE, (&[0.7], 0.5)], NONE),
    ("turning slowly", [NONE; 3], (&[0.5], 0.3 / (TAU * 0.5))),
];
const CARRYING: [Sum; 3] =
    [(&[0.9, 1.7, 2.3], 0.8), (&[0.8, 1.3, 2.9], 0.6), (&[1.1, 1.9, 2.7], 1.0)];
const MATTRESS: [Sum; 3] = [(&[2.0, 3.1, 4.7], 0.5), (&[2.3, 3.7], 0.4), (&[2.5, 3.5, 5.1], 1.2)];
const VAN: [Sum; 3] =
    [(&[0.11, 0.23, 0.51], 1.0), (&[0.13, 0.31], 0.7), (&[1.3, 12.1, 17.3, 24.7], 0.4)];
const NONE: Sum = (&[1.0], 0.0);

/// A motion along x, y and z and about y, each a sum of sines.
fn swaying(t: f64, [x, y, z]: [Sum; 3], (turns, amplitude): Sum) -> Motion {
    let [x, y, z] = [x, y, z].map(|(frequencies, amplitude)| sines(t, frequencies, amplitude));
    let [angle, rate, _] = sines(t, turns, amplitude);
    Motion {
        acceleration: [x[0], y[0], z[0]],
        angle,
        rate,
        speed: (x[2] * x[2] + y[2] * y[2] + z[2] * z[2]).sqrt(),
    }
}

/// A rod of this length, m, that swings by this amplitude, rad, at this angular frequency, rad/s, with the sensor at its end.
fn rod(t: f64, length: f64, amplitude: f64, omega: f64) -> Motion {
    let (sin, cos) = (omega * t).sin_cos();
    let (angle, rate) = (amplitude * sin, amplitude * omega * cos);
    let second = -omega * omega * angle;
    let (sin, cos) = angle.sin_cos();
    Motion {
        acceleration: [
            length * (second * cos - rate * rate * sin),
            0.0,
            length * (second * sin + rate * rate * cos),
        ],
        angle,
        rate,
        speed: (length * rate).abs(),
    }
}

/// A lift from rest to rest, with the least jerk.
fn lift(t: f64) -> Motion {
    let (height, duration) = LIFT;
    let x = t / duration;
    let up = height / (duration * duration) * x * (60.0 - 180.0 * x + 120.0 * x * x);
    Motion { acceleration: [0.0, 0.0, up], ..Motion::default() }
}

/// A shank that leans to and fro by this amplitude, rad, over a point foot 55 mm below the sensor, from rest on.
fn leaning(t: f64, amplitude: f64) -> Motion {
    const ABOVE: f64 = 0.055;
    const STEP: f64 = 1.0e-3;
    let angle_at = |t: f64| {
        let x = (t / 2.0).clamp(0.0, 1.0);
        let grown = x * x * x * (10.0 - 15.0 * x + 6.0 * x * x);
        amplitude * grown * (TAU * 0.4 * t).sin()
    };
    let [before, angle, after] = [-STEP, 0.0, STEP].map(|step| angle_at(t + step));
    let rate = (after - before) / (2.0 * STEP);
    let second = (after - 2.0 * angle + before) / (STEP * STEP);
    let (sin, cos) = angle.sin_cos();
    Motion {
        acceleration: [
            ABOVE * (second * cos - rate * rate * sin),
            0.0,
            -ABOVE * (second * sin + rate * rate * cos),
        ],
        angle,
        rate,
        speed: f64::INFINITY,
    }
}

fn shaker(t: f64, frequency: f64, amplitude: f64) -> Motion {
    let [shakes, ..] = sines(t, &[frequency], amplitude);
    let [angle, rate, _] = sines(t, &[frequency], 0.3 / (TAU * frequency));
    Motion { acceleration: [shakes, 0.4 * shakes, 0.6 * shakes], angle, rate, speed: f64::INFINITY }
}

type Named = (String, Box<dyn Fn(f64) -> Motion>);

fn motions() -> Vec<Named> {
    let mut motions: Vec<Named> = Vec::new();
    for length in [0.25, 0.5, 1.0, 2.0, 4.0_f64] {
        // A pendulum of 4 m at 3° passes for rest.
        let least = if length < 4.0 { 3.0 } else { 5.0 };
        for degrees in [least, 8.6, 15.0, 20.0_f64] {
            let omega = (GRAVITY / length).sqrt();
            let swings = move |t| rod(t, length, degrees.to_radians(), omega);
            motions.push((format!("pendulum of {length} m, {degrees}°"), Box::new(swings)));
        }
    }
    for (frequency, amplitude) in [(30.0, 5.0), (47.0, 10.0), (80.0, 5.0)] {
        let shakes = move |t| shaker(t, frequency, amplitude);
        motions.push((format!("shaker at {frequency} Hz"), Box::new(shakes)));
    }
    // At most 0.24 m/s, and 0.41 m/s as on a boat.
    for (length, degrees, hz) in [(0.509, 8.6, 0.5), (3.0, 10.0, 0.125)] {
        let driven = move |t| rod(t, length, f64::to_radians(degrees), TAU * hz);
        motions.push((format!("driven rod of {length} m"), Box::new(driven)));
    }
    motions.extend(SWAYING.map(|(name, along, about)| -> Named {
        (name.to_owned(), Box::new(move |t| swaying(t, along, about)))
    }));
    motions
}

/// A foot at 1 kHz.
struct Foot {
    estimator: ContactEstimator,
    chance: Chance,
    micros: u64,
    /// Samples are missing for the last of these seconds in each period of the first.
    gaps: Option<(f64, f64)>,
}

impl Foot {
    fn new(learnt: Option<Learnt>) -> Self {
        let params = Params { learnt, ..Params::DEFAULT };
        Self {
            estimator: ContactEstimator::new(
                &params.validate().expect("the preset"),
                Stream::KILOHERTZ,
            ),
            chance: Chance::new(1),
            micros: 0,
            gaps: None,
        }
    }

    /// Returns whether the sample of this time is missing.
    fn is_missing(&self) -> bool {
        let seconds = self.micros as f64 * 1.0e-6;
        self.gaps.is_some_and(|(every, gap)| seconds > 1.0 && seconds % every >= every - gap)
    }

    /// Returns whether P > 0.5 after the next millisecond; `false` if its sample is missing.
    fn is_stable(&mut self, force: Vec3, rate: Vec3) -> bool {
        self.micros += 1000;
        if self.is_missing() {
            return false;
        }
        let sample = ImuSample {
            timestamp: Timestamp::from_micros(self.micros),
            specific_force: SpecificForce(force),
            angular_rate: AngularRate(rate),
            ..ImuSample::default()
        };
        self.estimator.update(&sample, None).probabilities.stable > 0.5
    }

    /// Walks. Returns the share of stable samples that are found.
    fn walk(&mut self, walk: &Recording) -> f64 {
        let (mut stable, mut found) = (0, 0);
        for sample in &walk.samples {
            let imu = &sample.imu;
            let is_stable = self.is_stable(imu.specific_force.0, imu.angular_rate.0);
            if sample.label == Some(Label::Stable) && sample.time_s() > 10.0 {
                stable += 1;
                found += u32::from(is_stable);
            }
        }
        f64::from(found) / f64::from(stable)
    }

    /// Moves for a time in s. Returns the share of its fast frames that are called stable.
    fn move_like(&mut self, motion: &dyn Fn(f64) -> Motion, seconds: f64) -> f64 {
        let (mut fast, mut found) = (0, 0);
        for k in 0..(1000.0 * seconds) as u32 {
            let motion = motion(f64::from(k) * 1.0e-3);
            let (force, rate) = motion.measured();
            let force = force + self.chance.vector(NOISE.0);
            let rate = rate + self.chance.vector(NOISE.1);
            let is_stable = self.is_stable(force, rate);
            if motion.is_fast() && !self.is_missing() {
                fast += 1;
                found += u32::from(is_stable);
            }
        }
        f64::from(found) / f64::from(fast.max(1))
    }
}

fn walk() -> Recording {
    let plan = Plan::steady(GaitName::Walk, Ground::Hard, WALK, 7);
    simulate(&plan, &SensorParams::LSM6DSOX, 7).recording
}

fn limit(name: &str) -> f64 {
    match name {
        "carried" => CARRIED,
        _ => CALLED_STABLE,
    }
}

#[test]
fn motion_is_not_stable_from_power_up_nor_after_a_restart() {
    let mut walked = Foot::new(None);
    walked.walk(&walk());
    for learnt in [None, Some(walked.estimator.learnt())] {
        let mut wrong = Vec::new();
        for (name, motion) in motions() {
            let share = Foot::new(learnt).move_like(&*motion, LASTS);
            if share > limit(&name) {
                wrong.push(format!("{name}: {share:.3}"));
            }
        }
        assert!(wrong.is_empty(), "{learnt:?}: {wrong:#?}");
    }
}

#[test]
fn motion_after_a_walk_is_not_stable_and_costs_no_stance() {
    let walk = walk();
    for stands in [false, true] {
        let mut wrong = Vec::new();
        for (name, motion) in motions() {
            let mut foot = Foot::new(None);
            let before = foot.walk(&walk);
            if stands {
                foot.move_like(&|_| Motion::default(), STANDING);
            }
            let (_, duration) = LIFT;
            foot.move_like(&lift, duration);
            let share = foot.move_like(&*motion, LASTS);
            let after = foot.walk(&walk);
            if share > limit(&name) || after < before - LOST {
                wrong.push(format!(
                    "{name}: {before:.3} of the walk, then {share:.3}, then {after:.3}"
                ));
            }
        }
        assert!(wrong.is_empty(), "{wrong:#?}");
    }
}

#[test]
fn shank_that_leans_over_a_standing_foot_is_stable() {
    for (amplitude, seconds) in [(0.05, 1.0), (0.1, 1.0), (0.1, STANDING)] {
        let mut foot = Foot::new(None);
        foot.move_like(&|_| Motion::default(), seconds);
        let share = foot.move_like(&|t| leaning(t, amplitude), LASTS);
        assert!(share >= STANDS, "{amplitude} rad after {seconds} s: {share:.3}");
    }
}

#[test]
fn motion_with_gaps_is_seldom_stable() {
    // The second period is in step with a motion at 0.5 or 1 Hz.
    for (every, most) in [(2.3, 0.02), (2.0, 0.04)] {
        for gap in [0.1, 0.25, 0.6] {
            let motions = motions();
            let shares = motions.iter().map(|(name, motion)| {
                let mut foot = Foot::new(None);
                foot.gaps = Some((every, gap));
                let share = foot.move_like(&**motion, LASTS_WITH_GAPS);
                println!("{name}, {gap} s each {every} s: {share:.3}");
                share
            });
            let mean = shares.sum::<f64>() / motions.len() as f64;
            println!("{gap} s each {every} s: {mean:.4}");
            assert!(mean < most, "{gap} s each {every} s: {mean:.4}");
        }
    }
}

/// Returns the motion of one step of 0.8 s in every two seconds, with peaks of 1.2 m/s², 0.3 m/s and 0.8 rad/s. A stance of
/// a faster walk shakes as much.
fn slow_step(t: f64) -> Motion {
    const SWING: f64 = 0.8;
    const PEAK: f64 = 1.2;
    const ANGLE: f64 = 0.1;
    let t = t % 2.0;
    if t >= SWING {
        return Motion::default();
    }
    let omega = TAU / SWING;
    let (sin, cos) = (omega * t).sin_cos();
    Motion {
        acceleration: [0.8 * PEAK * sin, 0.0, 0.6 * PEAK * sin],
        angle: ANGLE * (1.0 - cos),
        rate: ANGLE * omega * sin,
        speed: PEAK / omega * (1.0 - cos),
    }
}

#[test]
fn slow_steps_after_a_walk_are_learnt() {
    let walk = walk();
    let mut foot = Foot::new(None);
    let before = foot.walk(&walk);
    foot.move_like(&slow_step, 20.0);
    // At its turning point this slow swing moves as little as a foot in a stance.
    let share = foot.move_like(&slow_step, 60.0);
    let after = foot.walk(&walk);
    assert!(share < 0.35 && after > before - LOST, "{share:.3}; {before:.3}, then {after:.3}");
}
