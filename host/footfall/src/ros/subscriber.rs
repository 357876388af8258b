//! Feet whose IMUs are topics of ROS 2: a line that subscribes to the topics and estimates the feet here.
//!
//! A topic is subscribed to once one of its publishers is found, with the reliability that its publishers offer. If
//! they offer reliability, lost messages are sent again. Otherwise, as with most drivers, messages are received as
//! best effort.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::convert::Infallible;
use std::fmt::Write as _;
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::task::{Wake, Waker};
use std::time::{Duration, Instant};

use bags::Channel;
use bags::live::{ImuDecoder, LoadDecoder, TopicNames, is_low_state, is_trunk, name_topics};
use estimator_core::{Load, Timestamp};
use feet::link::{Arrived, Remark, now};
use feet::{Arrival, Link, LinkError, LiveImu, LiveSample, Sending};
use options::{LoadTopic, matches_pattern};
use rustdds::discovery::DiscoveredWriterData;
use rustdds::no_key::{Decode, DefaultDecoder, DeserializerAdapter, SimpleDataReader};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{
    DomainParticipant, GUID, QosPolicies, QosPolicyBuilder, RepresentationIdentifier, Subscriber,
    TopicKind,
};
use stored::OLDEST_LOAD_US;

use crate::ros::definitions;
use crate::ros::domain::{NodeError, join};
use crate::topic_source::{FootTopic, TopicFeet};
use crate::words::in_words;

/// Type of the messages of an IMU.
const IMU: &str = "sensor_msgs/msg/Imu";

/// Messages of a topic that may wait: four seconds at 1 kHz.
const DEPTH: i32 = 4096;

/// Time between looks for publishers in the first seconds, and after that.
const LOOKS: Duration = Duration::from_millis(50);
const RARE_LOOKS: Duration = Duration::from_millis(500);

/// Time in which publishers are looked for often, and after which topics without one are reported.
const FOUND_WITHIN: Duration = Duration::from_secs(2);

/// Time without another topic after which the topics of a pattern are added.
const SETTLED: Duration = Duration::from_millis(500);

/// Number of changes between two publishers of a topic after which both publishers are reported.
const CHANGES: u32 = 10;

/// A message in CDR, with its encoding in the first four bytes.
pub(super) type Message = Vec<u8>;

/// Reader of messages of any type.
pub(super) type MessageReader = SimpleDataReader<Message, AnyMessage>;

/// Passes messages on without decoding them.
pub(super) struct AnyMessage;

#[derive(Clone)]
pub(super) struct Copied;

impl DeserializerAdapter<Message> for AnyMessage {
    type Error = Infallible;
    type Decoded = Message;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(decoded: Message) -> Message {
        decoded
    }
}

impl DefaultDecoder<Message> for AnyMessage {
    type Decoder = Copied;
    const DECODER: Copied = Copied;
}

impl Decode<'_, Message> for Copied {
    type Error = Infallible;

    fn decode_bytes(
        self,
        bytes: &[u8],
        encoding: RepresentationIdentifier,
    ) -> Result<Message, Infallible> {
        let is_little = encoding == RepresentationIdentifier::CDR_LE;
        let mut message = Vec::with_capacity(4 + bytes.len());
        message.extend([0, u8::from(is_little), 0, 0]);
        message.extend(bytes);
        Ok(message)
    }
}

/// Wakes the thread that waits for messages.
#[derive(Default)]
pub(super) struct Signal {
    is_set: Mutex<bool>,
    changed: Condvar,
}

impl Wake for Signal {
    fn wake(self: Arc<Self>) {
        *self.is_set.lock().unwrap_or_else(PoisonError::into_inner) = true;
        self.changed.notify_one();
    }
}

impl Signal {
    /// Waits for the signal, at most `longest`, and clears it.
    pub(super) fn wait(&self, longest: Duration) {
        let is_set = self.is_set.lock().unwrap_or_else(PoisonError::into_inner);
        let waited = self.changed.wait_timeout_while(is_set, longest, |is_set| !*is_set);
        let (mut is_set, _) = waited.unwrap_or_else(PoisonError::into_inner);
        *is_set = false;
    }
}

