//! Conversion of streaming feet to messages on topics.
//!
//! | topic | message | from |
//! |---|---|---|
//! | `/footfall/FL/contact` | `footfall_msgs/msg/Contact` | each contact |
//! | `/footfall/FL/contact/probability` | `std_msgs/msg/Float64`: P alone | each contact; 0 if invalid, because a number cannot express validity |
//! | `/footfall/FL/velocity` | `geometry_msgs/msg/TwistWithCovarianceStamped` | each contact: zero, with the default variance of the [zero-velocity measurement](estimator_core::velocity); 10⁴ (m/s)² if there is no information |
//! | `/footfall/FL/load` | `std_msgs/msg/Float64`, N | each load that the robot sends to the foot over CAN, and each that a recording has with a sample; NaN once it is no longer known |
//! | `/footfall/FL/imu` | `sensor_msgs/msg/Imu` | each raw sample of a serial line, and each sample of a recording with gravity as it was recorded; on CAN each acceleration, with the newest orientation and rate, which are up to 20 ms older: for display, not for integration |
//! | `/diagnostics` | `diagnostic_msgs/msg/DiagnosticArray` | health and faults, at once on a change, otherwise once a second |
//!
//! Stamps are the times of the samples on the receiver's clock: by numbered SYNCs if the foot has reported
//! one, otherwise by the least delay of the last seconds ([`FootClock`](feet::foot_clock::FootClock)).
//!
//! If a node publishes the contacts of feet whose IMUs are topics of ROS 2, the feet get no second topic of their
//! samples. Implausible samples, such as samples of a wrong unit, are warnings in diagnostics.
//!
//! A foot without a contact for half a second is silent: its probability is 0, and diagnostics report it.
//! Contacts of several boards with the same id ([`NewestSecond`](feet::NewestSecond)) carry no information:
//! they are invalid, their probability is 0, no IMU is published, and diagnostics report the cause.

use std::collections::BTreeMap;

use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::velocity::{VelocityCoefficients, VelocityParams};
use estimator_core::{
    Decision, Flags, ImuSample, PerAxis, Phase, Quaternion as Orientation, Timestamp, Validity,
    Vec3, VelocitySigma,
};
use feet::decode::ContactRow;
use feet::decode::live::{FootMessage, MessageBody};
use feet::feed::FeedEvent;
use feet::link::Remark;
use feet::session::SEVERAL_BOARDS;
use feet::{LiveFoot, Session, Update};
use samples::phase_code;
use wire::uart::RawMessage;
use wire::{Counter, Fault, Faults};

use crate::ros::compat::{AllFeet, Body};
use crate::ros::message::{
    ABSENT, DiagnosticArray, DiagnosticStatus, Imu, KeyValue, Level, RosContact, RosMessage,
    TwistWithCovarianceStamped, vector, zero_velocity,
};
use crate::ros::topics::{DIAGNOSTICS, FootTopics, NODE, Published};
use crate::words::in_words;

/// Diagnostic message of a foot without contacts.
pub const SILENT: &str = "silent: no contact for half a second";

/// Standard gravity as the estimator subtracts it, m/s².
const GRAVITY: f64 = STANDARD_GRAVITY as f64;

/// Period of a foot's diagnostics if nothing changes, µs.
const DIAGNOSTIC_US: u64 = 1_000_000;

/// Maximum age of an orientation or a rate combined with an acceleration, µs; by default they are sent every
/// 20 ms.
const BESIDE_US: u64 = 25_000;

/// Variance of an unknown value.
const UNKNOWN: f64 = 1.0e4;

/// Standard deviation of inclination, rad: 2°. In all recordings of BROAD but one, 95 % of the errors are smaller
/// (docs/reference/evaluation.md).
const INCLINATION_SIGMA: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// Covariance of an orientation about x, y and z of the world. About z it is unknown, because the heading is arbitrary.
const ORIENTATION: [f64; 9] = diagonal([
    INCLINATION_SIGMA * INCLINATION_SIGMA,
    INCLINATION_SIGMA * INCLINATION_SIGMA,
    UNKNOWN,
]);

/// Converter of the updates of a session to messages.
#[derive(Debug)]
pub struct Bridge {
    frame: String,
    /// Feet, by their index in the session.
    feet: BTreeMap<usize, FootMessages>,
    /// Combined messages of all feet for other programs.
    all_feet: Option<AllFeet>,
    /// Implausible properties of the samples of feet, by their names.
    findings: BTreeMap<String, Vec<String>>,
    /// Whether samples are published.
    has_imu: bool,
}

