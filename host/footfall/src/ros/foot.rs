//! Messages of a foot while it streams.

use estimator_core::{
    Decision, Flags, ImuSample, PerAxis, Phase, Quaternion as Orientation, Timestamp, Validity,
    Vec3, VelocityCoefficients, VelocityParams, VelocitySigma,
};
use feet::LiveFoot;
use feet::decode::ContactRow;
use feet::session::SEVERAL_BOARDS;
use recordings::samples::phase::code_of;
use recordings::samples::space::components;
use wire::uart::RawSample;
use wire::{Counter, Fault, Faults};

use crate::ros::message::{
    DiagnosticArray, DiagnosticStatus, Header, Imu, KeyValue, Level, RosContact, RosMessage,
    TwistWithCovarianceStamped,
};
use crate::ros::published::Published;
use crate::ros::topics::{DIAGNOSTICS, FootTopics, NODE};

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.806_65;

/// Period of a foot's diagnostics if nothing changes, µs.
const DIAGNOSTIC_US: u64 = 1_000_000;

/// Maximum age of an orientation or a rate combined with an acceleration, µs; by default they are sent every
/// 20 ms.
const BESIDE_US: u64 = 25_000;

/// Diagnostic message of a foot without contacts.
pub const SILENT: &str = "silent: no contact for half a second";

/// Covariance that marks a missing value.
pub(crate) const ABSENT: [f64; 9] = [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];

/// Variance of a value about which nothing is known.
const UNKNOWN: f64 = 1.0e4;

/// Standard deviation of inclination, rad: 2°, within which it is in 95 % of each recording of BROAD but one
/// (docs/evaluation.md).
const INCLINATION_SIGMA: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Covariance of an orientation about x, y and z of the world: the heading is arbitrary.
const ORIENTATION: [f64; 9] = diagonal([
    INCLINATION_SIGMA * INCLINATION_SIGMA,
    INCLINATION_SIGMA * INCLINATION_SIGMA,
    UNKNOWN,
]);

const fn diagonal([x, y, z]: [f64; 3]) -> [f64; 9] {
    [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z]
}

/// Sets the covariances of rate and acceleration: of the noise of the board's sensor with its default settings. Zeros,
/// which stand for unknown, of a part that it does not state.
fn with_noise(imu: Imu) -> Imu {
    let noise = lsm6dsox::Config::FRESH_KILOHERTZ.noise();
    let covariance = |sigma: Option<f32>| diagonal([f64::from(sigma.unwrap_or(0.0)).powi(2); 3]);
    Imu {
        angular_velocity_covariance: covariance(noise.angular_rate),
        linear_acceleration_covariance: covariance(noise.specific_force),
        ..imu
    }
}

/// Condition of a foot whose change is reported in diagnostics at once: faults, silence, several boards.
type Condition = (Faults, bool, bool);

/// State of the messages of a foot.
#[derive(Debug)]
pub(crate) struct Foot {
    pub(crate) topics: FootTopics,
    name: String,
    /// Node id for which the topics were created.
    pub(crate) node: Option<u8>,
    /// Whether silence was reported.
    pub(crate) is_silent: bool,
    /// Time and condition of the newest diagnostics.
    diagnosed: Option<(Timestamp, Condition)>,
    /// Newest orientation and rate, with their times on the foot's clock.
    orientation: Option<(Orientation, Timestamp)>,
    rate: Option<(Vec3, Timestamp)>,
}

impl Foot {
    pub(crate) fn new(state: &LiveFoot, frame: &str) -> Self {
        let name = state.name_or(NODE);
        Self {
            topics: FootTopics::with_frame(&name, frame),
            name: name.into_owned(),
            node: state.key.node,
            is_silent: false,
            diagnosed: None,
            orientation: None,
            rate: None,
        }
    }

