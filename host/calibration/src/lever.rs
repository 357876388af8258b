//! The vector from the point of the ground about which a standing foot turns to its IMU, from the turns in its stances.
//!
//! An IMU at r from a point that rests moves at ω × r when it turns about the point, and accelerates by
//!
//! ```text
//! a = ω̇ × r + ω × (ω × r)
//! ```
//!
//! The accelerometer reads this acceleration, a constant error b, and gravity. The direction of up is the estimate's at the
//! beginning of a stance, and the gyroscope's rate carries it through the stance. So the reading without gravity is linear
//! in r, in b, and in the error of that direction, a tilt. All of them follow by least squares from all stances of a walk:
//! the two angles of the tilt for each stance, r and b for all stances together. Gravity has its standard length, because a
//! free length could explain a rocking foot in place of r.
//!
//! A foot that hardly turns does not determine r, so r must explain most of the acceleration that b and gravity leave. A
//! foot that rolls from its heel to its toe does not turn about one point, so the first and the second half of its stances
//! must agree on r.

use std::fmt;
use std::ops::RangeInclusive;

use estimator_core::{ContactEstimate, Flag, Gravity};
use lsm6dsox::scale::STANDARD_GRAVITY;
use serde::Serialize;
use thiserror::Error;

use crate::sensor::inverse;
use samples::Recording;
use samples::space::Vector;

/// Time that is left out at both ends of a stance, s, because the landing rings out and the lift-off is detected late.
const MARGIN: f64 = 0.06;

/// Time over which readings are averaged, s, before the rate of turn is differentiated.
const SMOOTHING: f64 = 0.025;

/// Least duration of a stance without its ends, s.
const SHORTEST: f64 = 0.08;

/// Longest part of a stance for which one tilt is fitted, s. Longer stances are divided.
const LONGEST: f64 = 1.0;

/// Least number of these parts.
const FEWEST: usize = 8;

/// Least share of the squares that r must explain.
///
/// A foot that hardly turns in its stances explains less, and then its r can be far off.
const LEAST_EXPLAINED: f64 = 0.5;

/// Largest difference of r between the first and the second half of the stances, as a part of its length.
///
/// A foot that rolls, such as a shoe, turns about another point at the end of a stance than at its beginning.
const LARGEST_DIFFERENCE: f64 = 0.4;

/// Plausible lengths of r, m.
const LENGTHS: RangeInclusive<f64> = 0.005..=0.5;

/// Vector from the ground to the IMU. `Display` is a line of the report for the terminal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Lever {
    /// From the point about which the foot turns to the IMU, m, in the axes of the foot.
    pub vector_m: [f64; 3],
    /// Length of the lever, m.
    pub lever_m: f32,
    /// Number of stances, and of parts of long stances, from which the vector was fitted.
    pub stances: usize,
    /// RMS acceleration in these stances that gravity and a constant error leave, m/s².
    pub residual_before: f64,
    /// RMS acceleration that remains when the turn about the point is subtracted as well, m/s².
    pub residual_after: f64,
}

impl fmt::Display for Lever {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y, z] = self.vector_m;
        write!(
            f,
            "lever {:.3} m: the IMU is at ({x:.3}, {y:.3}, {z:.3}) m from the ground, from {} stances; \
             {:.3} of {:.3} m/s² are left",
            self.lever_m, self.stances, self.residual_after, self.residual_before
        )
    }
}

/// Reason why the stances do not determine the vector.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum LeverError {
    /// There are too few stances.
    #[error("{stances} stances are long enough, {FEWEST} are needed")]
    TooFew {
        /// Number of stances that are long enough.
        stances: usize,
    },
    /// The turn does not explain the acceleration.
    #[error(
        "a turn about a point on the ground leaves {after:.3} of {before:.3} m/s² in the stances: the foot hardly turns, or is not a rigid part with its IMU"
    )]
    Unexplained {
        /// RMS without the turn, m/s².
        before: f64,
        /// RMS with it, m/s².
        after: f64,
    },
    /// The foot turns about another point at the end of its stances than at their beginning.
    #[error("the foot rolls: the point about which it turns moves by {distance:.3} m in a stance")]
    Rolls {
        /// Distance of the two points, m.
        distance: f64,
    },
    /// No foot has the length.
    #[error("it would be {length:.3} m long, which no foot has: check the units")]
    Implausible {
        /// Length, m.
        length: f64,
    },
}

/// Search for the vector in a sequence of recordings.
#[derive(Clone, Debug, Default)]
pub struct LeverCalibration {
    /// Sums over the first halves of the stances, and over the second ones.
    halves: [Sums; 2],
    stances: usize,
}

