//! Options of a node, fixed while it runs.

use std::net::IpAddr;

use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{Name, ParameterValue};

use crate::ros::topics::DIAGNOSTICS;
use crate::ros::{Compat, Published};

/// Depth of the history of diagnostics, the same as in `diagnostic_updater`.
const DIAGNOSTICS_DEPTH: usize = 10;

recordings::named! {
    /// Whether a message lost on the network is sent again, with its name in ROS. Subscribers that request reliable
    /// messages receive no others.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
    pub enum Reliability {
        /// Lost messages are sent again
        Reliable = "reliable",
        /// Lost messages are not sent again
        BestEffort = "best_effort",
    }
}

/// Options of a node.
#[derive(Clone, Debug)]
pub struct Options {
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

impl Options {
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
        let qos = QosProfile::default()
            .durability(Durability::Volatile)
            .history(History::KeepLast { depth });
        match reliability {
            // A subscriber that does not read must not delay messages to others.
            Reliability::Reliable => qos.reliability_reliable(WhenFull::Fail),
            Reliability::BestEffort => qos.reliability_best_effort(),
        }
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
            let options = Options {
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
