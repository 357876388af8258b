//! Inertial navigation with zero-velocity measurements: an error-state Kalman filter with nine states.
//!
//! ```text
//! R ← R exp(ω T)      v ← v + T (R f − g)      p ← p + T v
//! error: position, velocity, attitude; F has T between position and velocity, −T [R f]× between
//! velocity and attitude; noise (σ_a T)² and (σ_ω T)² in each step
//! measured: v = 0, standard deviation σ per axis
//! ```
//!
//! The settings are those of `PyShoe`'s `INS.py`, which are those of `OpenShoe`: `σ_a` = 0.5 m/s²,
//! `σ_ω` = 0.5 °/s; σ = 0.01 m/s for binary detectors; initially 10 µm, 10 µm/s and 0.1°. The initial
//! vertical is the mean of the first 20 specific forces, whose length is g. No bias is estimated.

use samples::space::{Rotation, Vector};

use crate::window::Reading;

/// Standard deviation of the acceleration per axis and sample, m/s².
const ACCELERATION_NOISE: f64 = 0.5;

/// Standard deviation of the angular rate per axis and sample, rad/s.
const RATE_NOISE: f64 = 0.5 * std::f64::consts::PI / 180.0;

/// Initial standard deviation of position, m, and velocity, m/s.
const START: f64 = 1.0e-5;

/// Initial standard deviation of the attitude, rad.
const START_ATTITUDE: f64 = 0.1 * std::f64::consts::PI / 180.0;

/// Number of initial samples at rest that determine the vertical and g.
const START_SAMPLES: usize = 20;

/// Estimated motion.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimatedTrack {
    /// Position at each sample, m; z is up, the heading is arbitrary.
    pub positions: Vec<Vector>,
    /// Mean over all measurements of the normalised innovation squared, vᵀ S⁻¹ v, expected to be 3 if all σ
    /// are correct; `None` without a measurement.
    pub nis: Option<f64>,
}

/// Covariance of position, velocity and attitude.
type Covariance = [[f64; STATES]; STATES];

const STATES: usize = 9;

/// Index of the first velocity state.
const VELOCITY: usize = 3;

/// Index of the first attitude state.
const ATTITUDE: usize = 6;

/// State and its uncertainty.
struct Filter {
    orientation: Rotation,
    velocity: Vector,
    position: Vector,
    covariance: Covariance,
    gravity: f64,
}

/// Runs the filter over readings with a spacing of `period`, s. `sigmas` is the standard deviation of the
/// measured velocity at each sample, m/s; `None` without a measurement.
#[must_use]
pub fn navigate(readings: &[Reading], period: f64, sigmas: &[Option<f64>]) -> EstimatedTrack {
    let mut filter = Filter::new(readings);
    let mut positions = vec![filter.position];
    let (mut sum, mut count) = (0.0, 0);
    let sigmas = sigmas.iter().copied().chain(std::iter::repeat(None));
    for (reading, sigma) in readings.iter().zip(sigmas).skip(1) {
        filter.predict(reading, period);
        if let Some(sigma) = sigma {
            sum += filter.measure(sigma);
            count += 1;
        }
        positions.push(filter.position);
    }
    EstimatedTrack {
        positions,
        nis: (count > 0).then(|| sum / f64::from(count)),
    }
}

impl Filter {
    fn new(readings: &[Reading]) -> Self {
        let first = readings.iter().take(START_SAMPLES);
        let count = first.len().max(1) as f64;
        let mean = first.fold(Vector::default(), |sum, [x, y, z, ..]| {
            sum + Vector::new(*x, *y, *z) * (1.0 / count)
        });
        let mut covariance = [[0.0; STATES]; STATES];
        for (i, row) in covariance.iter_mut().enumerate() {
            let sigma = if i < ATTITUDE { START } else { START_ATTITUDE };
            row[i] = sigma * sigma;
        }
        Self {
            orientation: level(mean),
            velocity: Vector::default(),
            position: Vector::default(),
            covariance,
            gravity: mean.length(),
        }
    }

    fn predict(&mut self, [ax, ay, az, wx, wy, wz]: &Reading, period: f64) {
        let force = Vector::new(*ax, *ay, *az);
        let turn = Vector::new(*wx, *wy, *wz) * period;
        self.propagate(self.orientation.to_world(force), period);
        self.orientation = unit(self.orientation.after(by_vector(turn)));
        let acceleration = self.orientation.to_world(force) - Vector::new(0.0, 0.0, self.gravity);
        self.velocity = self.velocity + acceleration * period;
        self.position = self.position + self.velocity * period;
    }