impl LeverCalibration {
    /// Adds the stances of a recording.
    pub fn add(&mut self, recording: &Recording, estimates: &[ContactEstimate]) {
        let rate = f64::from(recording.sample_rate);
        let gravity = match recording.gravity {
            Gravity::Included => f64::from(STANDARD_GRAVITY),
            Gravity::Removed => 0.0,
        };
        let mut stance: Vec<Measured> = Vec::new();
        for (sample, estimate) in recording.samples.iter().zip(estimates) {
            let follows = !estimate.flags.contains(Flag::TimeGap);
            let stands = estimate.probabilities.stable > 0.5;
            if !(stands && follows) {
                self.add_stance(&stance, rate, gravity);
                stance.clear();
            }
            if stands {
                stance.push(Measured {
                    force: sample.imu.specific_force.0.into(),
                    rate: estimate.angular_rate.0.into(),
                    up: estimate.orientation.up().into(),
                });
            }
        }
        self.add_stance(&stance, rate, gravity);
    }

    /// Adds a stance, in which gravity has this length, m/s².
    fn add_stance(&mut self, stance: &[Measured], rate: f64, gravity: f64) {
        let samples = |seconds: f64| (seconds * rate).round() as usize;
        let half = samples(0.5 * SMOOTHING).max(1);
        let margin = samples(MARGIN).max(half + 1);
        let Some(end) = stance.len().checked_sub(margin) else {
            return;
        };
        let mean = |at: usize, of: fn(&Measured) -> Vector| {
            let near = &stance[at - half..=at + half];
            let sum = near.iter().map(of).fold(Vector::default(), |sum, value| sum + value);
            sum * (1.0 / near.len() as f64)
        };
        let motions: Vec<Motion> = (margin..end)
            .map(|at| Motion {
                measured: Measured {
                    force: mean(at, |sample| sample.force),
                    rate: mean(at, |sample| sample.rate),
                    up: stance[at].up,
                },
                change: (mean(at + 1, |sample| sample.rate) - mean(at - 1, |sample| sample.rate))
                    * (0.5 * rate),
            })
            .collect();
        for part in motions.chunks(samples(LONGEST).max(1)) {
            if part.len() >= samples(SHORTEST).max(2) {
                let (early, late) = part.split_at(part.len() / 2);
                for (half, samples) in self.halves.iter_mut().zip([early, late]) {
                    half.add(samples, 1.0 / rate, gravity);
                }
                self.stances += 1;
            }
        }
    }

    /// Returns the vector.
    ///
    /// # Errors
    /// The stances do not determine it.
    pub fn finish(&self) -> Result<Lever, LeverError> {
        let stances = self.stances;
        if stances < FEWEST {
            return Err(LeverError::TooFew { stances });
        }
        let [early, late] = &self.halves;
        let all = early.together(late);
        let (before, fitted) = (all.without_turn(), all.fit());
        let rms = |square: f64| (square.max(0.0) / all.count.max(1.0)).sqrt();
        let (vector, after) = fitted.unwrap_or((Vector::default(), before));
        let (residual_before, residual_after) = (rms(before), rms(after));
        let explained = 1.0 - after / before;
        if explained.is_nan() || explained < LEAST_EXPLAINED {
            return Err(LeverError::Unexplained { before: residual_before, after: residual_after });
        }
        let length = vector.length();
        if !LENGTHS.contains(&length) {
            return Err(LeverError::Implausible { length });
        }
        let of_half = |half: &Sums| half.fit().map_or(Vector::default(), |(vector, _)| vector);
        let distance = (of_half(early) - of_half(late)).length();
        if distance > LARGEST_DIFFERENCE * length {
            return Err(LeverError::Rolls { distance });
        }
        Ok(Lever {
            vector_m: vector.to_array(),
            lever_m: length as f32,
            stances,
            residual_before,
            residual_after,
        })
    }
}

/// A sample in a stance, in the axes of the foot.
#[derive(Clone, Copy, Debug)]
struct Measured {
    /// Specific force, m/s².
    force: Vector,
    /// Rate of turn, rad/s.
    rate: Vector,
    /// Up, as the estimate has it.
    up: Vector,
}

/// A sample and the change of the rate of turn, rad/s².
#[derive(Clone, Copy, Debug)]
struct Motion {
    measured: Measured,
    change: Vector,
}

/// Directions of the axes.
const AXES: [Vector; 3] =
    [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 1.0, 0.0), Vector::new(0.0, 0.0, 1.0)];

/// Sums of the least squares for r and b, from which the tilt of each stance has been eliminated.
#[derive(Clone, Debug, Default)]
struct Sums {
    normal: [[f64; 6]; 6],
    right: [f64; 6],
    square: f64,
    count: f64,
}