/// Quality of service of a subscriber.
fn qos(is_reliable: bool) -> QosPolicies {
    let reliability = if is_reliable {
        Reliability::Reliable { max_blocking_time: rustdds::Duration::ZERO }
    } else {
        Reliability::BestEffort
    };
    QosPolicyBuilder::new()
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth: DEPTH })
        .reliability(reliability)
        .build()
}

/// A publisher that was found.
struct Publisher {
    topic: String,
    /// Type of its messages, as in ROS and as in DDS.
    message: String,
    dds_type: String,
    is_reliable: bool,
}

impl Publisher {
    /// Returns the publisher of a writer; `None` if the writer is not of a topic of ROS.
    fn of(writer: &DiscoveredWriterData) -> Option<Self> {
        let data = &writer.publication_topic_data;
        let topic = data.topic_name.strip_prefix("rt")?;
        let message = data.type_name.replace("::dds_::", "::").replace("::", "/");
        Some(Self {
            topic: topic.to_owned(),
            message: message.strip_suffix('_').unwrap_or(&message).to_owned(),
            dds_type: data.type_name.clone(),
            is_reliable: matches!(data.reliability, Some(Reliability::Reliable { .. })),
        })
    }
}

/// Returns the publishers in the domain.
fn publishers(participant: &DomainParticipant) -> Vec<Publisher> {
    participant.discovered_writers().iter().filter_map(Publisher::of).collect()
}

/// A reader of a topic, created once a publisher is found.
pub(super) struct FoundTopic {
    pub(super) reader: MessageReader,
    /// Properties of the topic, as a bag has them.
    pub(super) channel: Channel,
    /// Type of its messages in DDS.
    pub(super) dds_type: String,
    is_reliable: bool,
}

/// Subscribes to a topic if one of its publishers is found.
///
/// # Errors
/// The reader cannot be created.
pub(super) fn subscribe_if_found(
    participant: &DomainParticipant,
    subscriber: &Subscriber,
    topic: &str,
) -> Result<Option<FoundTopic>, NodeError> {
    let found = publishers(participant);
    let mut of_topic = found.iter().filter(|publisher| publisher.topic == topic).peekable();
    let Some(first) = of_topic.peek().copied() else {
        return Ok(None);
    };
    let is_reliable = of_topic.all(|publisher| publisher.is_reliable);
    subscribe(participant, subscriber, first, is_reliable).map(Some)
}

fn subscribe(
    participant: &DomainParticipant,
    subscriber: &Subscriber,
    Publisher { topic, message, dds_type, .. }: &Publisher,
    is_reliable: bool,
) -> Result<FoundTopic, NodeError> {
    let create = NodeError::create(topic);
    let qos = qos(is_reliable);
    let dds_topic =
        participant.create_topic(format!("rt{topic}"), dds_type.clone(), &qos, TopicKind::NoKey);
    let dds_topic = dds_topic.map_err(|error| create(&error))?;
    let reader = subscriber.create_simple_datareader_no_key(&dds_topic, Some(qos));
    let reader = reader.map_err(|error| create(&error))?;
    let channel = Channel {
        topic: topic.clone(),
        message: message.clone(),
        encoding: "cdr".to_owned(),
        schema: definitions::installed(message).map(Arc::new),
        metadata: BTreeMap::new(),
    };
    Ok(FoundTopic { reader, channel, dds_type: dds_type.clone(), is_reliable })
}

/// A line of topics.
pub struct TopicLine {
    wanted: TopicFeet,
    participant: DomainParticipant,
    subscriber: Subscriber,
    signal: Arc<Signal>,
    waker: Waker,
    /// Feet by their topics. The feet of patterns are added once the topics are known.
    feet: Vec<WantedFoot>,
    /// Topics that match a pattern, the topics that were added, and the time of the newest match that is not added yet.
    matched: BTreeSet<String>,
    added: BTreeSet<String>,
    matched_at: Option<Instant>,
    /// Topics of loads, each with the feet whose loads it has.
    loads: Vec<(LoadTopic, String)>,
    topics: Vec<SubscribedTopic>,
    newest_loads: BTreeMap<String, (Timestamp, f64)>,
    pending: VecDeque<Arrived>,
    began: Instant,
    next_look: Instant,
    /// Whether topics without a publisher were reported.
    has_reported_absent: bool,
    /// Whether the robot publishes the state of a Unitree.
    has_low_state: bool,
}

