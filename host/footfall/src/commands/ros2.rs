//! `footfall ros2`: publishes streaming feet as a ROS 2 node.

use std::env;
use std::fmt::Write;
use std::net::{IpAddr, Ipv4Addr};

use clap::Args;

use super::options::{ListenArguments, PublishedArguments};
use crate::error::Error;
use crate::interruption::finish_when_interrupted;
use crate::messages::warn;
use crate::report::print_text;
use crate::ros::Published;
use crate::ros::node::{FootNode, FootNodeOptions, Reliability};
use crate::source::text_of;
use crate::stream::{Sink, Stream, deadline, unless_ended};

/// Arguments of `footfall ros2`.
#[derive(Debug, Args)]
pub struct Ros2Arguments {
    /// Feet that stream, and their source.
    #[command(flatten)]
    pub listen: ListenArguments,
    /// Frames, and messages of other programs.
    #[command(flatten)]
    pub published: PublishedArguments,
    /// Whether messages lost on the network are sent again; subscribers that request reliable messages
    /// receive no others
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
    /// Domain of DDS, 0 to 232.
    #[arg(
        long,
        value_name = "ID",
        value_parser = parse_domain,
        help = "DDS domain, 0 to 232; by default that of the variable ROS_DOMAIN_ID, or 0"
    )]
    pub domain_id: Option<u16>,
    /// The addresses of the interfaces that are used.
    #[arg(
        long,
        value_name = "ADDRESS",
        help = "Use only the interface with this address, such as 127.0.0.1; may be repeated. \
                ROS_LOCALHOST_ONLY=1 and ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST mean 127.0.0.1"
    )]
    pub network: Vec<IpAddr>,
    /// Stop after this time, or on Ctrl-C
    #[arg(long, value_name = "SECONDS", value_parser = crate::stream::parse_duration)]
    pub seconds: Option<f64>,
}

/// Highest domain: higher ones would use ports above 65535.
const LAST_DOMAIN: u16 = 232;

/// Parses a domain. Scripts set `ROS_DOMAIN_ID` to an empty text for the default.
fn parse_domain(text: &str) -> Result<u16, String> {
    if text.is_empty() {
        return Ok(0);
    }
    match text.parse() {
        Ok(domain @ 0..=LAST_DOMAIN) => Ok(domain),
        _ => Err(format!("{text} is not in 0..={LAST_DOMAIN}")),
    }
}

/// Returns the domain: the one given, else that of the ROS variable.
///
/// # Errors
/// The variable has no domain.
fn domain(given: Option<u16>) -> Result<u16, Error> {
    let name = "ROS_DOMAIN_ID";
    match (given, env::var_os(name)) {
        (Some(domain), _) => Ok(domain),
        (None, None) => Ok(0),
        (None, Some(text)) => {
            parse_domain(&text.to_string_lossy()).map_err(|reason| Error::Variable { name, reason })
        }
    }
}

/// Returns the interfaces to use: those given, else those in the ROS variables.
fn networks(named: Vec<IpAddr>) -> Vec<IpAddr> {
    let is = |variable, value| env::var(variable).is_ok_and(|text| text == value);
    let stays_here =
        is("ROS_LOCALHOST_ONLY", "1") || is("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
    if named.is_empty() && stays_here {
        return vec![Ipv4Addr::LOCALHOST.into()];
    }
    named
}

impl Ros2Arguments {
    pub(super) fn run(self) -> Result<(), Error> {
        let bridge = self.published.bridge()?;
        let options = FootNodeOptions {
            domain_id: domain(self.domain_id)?,
            networks: networks(self.network),
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
        let mut stream = Stream::open(sources, feet, bridge)?;
        let mut node = FootNode::new(options)?;
        let end = deadline(stream.clock(), self.seconds);
        let ended = stream.run(end, &mut node)?;
        // Subscribers must not keep the last contacts as current.
        stream.end(&mut node)?;
        stream.report();
        finish(node)?;
        unless_ended(ended)
    }
}

impl Sink for FootNode {
    fn publish(&mut self, published: Published) -> Result<(), Error> {
        warn_of_others(self);
        Ok(Self::publish(self, published)?)
    }

    fn idle(&mut self) -> Result<(), Error> {
        warn_of_others(self);
        Ok(())
    }
}

/// Warns once about another node of the same name, and once about one that publishes the same topic.
fn warn_of_others(node: &mut FootNode) {
    if node.has_new_namesake() {
        warn(format!(
            "another node in the domain is named {}, too: give this one a name of its own with --node-name or --namespace",
            node.name()
        ));
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