impl Sums {
    /// Adds a stance with samples every `period` seconds, in which gravity has this length, m/s².
    fn add(&mut self, stance: &[Motion], period: f64, gravity: f64) {
        let Some(first) = stance.first() else {
            return;
        };
        // Directions that rest in the world: two level directions, along which gravity remains if the estimate of up is
        // wrong, and up.
        let up = first.measured.up;
        let level = if up.x.abs() < 0.7 { AXES[0].cross(up) } else { AXES[1].cross(up) };
        let level = level * (1.0 / level.length());
        let mut resting = [level, up.cross(level), up];
        let mut cross = [[0.0; 2]; 6];
        let mut tilt = [0.0; 2];
        for Motion { measured: Measured { force, rate, .. }, change } in stance {
            let [level, across, up] = resting;
            let force = *force - up * gravity;
            let [x, y, z] = AXES.map(|axis| change.cross(axis) + rate.cross(rate.cross(axis)));
            let columns = [x, y, z, AXES[0], AXES[1], AXES[2]];
            for (i, column) in columns.iter().enumerate() {
                for (j, other) in columns.iter().enumerate() {
                    self.normal[i][j] += column.dot(*other);
                }
                cross[i][0] += column.dot(level);
                cross[i][1] += column.dot(across);
                self.right[i] += column.dot(force);
            }
            tilt[0] += level.dot(force);
            tilt[1] += across.dot(force);
            self.square += force.dot(force);
            let turn = *rate * period;
            resting = resting.map(|direction| {
                let first = turn.cross(direction);
                direction - first + turn.cross(first) * 0.5
            });
        }
        // The level directions are orthonormal, so that their own sums are the number of samples.
        let samples = stance.len() as f64;
        let product = |a: [f64; 2], b: [f64; 2]| (a[0] * b[0] + a[1] * b[1]) / samples;
        for i in 0..6 {
            for j in 0..6 {
                self.normal[i][j] -= product(cross[i], cross[j]);
            }
            self.right[i] -= product(cross[i], tilt);
        }
        self.square -= product(tilt, tilt);
        self.count += 3.0 * samples;
    }

    /// Sums of two sets of stances.
    fn together(&self, other: &Self) -> Self {
        let mut sums = self.clone();
        for (row, of_other) in sums.normal.iter_mut().zip(other.normal) {
            for (value, of_other) in row.iter_mut().zip(of_other) {
                *value += of_other;
            }
        }
        for (value, of_other) in sums.right.iter_mut().zip(other.right) {
            *value += of_other;
        }
        sums.square += other.square;
        sums.count += other.count;
        sums
    }

    /// Returns r, m, and the sum of squares that it and b leave; `None` if they are not determined.
    fn fit(&self) -> Option<(Vector, f64)> {
        let (solution, left) = self.solve(&self.normal)?;
        let [x, y, z, ..] = solution;
        Some((Vector::new(x, y, z), left))
    }