/// A foot that is wanted.
#[derive(Clone, Debug)]
struct WantedFoot {
    name: String,
    /// Whether the name was given.
    is_named: bool,
    topic: String,
    part: String,
}

/// A topic that is subscribed to.
struct SubscribedTopic {
    name: String,
    found: FoundTopic,
    imus: Vec<TopicImu>,
    loads: Vec<TopicLoad>,
    /// Whether a message that cannot be decoded was reported.
    has_reported_message: bool,
    /// Writer of the newest message, and the number of changes between writers while both send.
    writer: Option<GUID>,
    changes: u32,
}

/// IMUs in the messages of a topic, one for each frame.
struct TopicImu {
    foot: WantedFoot,
    decoder: ImuDecoder,
    frames: BTreeMap<String, LiveImu>,
}

struct TopicLoad {
    /// Name of the foot.
    foot: String,
    decoder: LoadDecoder,
}

impl TopicLine {
    /// Joins the domain. Topics are subscribed to as they are found.
    ///
    /// # Errors
    /// The domain cannot be used, a parameter is out of its range, or axes are given for a foot that is not named.
    pub fn open(wanted: &TopicFeet) -> Result<Self, LinkError> {
        let mut pending = VecDeque::new();
        let feet = named_feet(&wanted.feet, &mut pending);
        let names: Vec<&str> = feet.iter().map(|foot| foot.name.as_str()).collect();
        let settings = &wanted.playback.settings;
        // The feet of a pattern are not known yet.
        if !wanted.feet.iter().any(FootTopic::is_pattern) {
            settings.check_axes(&names).map_err(|error| LinkError::Other(Box::new(error)))?;
            let unused = settings.unused_feet(&names).map(Remark::Problem);
            pending.extend(unused.map(|remark| (now(), Arrival::Remark(remark))));
        }
        for foot in &feet {
            // Parameters are checked before the first message.
            new_imu(foot, &foot.name, wanted)?;
        }
        let other = |error: NodeError| LinkError::Other(Box::new(error));
        let participant = join(wanted.domain.id, &wanted.domain.networks).map_err(other)?;
        let subscriber = participant.create_subscriber(&qos(false));
        let subscriber = subscriber.map_err(|error| LinkError::Other(Box::new(error)))?;
        let signal = Arc::new(Signal::default());
        let mut line = Self {
            wanted: wanted.clone(),
            waker: Waker::from(Arc::clone(&signal)),
            signal,
            participant,
            subscriber,
            loads: Vec::new(),
            feet: Vec::new(),
            matched: BTreeSet::new(),
            added: BTreeSet::new(),
            matched_at: None,
            topics: Vec::new(),
            newest_loads: BTreeMap::new(),
            pending,
            began: Instant::now(),
            next_look: Instant::now(),
            has_reported_absent: false,
            has_low_state: false,
        };
        for load in wanted.loads.iter().filter(|load| load.foot.is_some()) {
            let foot = load.foot.clone().unwrap_or_default();
            line.loads.push((load.topic.clone(), foot));
        }
        feet.into_iter().for_each(|foot| line.add_foot(foot));
        Ok(line)
    }

    /// Adds a foot, with its load if a pattern of loads is given.
    fn add_foot(&mut self, foot: WantedFoot) {
        let patterns = self.wanted.loads.iter().filter(|load| load.foot.is_none());
        let loads = patterns.map(|load| (load.topic.of_foot(&foot.name), foot.name.clone()));
        self.loads.extend(loads);
        self.feet.push(foot);
    }

    fn remark(&mut self, remark: Remark) {
        self.pending.push_back((now(), Arrival::Remark(remark)));
    }

    fn problem(&mut self, text: String) {
        self.remark(Remark::Problem(text));
    }

