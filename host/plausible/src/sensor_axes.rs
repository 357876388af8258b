//! Whether accelerometer and gyroscope have the same axes, and whether these are right-handed.
//!
//! A foot that stands, swings and stands again has the velocity 0 at both ends, and gravity has turned by as much as the
//! foot. Each swing is integrated with the angular rate as recorded, and with the 47 other ways to lay its axes along those
//! of the accelerometer. A mirror image of a sensor (one axis with the wrong sign, or two exchanged, in both vectors) is a
//! sensor whose rates have the wrong sign. Single swings decide little, because a foot that turns forth and back ends in
//! the same direction with both signs, and a swing that ends with an impact ends with an error. So the errors of all swings
//! are added.

use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{Timestamp, Validity};
use samples::RecordedSample;
use samples::space::{Rotation, Vector};

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

/// Smallest turn of the foot in a swing that distinguishes axes, rad.
const LEAST_TURN: f64 = 0.25;

/// Smallest turn in a swing that distinguishes units, rad. It is smaller, because the wrong unit makes the turn smaller.
const LEAST_TURN_OF_UNITS: f64 = 0.04;

/// Rate at which a swing is integrated, Hz. Readings of a faster sensor are averaged.
const INTEGRATED_HZ: f32 = 200.0;

/// Number of swings that are integrated, and that are needed.
const MOST_SWINGS: usize = 24;
const LEAST_SWINGS: usize = 3;

/// Limits of the errors of a swing, beyond which an error counts as the limit: of the velocity at its end, m/s, and of gravity,
/// m/s², whose error counts half.
const MOST_VELOCITY: f64 = 5.0;
const MOST_GRAVITY: f64 = 10.0;

/// Ratio of the mean errors of two ways beyond which the better is right, and their least difference. No recording
/// whose axes are right has such a finding (`host-tests/tests/findings.rs`).
const MIRRORED: f64 = 1.3;
const DIFFERENT: f64 = 1.6;
const LEAST_DIFFERENCE: f64 = 0.3;

/// Ratio of the errors up to which a mirror image counts as good as the best way.
const ALIKE: f64 = 1.15;

/// Difference of the errors of the best two ways, m/s, up to which this foot does not distinguish the ways, because it does
/// not turn about the axis in which they differ.
const SAME: f64 = 0.03;

/// Ratio of the errors of the best two ways beyond which the best is right. On 4 of 29 recordings of people the right way is
/// the second best, with a ratio of up to 1.39.
const CLEAR: f64 = 1.45;

/// Number of ways to lay three axes along three others.
const WAYS: usize = 48;

/// The way of the recorded axes, and the way of their mirror image.
const RECORDED: usize = 0;
const MIRROR: usize = 7;

/// One way: for each axis the axis of the gyroscope along it, from 1, negative in the opposite direction.
pub(crate) type Way = [i8; 3];

/// The way with this number.
fn way(number: usize) -> Way {
    const ORDERS: [[i8; 3]; 6] = [[1, 2, 3], [1, 3, 2], [2, 1, 3], [2, 3, 1], [3, 1, 2], [3, 2, 1]];
    let signs = number % 8;
    let mut axes = ORDERS[number / 8];
    for (place, axis) in axes.iter_mut().enumerate() {
        if signs & (1 << place) != 0 {
            *axis = -*axis;
        }
    }
    axes
}

/// A vector along the axes of a way.
fn along(way: Way, v: Vector) -> Vector {
    let components = v.to_array();
    Vector::from_array(way.map(|axis| {
        let component = components[usize::from(axis.unsigned_abs()) - 1];
        if axis < 0 { -component } else { component }
    }))
}

/// Finding of the swings about the axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Axes {
    /// The axes are a mirror image.
    Mirrored,
    /// The axes of the gyroscope differ from the axes of the accelerometer. The way shows how they lie; `None` if several
    /// ways fit.
    Different(Option<Way>),
}

/// Integrates the swings of a foot.
pub(crate) struct AxesCheck {
    /// Factor of the angular rates.
    scale: f64,
    least_turn: f64,
    /// Number of ways that are tried.
    ways: usize,
    /// Number of readings that are averaged.
    averaged: usize,
    length: usize,
    piece: Vec<Reading>,
    stance: Option<Stance>,
    /// Readings since the last quiet piece.
    swing: Vec<Reading>,
    swings: usize,
    /// Sum of the errors of each way.
    errors: [f64; WAYS],
}

