//! `footfall ros2`: publishes streaming feet as a ROS 2 node.

use std::fmt::Write;

use clap::Args;

use super::options::{ListenArguments, PublishedArguments};
use crate::Source;
use crate::error::{Error, Worded};
use crate::interruption::finish_when_interrupted;
use crate::messages::warn;
use crate::report::print_text;
use crate::ros::Published;
use crate::ros::domain::NodeError;
use crate::ros::node::{FootNode, FootNodeOptions, Reliability};
use crate::source::text_of;
use crate::stream::{Sink, Stream, deadline, unless_ended};
use crate::topic_source::RosDomain;

/// Arguments of `footfall ros2`.
#[derive(Debug, Args)]
pub struct Ros2Arguments {
    /// Feet that stream, and their source.
    #[command(flatten)]
    pub listen: ListenArguments,
    /// Frames, and messages of other programs.
    #[command(flatten)]
    pub published: PublishedArguments,
    /// Whether messages lost on the network are sent again; a subscriber that requests reliable messages
    /// receives nothing from best-effort
    #[arg(long, value_name = "QOS", default_value = "reliable")]
    pub reliability: Reliability,
    /// Number of messages of a topic to keep for each subscriber
    #[arg(long, value_name = "MESSAGES", default_value_t = 10, value_parser = clap::value_parser!(u16).range(1..))]
    pub depth: u16,
    /// Namespace of the node and of all topics except /diagnostics
    #[arg(long, value_name = "NAMESPACE", default_value = "/")]
    pub namespace: String,
    /// Name of the node
    #[arg(long, value_name = "NAME", default_value = "footfall")]
    pub node_name: String,
    /// Stop after this time, or on Ctrl-C
    #[arg(long, value_name = "SECONDS", value_parser = crate::stream::parse_duration)]
    pub seconds: Option<f64>,
}

impl Ros2Arguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let mut bridge = self.published.bridge()?;
        let RosDomain { id: domain_id, networks } = self.listen.topics.domain()?;
        let options = FootNodeOptions {
            domain_id,
            networks,
            namespace: self.namespace,
            name: self.node_name,
            reliability: self.reliability,
            depth: self.depth.into(),
            source: text_of(&self.listen.sources),
            frame_id: self.published.frame(),
            compat: self.published.compat.clone(),
        };
        finish_when_interrupted();
        let (sources, feet) = self.listen.sources_and_feet()?;
        if sources.iter().all(|source| matches!(source, Source::Topics(_))) {
            // The samples are on topics already.
            bridge = bridge.without_imu();
        }
        let mut stream = Stream::open(sources, feet, bridge)?;
        let mut node = FootNode::new(options)?;
        let end = deadline(stream.clock(), self.seconds);
        let ended = stream.run(end, &mut node)?;
        // Report the feet as silent, so that subscribers do not take the last contacts as current.
        stream.end(&mut node)?;
        stream.report();
        finish(node)?;
        unless_ended(ended)
    }
}

/// The node failed.
#[derive(Debug, thiserror::Error)]
#[error("ROS 2: {0}")]
struct Ros2Error(NodeError);

impl Worded for Ros2Error {}

impl From<NodeError> for Error {
    fn from(error: NodeError) -> Self {
        Ros2Error(error).into()
    }
}

impl Sink for FootNode {
    fn publish(&mut self, published: Published) -> Result<(), Error> {
        look_around(self);
        Ok(Self::publish(self, published)?)
    }

    fn idle(&mut self) -> Result<(), Error> {
        look_around(self);
        Ok(())
    }
}

/// Looks for subscribers and for other nodes.
fn look_around(node: &mut FootNode) {
    node.renew_routes();
    warn_of_others(node);
}

/// Warns once about another node with the same name, once about another node that publishes the same topic, and once per
/// policy about subscribers that request more than this node offers.
fn warn_of_others(node: &mut FootNode) {
    if node.has_new_namesake() {
        warn(format!(
            "another node in the domain is named {}, too: give this one a name of its own with --node-name or --namespace",
            node.name()
        ));
    }
    if let Some(mismatch) = node.new_mismatch() {
        warn(mismatch);
    }
    if let Some(topic) = node.new_rival_topic() {
        warn(format!(
            "another node in the domain publishes {topic}, too, and subscribers get both: give the feet of one other names with --names, or this node a --namespace"
        ));
    }
}

/// Shuts down the node and prints the counts of sent and unsent messages.
fn finish(node: FootNode) -> Result<(), Error> {
    let counts = node.counts();
    let mut text = String::new();
    for (topic, count) in &counts {
        // Writing to memory does not fail.
        let _ = writeln!(text, "{:>9} {topic}", count.sent);
    }
    for (topic, count) in counts.iter().filter(|(_, count)| count.not_sent > 0) {
        warn(format!(
            "{topic}: {} messages were not sent: a reliable subscriber did not keep up",
            count.not_sent
        ));
    }
    node.finish();
    print_text(&text).map_err(Error::Print)
}