    /// Computes P ← F P Fᵀ + Q, with the specific force in the world frame.
    fn propagate(&mut self, force: Vector, period: f64) {
        let Vector { x, y, z } = force * period;
        // −T [f]×, row by row.
        let tilt = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]];
        let advance = |column: &mut [f64; STATES]| {
            for i in 0..3 {
                column[i] += period * column[VELOCITY + i];
                let attitude = (0..3).map(|k| tilt[i][k] * column[ATTITUDE + k]);
                column[VELOCITY + i] += attitude.sum::<f64>();
            }
        };
        // F on the columns of P, which is symmetric, and then on those of (F P)ᵀ.
        for _ in 0..2 {
            let mut rows = self.covariance;
            rows.iter_mut().for_each(advance);
            self.covariance = std::array::from_fn(|i| std::array::from_fn(|j| rows[j][i]));
        }
        for i in 0..3 {
            self.covariance[VELOCITY + i][VELOCITY + i] += (ACCELERATION_NOISE * period).powi(2);
            self.covariance[ATTITUDE + i][ATTITUDE + i] += (RATE_NOISE * period).powi(2);
        }
    }

    /// Applies a measurement of zero velocity with this standard deviation, m/s. Returns the normalised
    /// innovation squared.
    fn measure(&mut self, sigma: f64) -> f64 {
        let before = self.covariance;
        let mut innovation = [[0.0; 3]; 3];
        for (i, row) in innovation.iter_mut().enumerate() {
            row.copy_from_slice(&before[VELOCITY + i][VELOCITY..ATTITUDE]);
            row[i] += sigma * sigma;
        }
        let inverse = inverse(&innovation);
        let velocity = self.velocity.to_array();
        let weighted = inverse.map(|row| (0..3).map(|k| row[k] * velocity[k]).sum::<f64>());
        let mut change = [0.0; STATES];
        for i in 0..STATES {
            let gain: [f64; 3] = std::array::from_fn(|j| {
                (0..3)
                    .map(|k| before[i][VELOCITY + k] * inverse[k][j])
                    .sum()
            });
            change[i] = -(0..3).map(|k| gain[k] * velocity[k]).sum::<f64>();
            for (j, entry) in self.covariance[i].iter_mut().enumerate() {
                *entry -= (0..3)
                    .map(|k| gain[k] * before[VELOCITY + k][j])
                    .sum::<f64>();
            }
        }
        self.symmetrise();
        let [px, py, pz, vx, vy, vz, x, y, z] = change;
        self.position = self.position + Vector::new(px, py, pz);
        self.velocity = self.velocity + Vector::new(vx, vy, vz);
        self.orientation = unit(by_vector(Vector::new(x, y, z)).after(self.orientation));
        (0..3).map(|k| weighted[k] * velocity[k]).sum()
    }

    fn symmetrise(&mut self) {
        for i in 0..STATES {
            for j in 0..i {
                let mean = 0.5 * (self.covariance[i][j] + self.covariance[j][i]);
                self.covariance[i][j] = mean;
                self.covariance[j][i] = mean;
            }
        }
    }
}

/// Orientation in which a vector points up; the identity for a zero vector.
fn level(up: Vector) -> Rotation {
    let length = up.length();
    let half_way = Vector::new(0.0, 0.0, length) + up;
    match half_way.length() > 1.0e-9 * length {
        // The rotation from `up` to z has twice the angle to the vector half-way.
        true => unit(Rotation {
            w: up.dot(half_way),
            v: up.cross(half_way),
        }),
        // `up` points down.
        false => Rotation {
            w: if length > 0.0 { 0.0 } else { 1.0 },
            v: Vector::new(if length > 0.0 { 1.0 } else { 0.0 }, 0.0, 0.0),
        },
    }
}

/// Rotation by a vector, rad.
fn by_vector(vector: Vector) -> Rotation {
    let angle = vector.length();
    let (sine, cosine) = libm::sincos(0.5 * angle);
    let scale = if angle > 1.0e-12 { sine / angle } else { 0.5 };
    Rotation {
        w: cosine,
        v: vector * scale,
    }
}