    /// Looks for publishers, and subscribes to the topics that are found.
    fn look(&mut self) -> Result<(), LinkError> {
        let found = publishers(&self.participant);
        let mut of_robot = found.iter().filter(|publisher| !publisher.topic.contains(OWN));
        self.has_low_state |= of_robot.any(|state| is_low_state(&state.message));
        self.match_patterns(&found);
        let wanted: BTreeSet<String> = self
            .feet
            .iter()
            .map(|foot| foot.topic.clone())
            .chain(self.loads.iter().map(|(load, _)| load.topic.clone()))
            .collect();
        for topic in &wanted {
            let of_topic: Vec<&Publisher> =
                found.iter().filter(|publisher| publisher.topic == *topic).collect();
            let Some(first) = of_topic.first() else { continue };
            let is_reliable = of_topic.iter().all(|publisher| publisher.is_reliable);
            let other = of_topic.iter().find(|publisher| publisher.message != first.message);
            match self.topics.iter().position(|subscribed| subscribed.name == *topic) {
                None => self.subscribe(first, is_reliable)?,
                Some(index) if self.topics[index].found.is_reliable && !is_reliable => {
                    self.problem(format!(
                        "{topic}: a publisher of it does not send lost messages again (reliability best_effort), so the \
                         subscription does not ask for it any more"
                    ));
                    let found = subscribe(&self.participant, &self.subscriber, first, false);
                    let found = found.map_err(|error| LinkError::Other(Box::new(error)))?;
                    self.topics[index].found = found;
                }
                Some(_) => {}
            }
            if let Some(other) = other
                && !self.has_reported_absent
            {
                self.problem(format!(
                    "{topic} has publishers of two types, {} and {}: messages of the second are not read",
                    first.message, other.message
                ));
            }
        }
        if !self.has_reported_absent && self.began.elapsed() > FOUND_WITHIN {
            self.has_reported_absent = true;
            self.report_absent(&wanted, &found);
        }
        Ok(())
    }

    /// Collects the topics that match a pattern, and adds their feet once no further topic appears. Drivers may start one
    /// after the other, so topics that appear later are added, too.
    fn match_patterns(&mut self, found: &[Publisher]) {
        let patterns: Vec<&str> = (self.wanted.feet.iter())
            .filter_map(|foot| foot.is_pattern().then_some(foot.topic.as_str()))
            .collect();
        let topics = found.iter().filter(|publisher| publisher.message == IMU);
        let matched: Vec<String> = topics
            .filter(|publisher| patterns.iter().any(|pattern| matches(pattern, &publisher.topic)))
            .map(|publisher| publisher.topic.clone())
            .collect();
        let before = self.matched.len();
        self.matched.extend(matched);
        if self.matched.len() > before {
            self.matched_at = Some(Instant::now());
        }
        if self.matched_at.is_some_and(|at| at.elapsed() >= SETTLED) {
            self.matched_at = None;
            self.add_matched();
        }
    }

    /// Adds the feet of topics that were matched since the last call.
    fn add_matched(&mut self) {
        let new: Vec<String> = self.matched.difference(&self.added).cloned().collect();
        let is_first = self.added.is_empty();
        self.added.clone_from(&self.matched);
        let named = self.feet.iter().map(|foot| foot.topic.clone()).collect::<BTreeSet<_>>();
        let TopicNames { feet, trunks } = name_topics(&self.matched);
        let is_foot_left = !feet.is_empty() || !named.is_empty();
        for topic in trunks.into_iter().filter(|topic| new.contains(topic)) {
            let text = format!(
                "{topic} is left out: by its name it is of the robot's trunk; ros2:NAME={topic} takes it as a foot"
            );
            self.remark(if is_foot_left { Remark::Detail(text) } else { Remark::Problem(text) });
        }
        for (topic, name) in feet {
            if new.contains(&topic) && !named.contains(&topic) {
                // The feet so far keep their names.
                let is_taken = self.feet.iter().any(|foot| foot.name == name);
                let name = if is_taken { topic.trim_matches('/').to_owned() } else { name };
                self.add_foot(WantedFoot { name, is_named: false, topic, part: String::new() });
            }
        }
        if !is_first {
            return;
        }
        let names: Vec<&str> = self.feet.iter().map(|foot| foot.name.as_str()).collect();
        let settings = &self.wanted.playback.settings;
        let unknown = settings.check_axes(&names).err().map(|error| error.to_string());
        let problems: Vec<String> =
            unknown.into_iter().chain(settings.unused_feet(&names)).collect();
        problems.into_iter().for_each(|problem| self.problem(problem));
    }

