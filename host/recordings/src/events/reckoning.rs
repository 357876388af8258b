//! Dead reckoning: displacement of a foot since it last stood, from its accelerations alone.

use estimator_core::{ContactEstimate, Flag, Timestamp};

use crate::samples::space::{Rotation, Vector};

/// Longest step between samples, µs; the motion within longer steps is unknown.
const LONGEST_STEP_US: u64 = 20_000;

/// Flags of samples that cannot be integrated.
const UNSOUND: [Flag; 4] =
    [Flag::AttitudeNotInitialised, Flag::Saturated, Flag::Stale, Flag::InvalidSample];

/// Motion since the foot last stood: its acceleration without gravity, rotated into the world frame and integrated
/// twice with the trapezoidal rule.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reckoning {
    start: Timestamp,
    /// Time of the newest estimate.
    pub(super) now: Timestamp,
    /// Up in the frame of the foot during its stance.
    up: Vector,
    /// Acceleration in the world frame, m/s².
    acceleration: Vector,
    /// Velocity, m/s.
    velocity: Vector,
    /// Position, m.
    position: Vector,
    is_sound: bool,
}

impl Reckoning {
    /// Starts from a foot at rest; this is the last stable estimate.
    pub(super) fn from_rest(estimate: &ContactEstimate) -> Self {
        Self {
            start: estimate.timestamp,
            now: estimate.timestamp,
            up: up(estimate),
            acceleration: in_world(estimate),
            velocity: Vector::default(),
            position: Vector::default(),
            is_sound: true,
        }
    }

    /// Processes the next estimate.
    pub(super) fn add(&mut self, estimate: &ContactEstimate) {
        let step = estimate.timestamp.micros_since(self.now);
        let acceleration = in_world(estimate);
        match step {
            Some(micros) if micros <= LONGEST_STEP_US => {
                let seconds = micros as f64 / 1.0e6;
                let change = (self.acceleration + acceleration) * (0.5 * seconds);
                self.position = self.position + self.velocity * seconds + change * (0.5 * seconds);
                self.velocity = self.velocity + change;
            }
            _ => self.is_sound = false,
        }
        self.is_sound &= !UNSOUND.iter().any(|flag| estimate.flags.contains(*flag));
        self.acceleration = acceleration;
        self.now = estimate.timestamp;
    }

    /// Inclination of the foot against its stance, rad; 0 to π.
    pub(super) fn tilt(&self, estimate: &ContactEstimate) -> f64 {
        self.up.angle_to(up(estimate))
    }

    /// Distance along the ground of a foot that now stands again, m. The remaining speed is taken for an error
    /// that has grown linearly, and is removed. `None` if a sample was missing or doubtful.
    pub(super) fn distance_to_rest(&self) -> Option<f64> {
        let seconds = self.now.micros_since(self.start)? as f64 / 1.0e6;
        self.along_ground(self.position - self.velocity * (0.5 * seconds))
    }

    /// Distance along the ground of a foot that still moves, m.
    pub(super) fn distance(&self) -> Option<f64> {
        self.along_ground(self.position)
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