    pub(crate) fn contact(
        &mut self,
        row: &ContactRow,
        foot: &LiveFoot,
    ) -> (RosContact, Option<Imu>) {
        self.is_silent = false;
        let stamp = foot.stamp;
        let health = foot.health.unwrap_or_default();
        let axes = row.axes.map(PerAxis::to_array);
        let contact = RosContact {
            header: self.topics.header(stamp),
            foot: self.name.clone(),
            node: row.node.map_or(0, wire::NodeId::get),
            p_stable: row.stable,
            p_tangential: row.tangential,
            p_vertical: row.vertical,
            p_axes: axes.unwrap_or([f32::NAN; 6]),
            decision: row.status.decision() == Decision::Stable,
            state: code_of(row.status.phase()),
            valid: row.status.is_valid(),
            flags: row.flags.unwrap_or(health.flags),
            sequence: row.sequence,
        };
        if foot.is_of_several_boards() {
            let contact = RosContact {
                p_stable: 0.0,
                p_tangential: 0.0,
                p_vertical: 0.0,
                p_axes: [f32::NAN; 6],
                decision: false,
                state: code_of(Phase::Unknown),
                valid: false,
                ..contact
            };
            return (contact, None);
        }
        let made = row.timestamp;
        self.orientation = row.orientation.map(|q| (q, made)).or(self.orientation);
        self.rate = row.rate.map(|rate| (rate, made)).or(self.rate);
        if let Some(sample) = &row.measured {
            let [made_us, taken_us] = [made, sample.timestamp].map(Timestamp::as_micros);
            let age_us = made_us.saturating_sub(taken_us);
            let taken = Timestamp::from_micros(stamp.as_micros().saturating_sub(age_us));
            return (contact, self.recorded(sample, row.orientation, taken));
        }
        let imu = match (row.acceleration, self.orientation, self.rate) {
            (Some(acceleration), Some((orientation, first)), Some((rate, second)))
                if is_near(first, made) && is_near(second, made) =>
            {
                let force = with_gravity(acceleration, orientation);
                Some(with_noise(self.imu(stamp, Some(orientation), vector(rate), force)))
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
        is_usable.then(|| self.imu(stamp, orientation, vector(rate), vector(force)))
    }

    /// Message of a sample, with covariances of rate and acceleration that stand for unknown.
    fn imu(
        &self,
        stamp: Timestamp,
        orientation: Option<Orientation>,
        angular_velocity: [f64; 3],
        linear_acceleration: [f64; 3],
    ) -> Imu {
        Imu {
            header: self.topics.header(stamp),
            orientation: orientation.map(quaternion).unwrap_or_default(),
            orientation_covariance: orientation.map_or(ABSENT, |_| ORIENTATION),
            angular_velocity,
            linear_acceleration,
            ..Imu::default()
        }
    }

    /// Zero-velocity measurement of a contact. The variance is that of its row, else it follows from
    /// probability and rate with the [default settings](VelocityParams::DEFAULT); the measurement carries no
    /// information if the contact is invalid or the rate unknown. The angular part never carries information.
    pub(crate) fn velocity(
        &self,
        contact: &RosContact,
        row: &ContactRow,
    ) -> TwistWithCovarianceStamped {
        const COEFFICIENTS: VelocityCoefficients =
            VelocityCoefficients::new(&VelocityParams::DEFAULT);
        let sigma = match (row.velocity_sigma, self.rate) {
            (Some(sigma), _) => VelocitySigma(sigma),
            (None, Some((rate, at))) if contact.valid && is_near(at, row.timestamp) => {
                COEFFICIENTS.sigma(contact.p_stable, rate, Flags::NONE)
            }
            _ => VelocitySigma::MOST,
        };
        zero_velocity(&contact.header, sigma)
    }

    pub(crate) fn raw(&self, raw: &RawSample, stamp: Timestamp) -> Option<Imu> {
        let scaled =
            |codes: [i16; 3], scale: f32| codes.map(|code| f64::from(code) * f64::from(scale));
        // An invalid sample was not read from the sensor.
        let rate = scaled(raw.rate, raw.rate_scale);
        let force = scaled(raw.acceleration, raw.acceleration_scale);
        let is_valid = !matches!(raw.validity, Validity::Invalid);
        is_valid.then(|| with_noise(self.imu(stamp, None, rate, force)))
    }

    /// Returns the diagnostics if they are due at `at`: the condition has changed, or a second has passed.
    pub(crate) fn diagnostics(&mut self, foot: &LiveFoot, at: Timestamp) -> Option<Published> {
        let is_shared = foot.is_of_several_boards();
        let condition = (foot.faults, self.is_silent, is_shared);
        let since_us = |before: Timestamp| at.as_micros().saturating_sub(before.as_micros());
        if let Some((before, reported)) = self.diagnosed
            && reported == condition
            && since_us(before) < DIAGNOSTIC_US
        {
            return None;
        }
        self.diagnosed = Some((at, condition));
        let level = if self.is_silent {
            Level::Stale
        } else if is_shared || foot.faults.void_estimate() {
            Level::Error
        } else if foot.faults.is_empty() {
            Level::Ok
        } else {
            Level::Warn
        };
        let silent = self.is_silent.then_some(SILENT);
        let shared = is_shared.then_some(SEVERAL_BOARDS);
        let faults = foot.faults.iter().map(Fault::name);
        let names = silent.into_iter().chain(shared).chain(faults);
        let message = match &names.collect::<Vec<_>>()[..] {
            [] => "no fault".to_owned(),
            names => names.join(", "),
        };
        let status = DiagnosticStatus {
            level,
            name: format!("footfall: {}", self.name),
            message,
            hardware_id: self.topics.hardware.to_string(),
            values: counts(foot),
        };
        let message = RosMessage::Diagnostics(DiagnosticArray {
            header: self.topics.header(at),
            status: vec![status],
        });
        Some(Published::new(&DIAGNOSTICS.into(), at, message))
    }
}

/// Counters of the board, or on CAN the number of drops.
fn counts(foot: &LiveFoot) -> Vec<KeyValue> {
    let pair = |key: &str, value: String| KeyValue { key: key.to_owned(), value };
    if let Some(board) = &foot.board {
        let value = |counter| board.counters.get(counter).to_string();
        let count = |counter: Counter| pair(counter.name(), value(counter));
        return Counter::ALL.map(count).into();
    }
    let drops = foot.health.map(|health| health.dropped.to_string());
    Vec::from_iter(drops.map(|count| pair("dropped, modulo 256", count)))
}

/// Zero velocity with this standard deviation in each direction; the angular part carries no information.
pub(crate) fn zero_velocity(
    header: &Header,
    VelocitySigma(sigma): VelocitySigma,
) -> TwistWithCovarianceStamped {
    let mut velocity = TwistWithCovarianceStamped {
        header: header.clone(),
        ..TwistWithCovarianceStamped::default()
    };
    for (axis, row) in velocity.covariance.iter_mut().enumerate() {
        let of_axis = match axis {
            0..3 => sigma,
            _ => VelocitySigma::MOST.0,
        };
        row[axis] = f64::from(of_axis).powi(2);
    }
    velocity
}

/// Returns whether `earlier` is at most `BESIDE_US` before `time`, both on a foot's clock.
const fn is_near(earlier: Timestamp, time: Timestamp) -> bool {
    matches!(time.as_micros().checked_sub(earlier.as_micros()), Some(age) if age <= BESIDE_US)
}

fn quaternion(q: Orientation) -> [f64; 4] {
    [q.x, q.y, q.z, q.w].map(f64::from)
}

pub(crate) fn vector(v: Vec3) -> [f64; 3] {
    components(v).map(f64::from)
}

/// Specific force as measured by an accelerometer: `acceleration` plus gravity, in the frame of the foot.
fn with_gravity(acceleration: Vec3, orientation: Orientation) -> [f64; 3] {
    let [x, y, z, w] = quaternion(orientation);
    let measured = vector(acceleration);
    // Third row of the rotation: world z in the frame of the foot.
    [
        measured[0] + GRAVITY * 2.0 * (x * z - w * y),
        measured[1] + GRAVITY * 2.0 * (y * z + w * x),
        measured[2] + GRAVITY * (1.0 - 2.0 * (x * x + y * y)),
    ]
}