    fn subscribe(&mut self, publisher: &Publisher, is_reliable: bool) -> Result<(), LinkError> {
        let topic = &publisher.topic;
        let found = subscribe(&self.participant, &self.subscriber, publisher, is_reliable);
        let found = found.map_err(|error| LinkError::Other(Box::new(error)))?;
        let mapping = &self.wanted.playback.input_options.table.mapping;
        let mut problems = Vec::new();
        let mut imus = Vec::new();
        for foot in self.feet.iter().filter(|foot| foot.topic == *topic) {
            match ImuDecoder::of(&found.channel, &foot.part, mapping) {
                Ok(decoder) => {
                    imus.push(TopicImu { foot: foot.clone(), decoder, frames: BTreeMap::new() });
                }
                Err(problem) => problems.push(in_words(&problem)),
            }
        }
        let mut loads = Vec::new();
        for (load, foot) in self.loads.iter().filter(|(load, _)| load.topic == *topic) {
            match LoadDecoder::of(&found.channel, load) {
                Ok(decoder) => loads.push(TopicLoad { foot: foot.clone(), decoder }),
                Err(problem) => problems.push(in_words(&problem)),
            }
        }
        let reliability = if is_reliable { "reliable" } else { "best_effort" };
        self.remark(Remark::Detail(format!(
            "{topic}: {}, reliability {reliability}",
            publisher.message
        )));
        problems.into_iter().for_each(|problem| self.problem(problem));
        self.topics.push(SubscribedTopic {
            name: topic.clone(),
            found,
            imus,
            loads,
            has_reported_message: false,
            writer: None,
            changes: 0,
        });
        Ok(())
    }

    /// Reports topics without a publisher, and lists the published topics.
    fn report_absent(&mut self, wanted: &BTreeSet<String>, found: &[Publisher]) {
        let is_found = |topic: &&String| found.iter().any(|publisher| publisher.topic == **topic);
        let mut absent: Vec<&str> =
            wanted.iter().filter(|topic| !is_found(topic)).map(String::as_str).collect();
        let patterns = self.wanted.feet.iter().filter(|foot| foot.is_pattern());
        if self.matched.is_empty() {
            absent.extend(patterns.map(|pattern| pattern.topic.as_str()));
        }
        if absent.is_empty() {
            return;
        }
        let domain = self.wanted.domain.id;
        let mut text = format!(
            "no publisher of {} was found in domain {domain} for {} s",
            absent.join(", "),
            FOUND_WITHIN.as_secs()
        );
        let imus: BTreeSet<&str> = found
            .iter()
            .filter(|publisher| publisher.message == IMU)
            .map(|publisher| publisher.topic.as_str())
            .collect();
        // Writing to memory does not fail.
        let _ = if found.is_empty() {
            write!(text, ", nor of any other topic: is ROS_DOMAIN_ID the same there?")
        } else if imus.is_empty() {
            write!(text, ", nor of any topic of {IMU}")
        } else {
            let imus: Vec<&str> = imus.into_iter().collect();
            write!(text, "; topics of {IMU} are {}", imus.join(", "))
        };
        self.problem(text);
    }

    /// Takes all messages that have arrived.
    fn take_messages(&mut self) {
        let mut topics = std::mem::take(&mut self.topics);
        // Take the loads before the samples, so that each sample gets the newest load.
        for with_imus in [false, true] {
            let of_kind = |topic: &&mut SubscribedTopic| topic.imus.is_empty() != with_imus;
            for topic in topics.iter_mut().filter(of_kind) {
                topic.found.reader.drain_read_notifications();
                loop {
                    match topic.found.reader.try_take_one() {
                        Ok(None) => break,
                        Ok(Some(change)) => {
                            let writer = change.writer_guid();
                            self.take_message(topic, writer, &change.into_value());
                        }
                        Err(error) => self.report_message(topic, &error),
                    }
                }
            }
        }
        self.topics = topics;
    }

