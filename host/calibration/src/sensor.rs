//! Accelerometer bias and scale, and gyroscope bias, from rests in different orientations.
//!
//! At rest an accelerometer reads gravity in any orientation. So the bias b and the scale s of each axis are the values
//! for which all rests m have |s (m − b)| = g, by least squares (Gauss-Newton, starting from a perfect sensor). The six
//! unknowns need at least six orientations. Each axis must have pointed up and down to separate them.
//!
//! g is standard gravity, because the estimator subtracts it. The scale absorbs the deviation of local gravity, up to
//! 0.3 %. The result holds at the temperature of the recordings.

use std::fmt;

use estimator_core::internals::{LARGEST_SWAY, SENSOR_NOISE};
use estimator_core::params::RestParams;
use estimator_core::{Gravity, Validity};
use lsm6dsox::scale::{DEGREE, STANDARD_GRAVITY};
use serde::Serialize;
use thiserror::Error;

use samples::space::Vector;
use samples::{RecordedSample, Recording};

/// Standard gravity, m/s².
const GRAVITY: f64 = STANDARD_GRAVITY as f64;

/// One mg, m/s².
const MILLI_G: f64 = 1e-3 * GRAVITY;

/// One m°/s, rad/s.
const MILLI_DPS: f64 = 1e-3 * DEGREE as f64;

/// Least number of orientations: one per unknown.
const ORIENTATIONS: usize = 6;

/// Angle between up in two rests below which they are one orientation, degrees.
const SAME_ORIENTATION: f64 = 15.0;

/// Largest accepted ratio of the error of a bias or a scale to the error of one rest. The ratio is 0.7 for six rests
/// in which each axis points up once and down once.
const LARGEST_DILUTION: f64 = 2.0;

/// Largest RMS deviation of the rests from gravity after the fit, m/s²; more is neither bias nor scale.
const LARGEST_RESIDUAL: f64 = 0.1;

/// Largest relative deviation of the mean reading from gravity; more indicates another unit.
const LARGEST_LENGTH_ERROR: f64 = 0.2;

/// Largest plausible bias, m/s²: five times the typical bias of the LSM6DSOX.
const LARGEST_BIAS: f64 = 100.0 * MILLI_G;

/// Largest plausible deviation of a scale from 1.
const LARGEST_SCALE_ERROR: f64 = 0.1;

/// Error of rests that do not determine bias and scale.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum RestsError {
    /// Too few orientations.
    #[error(
        "{rests} rests in {orientations} of the {ORIENTATIONS} orientations that are needed: lay the sensor still for two seconds on each of its six sides"
    )]
    TooFew {
        /// Number of rests.
        rests: usize,
        /// Number of different orientations.
        orientations: usize,
    },
    /// The readings at rest do not have the length of gravity.
    #[error(
        "at rest the accelerometer reads {length:.2} m/s², but gravity is 9.81: check that accelerations are in m/s²"
    )]
    NotGravity {
        /// Mean length of the readings, m/s².
        length: f64,
    },
    /// The orientations do not separate the axes.
    #[error(
        "the {orientations} orientations do not determine the bias and scale of {axis}: lay the sensor so that each of its axes points up once and down once"
    )]
    Span {
        /// Number of different orientations.
        orientations: usize,
        /// Axis that is determined worst.
        axis: &'static str,
    },
    /// No bias and scale explain the rests.
    #[error(
        "the rests do not have gravity's length: {residual:.3} m/s² RMS is left with the best bias and scale; check the units, and that nothing moved"
    )]
    Residual {
        /// RMS of the residual, m/s².
        residual: f64,
    },
    /// No sensor has the fitted bias or scale.
    #[error(
        "{axis} would have a bias of {bias:.2} m/s² and a scale of {scale:.3}, which no sensor has; check the units"
    )]
    Implausible {
        /// The axis.
        axis: &'static str,
        /// Bias, m/s².
        bias: f64,
        /// Scale of the readings without the bias.
        scale: f64,
    },
    /// The recording has no gravity.
    #[error("{recording}: gravity has been removed, and rests cannot be used without it")]
    NoGravity {
        /// Name of the recording.
        recording: String,
    },
}

const AXES: [&str; 3] = ["ax", "ay", "az"];

