//! Contacts and motions of one foot, in the same form over CAN and over the serial line. Rest is found from the
//! motions.

use std::collections::VecDeque;
use std::time::Duration;

use estimator_core::internals::SENSOR_NOISE;
use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{Quaternion, Timestamp, Vec3};
use samples::space::{Rotation, Vector};
use wire::{Emergency, Faults};

use crate::decode::ContactRow;
use crate::decode::live::{FootMessage, MessageBody};
use crate::foot::{Client, RequestError};

/// Standard gravity, m/s².
const GRAVITY: f64 = STANDARD_GRAVITY as f64;

/// Motion of the foot at one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FootMotion {
    /// Time on the foot's clock.
    pub(super) at: Timestamp,
    /// Specific force, m/s².
    pub(super) force: Vector,
    /// Angular rate, rad/s.
    pub(super) rate: Vector,
    /// Messages from which it was made.
    pub(super) source: MotionSource,
}

/// Origin of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum MotionSource {
    /// Raw samples of a serial line: axes of the sensor, each millisecond.
    #[default]
    Raw,
    /// Frames of a bus: axes of the foot, without bias, each 20 ms.
    Frames,
}

/// Something received from the foot.
pub(super) enum Moment<'a> {
    Contact(&'a ContactRow),
    Motion(FootMotion),
    Faults(Faults),
}

/// Longest time until the program notices that the person has left.
const NOTICE: Duration = Duration::from_millis(200);

/// Listens to the foot of `client` until `find` returns a value, at most `longest`, or until the person has left.
pub(super) fn watch<T>(
    client: &mut Client,
    has_left: &dyn Fn() -> bool,
    longest: Duration,
    mut find: impl FnMut(Moment) -> Option<T>,
) -> Result<Option<T>, RequestError> {
    let node = client.node().map(wire::NodeId::get);
    let mut newest = Newest::default();
    let mut take = |message: &FootMessage| {
        if node.is_some() && message.foot.node != node {
            return None;
        }
        let motion = newest.motion(message);
        let found = match &message.body {
            MessageBody::Contact(row) => find(Moment::Contact(row)),
            MessageBody::Board(board) => find(Moment::Faults(board.faults)),
            MessageBody::Emergency(Emergency { fault: Some(fault), .. }) => {
                find(Moment::Faults(Faults::NONE.with(*fault)))
            }
            _ => None,
        };
        found.or_else(|| find(Moment::Motion(motion?)))
    };
    let clock = client.clock();
    let end = clock.now() + longest;
    loop {
        let left = clock.until(end);
        let found = client.listen(left.min(NOTICE), &mut take)?;
        if found.is_some() || left.is_zero() || has_left() {
            return Ok(found);
        }
    }
}

/// Newest frames of a bus, which hold the parts of a motion.
#[derive(Default)]
struct Newest {
    orientation: Option<Quaternion>,
    rate: Option<Vec3>,
}

impl Newest {
    /// Motion that a message completes: a raw sample, or an acceleration with the newest orientation and rate.
    fn motion(&mut self, message: &FootMessage) -> Option<FootMotion> {
        match &message.body {
            MessageBody::Raw(raw) => {
                let sample = raw.to_si();
                Some(FootMotion {
                    at: raw.timestamp,
                    force: sample.specific_force.0.into(),
                    rate: sample.angular_rate.0.into(),
                    source: MotionSource::Raw,
                })
            }
            MessageBody::Contact(row) => {
                self.orientation = row.orientation.or(self.orientation);
                self.rate = row.rate.or(self.rate);
                let Quaternion { w, x, y, z } = self.orientation?;
                let v = Vector::from_array([x, y, z].map(f64::from));
                let orientation = Rotation { w: f64::from(w), v };
                let up = orientation.to_sensor(Vector::new(0.0, 0.0, 1.0));
                Some(FootMotion {
                    at: row.timestamp,
                    force: Vector::from(row.acceleration?) + up * GRAVITY,
                    rate: self.rate?.into(),
                    source: MotionSource::Frames,
                })
            }
            _ => None,
        }
    }
}

