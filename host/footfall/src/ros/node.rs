//! A ROS 2 node that publishes the messages of feet. It uses `rustdds` and `ros2-client`; no installation of
//! ROS is required or linked.
//!
//! A publisher of each topic is created with its first message.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use futures::executor::block_on;
use ros2_client::entities_info::ParticipantEntitiesInfo;
use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{
    Context, MessageTypeName, Name, Node, NodeEvent, NodeName, NodeOptions, ParameterValue,
    Publisher, WriteError,
};
use rustdds::{DomainParticipant, QosPolicies, RTPSEntity};

use crate::ros::Compat;
use crate::ros::compat::LOW_STATE_TOPIC;
use crate::ros::domain::{NodeError, join};
use crate::ros::low_state::LowStateMerger;
use crate::ros::message::{Definition, RosMessage};
use crate::ros::routes::Routes;
use crate::ros::topics::{DIAGNOSTICS, Published};

/// Depth of the history of diagnostics, the same as in `diagnostic_updater`.
const DIAGNOSTICS_DEPTH: usize = 10;

/// Time for subscribers to request lost messages at shutdown: five heartbeats.
const LAST_REQUESTS: Duration = Duration::from_millis(500);

/// Time between looks for publishers of the same topics.
const LOOK_EACH: Duration = Duration::from_secs(1);

samples::named! {
    /// Whether a message lost on the network is sent again, with its name in ROS. A subscriber that requests
    /// reliable messages receives nothing from a best-effort publisher.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
    pub enum Reliability {
        /// Lost messages are sent again
        Reliable = "reliable",
        /// Lost messages are not sent again
        BestEffort = "best_effort",
    }
}

/// Options of a node, fixed while it runs.
#[derive(Clone, Debug)]
pub struct FootNodeOptions {
    /// Domain id, 0 to 232, as in `ROS_DOMAIN_ID`; other domains do not receive the messages.
    pub domain_id: u16,
    /// Addresses of the interfaces to use; empty uses all.
    pub networks: Vec<IpAddr>,
    /// Namespace of the node and of each topic except `/diagnostics`; `/` for none.
    pub namespace: String,
    /// Name of the node.
    pub name: String,
    /// Reliability of all topics except `/diagnostics`, which is reliable.
    pub reliability: Reliability,
    /// Number of messages of a topic kept for a subscriber, 1 or more.
    pub depth: usize,
    /// Source of the feet's data; a parameter of the node.
    pub source: String,
    /// Pattern of frame names; a parameter of the node.
    pub frame_id: String,
    /// Programs whose messages are also published; a parameter of the node.
    pub compat: Vec<Compat>,
}

impl FootNodeOptions {
    /// Parameters of the node. They are read-only; the settings of a foot are changed with `footfall foot`.
    pub(crate) fn parameters(&self) -> Vec<(&'static str, ParameterValue)> {
        let text = |text: &str| ParameterValue::String(text.to_owned());
        let names: Vec<&str> = self.compat.iter().map(|compat| compat.name()).collect();
        let names = names.join(",");
        let compat = if names.is_empty() { "none" } else { &names };
        let depth = i64::try_from(self.depth).unwrap_or(i64::MAX);
        vec![
            ("source", text(&self.source)),
            ("frame_id", text(&self.frame_id)),
            ("compat", text(compat)),
            ("qos.reliability", text(self.reliability.name())),
            ("qos.depth", ParameterValue::Integer(depth)),
        ]
    }

    /// Quality of service of a message.
    pub(crate) fn qos(&self, published: &Published) -> QosProfile {
        let (reliability, depth) = match published.topic.as_ref() {
            DIAGNOSTICS => (Reliability::Reliable, DIAGNOSTICS_DEPTH),
            _ => (self.reliability, self.depth),
        };
        Self::reliable_or_not(Self::profile(depth), reliability)
    }

    /// Quality of service of merged states.
    fn merged_qos(&self) -> QosPolicies {
        Self::reliable_or_not(Self::profile(self.depth), self.reliability).into()
    }

    fn reliable_or_not(qos: QosProfile, reliability: Reliability) -> QosProfile {
        match reliability {
            // A subscriber that does not read must not delay messages to others.
            Reliability::Reliable => qos.reliability_reliable(WhenFull::Fail),
            Reliability::BestEffort => qos.reliability_best_effort(),
        }
    }

    /// Quality of service with this depth, without a reliability.
    fn profile(depth: usize) -> QosProfile {
        QosProfile::default().durability(Durability::Volatile).history(History::KeepLast { depth })
    }

