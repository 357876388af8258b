//! State of a foot while it streams, and its messages.

use decode::Row;
use decode::row::Clock;
use estimator_core::{
    Decision, Flags, ImuSample, PerAxis, Phase, Quaternion as Orientation, Timestamp, Validity,
    Vec3, VelocityCoefficients, VelocityParams, VelocitySigma,
};
use live::NewestSecond;
use live::clock::FootClock;
use wire::uart::RawSample;
use wire::{Fault, Faults};

use crate::message::{
    Contact, DiagnosticArray, DiagnosticStatus, Header, Imu, KeyValue, Level, Quaternion, Time,
    TwistWithCovariance, TwistWithCovarianceStamped, Vector3,
};
use crate::topics::Topics;

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;

/// Period of a foot's diagnostics if nothing changes, µs.
const DIAGNOSTIC_US: u64 = 1_000_000;

/// Maximum age of an orientation or a rate combined with an acceleration, µs; by default they are sent every
/// 20 ms.
const BESIDE_US: u64 = 25_000;

/// Diagnostic message of a foot without contacts.
pub const SILENT: &str = "silent: no contact for half a second";

/// Diagnostic message of several boards with the same id.
pub const SEVERAL_BOARDS: &str = "several boards with this id";

/// Covariance that marks a missing value.
pub(crate) const ABSENT: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// State of a foot.
#[derive(Debug)]
pub(crate) struct Foot {
    pub(crate) topics: Topics,
    pub(crate) name: String,
    pub(crate) clock: FootClock,
    pub(crate) second: NewestSecond,
    /// Listening time of its newest contact, µs.
    pub(crate) contact_us: Option<u64>,
    pub(crate) is_silent: bool,
    /// Whether its newest contact came from several boards with the same id.
    pub(crate) is_shared: bool,
    pub(crate) flags: u8,
    pub(crate) faults: Faults,
    /// Counters of the board, or on CAN the number of drops.
    pub(crate) counts: Vec<KeyValue>,
    pub(crate) diagnosed_us: Option<u64>,
    /// Newest orientation and rate, with their times on the foot's clock.
    pub(crate) orientation: Option<(Orientation, Timestamp)>,
    pub(crate) rate: Option<(Vec3, Timestamp)>,
}

impl Foot {
    pub(crate) fn new(name: &str, frame: &str) -> Self {
        Self {
            topics: Topics::with_frame(name, frame),
            name: name.to_owned(),
            clock: FootClock::default(),
            second: NewestSecond::default(),
            contact_us: None,
            is_silent: false,
            is_shared: false,
            flags: 0,
            faults: Faults::NONE,
            counts: Vec::new(),
            diagnosed_us: None,
            orientation: None,
            rate: None,
        }
    }

    pub(crate) fn header(&self, stamp: Timestamp) -> Header {
        Header {
            stamp: Time::from(stamp),
            frame_id: self.topics.frame.as_ref().to_owned(),
        }
    }

    pub(crate) fn contact(&mut self, row: &Row, at: Timestamp) -> (Contact, Option<Imu>) {
        self.second.take(row.timestamp, row.segment, at);
        self.is_shared = self.second.is_of_several_boards(at);
        let stamp = match row.common {
            Some((time, Clock::Sync)) => self.clock.synchronised(row.timestamp, at, time),
            _ => self.clock.time(row.timestamp, at),
        };
        self.flags = row.flags.unwrap_or(self.flags);
        let axes = row.axes.map(PerAxis::to_array);
        let contact = Contact {
            header: self.header(stamp),
            foot: self.name.clone(),
            node: row.node.map_or(0, wire::NodeId::get),
            p_stable: row.stable,
            p_tangential: row.tangential,
            p_vertical: row.vertical,
            p_axes: axes.unwrap_or([f32::NAN; 6]),
            decision: row.status.decision() == Decision::Stable,
            state: state(row.status.phase()),
            valid: row.status.is_valid(),
            flags: self.flags,
            sequence: row.sequence,
        };
        if self.is_shared {
            let contact = Contact {
                p_stable: 0.0,
                p_tangential: 0.0,
                p_vertical: 0.0,
                p_axes: [f32::NAN; 6],
                decision: false,
                state: state(Phase::Unknown),
                valid: false,
                ..contact
            };
            return (contact, None);
        }
        let made = row.timestamp;
        self.orientation = row.orientation.map(|q| (q, made)).or(self.orientation);
        self.rate = row.rate.map(|rate| (rate, made)).or(self.rate);
        if let Some(sample) = &row.measured {
            return (contact, self.recorded(sample, row.orientation, stamp));
        }
        let imu = match (row.acceleration, self.orientation, self.rate) {
            (Some(acceleration), Some((orientation, first)), Some((rate, second)))
                if is_near(first, made) && is_near(second, made) =>
            {
                Some(Imu {
                    header: self.header(stamp),
                    orientation: quaternion(orientation),
                    angular_velocity: vector(rate),
                    linear_acceleration: with_gravity(acceleration, orientation),
                    ..Imu::default()
                })
            }
            _ => None,
        };
        (contact, imu)
    }

    /// Sample as it was recorded, with the estimated orientation; `None` if it is invalid or not a number.
    fn recorded(
        &self,
        sample: &ImuSample,
        orientation: Option<Orientation>,
        stamp: Timestamp,
    ) -> Option<Imu> {
        let [force, rate] = [sample.specific_force.0, sample.angular_rate.0];
        let is_number = |v: Vec3| v.x.is_finite() && v.y.is_finite() && v.z.is_finite();
        let is_usable = is_number(force) && is_number(rate);
        let is_usable = is_usable && !matches!(sample.validity, Validity::Invalid);
        is_usable.then(|| Imu {
            header: self.header(stamp),
            orientation: orientation.map(quaternion).unwrap_or_default(),
            angular_velocity: vector(rate),
            linear_acceleration: vector(force),
            ..Imu::default()
        })
    }