    /// Returns a warning about the first sample of a foot with this frame if it probably comes from the IMU of the trunk.
    /// Returns nothing if there are several feet, because on some robots their IMUs have the same frame as the trunk's.
    fn trunk_text(&self, foot: &WantedFoot, frame: &str) -> Option<String> {
        let topic = &foot.topic;
        // Topics that name the trunk were reported before.
        let is_reported = is_trunk(topic, "", false);
        if foot.is_named || is_reported || self.feet.len() > 1 {
            return None;
        }
        let cause = if is_trunk(topic, frame, false) {
            format!("has the frame {frame:?}")
        } else if is_trunk(topic, frame, self.has_low_state) {
            "comes beside the state of a Unitree, which has no IMU on its feet".to_owned()
        } else {
            return None;
        };
        Some(format!(
            "{topic} {cause}, so it is probably the IMU of the robot's trunk, which does not show contacts; ros2:NAME={} takes \
             it as a foot",
            address(topic, &foot.part)
        ))
    }

    fn take_message(&mut self, topic: &mut SubscribedTopic, writer: GUID, message: &[u8]) {
        let received = now();
        if topic.writer.replace(writer).is_some_and(|before| before != writer)
            && !topic.imus.is_empty()
        {
            topic.changes += 1;
            if topic.changes == CHANGES {
                self.problem(format!(
                    "{} has two publishers, whose samples are mixed: end one of them, or give it another topic",
                    topic.name
                ));
            }
        }
        let mut failed = None;
        for load in &topic.loads {
            match load.decoder.decode(message) {
                Ok(value) => {
                    let scale = self.wanted.playback.input_options.table.scale.load;
                    let newest = (received, scale * value);
                    self.newest_loads.insert(load.foot.to_ascii_lowercase(), newest);
                }
                Err(problem) => failed = Some(problem.to_string()),
            }
        }
        for imu in &mut topic.imus {
            match imu.decoder.decode(message) {
                Ok(decoded) => {
                    let load = self.newest_loads.get(&imu.foot.name.to_ascii_lowercase());
                    let load = load.filter(|(at, value)| {
                        let age_us = received.as_micros().saturating_sub(at.as_micros());
                        age_us <= OLDEST_LOAD_US && value.is_finite()
                    });
                    let sample = LiveSample {
                        stamp_us: decoded.stamp_us,
                        stamp_rest_ns: decoded.stamp_rest_ns,
                        received,
                        readings: decoded.readings,
                        load: load.map(|(_, value)| Load(*value as f32)),
                    };
                    if imu.frames.is_empty()
                        && let Some(text) = self.trunk_text(&imu.foot, &decoded.frame)
                    {
                        self.problem(text);
                    }
                    imu.take(&decoded.frame, sample, &self.wanted, &mut self.pending);
                }
                Err(problem) => failed = Some(problem.to_string()),
            }
        }
        if let Some(problem) = failed {
            self.report_message(topic, &problem);
        }
    }

    /// Reports the first message of a topic that cannot be decoded.
    fn report_message(&mut self, topic: &mut SubscribedTopic, problem: &dyn std::fmt::Display) {
        if !std::mem::replace(&mut topic.has_reported_message, true) {
            self.problem(format!("{}: a message cannot be read: {problem}", topic.name));
        }
    }
}

impl TopicImu {
    /// Processes a sample of a frame. If a topic has several frames, each is a foot, named by its frame.
    fn take(
        &mut self,
        frame: &str,
        sample: LiveSample,
        wanted: &TopicFeet,
        pending: &mut VecDeque<Arrived>,
    ) {
        if !self.frames.contains_key(frame) {
            let name = if self.frames.is_empty() { self.foot.name.as_str() } else { frame };
            // Parameters were checked when the line was opened.
            let Ok(imu) = new_imu(&self.foot, name.trim_matches('/'), wanted) else { return };
            if self.frames.len() == 1 {
                self.split(frame, wanted, pending);
            }
            self.frames.insert(frame.to_owned(), imu);
        }
        if let Some(imu) = self.frames.get_mut(frame) {
            imu.take(sample, pending);
        }
    }