    /// Namespace with a leading and without a trailing slash, except for `/`. A relative name would be prefixed
    /// with the namespace again.
    pub(crate) fn absolute_namespace(&self) -> String {
        format!("/{}", self.namespace.trim_matches('/'))
    }

    /// Name of a topic in the namespace; `None` if invalid in ROS.
    pub(crate) fn topic(&self, topic: &str) -> Option<Name> {
        let namespace = match topic {
            // Diagnostic aggregators subscribe to this topic in any namespace.
            DIAGNOSTICS => "/".to_owned(),
            _ => self.absolute_namespace(),
        };
        let (before, base) = topic.rsplit_once('/')?;
        let before = format!("{}{before}", namespace.trim_end_matches('/'));
        let before = if before.is_empty() { "/" } else { &before };
        Name::new(before, base).ok()
    }
}

/// Counts of the messages of a topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sent {
    /// Messages sent to the subscribers.
    pub sent: u64,
    /// Messages not sent because subscribers had not acknowledged the previous 8192.
    pub not_sent: u64,
}

fn bad_name(what: &'static str, name: &str) -> NodeError {
    let name = name.to_owned();
    NodeError::Name { what, name }
}

/// A node that publishes.
pub struct FootNode {
    options: FootNodeOptions,
    topics: BTreeMap<Arc<str>, Topic>,
    node: Node,
    /// Thread that answers requests for parameters and tracks subscribers.
    spinner: JoinHandle<()>,
    /// Whether another node of the same name was found and has not been reported yet.
    has_namesake: Arc<AtomicBool>,
    participant: DomainParticipant,
    /// Time of the next search for publishers of the same topics; `None` once one was found.
    next_look: Option<Instant>,
    /// Time of the next search for subscribers that request more than the node offers.
    next_mismatch_look: Instant,
    /// Reported policies that such subscribers ask for.
    mismatches: BTreeSet<String>,
    /// Routes to subscribers on this machine, and when they are chosen again.
    routes: Routes,
    next_renewal: Instant,
    /// Merger of the states of a Unitree robot, if they are wanted.
    merger: Option<LowStateMerger>,
}

struct Topic {
    publisher: Publisher<RosMessage>,
    /// Quality of service that it offers.
    qos: QosPolicies,
    sent: Sent,
}

impl FootNode {
    /// Joins the domain.
    ///
    /// # Errors
    /// A name is invalid in ROS, or ports or interfaces cannot be used.
    pub fn new(options: FootNodeOptions) -> Result<Self, NodeError> {
        if options.topic("/x").is_none() {
            return Err(bad_name("namespace", &options.namespace));
        }
        // `NodeName` accepts names for which its services' names are rejected.
        let name = Name::new("/", &options.name)
            .and_then(|_| NodeName::new(&options.absolute_namespace(), &options.name))
            .map_err(|_| bad_name("node", &options.name))?;
        let domain_id = options.domain_id;
        let participant = join(domain_id, &options.networks)?;
        let context = Context::from_domain_participant(participant.clone());
        let context = context.map_err(NodeError::domain(domain_id))?;
        let create = NodeError::create(name.fully_qualified_name());
        let node = context.new_node(name.clone(), parameters(&options));
        let mut node = node.map_err(|error| create(&error))?;
        let spinner = node.spinner().map_err(|error| create(&error))?;
        let has_namesake = Arc::new(AtomicBool::new(false));
        if let Some(events) = node.status_receiver() {
            let own = context.participant_entities_info();
            let found = Arc::clone(&has_namesake);
            // A separate thread empties the queue of events, because the queue is short and the spinner fills it.
            let watch = thread::Builder::new().spawn(move || {
                while let Ok(event) = block_on(events.recv()) {
                    if matches!(event, NodeEvent::ParticipantEntities(other) if share_a_name(&own, &other))
                    {
                        return found.store(true, Ordering::Relaxed);
                    }
                }
            });
            // The thread ends with the node, whose events it receives.
            watch.map_err(|error| create(&error))?;
        }
        let spinner = thread::Builder::new().name("ros2".to_owned()).spawn(|| {
            // Messages are published even if the spinner fails.
            let _ = block_on(spinner.spin());
        });
        let spinner = spinner.map_err(|error| create(&error))?;
        let merger = if options.compat.contains(&Compat::Unitree) {
            Some(merger(&options, &participant).map_err(|error| create(&error))?)
        } else {
            None
        };
        Ok(Self {
            merger,
            next_mismatch_look: Instant::now() + LOOK_EACH,
            mismatches: BTreeSet::new(),
            routes: Routes::default(),
            next_renewal: Instant::now(),
            options,
            topics: BTreeMap::new(),
            node,
            spinner,
            has_namesake,
            participant,
            next_look: Some(Instant::now()),
        })
    }