/// A reading of both sensors: m/s², rad/s.
#[derive(Clone, Copy)]
struct Reading {
    time: Timestamp,
    force: Vector,
    rate: Vector,
}

/// Means of a quiet piece.
#[derive(Clone, Copy)]
struct Stance {
    /// Time of its last reading.
    until: Timestamp,
    gravity: Vector,
    /// Bias of the gyroscope, rad/s.
    bias: Vector,
}

impl AxesCheck {
    /// Tries all ways.
    pub(crate) fn new(sample_rate: f32) -> Self {
        Self::with(sample_rate, 1.0, LEAST_TURN, WAYS)
    }

    /// Tries the recorded axes alone, with angular rates times `scale`, to compare units.
    pub(crate) fn of_unit(sample_rate: f32, scale: f64) -> Self {
        Self::with(sample_rate, scale, LEAST_TURN_OF_UNITS, 1)
    }

    fn with(sample_rate: f32, scale: f64, least_turn: f64, ways: usize) -> Self {
        let length = ((sample_rate * PIECE_S) as usize).max(LEAST_SAMPLES);
        Self {
            scale,
            least_turn,
            ways,
            averaged: ((sample_rate / INTEGRATED_HZ) as usize).max(1),
            length,
            piece: Vec::with_capacity(length),
            stance: None,
            swing: Vec::new(),
            swings: 0,
            errors: [0.0; WAYS],
        }
    }

    pub(crate) fn add(&mut self, sample: &RecordedSample) {
        if self.swings == MOST_SWINGS {
            return;
        }
        let imu = &sample.imu;
        let (force, rate) = (Vector::from(imu.specific_force.0), Vector::from(imu.angular_rate.0));
        let is_number = (force + rate).length().is_finite();
        if !is_number || imu.validity == Validity::Invalid {
            self.forget();
            self.piece.clear();
            return;
        }
        self.piece.push(Reading { time: imu.timestamp, force, rate: rate * self.scale });
        if self.piece.len() == self.length {
            self.end_piece();
            self.piece.clear();
        }
    }

    /// Mean error of the recorded axes over the swings; `None` if there are too few.
    pub(crate) fn error(&self) -> Option<f64> {
        (self.swings >= LEAST_SWINGS).then(|| self.errors[RECORDED] / self.swings as f64)
    }

    /// Returns how the axes differ, if they do.
    pub(crate) fn axes(&self) -> Option<Axes> {
        let recorded = self.error()?;
        let errors = self.errors.map(|sum| sum / self.swings as f64);
        let (best, least) = errors
            .iter()
            .copied()
            .enumerate()
            .min_by(|(_, one), (_, other)| one.total_cmp(other))?;
        let is_better = |error: f64, ratio: f64| {
            recorded > ratio * error && recorded > error + LEAST_DIFFERENCE
        };
        if is_better(errors[MIRROR], MIRRORED) && errors[MIRROR] < ALIKE * least {
            return Some(Axes::Mirrored);
        }
        let is_clear = is_clear(&errors, least);
        is_better(least, DIFFERENT).then(|| Axes::Different(is_clear.then(|| way(best))))
    }

    /// Forgets a swing that cannot be integrated.
    fn forget(&mut self) {
        self.stance = None;
        self.swing.clear();
    }

    fn end_piece(&mut self) {
        let Some(last) = self.piece.last().copied() else {
            return;
        };
        let Some((gravity, bias)) = quiet(&self.piece) else {
            self.continue_swing();
            return;
        };
        if let Some(before) = self.stance.take()
            && !self.swing.is_empty()
        {
            self.integrate(before, gravity);
        }
        self.swing.clear();
        self.stance = Some(Stance { until: last.time, gravity, bias });
    }

    /// Adds a piece to the swing, unless the swing is too long, or samples are missing.
    fn continue_swing(&mut self) {
        let Some(stance) = self.stance else {
            return;
        };
        for reading in &self.piece {
            let before = self.swing.last().map_or(stance.until, |before| before.time);
            let step_s = seconds(before, reading.time);
            if step_s > LONGEST_STEP_S || seconds(stance.until, reading.time) > LONGEST_S {
                self.forget();
                return;
            }
            self.swing.push(*reading);
        }
    }