    /// Returns the sum of squares that b alone leaves.
    fn without_turn(&self) -> f64 {
        let mut normal = self.normal;
        for (i, row) in normal.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                if i < 3 || j < 3 {
                    *value = f64::from(u8::from(i == j));
                }
            }
        }
        let bias_only = Self { right: self.only_bias(), ..self.clone() };
        bias_only.solve(&normal).map_or(self.square, |(_, left)| left)
    }

    const fn only_bias(&self) -> [f64; 6] {
        let [.., x, y, z] = self.right;
        [0.0, 0.0, 0.0, x, y, z]
    }

    /// Solves the equations with the matrix `normal`. Returns the solution, and the sum of squares that it leaves.
    fn solve(&self, normal: &[[f64; 6]; 6]) -> Option<([f64; 6], f64)> {
        let inverse = inverse(*normal).ok()?;
        let solution = inverse.map(|row| row.iter().zip(self.right).map(|(a, b)| a * b).sum());
        let explained: f64 = solution.iter().zip(self.right).map(|(a, b): (&f64, f64)| a * b).sum();
        Some((solution, self.square - explained))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{
        AngularRate, ImuSample, Probabilities, Quaternion, SpecificForce, Timestamp, Vec3,
    };
    use samples::RecordedSample;

    const RATE: f64 = 500.0;

    /// `v` turned about an axis of length 1 by an angle, rad (Rodrigues).
    fn turned(v: Vector, axis: Vector, angle: f64) -> Vector {
        let (sine, cosine) = angle.sin_cos();
        v * cosine + axis.cross(v) * sine + axis * (axis.dot(v) * (1.0 - cosine))
    }

    /// A foot that stands for 0.4 s of each 0.6 s and rocks about a point of the ground, with its IMU at `lever` from
    /// it and an accelerometer that is off by `bias`. It rocks with this amplitude, rad, about y and x in turn.
    fn rocking(lever: Vector, bias: Vector, amplitude: f64) -> (Recording, Vec<ContactEstimate>) {
        const FREQUENCY: f64 = 25.0; // rad/s
        let mut samples = Vec::new();
        let mut estimates = Vec::new();
        for k in 0..(20.0 * RATE) as u64 {
            let t = k as f64 / RATE;
            let (sine, cosine) = (FREQUENCY * t).sin_cos();
            let axis = AXES[usize::from(t % 2.4 < 1.2)];
            let rate = axis * (FREQUENCY * amplitude * cosine);
            let change = axis * (-FREQUENCY * FREQUENCY * amplitude * sine);
            let gravity = turned(Vector::new(0.0, 0.0, 9.8), axis, -amplitude * sine);
            let force = gravity + change.cross(lever) + rate.cross(rate.cross(lever)) + bias;
            let single = |v: Vector| Vec3::new(v.x as f32, v.y as f32, v.z as f32);
            let stands = t % 0.6 < 0.4;
            let timestamp = Timestamp::from_micros(k * 2_000);
            samples.push(RecordedSample {
                imu: ImuSample {
                    timestamp,
                    specific_force: SpecificForce(single(force)),
                    angular_rate: AngularRate(single(rate)),
                    ..ImuSample::default()
                },
                load: None,
                label: None,
            });
            estimates.push(ContactEstimate {
                timestamp,
                // The estimate's up is off by the rocking.
                orientation: Quaternion::IDENTITY,
                angular_rate: AngularRate(single(rate)),
                probabilities: Probabilities {
                    stable: if stands { 0.9 } else { 0.1 },
                    ..Probabilities::default()
                },
                ..ContactEstimate::default()
            });
        }
        let recording = Recording {
            name: "rocking".to_owned(),
            sample_rate: RATE as f32,
            gravity: Gravity::Included,
            load_title: String::new(),
            samples,
        };
        (recording, estimates)
    }

    fn lever(recording: &Recording, estimates: &[ContactEstimate]) -> Result<Lever, LeverError> {
        let mut calibration = LeverCalibration::default();
        calibration.add(recording, estimates);
        calibration.finish()
    }

    #[test]
    fn lever_of_a_foot_that_rocks_is_found_beside_a_bias() {
        let expected = Vector::new(0.02, -0.01, 0.05);
        let (recording, estimates) = rocking(expected, Vector::new(0.3, -0.2, 0.1), 0.03);
        let found = lever(&recording, &estimates).expect("a lever");
        let error = (Vector::from_array(found.vector_m) - expected).length();
        assert!(error < 0.003, "{found:?}");
        assert!(found.residual_after < 0.2 * found.residual_before, "{found:?}");
    }

    #[test]
    fn foot_that_does_not_turn_has_no_lever() {
        let (recording, estimates) = rocking(Vector::new(0.0, 0.0, 0.05), Vector::default(), 0.0);
        let refused = lever(&recording, &estimates).unwrap_err();
        assert!(matches!(refused, LeverError::Unexplained { .. }), "{refused}");
    }

    #[test]
    fn acceleration_that_no_turn_explains_gives_no_lever() {
        let (mut recording, estimates) = rocking(Vector::default(), Vector::default(), 0.03);
        for (k, sample) in recording.samples.iter_mut().enumerate() {
            sample.imu.specific_force.0.x += (0.11 * k as f32).sin();
        }
        let refused = lever(&recording, &estimates).unwrap_err();
        assert!(matches!(refused, LeverError::Unexplained { .. }), "{refused}");
    }

    #[test]
    fn foot_that_rolls_has_no_lever() {
        let of = |x| rocking(Vector::new(x, 0.0, 0.05), Vector::default(), 0.03);
        let ((mut recording, estimates), (toe, _)) = (of(0.05), of(-0.05));
        for (k, sample) in recording.samples.iter_mut().enumerate() {
            if k as f64 / RATE % 0.6 > 0.2 {
                *sample = toe.samples[k];
            }
        }
        let refused = lever(&recording, &estimates).unwrap_err();
        assert!(matches!(refused, LeverError::Rolls { .. }), "{refused}");
    }

    #[test]
    fn few_stances_give_no_lever() {
        let (mut recording, mut estimates) =
            rocking(Vector::new(0.0, 0.0, 0.05), Vector::default(), 0.03);
        recording.samples.truncate((2.0 * RATE) as usize);
        estimates.truncate((2.0 * RATE) as usize);
        assert_eq!(lever(&recording, &estimates), Err(LeverError::TooFew { stances: 4 }));
    }
}