    /// Namespace and name.
    #[must_use]
    pub fn name(&self) -> String {
        self.node.fully_qualified_name()
    }

    /// Returns whether another node in the domain was found to have the same namespace and name; true only once. Tools of
    /// ROS show such nodes as one, and their topics are the same.
    pub fn has_new_namesake(&self) -> bool {
        self.has_namesake.swap(false, Ordering::Relaxed)
    }

    /// Returns a topic that another node in the domain publishes as well, because subscribers then get the messages of both
    /// nodes. Returns a topic only once. Ignores `/diagnostics`, on which any node publishes.
    pub fn new_rival_topic(&mut self) -> Option<String> {
        let now = Instant::now();
        if self.next_look.is_none_or(|due| now < due) {
            return None;
        }
        let own = self.participant.guid().prefix;
        let writers = self.participant.discovered_writers();
        let others =
            writers.iter().filter(|writer| writer.writer_proxy.remote_writer_guid.prefix != own);
        // Topics of ROS begin with `rt` in DDS.
        let theirs: BTreeSet<&str> = others
            .filter_map(|writer| writer.publication_topic_data.topic_name.strip_prefix("rt"))
            .collect();
        let ours = self.topics.keys().filter(|topic| topic.as_ref() != DIAGNOSTICS);
        let rival = ours
            .filter_map(|topic| Some(self.options.topic(topic)?.to_string()))
            .find(|name| theirs.contains(name.as_str()));
        self.next_look = rival.is_none().then_some(now + LOOK_EACH);
        rival
    }

    /// Returns a sentence about a subscriber that requests more than this node offers, and so receives nothing.
    /// Each policy is reported once.
    pub fn new_mismatch(&mut self) -> Option<String> {
        let now = Instant::now();
        if now < self.next_mismatch_look {
            return None;
        }
        self.next_mismatch_look = now + LOOK_EACH;
        let offered = self.offered();
        for reader in self.participant.discovered_readers() {
            let requested = &reader.subscription_topic_data;
            let Some(name) = requested.topic_name().strip_prefix("rt") else { continue };
            let Some(offered) = offered.get(name) else { continue };
            let Some(policy) = offered.compliance_failure_wrt(&requested.qos()) else { continue };
            let policy = format!("{policy:?}").to_lowercase();
            if !self.mismatches.insert(policy.clone()) {
                continue;
            }
            let (asks, offers, remedy) = match policy.as_str() {
                "reliability" => {
                    ("reliable", "best_effort", "start this node with --reliability reliable")
                }
                "durability" => {
                    ("transient_local", "volatile", "subscribe with durability volatile")
                }
                _ => ("more", "the default of ROS", "subscribe with the default of ROS"),
            };
            return Some(format!(
                "a subscriber of {name} gets nothing, because it asks for {policy} {asks}, and {offers} is offered: {remedy}"
            ));
        }
        None
    }

    /// Chooses the routes to subscribers on this machine again if they may be missing, at most once a second.
    pub fn renew_routes(&mut self) {
        let now = Instant::now();
        if now < self.next_renewal {
            return;
        }
        self.next_renewal = now + LOOK_EACH;
        let mut offered = self.offered();
        if self.merger.is_some()
            && let Some(name) = self.options.topic(LOW_STATE_TOPIC)
        {
            offered.insert(name.to_string(), self.options.merged_qos());
        }
        self.routes.renew(&self.participant, |name| offered.get(name).cloned());
    }

    /// Returns the quality of service of each topic, by its full name.
    fn offered(&self) -> BTreeMap<String, QosPolicies> {
        let named = self.topics.iter().filter_map(|(topic, published)| {
            let name = self.options.topic(topic)?.to_string();
            Some((name, published.qos.clone()))
        });
        named.collect()
    }