/// Errors of a sensor, and the rests that they follow from. `Display` gives the report for the terminal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SensorCalibration {
    /// Different orientations among the rests.
    pub orientations: usize,
    /// All rests.
    pub rests: Vec<Rest>,
    /// Accelerometer bias, m/s².
    pub accelerometer_bias: [f64; 3],
    /// Factor of a reading without its bias.
    pub accelerometer_scale: [f64; 3],
    /// Gyroscope bias, rad/s.
    pub gyroscope_bias: [f64; 3],
    /// RMS deviation of the rests from gravity, as they were read, m/s².
    pub residual_before: f64,
    /// RMS deviation after the correction of bias and scale, m/s².
    pub residual_after: f64,
}

impl SensorCalibration {
    /// Finds the rests in recordings and fits the errors of the sensor.
    ///
    /// # Errors
    /// The rests do not determine bias and scale.
    pub fn of<'a>(recordings: impl IntoIterator<Item = &'a Recording>) -> Result<Self, RestsError> {
        let mut all = Vec::new();
        for recording in recordings {
            if recording.gravity == Gravity::Removed {
                return Err(RestsError::NoGravity { recording: recording.name.clone() });
            }
            all.extend(rests(recording));
        }
        let forces = orientations(&all);
        if forces.len() < ORIENTATIONS {
            return Err(RestsError::TooFew { rests: all.len(), orientations: forces.len() });
        }
        let length = forces.iter().map(|f| f.length()).sum::<f64>() / forces.len() as f64;
        if (length / GRAVITY - 1.0).abs() > LARGEST_LENGTH_ERROR {
            return Err(RestsError::NotGravity { length });
        }
        let before = residual(&forces, &PERFECT);
        let fit = fit(&forces)?;
        let after = residual(&forces, &fit);
        if after > LARGEST_RESIDUAL {
            return Err(RestsError::Residual { residual: after });
        }
        let [bx, by, bz, sx, sy, sz] = fit;
        for ((axis, bias), scale) in AXES.into_iter().zip([bx, by, bz]).zip([sx, sy, sz]) {
            if bias.abs() > LARGEST_BIAS || (scale - 1.0).abs() > LARGEST_SCALE_ERROR {
                return Err(RestsError::Implausible { axis, bias, scale });
            }
        }
        Ok(Self {
            orientations: forces.len(),
            accelerometer_bias: [bx, by, bz],
            accelerometer_scale: [sx, sy, sz],
            gyroscope_bias: gyroscope_bias(&all),
            residual_before: before,
            residual_after: after,
            rests: all,
        })
    }

    /// Returns the values of the foot's object 0x2017, in the order of its sub-indices from 1.
    #[must_use]
    pub fn object(&self) -> [f32; 6] {
        let ([bx, by, bz], [sx, sy, sz]) = (self.accelerometer_bias, self.accelerometer_scale);
        [bx, by, bz, sx, sy, sz].map(|value| value as f32)
    }
}

/// Returns the mean force of each orientation, weighted by the rests' durations. Each orientation counts once, so
/// that a sensor left lying does not outweigh the others.
fn orientations(rests: &[Rest]) -> Vec<Vector> {
    let mut sums: Vec<(Vector, f64)> = Vec::new();
    for rest in rests {
        let force = Vector::from_array(rest.specific_force);
        let known =
            sums.iter_mut().find(|(sum, _)| sum.angle_to(force).to_degrees() < SAME_ORIENTATION);
        match known {
            Some((sum, weight)) => {
                *sum = *sum + force * rest.duration_s;
                *weight += rest.duration_s;
            }
            None => sums.push((force * rest.duration_s, rest.duration_s)),
        }
    }
    sums.into_iter().map(|(sum, weight)| sum * (1.0 / weight)).collect()
}

/// Bias (three axes, m/s²) and scale (three).
type Unknowns = [f64; 6];

/// A perfect sensor.
const PERFECT: Unknowns = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];