impl Bridge {
    /// Creates a bridge. `frame` is the pattern of frame names, in which `{foot}` is replaced by the foot's name;
    /// `all_feet` makes messages of all feet for other programs.
    #[must_use]
    pub fn new(frame: &str, all_feet: Option<AllFeet>) -> Self {
        let frame = frame.to_owned();
        Self { frame, feet: BTreeMap::new(), all_feet, findings: BTreeMap::new(), has_imu: true }
    }

    /// Publishes no samples of the IMUs, because other topics have them.
    #[must_use]
    pub fn without_imu(self) -> Self {
        Self { has_imu: false, ..self }
    }

    /// Returns the body whose feet the combined messages describe.
    #[must_use]
    pub fn body(&self) -> Body {
        self.all_feet.as_ref().map_or_else(Body::default, AllFeet::body)
    }

    /// Names of feet that combined messages have no place for.
    pub fn without_place(&self) -> impl Iterator<Item = &str> {
        let all_feet = self.all_feet.iter();
        all_feet.flat_map(|feet| feet.others.iter().map(String::as_str))
    }

    /// Names of feet that have sent no contact, without which there are no combined messages.
    #[must_use]
    pub fn absent(&self, session: &Session) -> Vec<&'static str> {
        let all_feet = self.all_feet.as_ref();
        all_feet.map_or_else(Vec::new, |feet| feet.absent(session.listening().us()))
    }

    /// Returns the messages for the newest update of a session.
    pub fn messages(&mut self, session: &Session, update: &Update) -> Vec<Published> {
        let listening = session.listening();
        let mut published = Vec::new();
        let (at, contact) = match update {
            Update::Message(foot, heard) => {
                let contact =
                    self.add_messages_of_foot(*foot, &session.feet()[*foot], heard, &mut published);
                (heard.at, contact)
            }
            Update::Quiet(now) => (*now, None),
            Update::Line(event) => {
                if let FeedEvent::Remark(Remark::Implausible(foot, finding)) = event {
                    let finding = in_words(finding);
                    let mut feet = self.feet.values_mut();
                    if let Some(known) = feet.find(|known| *known.name == **foot) {
                        known.findings.push(finding.clone());
                    }
                    self.findings.entry(foot.to_string()).or_default().push(finding);
                }
                return published;
            }
        };
        if let Some(all_feet) = &mut self.all_feet {
            published.extend(match contact {
                Some(contact) => all_feet.take(&contact, at, listening.us()),
                None => all_feet.advance(at, listening.us()),
            });
        }
        published.extend(self.silent(session, listening.us(), at));
        published
    }

    /// Adds the messages of a foot; returns its contact, if it has sent one.
    fn add_messages_of_foot(
        &mut self,
        index: usize,
        state: &LiveFoot,
        FootMessage { at, body, .. }: &FootMessage,
        published: &mut Vec<Published>,
    ) -> Option<RosContact> {
        let made = || FootMessages {
            findings: self.findings.get(&*state.name_or(NODE)).cloned().unwrap_or_default(),
            ..FootMessages::new(state, &self.frame)
        };
        let foot = self.feet.entry(index).or_insert_with(made);
        if foot.node != state.key.node {
            // The id of a foot on a serial line has become known. Until then its topics have the name of the line.
            *foot = made();
        }
        let mut publish = |topic, message| published.push(Published::new(topic, *at, message));
        let (mut sent, mut imu) = (None, None);
        match body {
            MessageBody::Contact(row) => {
                let contact;
                (contact, imu) = foot.contact(row, state);
                sent = Some(contact.clone());
                let probability = RosMessage::probability(&contact);
                let velocity = RosMessage::Velocity(Box::new(foot.velocity(&contact, row)));
                publish(&foot.topics.contact, RosMessage::Contact(contact));
                publish(&foot.topics.velocity, velocity);
                publish(&foot.topics.probability, probability);
                if let Some(load) = row.load {
                    publish(&foot.topics.load, RosMessage::number(load));
                }
            }
            MessageBody::Raw(raw) => imu = foot.raw(raw, state.stamp),
            MessageBody::Load(newtons) => publish(&foot.topics.load, RosMessage::number(*newtons)),
            _ => {}
        }
        if let Some(imu) = imu.filter(|_| self.has_imu) {
            publish(&foot.topics.imu, RosMessage::Imu(Box::new(imu)));
        }
        published.extend(foot.diagnostics(state, *at));
        sent
    }

    /// Returns the messages due at the end of reception, which report all feet as silent.
    pub fn end(&mut self, session: &Session) -> Vec<Published> {
        let listening = session.listening();
        let all_feet = self.all_feet.as_mut();
        let due = all_feet.map(|feet| feet.end(listening.now()));
        let mut published = due.unwrap_or_default();
        published.extend(self.silent(session, u64::MAX, listening.now()));
        published
    }

    /// Returns the messages of feet that are silent at `listened_us`, which are due at once and then once a second.
    fn silent(&mut self, session: &Session, listened_us: u64, at: Timestamp) -> Vec<Published> {
        let mut published = Vec::new();
        let feet = self.feet.iter_mut();
        let feet = feet.map(|(index, foot)| (&session.feet()[*index], foot));
        let silent = feet.filter(|(state, _)| state.has_fallen_silent(listened_us));
        let mut silent: Vec<_> = silent.collect();
        silent.sort_by_key(|(state, _)| (&state.key, &state.name));
        for (state, foot) in silent {
            if !foot.is_silent {
                foot.is_silent = true;
                let nothing = RosMessage::number(0.0);
                published.push(Published::new(&foot.topics.probability, at, nothing));
            }
            published.extend(foot.diagnostics(state, at));
        }
        published
    }
}