    /// Zero-velocity measurement of a contact at `made` on the foot's clock. The variance follows from
    /// probability and rate with the [default settings](VelocityParams::DEFAULT); the measurement carries no
    /// information if the contact is invalid or the rate unknown. The angular part never carries information.
    pub(crate) fn velocity(
        &self,
        contact: &Contact,
        made: Timestamp,
    ) -> TwistWithCovarianceStamped {
        const COEFFICIENTS: VelocityCoefficients =
            VelocityCoefficients::new(&VelocityParams::DEFAULT);
        let sigma = match self.rate {
            Some((rate, at)) if contact.valid && is_near(at, made) => {
                COEFFICIENTS.sigma(contact.p_stable, rate, Flags::NONE)
            }
            _ => VelocitySigma::MOST,
        };
        zero_velocity(&contact.header, sigma)
    }

    pub(crate) fn raw(&mut self, raw: &RawSample, at: Timestamp) -> Option<Imu> {
        let stamp = self.clock.time(raw.timestamp, at);
        let scaled = |codes: [i16; 3], scale: f32| {
            let [x, y, z] = codes.map(|code| f64::from(code) * f64::from(scale));
            Vector3 { x, y, z }
        };
        // An invalid sample was not read from the sensor.
        (!matches!(raw.validity, Validity::Invalid)).then(|| Imu {
            header: self.header(stamp),
            orientation_covariance: ABSENT,
            angular_velocity: scaled(raw.rate, raw.rate_scale),
            linear_acceleration: scaled(raw.acceleration, raw.acceleration_scale),
            ..Imu::default()
        })
    }

    pub(crate) fn diagnostics(&mut self, at: Timestamp) -> DiagnosticArray {
        self.diagnosed_us = Some(at.as_micros());
        let level = if self.is_silent {
            Level::Stale
        } else if self.is_shared || self.faults.void_estimate() {
            Level::Error
        } else if self.faults.is_empty() {
            Level::Ok
        } else {
            Level::Warn
        };
        let silent = self.is_silent.then_some(SILENT);
        let shared = self.is_shared.then_some(SEVERAL_BOARDS);
        let faults = self.faults.iter().map(Fault::name);
        let names: Vec<_> = silent.into_iter().chain(shared).chain(faults).collect();
        let message = if names.is_empty() {
            "no fault".to_owned()
        } else {
            names.join(", ")
        };
        let status = DiagnosticStatus {
            level,
            name: format!("footfall: {}", self.name),
            message,
            hardware_id: self.topics.hardware.as_ref().to_owned(),
            values: self.counts.clone(),
        };
        DiagnosticArray {
            header: self.header(at),
            status: vec![status],
        }
    }

    /// Condition whose change is reported in diagnostics at once.
    pub(crate) const fn condition(&self) -> (Faults, bool, bool) {
        (self.faults, self.is_silent, self.is_shared)
    }

    pub(crate) fn is_due(&self, at: Timestamp) -> bool {
        let since = |before: u64| at.as_micros().saturating_sub(before);
        self.diagnosed_us
            .is_none_or(|before| since(before) >= DIAGNOSTIC_US)
    }
}

/// Number of a phase in [`Contact`].
#[must_use]
pub const fn state(phase: Phase) -> u8 {
    match phase {
        Phase::Unknown => 0,
        Phase::Stance => 1,
        Phase::Slip => 2,
        Phase::Swing => 3,
        Phase::QuietSwing => 4,
    }
}

/// Zero velocity with this standard deviation in each direction; the angular part carries no information.
pub(crate) fn zero_velocity(
    header: &Header,
    VelocitySigma(sigma): VelocitySigma,
) -> TwistWithCovarianceStamped {
    let mut twist = TwistWithCovariance::default();
    for (axis, row) in twist.covariance.iter_mut().enumerate() {
        let of_axis = if axis < 3 {
            sigma
        } else {
            VelocitySigma::MOST.0
        };
        row[axis] = f64::from(of_axis).powi(2);
    }
    TwistWithCovarianceStamped {
        header: header.clone(),
        twist,
    }
}

/// Returns whether `earlier` is at most `BESIDE_US` before `time`, both on a foot's clock.
const fn is_near(earlier: Timestamp, time: Timestamp) -> bool {
    matches!(time.as_micros().checked_sub(earlier.as_micros()), Some(age) if age <= BESIDE_US)
}

fn quaternion(q: Orientation) -> Quaternion {
    let [w, x, y, z] = [q.w, q.x, q.y, q.z].map(f64::from);
    Quaternion { x, y, z, w }
}

pub(crate) fn vector(v: Vec3) -> Vector3 {
    let [x, y, z] = [v.x, v.y, v.z].map(f64::from);
    Vector3 { x, y, z }
}

/// Specific force as measured by an accelerometer: `acceleration` plus gravity, in the frame of the foot.
fn with_gravity(acceleration: Vec3, orientation: Orientation) -> Vector3 {
    let Quaternion { x, y, z, w } = quaternion(orientation);
    let Vector3 {
        x: ax,
        y: ay,
        z: az,
    } = vector(acceleration);
    // Third row of the rotation: world z in the frame of the foot.
    Vector3 {
        x: ax + GRAVITY * 2.0 * (x * z - w * y),
        y: ay + GRAVITY * 2.0 * (y * z + w * x),
        z: az + GRAVITY * (1.0 - 2.0 * (x * x + y * y)),
    }
}
