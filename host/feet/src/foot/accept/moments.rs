//! Contacts and motions of one foot, the same over CAN and over the serial line.

use std::time::Duration;

use crate::decode::ContactRow;
use crate::decode::live::{Heard, Said};
use estimator_core::{Quaternion, Timestamp, Vec3};
use recordings::samples::space::{Rotation, Vector};
use wire::{Emergency, Faults};

use crate::foot::client::{Client, RequestError};

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.80665;

/// Motion of the foot at one sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Motion {
    /// Time on the foot's clock.
    pub(super) at: Timestamp,
    /// Specific force, m/s².
    pub(super) force: Vector,
    /// Angular rate, rad/s.
    pub(super) rate: Vector,
    /// Where it comes from.
    pub(super) source: Source,
}

/// Origin of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Source {
    /// Raw samples of a serial line: axes of the sensor, each millisecond.
    #[default]
    Raw,
    /// Frames of a bus: axes of the foot, without bias, each 20 ms.
    Frames,
}

/// Something received from the foot.
pub(super) enum Moment<'a> {
    Contact(&'a ContactRow),
    Motion(Motion),
    Faults(Faults),
}

/// Longest time until a person who has left is noticed.
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
    let mut take = |heard: &Heard| {
        if node.is_some() && heard.foot.node != node {
            return None;
        }
        let motion = newest.motion(heard);
        let found = match &heard.said {
            Said::Contact(row) => find(Moment::Contact(row)),
            Said::Board(board) => find(Moment::Faults(board.faults)),
            Said::Emergency(Emergency { fault: Some(fault), .. }) => {
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
    fn motion(&mut self, heard: &Heard) -> Option<Motion> {
        match &heard.said {
            Said::Raw(raw) => {
                let sample = raw.to_si();
                Some(Motion {
                    at: raw.timestamp,
                    force: sample.specific_force.0.into(),
                    rate: sample.angular_rate.0.into(),
                    source: Source::Raw,
                })
            }
            Said::Contact(row) => {
                self.orientation = row.orientation.or(self.orientation);
                self.rate = row.rate.or(self.rate);
                let Quaternion { w, x, y, z } = self.orientation?;
                let v = Vector::from_array([x, y, z].map(f64::from));
                let orientation = Rotation { w: f64::from(w), v };
                let up = orientation.to_sensor(Vector::new(0.0, 0.0, 1.0));
                Some(Motion {
                    at: row.timestamp,
                    force: Vector::from(row.acceleration?) + up * GRAVITY,
                    rate: self.rate?.into(),
                    source: Source::Frames,
                })
            }
            _ => None,
        }
    }
}