    /// Adds the errors of each way at the end of a swing, after which gravity is `after`.
    fn integrate(&mut self, before: Stance, after: Vector) {
        let steps = self.steps(before);
        let mut first = Motion::still();
        let mut turn = 0.0_f64;
        for step in &steps {
            first.advance(step, step.rate, before.gravity);
            let Rotation { w, v } = first.orientation;
            turn = turn.max(2.0 * libm::atan2(v.length(), w.abs()));
        }
        if turn < self.least_turn {
            return;
        }
        self.errors[RECORDED] += first.error(before.gravity, after);
        for number in 1..self.ways {
            let way = way(number);
            let mut motion = Motion::still();
            for step in &steps {
                motion.advance(step, along(way, step.rate), before.gravity);
            }
            self.errors[number] += motion.error(before.gravity, after);
        }
        self.swings += 1;
    }

    /// Averaged readings of the swing, without the bias of the gyroscope.
    fn steps(&self, before: Stance) -> Vec<Step> {
        let mut newest = before.until;
        let mean = |readings: &[Reading], of: fn(&Reading) -> Vector| {
            let sum = readings.iter().map(of).fold(Vector::default(), |sum, v| sum + v);
            sum * (1.0 / readings.len() as f64)
        };
        let steps = self.swing.chunks(self.averaged).map(|readings| {
            let until = readings.last().map_or(newest, |last| last.time);
            let duration_s = seconds(std::mem::replace(&mut newest, until), until);
            Step {
                duration_s,
                force: mean(readings, |reading| reading.force),
                rate: mean(readings, |reading| reading.rate) - before.bias,
            }
        });
        steps.collect()
    }
}

/// Time from one reading to another, s.
fn seconds(from: Timestamp, to: Timestamp) -> f64 {
    to.micros_since(from).unwrap_or(0) as f64 / 1.0e6
}

/// Returns whether no other way fits nearly as well as the best, whose error is `least`.
fn is_clear(errors: &[f64; WAYS], least: f64) -> bool {
    !errors.iter().any(|error| *error > least + SAME && *error <= CLEAR * least)
}

/// Averaged reading.
struct Step {
    duration_s: f64,
    force: Vector,
    rate: Vector,
}

/// Mean acceleration and angular rate of a piece in which the foot stands.
fn quiet(piece: &[Reading]) -> Option<(Vector, Vector)> {
    let share = 1.0 / piece.len() as f64;
    let sum = |sum: Vector, v: &Vector| sum + *v;
    let force = piece.iter().map(|reading| &reading.force).fold(Vector::default(), sum) * share;
    let rate = piece.iter().map(|reading| &reading.rate).fold(Vector::default(), sum) * share;
    let is_gravity = (force.length() - f64::from(STANDARD_GRAVITY)).abs() < QUIET_FORCE;
    let is_quiet = piece.iter().all(|reading| {
        (reading.force - force).length() < 2.0 * QUIET_FORCE
            && reading.rate.length() < 2.0 * QUIET_RATE
    });
    (is_gravity && is_quiet && rate.length() < QUIET_RATE).then_some((force, rate))
}

/// Orientation and velocity relative to the quiet piece.
struct Motion {
    orientation: Rotation,
    velocity: Vector,
}

impl Motion {
    fn still() -> Self {
        let orientation = Rotation { w: 1.0, v: Vector::default() };
        Self { orientation, velocity: Vector::default() }
    }

    fn advance(&mut self, step: &Step, rate: Vector, gravity: Vector) {
        let half = 0.5 * step.duration_s * rate.length();
        // sin(x) / x.
        let sinc = if half > 1.0e-9 { libm::sin(half) / half } else { 1.0 };
        let turn = Rotation { w: libm::cos(half), v: rate * (0.5 * step.duration_s * sinc) };
        self.orientation = self.orientation.after(turn);
        let acceleration = self.orientation.to_world(step.force) - gravity;
        self.velocity = self.velocity + acceleration * step.duration_s;
    }