fn fit(forces: &[Vector]) -> Result<Unknowns, RestsError> {
    let span = |axis: usize| RestsError::Span { orientations: forces.len(), axis: AXES[axis % 3] };
    let mut unknowns = PERFECT;
    let mut covariance = [[0.0; 6]; 6];
    // These are far more iterations than needed, because the convergence is quadratic from an error of a few per cent.
    for _ in 0..20 {
        let mut normal = [[0.0; 6]; 6];
        let mut gradient = [0.0; 6];
        for force in forces {
            let corrected = correct(*force, &unknowns);
            let length = corrected.length().max(f64::MIN_POSITIVE);
            let [dx, dy, dz] = (corrected * (1.0 / length)).to_array();
            let [fx, fy, fz] = force.to_array();
            let [bx, by, bz, sx, sy, sz] = unknowns;
            // Scales in units of g, so that the dilutions of bias and scale can be compared.
            let row = [
                -dx * sx,
                -dy * sy,
                -dz * sz,
                dx * (fx - bx) / GRAVITY,
                dy * (fy - by) / GRAVITY,
                dz * (fz - bz) / GRAVITY,
            ];
            for (i, a) in row.into_iter().enumerate() {
                gradient[i] += a * (length - GRAVITY);
                for (j, b) in row.into_iter().enumerate() {
                    normal[i][j] += a * b;
                }
            }
        }
        covariance = inverse(normal).map_err(span)?;
        for (k, unknown) in unknowns.iter_mut().enumerate() {
            let step: f64 = covariance[k].iter().zip(gradient).map(|(c, g)| c * g).sum();
            *unknown -= if k < 3 { step } else { step / GRAVITY };
        }
    }
    let dilution = |k: &usize| covariance[*k][*k].max(0.0).sqrt();
    let worst = (0..6).max_by(|a, b| dilution(a).total_cmp(&dilution(b)));
    match worst {
        Some(k) if dilution(&k) > LARGEST_DILUTION => Err(span(k)),
        _ => Ok(unknowns),
    }
}

/// Returns the inverse of a matrix by elimination with pivots, or the dependent column if it is singular.
/// Six rows do not need a library of linear algebra.
pub(super) fn inverse(mut matrix: [[f64; 6]; 6]) -> Result<[[f64; 6]; 6], usize> {
    let mut inverse: [[f64; 6]; 6] =
        std::array::from_fn(|i| std::array::from_fn(|j| f64::from(u8::from(i == j))));
    for column in 0..6 {
        let pivot = (column..6)
            .max_by(|a, b| matrix[*a][column].abs().total_cmp(&matrix[*b][column].abs()))
            .unwrap_or(column);
        if matrix[pivot][column].is_nan() || matrix[pivot][column].abs() < 1e-9 {
            return Err(column);
        }
        matrix.swap(column, pivot);
        inverse.swap(column, pivot);
        let factor = 1.0 / matrix[column][column];
        matrix[column] = matrix[column].map(|value| value * factor);
        inverse[column] = inverse[column].map(|value| value * factor);
        let (of_matrix, of_inverse) = (matrix[column], inverse[column]);
        for row in (0..6).filter(|row| *row != column) {
            let factor = matrix[row][column];
            for k in 0..6 {
                matrix[row][k] -= factor * of_matrix[k];
                inverse[row][k] -= factor * of_inverse[k];
            }
        }
    }
    Ok(inverse)
}

fn correct(force: Vector, [bx, by, bz, sx, sy, sz]: &Unknowns) -> Vector {
    Vector::new(sx * (force.x - bx), sy * (force.y - by), sz * (force.z - bz))
}

/// Returns the RMS deviation of the forces from gravity, m/s².
fn residual(forces: &[Vector], unknowns: &Unknowns) -> f64 {
    let squares = forces.iter().map(|force| (correct(*force, unknowns).length() - GRAVITY).powi(2));
    (squares.sum::<f64>() / forces.len().max(1) as f64).sqrt()
}

/// Returns the mean reading of the gyroscope at rest, weighted by the rests' durations.
fn gyroscope_bias(rests: &[Rest]) -> [f64; 3] {
    let total: f64 = rests.iter().map(|rest| rest.duration_s).sum();
    let sum = |axis: usize| {
        rests.iter().map(|rest| rest.duration_s * rest.angular_rate[axis]).sum::<f64>()
    };
    std::array::from_fn(|axis| sum(axis) / total)
}