/// Condition of a foot whose change is reported in diagnostics at once: faults, silence, several boards, number of findings.
type Condition = (Faults, bool, bool, usize);

/// Messages of a streaming foot.
#[derive(Debug)]
struct FootMessages {
    topics: FootTopics,
    name: String,
    /// Node id for which the topics were created.
    node: Option<u8>,
    /// Whether silence was reported.
    is_silent: bool,
    /// Time and condition of the newest diagnostics.
    diagnosed: Option<(Timestamp, Condition)>,
    /// Newest orientation and rate, with their times on the foot's clock.
    orientation: Option<(Orientation, Timestamp)>,
    rate: Option<(Vec3, Timestamp)>,
    /// Implausible properties of its samples.
    findings: Vec<String>,
}

impl FootMessages {
    fn new(state: &LiveFoot, frame: &str) -> Self {
        let name = state.name_or(NODE);
        Self {
            topics: FootTopics::with_frame(&name, frame),
            name: name.into_owned(),
            node: state.key.node,
            is_silent: false,
            diagnosed: None,
            orientation: None,
            rate: None,
            findings: Vec::new(),
        }
    }

    /// Returns the message of a contact, and of the IMU if the contact has its values.
    fn contact(&mut self, row: &ContactRow, foot: &LiveFoot) -> (RosContact, Option<Imu>) {
        self.is_silent = false;
        let stamp = foot.stamp;
        let health = foot.health.unwrap_or_default();
        let axes = row.axes.map(PerAxis::to_array);
        let mut header = self.topics.header(stamp);
        header.stamp = header.stamp.plus_ns(row.rest_ns);
        let contact = RosContact {
            header,
            foot: self.name.clone(),
            node: row.node.map_or(0, wire::NodeId::get),
            p_stable: row.stable,
            p_tangential: row.tangential,
            p_vertical: row.vertical,
            p_axes: axes.unwrap_or([f32::NAN; 6]),
            decision: row.status.decision() == Decision::Stable,
            state: phase_code(row.status.phase()),
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
                state: phase_code(Phase::Unknown),
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

    /// Returns a recorded sample with the estimated orientation; `None` if the sample is invalid or NaN.
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

    /// Returns the message of a sample. The covariances of rate and acceleration are 0, which means unknown.
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

    /// Returns the zero-velocity measurement of a contact. Its variance comes from the row; without one, it follows
    /// from probability and rate with the [default settings](VelocityParams::DEFAULT). The measurement carries no
    /// information if the contact is invalid or the rate is unknown. The angular part never carries information.
    fn velocity(&self, contact: &RosContact, row: &ContactRow) -> TwistWithCovarianceStamped {
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

    /// Returns the message of a raw sample; `None` if the sample is invalid.
    fn raw(&self, raw: &RawMessage, stamp: Timestamp) -> Option<Imu> {
        let scaled =
            |codes: [i16; 3], scale: f32| codes.map(|code| f64::from(code) * f64::from(scale));
        // The values of an invalid sample are not readings of the sensor.
        let rate = scaled(raw.rate, raw.rate_scale);
        let force = scaled(raw.acceleration, raw.acceleration_scale);
        let is_valid = !matches!(raw.validity, Validity::Invalid);
        is_valid.then(|| with_noise(self.imu(stamp, None, rate, force)))
    }

    /// Returns the diagnostics if they are due at `at`, because the condition has changed or a second has passed.
    fn diagnostics(&mut self, foot: &LiveFoot, at: Timestamp) -> Option<Published> {
        let is_shared = foot.is_of_several_boards();
        let condition = (foot.faults, self.is_silent, is_shared, self.findings.len());
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
        } else if foot.faults.is_empty() && self.findings.is_empty() {
            Level::Ok
        } else {
            Level::Warn
        };
        let silent = self.is_silent.then_some(SILENT);
        let shared = is_shared.then_some(SEVERAL_BOARDS);
        let faults = foot.faults.iter().map(Fault::name);
        let mut names: Vec<&str> = silent.into_iter().chain(shared).chain(faults).collect();
        names.extend(self.findings.iter().map(String::as_str));
        let message = match &names[..] {
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

/// Returns the counters of the board; on CAN, the number of dropped frames.
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

/// Returns whether `earlier` is at most `BESIDE_US` before `time`, both on a foot's clock.
const fn is_near(earlier: Timestamp, time: Timestamp) -> bool {
    matches!(time.as_micros().checked_sub(earlier.as_micros()), Some(age) if age <= BESIDE_US)
}

fn quaternion(q: Orientation) -> [f64; 4] {
    [q.x, q.y, q.z, q.w].map(f64::from)
}

/// Returns the specific force that an accelerometer measures: `acceleration` plus gravity, in the frame of the foot.
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

const fn diagonal([x, y, z]: [f64; 3]) -> [f64; 9] {
    [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z]
}

/// Sets the covariances of rate and acceleration to the noise of the board's sensor with its default settings. They are
/// zero, which means unknown, if the sensor's data sheet does not state the noise.
fn with_noise(imu: Imu) -> Imu {
    let noise = lsm6dsox::Config::FRESH_KILOHERTZ.noise();
    let covariance = |sigma: Option<f32>| diagonal([f64::from(sigma.unwrap_or(0.0)).powi(2); 3]);
    Imu {
        angular_velocity_covariance: covariance(noise.angular_rate),
        linear_acceleration_covariance: covariance(noise.specific_force),
        ..imu
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use feet::decode::KnownFeet;
    use feet::feed::FeedEvent;
    use feet::{Arrival, Feed};
    use wire::{CanFrame, NodeId};

    use super::*;
    use crate::ros::compat::Compat;
    use crate::ros::topics::FRAME;

    /// Messages of a robot with two feet. The right one has the id `right`.
    fn messages(right: NodeId) -> Vec<Published> {
        let source = "feet=2,speed=max,seconds=3".parse::<simulated_robot::Demo>();
        let feed = Feed::open(source.expect("a source"));
        let (mut session, mut bridge) =
            (Session::new(KnownFeet::default()), Bridge::new(FRAME, None));
        let mut published = Vec::new();
        loop {
            let mut fed = feed.next(Duration::from_secs(600)).expect("it ends");
            if let FeedEvent::Arrived((_, Arrival::Frame { frame, .. })) = &mut fed {
                let own = u16::from(wire::Foot::Right.default_node_id().get());
                if frame.id() & 0x7F == own {
                    let id = frame.id() - own + u16::from(right.get());
                    *frame = CanFrame::new(id, frame.data()).expect("a frame");
                }
            }
            session.take(fed);
            while let Some(update) = session.next_update() {
                if let Update::Line(FeedEvent::Ended(_)) = update {
                    return published;
                }
                published.extend(bridge.messages(&session, &update));
            }
        }
    }

    fn contacts(published: &[Published]) -> impl Iterator<Item = &RosContact> {
        published.iter().filter_map(|published| match &published.message {
            RosMessage::Contact(contact) => Some(contact),
            _ => None,
        })
    }

    /// Returns for each diagnostic message whether it reports several boards.
    fn diagnoses(published: &[Published]) -> Vec<bool> {
        let of = |published: &Published| match &published.message {
            RosMessage::Diagnostics(array) => {
                let status = array.status.first()?;
                let says = status.message.contains(SEVERAL_BOARDS);
                assert_eq!(says, matches!(status.level, Level::Error));
                Some(says)
            }
            _ => None,
        };
        published.iter().filter_map(of).collect()
    }

    #[test]
    fn boards_sharing_an_id_become_invalid_within_100_ms() {
        let published = messages(wire::Foot::Left.default_node_id());
        let all: Vec<_> = contacts(&published).collect();
        assert!(all.len() > 5000, "{}", all.len());
        for contact in &all[200..] {
            assert!(!contact.valid && !contact.decision, "{contact:?}");
            assert_eq!((contact.p_stable, contact.state), (0.0, 0));
        }
        let diagnoses = diagnoses(&published);
        assert_eq!(diagnoses.first(), Some(&false));
        assert!(diagnoses[1..].iter().all(|several| *several), "{diagnoses:?}");
    }

    #[test]
    fn probability_is_0_for_invalid_contacts() {
        let published = messages(wire::Foot::Right.default_node_id());
        let numbers = published.iter().filter_map(|published| match published.message {
            RosMessage::Number(number) if published.topic.ends_with("probability") => Some(number),
            _ => None,
        });
        let mut doubtful = 0;
        for (contact, number) in contacts(&published).zip(numbers) {
            if contact.valid {
                assert_eq!(number, f64::from(contact.p_stable));
            } else {
                doubtful += usize::from(contact.p_stable > 0.0);
                assert_eq!(number, 0.0, "{contact:?}");
            }
        }
        assert!(doubtful > 100, "{doubtful}");
    }

    #[test]
    fn velocity_is_uninformative_for_invalid_contacts() {
        let published = messages(wire::Foot::Right.default_node_id());
        let velocities = published.iter().filter_map(|published| match &published.message {
            RosMessage::Velocity(velocity) => Some(velocity),
            _ => None,
        });
        let mut precise = 0;
        for (contact, velocity) in contacts(&published).zip(velocities) {
            let variance = velocity.covariance[0][0];
            assert_eq!(velocity.twist, [0.0; 6]);
            assert!(variance > 0.0 && variance <= 1.0e4, "{variance}");
            if contact.valid {
                precise += usize::from(variance < 0.1 * 0.1);
            } else {
                assert_eq!(variance, 1.0e4, "{contact:?}");
            }
        }
        assert!(precise > 1000, "{precise}");
    }

    #[test]
    fn boards_with_different_ids_stay_valid() {
        let published = messages(wire::Foot::Right.default_node_id());
        assert!(contacts(&published).any(|contact| contact.valid && contact.p_stable > 0.5));
        assert!(!diagnoses(&published).contains(&true));
    }

    /// Formats the messages published after the last contact of a foot.
    fn last_words(published: &[Published]) -> Vec<String> {
        let words = published.iter().map(|published| match &published.message {
            RosMessage::Number(number) => format!("{} {number}", published.topic),
            RosMessage::Diagnostics(array) => array.status[0].message.clone(),
            RosMessage::Bool(stands) => format!("{} {stands}", published.topic),
            other => panic!("{other:?}"),
        });
        words.collect()
    }

    #[test]
    fn silent_foot_is_reported_once_a_second_with_probability_0() {
        let mut session = Session::new(KnownFeet::default());
        let decisions = AllFeet::new(&[Compat::Bool], 1.0).expect("one body");
        let mut bridge = Bridge::new(FRAME, Some(decisions));
        let mut next = |session: &mut Session| -> Vec<Published> {
            let updates = std::iter::from_fn(|| {
                let update = session.next_update()?;
                Some(bridge.messages(session, &update))
            });
            updates.flatten().collect()
        };
        let contact = |session: &mut Session, ms: u64| {
            let at = Timestamp::from_micros(1000 * ms);
            let row =
                ContactRow { timestamp: at, foot: Some("FL".into()), ..ContactRow::default() };
            session.take(FeedEvent::Arrived((at, Arrival::Estimate(Box::new(row)))));
        };
        for ms in 0..100 {
            contact(&mut session, ms);
            next(&mut session);
        }
        let mut idle = |from_ms: u64, to_ms: u64| -> Vec<(u64, String)> {
            let times = (from_ms..to_ms).step_by(20);
            let words = times.flat_map(|ms| {
                session.idle(Duration::from_millis(ms - 99));
                last_words(&next(&mut session)).into_iter().map(move |words| (ms, words))
            });
            words.collect()
        };
        let does_not_stand = "/footfall/FL/contact/decision false";
        let all = idle(110, 2000);
        let decisions = all.iter().filter(|(_, words)| words == does_not_stand);
        assert_eq!(decisions.count(), 95);
        let rest: Vec<_> = all.iter().filter(|(_, words)| words != does_not_stand).collect();
        let number = "/footfall/FL/contact/probability 0".to_owned();
        let expected = [(610, number), (610, SILENT.to_owned()), (1610, SILENT.to_owned())];
        assert!(rest.iter().copied().eq(&expected), "{rest:?}");
        contact(&mut session, 2000);
        let back = next(&mut session);
        let said = back.iter().filter_map(|published| match &published.message {
            RosMessage::Diagnostics(array) => Some(array.status[0].message.as_str()),
            _ => None,
        });
        assert!(said.eq(["no fault"]));
        let last = last_words(&bridge.end(&session));
        assert_eq!(last.len(), 3, "{last:?}");
        assert_eq!((last[0].as_str(), last[2].as_str()), (does_not_stand, SILENT));
    }
}