    /// Error at the end of a swing, between stances with these readings of gravity.
    fn error(&self, before: Vector, after: Vector) -> f64 {
        let gravity = (self.orientation.to_world(after) - before).length();
        self.velocity.length().min(MOST_VELOCITY) + 0.5 * gravity.min(MOST_GRAVITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Vec3;
    use samples::mounting::parse_axes;

    use crate::check;
    use crate::finding::Finding;
    use crate::fixtures::{found, pitching, with_both};

    #[test]
    fn ways_begin_with_the_recorded_axes_and_include_their_mirror() {
        assert_eq!((way(RECORDED), way(MIRROR)), ([1, 2, 3], [-1, -2, -3]));
        let mut all: Vec<Way> = (0..WAYS).map(way).collect();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), WAYS);
    }

    #[test]
    fn permuted_accelerometer_is_found_and_its_advice_repairs_it() {
        let mut recording = pitching();
        for sample in &mut recording.samples {
            let force = &mut sample.imu.specific_force.0;
            *force = Vec3::new(force.y, -force.x, force.z);
        }
        let findings = check(&recording);
        let [Finding::DifferentAxes { gyroscope: Some(way) }] = findings[..] else {
            panic!("{findings:?}");
        };
        assert!(findings[0].to_string().contains(": map w"), "{}", findings[0]);
        for sample in &mut recording.samples {
            let rate = &mut sample.imu.angular_rate.0;
            let [x, y, z] = along(way, Vector::from(*rate)).to_array().map(|value| value as f32);
            *rate = Vec3::new(x, y, z);
        }
        assert_eq!(found(&recording), [""; 0]);
    }

    #[test]
    fn way_is_clear_only_if_no_other_fits_nearly_as_well() {
        let mut errors = [9.0; WAYS];
        errors[3] = 2.0;
        for (second, clear) in [(2.01, true), (2.2, false), (2.8, false), (3.0, true)] {
            errors[5] = second;
            assert_eq!(is_clear(&errors, 2.0), clear, "{second}");
        }
    }

    #[test]
    fn mirrored_axes_are_left_handed_and_turned_ones_are_not() {
        type Change = fn(Vec3) -> Vec3;
        let right: [Change; 3] =
            [|v| v, |v| Vec3::new(v.y, -v.x, v.z), |v| Vec3::new(-v.x, -v.y, v.z)];
        for change in right {
            assert_eq!(found(&with_both(pitching(), change)), [""; 0]);
        }
        let left: [(Change, &str); 4] = [
            (|v| Vec3::new(-v.x, v.y, v.z), "z"),
            (|v| Vec3::new(v.y, v.x, v.z), "z"),
            (|v| Vec3::new(v.x, v.z, v.y), "y"),
            (|v| Vec3::new(v.z, v.y, v.x), "x"),
        ];
        for (change, up) in left {
            let findings = check(&with_both(pitching(), change));
            assert_eq!(findings, [Finding::LeftHanded { up }]);
        }
    }

    #[test]
    fn advice_for_left_handed_axes_repairs_them() {
        let exchanged = with_both(pitching(), |v| Vec3::new(v.x, v.z, v.y));
        assert_eq!(
            check(&exchanged)[0].to_string(),
            "the axes are left-handed: gravity turns against the angular rate, and y is up, as where y and z are \
             exchanged: map ay=az,az=ay,wy=wz,wz=wy"
        );
        assert_eq!(found(&with_both(exchanged, |v| Vec3::new(v.x, v.z, v.y))), [""; 0]);
        let mut mirrored = with_both(pitching(), |v| Vec3::new(v.x, -v.y, v.z));
        assert_eq!(
            check(&mirrored)[0].to_string(),
            "the axes are left-handed: gravity turns against the angular rate: one axis has the wrong sign, or two are \
             exchanged; scale 1,-1 repairs it"
        );
        for sample in &mut mirrored.samples {
            sample.imu.angular_rate.0 = sample.imu.angular_rate.0 * -1.0;
        }
        assert_eq!(found(&mirrored), [""; 0]);
        // If a foot is read with a mounting, the columns to exchange are not known.
        let mounting = parse_axes("x,-z,y").expect("axes");
        let finding = Finding::LeftHanded { up: "y" }.with_mounting(&mounting);
        assert_eq!(finding, Finding::LeftHanded { up: "z" });
    }
}