    /// Renames the topic's first foot after its frame, because a second frame has appeared.
    fn split(&mut self, other: &str, wanted: &TopicFeet, pending: &mut VecDeque<Arrived>) {
        let Some((first, imu)) = self.frames.pop_first() else { return };
        let text = format!(
            "{} has the frames {first} and {other}: each is a foot, named by its frame",
            self.foot.topic
        );
        let remark = if self.foot.is_named { Remark::Problem(text) } else { Remark::Detail(text) };
        pending.push_back((now(), Arrival::Remark(remark)));
        let name: Arc<str> = first.trim_matches('/').into();
        if let Ok(imu) = imu.renamed(name, &wanted.playback) {
            self.frames.insert(first, imu);
        }
    }
}

/// Creates the estimator of a foot.
fn new_imu(foot: &WantedFoot, name: &str, wanted: &TopicFeet) -> Result<LiveImu, LinkError> {
    let imu = LiveImu::new(name.into(), foot.topic.as_str().into(), &wanted.playback);
    imu.map_err(|error| feet::link::RecordingError::from(error).into())
}

/// Returns the feet of all single topics, with their given names, or named by their topics as in a bag.
fn named_feet(topics: &[FootTopic], pending: &mut VecDeque<Arrived>) -> Vec<WantedFoot> {
    let address = |foot: &FootTopic| address(&foot.topic, &foot.part);
    let topics = || topics.iter().filter(|foot| !foot.is_pattern());
    let unnamed: BTreeSet<String> =
        topics().filter(|foot| foot.name.is_none()).map(address).collect();
    let TopicNames { feet, trunks } = name_topics(&unnamed);
    for topic in &trunks {
        let text = format!(
            "{topic} is by its name of the robot's trunk, which no foot moves with; ros2:NAME={topic} says that it is a foot"
        );
        pending.push_back((now(), Arrival::Remark(Remark::Problem(text))));
    }
    let by_topic: BTreeMap<String, String> = feet.into_iter().collect();
    let wanted = topics().map(|foot| {
        let own = by_topic.get(&address(foot)).cloned();
        let own = own.unwrap_or_else(|| foot.topic.trim_matches('/').to_owned());
        WantedFoot {
            is_named: foot.name.is_some(),
            name: foot.name.clone().unwrap_or(own),
            topic: foot.topic.clone(),
            part: foot.part.clone(),
        }
    });
    wanted.collect()
}

/// Part of the topics that footfall itself publishes, in any namespace.
const OWN: &str = "/footfall/";

/// Returns whether a pattern matches a topic. Footfall's own topics are no sources, unless the pattern names them.
fn matches(pattern: &str, topic: &str) -> bool {
    matches_pattern(pattern, topic) && (pattern.contains(OWN) || !topic.contains(OWN))
}

/// Address of a part of the messages of a topic, or of whole messages.
fn address(topic: &str, part: &str) -> String {
    if part.is_empty() { topic.to_owned() } else { format!("{topic}.{part}") }
}

impl Link for TopicLine {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        let end = Instant::now() + longest;
        loop {
            if let Some(arrived) = self.pending.pop_front() {
                return Ok(Some(arrived));
            }
            if Instant::now() >= self.next_look {
                self.look()?;
                let is_early = self.began.elapsed() < 2 * FOUND_WITHIN;
                self.next_look = Instant::now() + if is_early { LOOKS } else { RARE_LOOKS };
            }
            for topic in &self.topics {
                topic.found.reader.set_waker(Some(self.waker.clone()));
            }
            // Read only after setting the wakers, because a message that arrived before does not wake this thread.
            self.take_messages();
            if !self.pending.is_empty() {
                continue;
            }
            let now = Instant::now();
            if now >= end {
                return Ok(None);
            }
            self.signal.wait((end - now).min(self.next_look.saturating_duration_since(now)));
        }
    }

    fn send(&mut self, _: &Sending) -> Result<(), LinkError> {
        Err(LinkError::wrong_kind(
            self.wanted.to_string(),
            "nothing: feet on topics take no requests",
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_leave_out_topics_of_footfall_itself() {
        assert!(matches("/*/imu", "/lf_foot/imu"));
        assert!(!matches("/*/imu", "/footfall/FL/imu"));
        assert!(!matches("/*/imu", "/dog/footfall/FL/imu"));
        assert!(matches("/footfall/*/imu", "/footfall/FL/imu"));
    }
}