impl fmt::Display for SensorCalibration {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} rests in {} orientations, {:.0} s of them",
            self.rests.len(),
            self.orientations,
            self.rests.iter().map(|rest| rest.duration_s).sum::<f64>()
        )?;
        let line = |values: [f64; 3], decimals: usize| {
            values.map(|value| format!("{value:9.decimals$}")).join(" ")
        };
        let milli_g = self.accelerometer_bias.map(|bias| bias / MILLI_G);
        let dps = self.gyroscope_bias.map(|bias| 1e-3 * bias / MILLI_DPS);
        writeln!(f, "                              x         y         z")?;
        writeln!(f, "accelerometer bias (mg) {}", line(milli_g, 2))?;
        writeln!(f, "accelerometer scale     {}", line(self.accelerometer_scale, 5))?;
        writeln!(f, "gyroscope bias (°/s)    {}", line(dps, 3))?;
        writeln!(
            f,
            "off gravity by {:.4} m/s² RMS before, {:.4} after",
            self.residual_before, self.residual_after
        )?;
        f.write_str("if the foot has a footfall board: set")?;
        let names =
            ["bias_m_s2.ax", "bias_m_s2.ay", "bias_m_s2.az", "scale.ax", "scale.ay", "scale.az"];
        for (name, value) in names.into_iter().zip(self.object()) {
            write!(f, " accelerometer.{name}={value}")?;
        }
        Ok(())
    }
}

/// Least duration of a rest, s.
const SHORTEST: f64 = 1.0;

/// Margin omitted at either end, s, in which a hand releases or grasps the sensor.
const MARGIN: f64 = 0.2;

/// Largest distance of a sample from the running mean, m/s².
const FORCE_TOLERANCE: f64 = 20.0 * SENSOR_NOISE.force as f64;

/// Largest distance of the angular rate from its running mean, rad/s.
const RATE_TOLERANCE: f64 = 25.0 * SENSOR_NOISE.rate as f64;

/// Largest difference between the means of a stretch's halves, m/s²; a slow turn exceeds it.
const SWAY: f64 = LARGEST_SWAY as f64;

/// A still stretch.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rest {
    /// When it begins on the recording's clock, s.
    pub start_s: f64,
    /// How long it is without its margins, s.
    pub duration_s: f64,
    /// Mean specific force, sensor frame, m/s².
    pub specific_force: [f64; 3],
    /// Mean angular rate, sensor frame, rad/s.
    pub angular_rate: [f64; 3],
}

/// Returns the rests of a recording, in order of time.
#[must_use]
pub fn rests(recording: &Recording) -> Vec<Rest> {
    let mut rests = Vec::new();
    let mut stretch = Stretch::default();
    for sample in &recording.samples {
        if !stretch.takes(sample) {
            rests.extend(stretch.rest(recording.sample_rate));
            stretch = Stretch::default();
            stretch.takes(sample);
        }
    }
    rests.extend(stretch.rest(recording.sample_rate));
    rests
}

fn force(sample: &RecordedSample) -> Vector {
    Vector::from(sample.imu.specific_force.0)
}

fn rate(sample: &RecordedSample) -> Vector {
    Vector::from(sample.imu.angular_rate.0)
}

/// Samples that may form a rest.
#[derive(Default)]
struct Stretch<'a> {
    samples: Vec<&'a RecordedSample>,
    force: Mean,
    rate: Mean,
}

impl<'a> Stretch<'a> {
    /// Adds a valid sample close to those so far; returns whether it was added.
    fn takes(&mut self, sample: &'a RecordedSample) -> bool {
        let (force, rate) = (force(sample), rate(sample));
        let alike = self.samples.is_empty()
            || ((force - self.force.value()).length() <= FORCE_TOLERANCE
                && (rate - self.rate.value()).length() <= RATE_TOLERANCE);
        if !alike || sample.imu.checked_validity() != Validity::Valid {
            return false;
        }
        self.samples.push(sample);
        self.force.add(force);
        self.rate.add(rate);
        true
    }

