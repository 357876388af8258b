//! Dead reckoning: how far a foot has come since it last stood, from its accelerations alone.

use estimator_core::{ContactEstimate, Flag, Timestamp};

use crate::space::{Rotation, Vector};

/// Samples further apart leave open how the foot moved between them, µs.
const LONGEST_STEP_US: u64 = 20_000;

/// A sample with one of these says nothing that can be summed up.
const UNSOUND: [Flag; 4] = [
    Flag::AttitudeNotInitialised,
    Flag::Saturated,
    Flag::Stale,
    Flag::InvalidSample,
];

/// The motion since a foot last stood: its acceleration without gravity, turned into the world and
/// summed up twice, trapezoid by trapezoid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reckoning {
    start: Timestamp,
    now: Timestamp,
    /// Up in the frame of the foot, while it stood.
    up: Vector,
    /// World frame, m/s².
    acceleration: Vector,
    /// m/s.
    velocity: Vector,
    /// m.
    position: Vector,
    is_sound: bool,
}

impl Reckoning {
    /// A foot that stands: this estimate is the last one that says so.
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

    /// The newest estimate's time.
    pub(super) const fn now(&self) -> Timestamp {
        self.now
    }

    /// Takes in the next estimate.
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
        self.is_sound &= UNSOUND
            .into_iter()
            .all(|flag| !estimate.flags.contains(flag));
        self.acceleration = acceleration;
        self.now = estimate.timestamp;
    }

    /// Angle by which the foot is inclined against its stance, rad; 0 to π.
    pub(super) fn tilt(&self, estimate: &ContactEstimate) -> f64 {
        self.up.angle_to(up(estimate))
    }

    /// How far along the ground the foot has come, m, where it now stands again: what is left of the
    /// speed is an error that has grown evenly, and is taken out. `None` where a sample was missing or
    /// cannot be believed.
    pub(super) fn distance_to_rest(&self) -> Option<f64> {
        let seconds = self.now.micros_since(self.start)? as f64 / 1.0e6;
        self.along_ground(self.position - self.velocity * (0.5 * seconds))
    }

    /// How far along the ground the foot has come, m, while it still moves.
    pub(super) fn distance(&self) -> Option<f64> {
        self.along_ground(self.position)
    }

    fn along_ground(&self, Vector { x, y, .. }: Vector) -> Option<f64> {
        let distance = Vector::new(x, y, 0.0).length();
        (self.is_sound && distance.is_finite()).then_some(distance)
    }
}

/// The acceleration without gravity in the world frame, m/s².
fn in_world(estimate: &ContactEstimate) -> Vector {
    let a = estimate.linear_acceleration.0;
    rotation(estimate).to_world(Vector::new(a.x.into(), a.y.into(), a.z.into()))
}

/// Up in the frame of the foot.
fn up(estimate: &ContactEstimate) -> Vector {
    rotation(estimate).to_sensor(Vector::new(0.0, 0.0, 1.0))
}

fn rotation(estimate: &ContactEstimate) -> Rotation {
    let q = estimate.orientation;
    Rotation {
        w: q.w.into(),
        v: Vector::new(q.x.into(), q.y.into(), q.z.into()),
    }
}
