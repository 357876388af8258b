//! What a node is set to, once and for all: nothing of it changes while it runs.

use std::net::IpAddr;

use ros::topics::DIAGNOSTICS;
use ros::{Compat, Published};
use ros2_client::qos::{Durability, History, QosProfile, WhenFull};
use ros2_client::{Name, ParameterValue};

/// Diagnostics that are kept for a subscriber, as `diagnostic_updater` has them.
const DIAGNOSTICS_DEPTH: usize = 10;

/// Whether a message that is lost on the network is sent again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reliability {
    /// Yes. Subscribers of both kinds get the messages.
    Reliable,
    /// No. Subscribers that ask for reliable messages get none.
    BestEffort,
}

impl Reliability {
    /// As ROS spells it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reliable => "reliable",
            Self::BestEffort => "best_effort",
        }
    }
}

/// What a node is set to.
#[derive(Clone, Debug)]
pub struct Options {
    /// Participants of other domains do not hear it: 0 to 232, as `ROS_DOMAIN_ID`.
    pub domain_id: u16,
    /// Addresses of the interfaces that are used; none means all.
    pub networks: Vec<IpAddr>,
    /// Before the node's name and each topic but `/diagnostics`; `/` for none.
    pub namespace: String,
    /// The node's name.
    pub name: String,
    /// Of all topics but `/diagnostics`, which is reliable.
    pub reliability: Reliability,
    /// Messages of a topic that are kept for a subscriber, 1 or more.
    pub depth: usize,
    /// Where the feet stream from: a parameter of the node.
    pub source: String,
    /// What frames are called: a parameter of the node.
    pub frame_id: String,
    /// Whose messages are published besides: a parameter of the node.
    pub compat: Option<Compat>,
}

impl Options {
    /// The parameters that the node shows. They cannot be set: a foot's own settings are set by
    /// `footfall foot`.
    pub(crate) fn parameters(&self) -> Vec<(&'static str, ParameterValue)> {
        let text = |text: &str| ParameterValue::String(text.to_owned());
        let compat = match self.compat {
            None => "none",
            Some(Compat::Pronto) => "pronto",
            Some(Compat::Champ) => "champ",
        };
        let depth = i64::try_from(self.depth).unwrap_or(i64::MAX);
        vec![
            ("source", text(&self.source)),
            ("frame_id", text(&self.frame_id)),
            ("compat", text(compat)),
            ("qos.reliability", text(self.reliability.name())),
            ("qos.depth", ParameterValue::Integer(depth)),
        ]
    }

    /// The quality of service of a message.
    pub(crate) fn qos(&self, published: &Published) -> QosProfile {
        let (reliability, depth) = match published.topic.as_ref() {
            DIAGNOSTICS => (Reliability::Reliable, DIAGNOSTICS_DEPTH),
            _ => (self.reliability, self.depth),
        };
        let qos = QosProfile::default()
            .durability(Durability::Volatile)
            .history(History::KeepLast { depth });
        match reliability {
            // A subscriber that does not read must not delay what comes after, for others.
            Reliability::Reliable => qos.reliability_reliable(WhenFull::Fail),
            Reliability::BestEffort => qos.reliability_best_effort(),
        }
    }

    /// The namespace with a slash before it and none behind it, but for `/`. A relative name would be put into
    /// the namespace once more.
    pub(crate) fn absolute_namespace(&self) -> String {
        format!("/{}", self.namespace.trim_matches('/'))
    }

    /// The name of a topic in the namespace; `None` if it is not valid in ROS.
    pub(crate) fn topic(&self, topic: &str) -> Option<Name> {
        let namespace = match topic {
            // Programs that gather diagnostics listen there, whatever the namespace is.
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
    fn a_namespace_is_absolute_however_its_slashes_are_written() {
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
                compat: None,
            };
            let expected = Name::new(before, "contact").ok();
            assert_eq!(
                options.topic("/footfall/FL/contact"),
                expected,
                "{namespace}"
            );
            let diagnostics = Name::new("/", "diagnostics").ok();
            assert_eq!(options.topic(DIAGNOSTICS), diagnostics, "{namespace}");
        }
    }
}
