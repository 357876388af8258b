//! Whether the axes are right-handed: the velocity of a foot that stands, swings and stands again is 0 at both ends.
//!
//! Each swing between two quiet pieces is integrated twice, with the angular rate as recorded and with its sign changed.
//! A mirror image of a sensor (one axis with the wrong sign, or two axes exchanged, in both its vectors) is a sensor
//! whose rates have the wrong sign. Only the right sign gives a velocity near 0 at the end of the swing. The direction of
//! gravity alone shows less: a foot that turns forth and back ends in the same direction with both signs.

use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{Timestamp, Validity};

use crate::samples::RecordedSample;
use crate::space::{Rotation, Vector};

/// Duration of a piece, s.
const PIECE_S: f32 = 0.05;

/// Smallest number of samples of a piece.
const LEAST_SAMPLES: usize = 5;

/// Largest deviation of |a| from gravity in a quiet piece, m/s².
const QUIET_FORCE: f64 = 1.0;

/// Largest angular rate of a quiet piece, rad/s: the bias of a sensor, and the noise of a stance.
const QUIET_RATE: f64 = 0.3;

/// Longest swing that is integrated, s. In a longer one the errors of the sensor accumulate.
const LONGEST_S: f64 = 2.0;

/// Longest step within a swing, s.
const LONGEST_STEP_S: f64 = 0.05;

/// Turn of the foot from which a swing tells the signs apart, rad.
const LEAST_TURN: f64 = 0.25;

/// Velocity at the end up to which a sign can be right, m/s.
const RIGHT_VELOCITY: f64 = 0.4;

/// Ratio of both velocities at the end from which a swing decides, and the least difference, m/s.
const RATIO: f64 = 3.0;
const LEAST_DIFFERENCE: f64 = 0.3;

/// Number of deciding swings that are needed, and the multiple by which they must outnumber the others.
const LEAST_SWINGS: u32 = 3;
const MAJORITY: u32 = 4;

/// Compares both signs of the angular rate, swing by swing.
pub(super) struct HandednessCheck {
    length: usize,
    piece: Vec<(Timestamp, Vector, Vector)>,
    swing: Option<Swing>,
    /// Number of swings that end at rest with the recorded sign.
    right: u32,
    /// Number of swings that end at rest with the other sign.
    left: u32,
}

/// Motion since the last quiet piece.
struct Swing {
    /// Time of the last quiet sample, and of the newest one.
    since: Timestamp,
    newest: Timestamp,
    /// Means of the quiet piece: gravity, m/s², and the bias of the gyroscope, rad/s.
    gravity: Vector,
    bias: Vector,
    /// Motion with the recorded sign of the angular rate, and with the opposite sign.
    motions: [Motion; 2],
    /// Largest turn, rad.
    turn: f64,
}

/// Orientation and velocity relative to the quiet piece.
#[derive(Clone, Copy)]
struct Motion {
    orientation: Rotation,
    velocity: Vector,
}

impl HandednessCheck {
    pub(super) fn new(sample_rate: f32) -> Self {
        let length = ((sample_rate * PIECE_S) as usize).max(LEAST_SAMPLES);
        Self { length, piece: Vec::with_capacity(length), swing: None, right: 0, left: 0 }
    }

    pub(super) fn add(&mut self, sample: &RecordedSample) {
        let imu = &sample.imu;
        let (force, rate) = (Vector::from(imu.specific_force.0), Vector::from(imu.angular_rate.0));
        let is_number = (force + rate).length().is_finite();
        if !is_number || imu.validity == Validity::Invalid {
            (self.swing, self.piece) = (None, Vec::with_capacity(self.length));
            return;
        }
        self.piece.push((imu.timestamp, force, rate));
        if self.piece.len() == self.length {
            self.end_piece();
            self.piece.clear();
        }
    }

    /// Returns whether the axes are left-handed.
    pub(super) const fn is_left_handed(&self) -> bool {
        self.left >= LEAST_SWINGS && self.left > MAJORITY * self.right
    }

    fn end_piece(&mut self) {
        let Some((since, ..)) = self.piece.last().copied() else {
            return;
        };
        let Some((gravity, bias)) = quiet(&self.piece) else {
            self.swing = self.swing.take().and_then(|swing| swing.continued(&self.piece));
            return;
        };
        if let Some(ended) = self.swing.take() {
            match ended.decides() {
                Some(true) => self.right += 1,
                Some(false) => self.left += 1,
                None => {}
            }
        }
        let still = Motion {
            orientation: Rotation { w: 1.0, v: Vector::default() },
            velocity: Vector::default(),
        };
        let motions = [still; 2];
        self.swing = Some(Swing { since, newest: since, gravity, bias, motions, turn: 0.0 });
    }
}

/// Mean acceleration and angular rate of a piece in which the foot stands.
fn quiet(piece: &[(Timestamp, Vector, Vector)]) -> Option<(Vector, Vector)> {
    let share = 1.0 / piece.len() as f64;
    let sum = |sum: Vector, v: &Vector| sum + *v;
    let force = piece.iter().map(|(_, force, _)| force).fold(Vector::default(), sum) * share;
    let rate = piece.iter().map(|(_, _, rate)| rate).fold(Vector::default(), sum) * share;
    let is_gravity = (force.length() - f64::from(STANDARD_GRAVITY)).abs() < QUIET_FORCE;
    let is_quiet = piece.iter().all(|(_, a, w)| {
        (*a - force).length() < 2.0 * QUIET_FORCE && w.length() < 2.0 * QUIET_RATE
    });
    (is_gravity && is_quiet && rate.length() < QUIET_RATE).then_some((force, rate))
}

impl Swing {
    /// Integrates a piece. `None` if the swing is too long, or samples are missing.
    fn continued(mut self, piece: &[(Timestamp, Vector, Vector)]) -> Option<Self> {
        for (time, force, rate) in piece {
            let step_s = time.micros_since(self.newest)? as f64 / 1.0e6;
            if step_s > LONGEST_STEP_S {
                return None;
            }
            self.newest = *time;
            let rate = *rate - self.bias;
            for (motion, sign) in self.motions.iter_mut().zip([1.0, -1.0]) {
                motion.advance(*force, rate * sign, self.gravity, step_s);
            }
            let Rotation { w, v } = self.motions[0].orientation;
            self.turn = self.turn.max(2.0 * libm::atan2(v.length(), w.abs()));
        }
        let lasts_s = self.newest.micros_since(self.since)? as f64 / 1.0e6;
        (lasts_s <= LONGEST_S).then_some(self)
    }

    /// Returns whether the recorded sign is the right one, where the swing decides.
    fn decides(&self) -> Option<bool> {
        let [recorded, other] = self.motions.map(|motion| motion.velocity.length());
        let (better, worse) = (recorded.min(other), recorded.max(other));
        let decides = self.turn > LEAST_TURN
            && better < RIGHT_VELOCITY
            && worse > better + LEAST_DIFFERENCE
            && worse > RATIO * better;
        decides.then_some(recorded < other)
    }
}

impl Motion {
    fn advance(&mut self, force: Vector, rate: Vector, gravity: Vector, step_s: f64) {
        let half = 0.5 * step_s * rate.length();
        // sin(x) / x.
        let sinc = if half > 1.0e-9 { libm::sin(half) / half } else { 1.0 };
        let turn = Rotation { w: libm::cos(half), v: rate * (0.5 * step_s * sinc) };
        self.orientation = self.orientation.after(turn);
        let acceleration = self.orientation.to_world(force) - gravity;
        self.velocity = self.velocity + acceleration * step_s;
    }
}