/// Time without motion that counts as rest, µs.
const REST_US: u64 = 500_000;

/// Fewest motions in that time, because a foot on a bus sends one only every 20 ms.
const FEWEST: usize = 15;

/// Largest standard deviation at rest, m/s² and rad/s. A foot whose noise is out of bounds still rests, so that the
/// figure of its noise is the one that fails.
const FORCE: f64 = 7.5 * SENSOR_NOISE.force as f64;
const RATE: f64 = 17.0 * SENSOR_NOISE.rate as f64;

/// Mean and standard deviation of motions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Statistics {
    pub(super) force: Vector,
    pub(super) rate: Vector,
    /// Largest standard deviation of an axis, m/s² and rad/s.
    pub(super) force_noise: f64,
    pub(super) rate_noise: f64,
}

impl Statistics {
    pub(super) fn of<'a>(motions: impl ExactSizeIterator<Item = &'a FootMotion> + Clone) -> Self {
        let (force, force_noise) = moments(motions.clone().map(|motion| motion.force));
        let (rate, rate_noise) = moments(motions.map(|motion| motion.rate));
        Self { force, rate, force_noise, rate_noise }
    }

    fn is_rest(&self) -> bool {
        self.force_noise < FORCE && self.rate_noise < RATE
    }
}

/// Mean, and largest standard deviation of an axis.
fn moments(values: impl ExactSizeIterator<Item = Vector> + Clone) -> (Vector, f64) {
    let per_value = 1.0 / values.len().max(1) as f64;
    let sum = values.clone();
    let mean = sum.fold(Vector::default(), |sum, value| sum + value) * per_value;
    let mut squares = [0.0; 3];
    for value in values {
        let differences = (value + mean * -1.0).to_array();
        for (sum, difference) in squares.iter_mut().zip(differences) {
            *sum += difference * difference;
        }
    }
    let largest = squares.into_iter().fold(0.0, f64::max);
    (mean, (largest * per_value).sqrt())
}

/// Detector of rest.
#[derive(Default)]
pub(super) struct RestDetector {
    motions: VecDeque<FootMotion>,
}

impl RestDetector {
    /// Processes a motion; returns the statistics of the newest half second if the foot was at rest in it.
    pub(super) fn take(&mut self, motion: FootMotion) -> Option<Statistics> {
        let newest_us = motion.at.as_micros();
        self.motions.push_back(motion);
        let mut span_us = 0;
        while let Some(first) = self.motions.front() {
            span_us = newest_us.saturating_sub(first.at.as_micros());
            // Motions before a restart are dropped, because the foot's clock begins again.
            if span_us <= REST_US && first.at <= motion.at {
                break;
            }
            self.motions.pop_front();
        }
        if self.motions.len() < FEWEST || span_us < REST_US * 9 / 10 {
            return None;
        }
        let statistics = Statistics::of(self.motions.iter());
        statistics.is_rest().then_some(statistics)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Timestamp;

    fn at(ms: u64, force: f64) -> FootMotion {
        FootMotion {
            at: Timestamp::from_micros(1000 * ms),
            force: Vector::new(0.0, 0.0, force),
            ..FootMotion::default()
        }
    }

    #[test]
    fn rest_is_found_half_a_second_after_the_last_motion() {
        let mut stillness = RestDetector::default();
        let found = (0..2000).step_by(20).find(|ms| {
            let force = if *ms < 1000 { 9.0 + (ms % 40) as f64 } else { 9.8 };
            stillness.take(at(*ms, force)).is_some()
        });
        assert!(found.is_some_and(|ms| (1440..=1500).contains(&ms)), "{found:?}");
    }

    #[test]
    fn restart_of_the_clock_begins_a_new_rest() {
        let mut stillness = RestDetector::default();
        let at_rest = |stillness: &mut RestDetector, from: u64| {
            (from..from + 1000).step_by(20).find(|ms| stillness.take(at(*ms, 9.8)).is_some())
        };
        assert_eq!(at_rest(&mut stillness, 50_000), Some(50_460));
        assert_eq!(at_rest(&mut stillness, 0), Some(460));
    }
}