/// Normalises a rotation to length 1.
fn unit(rotation: Rotation) -> Rotation {
    let square = rotation.w * rotation.w + rotation.v.dot(rotation.v);
    let scale = 1.0 / libm::sqrt(square);
    Rotation {
        w: rotation.w * scale,
        v: rotation.v * scale,
    }
}

/// Inverse of a symmetric matrix, by its cofactors.
fn inverse(m: &[[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let [a, b, c] = m.map(Vector::from_array);
    let columns = [b.cross(c), c.cross(a), a.cross(b)];
    let determinant = a.dot(columns[0]);
    columns.map(|column| (column * (1.0 / determinant)).to_array())
}

#[cfg(test)]
mod tests {
    use super::*;

    const G: f64 = 9.8;

    /// Readings of a level foot at 100 Hz that accelerates at 1 m/s² along x for a second, then decelerates
    /// equally; at rest before and after.
    fn pushed() -> Vec<Reading> {
        let acceleration = |k: usize| match k {
            100..200 => 1.0,
            200..300 => -1.0,
            _ => 0.0,
        };
        (0..400)
            .map(|k| [acceleration(k), 0.0, G, 0.0, 0.0, 0.0])
            .collect()
    }

    #[test]
    fn acceleration_is_integrated_twice() {
        let track = navigate(&pushed(), 0.01, &[]);
        let end = track.positions[399];
        assert!(
            (end.x - 1.0).abs() < 1.0e-9 && end.y.abs() + end.z.abs() < 1.0e-9,
            "{end:?}"
        );
        assert_eq!(track.nis, None);
    }

    #[test]
    fn attitude_rotates_the_force_for_any_vertical() {
        for up in [
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
            [0.6, 0.0, 0.8],
            [0.0, -1.0, 0.0],
        ] {
            let [x, y, z] = up.map(|component| component * G);
            let turning = |k: usize| if k < 50 { 0.0 } else { 1.5 };
            let readings: Vec<Reading> = (0..200)
                .map(|k| {
                    [
                        x,
                        y,
                        z,
                        up[0] * turning(k),
                        up[1] * turning(k),
                        up[2] * turning(k),
                    ]
                })
                .collect();
            let end = navigate(&readings, 0.01, &[]).positions[199];
            assert!(end.length() < 1.0e-6, "{up:?}: {end:?}");
        }
    }

    #[test]
    fn stance_removes_a_drift() {
        // A bias of 0.1 m/s² drifts 20 cm in 2 s.
        let drifting: Vec<Reading> = (0..220)
            .map(|k| [if k < 20 { 0.0 } else { 0.1 }, 0.0, G, 0.0, 0.0, 0.0])
            .collect();
        let free = navigate(&drifting, 0.01, &[]).positions[219].x;
        assert!((free - 0.2).abs() < 0.01, "{free}");
        let at_end: Vec<_> = (0..220).map(|k| (k >= 215).then_some(0.01)).collect();
        let held = navigate(&drifting, 0.01, &at_end);
        assert!(
            held.positions[219].x.abs() < 0.03,
            "{:?}",
            held.positions[219]
        );
    }

    #[test]
    fn nis_is_scaled_by_sigma() {
        // A foot that moves at 0.1 m/s, measured as standing with σ = 0.01 m/s.
        let mut readings = vec![[0.0, 0.0, G, 0.0, 0.0, 0.0]; 40];
        readings[30][0] = 10.0;
        let nis = |sigma: f64| {
            let sigmas: Vec<_> = (0..40).map(|k| (k == 30).then_some(sigma)).collect();
            navigate(&readings, 0.01, &sigmas)
                .nis
                .expect("a measurement")
        };
        assert!((nis(10.0) - 1.0e-4).abs() < 1.0e-6, "{}", nis(10.0));
        assert!(nis(0.01) > nis(0.1), "{}", nis(0.01));
    }

    fn row_times(row: &[f64; 3], matrix: &[[f64; 3]; 3]) -> [f64; 3] {
        std::array::from_fn(|j| (0..3).map(|k| row[k] * matrix[k][j]).sum())
    }

    #[test]
    fn symmetric_matrix_times_its_inverse_is_the_identity() {
        let m = [[4.0, 1.0, 0.5], [1.0, 3.0, -0.2], [0.5, -0.2, 2.0]];
        let inverse = inverse(&m);
        for (i, row) in m.iter().enumerate() {
            let products = row_times(row, &inverse);
            for (j, product) in products.into_iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((product - expected).abs() < 1.0e-12);
            }
        }
    }
}