    /// Publishes a message without blocking; a message that does not fit into the queue is counted.
    ///
    /// # Errors
    /// The topic is new and cannot be created.
    pub fn publish(&mut self, published: Published) -> Result<(), NodeError> {
        if let (RosMessage::Unitree(state), Some(merger)) = (&published.message, &self.merger)
            && merger.set(state.foot_force)
        {
            return Ok(());
        }
        if !self.topics.contains_key(&published.topic) {
            let publisher = self.publisher(&published)?;
            let qos = self.options.qos(&published).into();
            let topic = Topic { publisher, qos, sent: Sent::default() };
            self.topics.insert(Arc::clone(&published.topic), topic);
        }
        let Some(topic) = self.topics.get_mut(&published.topic) else {
            return Ok(());
        };
        match topic.publisher.publish(published.message) {
            Ok(()) => topic.sent.sent += 1,
            Err(WriteError::WouldBlock { .. }) => topic.sent.not_sent += 1,
            Err(error) => return Err(NodeError::create(&*published.topic)(&error)),
        }
        Ok(())
    }

    fn publisher(&mut self, published: &Published) -> Result<Publisher<RosMessage>, NodeError> {
        let name = self.options.topic(&published.topic);
        let name = name.ok_or_else(|| bad_name("topic", &published.topic))?;
        let (package, message) = Definition::of(&published.message).package_and_name();
        let kind = MessageTypeName::new(package, message);
        let qos = self.options.qos(published);
        let topic = self.node.create_topic(&name, kind, &qos);
        let publisher = topic.and_then(|topic| self.node.create_publisher(&topic, Some(qos)));
        publisher.map_err(|error| NodeError::create(&*published.topic)(&error))
    }

    /// Counts of the messages of each topic so far, by full name of the topic.
    #[must_use]
    pub fn counts(&self) -> BTreeMap<String, Sent> {
        let topics = self.topics.iter();
        let named = topics.filter_map(|(topic, published)| {
            let name = self.options.topic(topic)?;
            Some((name.to_string(), published.sent))
        });
        named.collect()
    }

    /// Leaves the domain after giving subscribers time to request lost messages.
    pub fn finish(self) {
        let is_reliable = self.options.reliability == Reliability::Reliable;
        if is_reliable && !self.topics.is_empty() {
            thread::sleep(LAST_REQUESTS);
        }
        drop(self.merger);
        drop(self.topics);
        drop(self.node);
        // The thread ends with the node; a panic in it is ignored.
        let _ = self.spinner.join();
    }
}

/// Begins to look for the states of a Unitree robot.
fn merger(
    options: &FootNodeOptions,
    participant: &DomainParticipant,
) -> io::Result<LowStateMerger> {
    let topic = options.topic(LOW_STATE_TOPIC).map(|name| name.to_string());
    let dds_topic = format!("rt{}", topic.unwrap_or_default());
    LowStateMerger::start(participant.clone(), dds_topic, options.merged_qos())
}

/// Returns whether two different participants have nodes of the same namespace and name.
fn share_a_name(own: &ParticipantEntitiesInfo, other: &ParticipantEntitiesInfo) -> bool {
    let is_own = |name: String| {
        let mut own = own.nodes().iter();
        own.any(|node| node.fully_qualified_name() == name)
    };
    let mut others = other.nodes().iter();
    own.gid() != other.gid() && others.any(|node| is_own(node.fully_qualified_name()))
}

/// Declares the parameters of a node as read-only.
fn parameters(options: &FootNodeOptions) -> NodeOptions {
    let declared = options.parameters();
    let mut parameters = NodeOptions::new();
    for (name, value) in &declared {
        parameters = parameters.declare_parameter(name, value.clone());
    }
    parameters.parameter_validator(Box::new(move |name: &str, value: &ParameterValue| {
        let is = declared.iter().find(|(declared, _)| *declared == name);
        if is.is_none_or(|(_, declared)| declared == value) {
            Ok(())
        } else {
            Err(format!("{name} is read-only: start footfall ros2 with another"))
        }
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn namespace_is_absolute_regardless_of_slashes() {
        for (namespace, before) in [
            ("dog", "/dog/footfall/FL"),
            ("/dog", "/dog/footfall/FL"),
            ("dog/left/", "/dog/left/footfall/FL"),
            ("/", "/footfall/FL"),
            ("", "/footfall/FL"),
        ] {
            let options = FootNodeOptions {
                domain_id: 0,
                networks: Vec::new(),
                namespace: namespace.to_owned(),
                name: "feet".to_owned(),
                reliability: Reliability::Reliable,
                depth: 1,
                source: String::new(),
                frame_id: String::new(),
                compat: Vec::new(),
            };
            let expected = Name::new(before, "contact").ok();
            assert_eq!(options.topic("/footfall/FL/contact"), expected, "{namespace}");
            let diagnostics = Name::new("/", "diagnostics").ok();
            assert_eq!(options.topic(DIAGNOSTICS), diagnostics, "{namespace}");
        }
    }
}