    fn rest(&self, sample_rate: f32) -> Option<Rest> {
        let margin = (MARGIN * f64::from(sample_rate)).round() as usize;
        let end = self.samples.len().checked_sub(margin)?;
        let inside = self.samples.get(margin..end)?;
        let (first, last) = (inside.first()?, inside.last()?);
        let duration = last.time_s() - first.time_s();
        let force = |samples: &[&RecordedSample]| mean(samples.iter().map(|sample| force(sample)));
        let (early, late) = inside.split_at(inside.len() / 2);
        let rate = mean(inside.iter().map(|sample| rate(sample))).to_array();
        // A larger rate is rotation, because no bias is that large.
        let largest_bias = f64::from(RestParams::DEFAULT.bias_limit);
        let still = duration + 2.0 * MARGIN >= SHORTEST
            && (force(early) - force(late)).length() <= SWAY
            && rate.iter().all(|rate| rate.abs() <= largest_bias);
        still.then(|| Rest {
            start_s: first.time_s(),
            duration_s: duration,
            specific_force: force(inside).to_array(),
            angular_rate: rate,
        })
    }
}

#[derive(Default)]
struct Mean {
    sum: Vector,
    count: f64,
}

impl Mean {
    fn add(&mut self, value: Vector) {
        self.sum = self.sum + value;
        self.count += 1.0;
    }

    fn value(&self) -> Vector {
        let count = self.count.max(1.0);
        Vector::from_array(self.sum.to_array().map(|sum| sum / count))
    }
}

fn mean(values: impl Iterator<Item = Vector>) -> Vector {
    let mut mean = Mean::default();
    values.for_each(|value| mean.add(value));
    mean.value()
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{AngularRate, Gravity, ImuSample, SpecificForce, Timestamp, Vec3};

    /// Returns a recording at 100 Hz.
    fn recording(samples: impl IntoIterator<Item = ([f32; 3], [f32; 3])>) -> Recording {
        let vec3 = |[x, y, z]: [f32; 3]| Vec3::new(x, y, z);
        let sample = |(k, (force, rate)): (u64, ([f32; 3], [f32; 3]))| RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(10_000 * k),
                specific_force: SpecificForce(vec3(force)),
                angular_rate: AngularRate(vec3(rate)),
                validity: Validity::Valid,
            },
            load: None,
            label: None,
        };
        Recording {
            name: "turned by hand".to_owned(),
            sample_rate: 100.0,
            gravity: Gravity::Included,
            load_title: String::new(),
            samples: (0..).zip(samples).map(sample).collect(),
        }
    }

    fn still(force: [f32; 3], samples: usize) -> Vec<([f32; 3], [f32; 3])> {
        vec![(force, [0.001, 0.0, -0.002]); samples]
    }

    #[test]
    fn rest_ends_at_a_turn_and_short_rests_are_ignored() {
        let mut samples = still([0.0, 0.0, 9.8], 200);
        samples.extend(
            (0..50).map(|k| ([0.2 * k as f32, 0.0, 9.8 - 0.2 * k as f32], [0.0, 1.5, 0.0])),
        );
        samples.extend(still([9.8, 0.0, 0.0], 150));
        samples.extend(still([0.0, 9.8, 0.0], 90));
        let rests = rests(&recording(samples));
        let seen: Vec<_> = rests.iter().map(|rest| rest.specific_force[0] as f32).collect();
        assert_eq!(seen, [0.0, 9.8]);
        assert!((rests[1].start_s - 2.7).abs() < 0.011, "{rests:?}");
        assert!((rests[1].duration_s - 1.1).abs() < 0.011, "{rests:?}");
        assert!((rests[0].angular_rate[2] + 0.002).abs() < 1e-6);
    }

    #[test]
    fn slow_turns_and_invalid_samples_are_not_rests() {
        let turn = (0..2000).map(|k| {
            let angle = 0.01 * k as f32 * 0.02;
            ([0.0, 9.8 * angle.sin(), 9.8 * angle.cos()], [0.02, 0.0, 0.0])
        });
        assert_eq!(rests(&recording(turn)), []);
        let fast = vec![([0.0, 0.0, 9.8], [0.0, 0.0, 0.2]); 1000];
        assert_eq!(rests(&recording(fast)), []);
        let broken = vec![([f32::NAN, 0.0, 9.8], [0.0; 3]); 1000];
        assert_eq!(rests(&recording(broken)), []);
    }
}
