//! A foot that has walked and then hangs, is carried, lies on a mattress or is shaken is not stable for as long as
//! that lasts; when it walks again, its stances are found as before.
//!
//! These motions were not recorded on a robot: they are sums of sines with the noise of the sensor.

use std::f64::consts::TAU;

use estimator_core::{
    AngularRate, ContactEstimator, ImuSample, Params, SpecificForce, Timestamp, Vec3,
};
use gait::{GaitName, Ground, Plan, SensorParams, simulate};
use host_tests::changed::Chance;
use recordings::samples::recording::{Label, Recording};

const GRAVITY: f64 = 9.806_65;

/// Duration of each walk, s.
const WALK: f64 = 60.0;

/// Duration of each motion, s.
const LASTS: u32 = 600;

/// Maximum share with P > 0.5 in any half-minute of the motion; its first half-minute is left out, in which the
/// last step counts as evidence.
const CALLED_STABLE: f64 = 0.03;

/// Maximum share with P > 0.5 in all ten minutes.
const CALLED_STABLE_IN_ALL: f64 = 0.03;

/// Maximum decrease of the share of stable samples with P > 0.5, from the walk before to the walk after; the first
/// ten seconds of both are left out.
const LOST: f64 = 0.02;

/// Noise of the sensor, m/s² and rad/s.
const NOISE: (f32, f32) = (0.02, 0.0012);

/// Acceleration of the foot along world axes, m/s², its angle about y, rad, and its rate, rad/s.
struct Motion {
    acceleration: [f64; 3],
    angle: f64,
    rate: f64,
}

/// Readings of the sensor of a foot with this motion.
fn measured(motion: &Motion) -> (Vec3, Vec3) {
    let [x, y, z] = motion.acceleration;
    let (sin, cos) = motion.angle.sin_cos();
    let z = z + GRAVITY;
    let force = [cos * x - sin * z, y, sin * x + cos * z].map(|component| component as f32);
    let [x, y, z] = force;
    (Vec3::new(x, y, z), Vec3::new(0.0, motion.rate as f32, 0.0))
}

/// A sum of sines of these frequencies, Hz, with individual phases, and its derivative.
fn sines(t: f64, frequencies: &[f64], amplitude: f64) -> (f64, f64) {
    let share = amplitude / (frequencies.len() as f64).sqrt();
    let terms = frequencies.iter().enumerate().map(|(k, frequency)| {
        let omega = TAU * frequency;
        let (sin, cos) = (omega * t + 2.0 * k as f64).sin_cos();
        (share * sin, share * omega * cos)
    });
    terms.fold((0.0, 0.0), |sum, term| (sum.0 + term.0, sum.1 + term.1))
}

/// Half a hertz, 8.6 degrees to each side, and at most 0.24 m/s: a driven rod of half a metre that turns about its
/// upper end.
fn pendulum(t: f64) -> Motion {
    let omega = TAU * 0.5;
    let amplitude = 8.6_f64.to_radians();
    let length = 0.24 / (amplitude * omega);
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
    }
}

fn carried(t: f64) -> Motion {
    let (angle, rate) = sines(t, &[0.3, 0.7, 1.1], 0.12);
    Motion {
        acceleration: [
            sines(t, &[0.9, 1.7, 2.3], 0.8).0,
            sines(t, &[0.8, 1.3, 2.9], 0.6).0,
            sines(t, &[1.1, 1.9, 2.7], 1.0).0,
        ],
        angle,
        rate,
    }
}

fn mattress(t: f64) -> Motion {
    let (angle, rate) = sines(t, &[2.1, 3.3], 0.03);
    Motion {
        acceleration: [
            sines(t, &[2.0, 3.1, 4.7], 0.5).0,
            sines(t, &[2.3, 3.7], 0.4).0,
            sines(t, &[2.5, 3.5, 5.1], 1.2).0,
        ],
        angle,
        rate,
    }
}

fn shaker(t: f64, frequency: f64, amplitude: f64) -> Motion {
    let (shakes, _) = sines(t, &[frequency], amplitude);
    let (angle, rate) = sines(t, &[frequency], 0.3 / (TAU * frequency));
    Motion {
        acceleration: [shakes, 0.4 * shakes, 0.6 * shakes],
        angle,
        rate,
    }
}

/// A foot at 1 kHz.
struct Foot {
    estimator: ContactEstimator<256>,
    chance: Chance,
    micros: u64,
}

impl Foot {
    fn new() -> Self {
        let config = Params::DEFAULT.validate().expect("the preset");
        Self {
            estimator: ContactEstimator::new(&config),
            chance: Chance::new(1),
            micros: 0,
        }
    }

    fn is_stable(&mut self, force: Vec3, rate: Vec3) -> bool {
        self.micros += 1000;
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

    /// Moves for ten minutes. Returns the share of each half-minute that is called stable.
    fn move_like(&mut self, motion: &dyn Fn(f64) -> Motion) -> Vec<f64> {
        let half_minute = |part: u32| {
            let mut found = 0;
            for k in 30_000 * part..30_000 * (part + 1) {
                let (force, rate) = measured(&motion(f64::from(k) * 1.0e-3));
                let force = force + self.chance.vector(NOISE.0);
                let rate = rate + self.chance.vector(NOISE.1);
                found += u32::from(self.is_stable(force, rate));
            }
            f64::from(found) / 30.0e3
        };
        (0..LASTS / 30).map(half_minute).collect()
    }
}

#[test]
fn motion_after_a_walk_is_not_stable_and_costs_no_stance() {
    type Named = (&'static str, Box<dyn Fn(f64) -> Motion>);
    let plan = Plan::steady(GaitName::Walk, Ground::Hard, WALK, 7);
    let walk = simulate(&plan, &SensorParams::LSM6DSOX, 7).recording;
    let motions: [Named; 6] = [
        ("pendulum", Box::new(pendulum)),
        ("carried by hand", Box::new(carried)),
        ("on a mattress", Box::new(mattress)),
        ("shaken at 30 Hz", Box::new(|t| shaker(t, 30.0, 5.0))),
        ("shaken at 47 Hz", Box::new(|t| shaker(t, 47.0, 10.0))),
        ("shaken at 80 Hz", Box::new(|t| shaker(t, 80.0, 5.0))),
    ];
    let mut wrong = Vec::new();
    for (name, motion) in motions {
        let mut foot = Foot::new();
        let before = foot.walk(&walk);
        let shares = foot.move_like(&*motion);
        let after = foot.walk(&walk);
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        let worst = shares[1..].iter().copied().fold(0.0, f64::max);
        println!("{name}: {before:.3} of the walk, then {mean:.4} ({worst:.4}), then {after:.3}");
        if worst > CALLED_STABLE || mean > CALLED_STABLE_IN_ALL || after < before - LOST {
            wrong.push((name, before, shares, after));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#.3?}");
}
