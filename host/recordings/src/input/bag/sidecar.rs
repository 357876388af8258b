//! Sample data for which `sensor_msgs/msg/Imu` has no field, on topics beside that of the samples: validity and
//! label. Their messages precede the sample that they belong to and have its time.
//!
//! | topic | message | topic of the samples |
//! |---|---|---|
//! | `/imu/fl/validity` | `std_msgs/msg/String`, a name of a validity | `/imu/fl` |
//! | `/imu/fl/label` | `std_msgs/msg/Bool`, true for stable | `/imu/fl` |
//!
//! `footfall convert` writes them. Topics of these names with other content are ignored.

use std::collections::HashMap;

use crate::samples::recording::Label;
use crate::samples::validity::of_name;
use estimator_core::Validity;

use super::cdr::decode;
use super::storage::Channel;

/// Validity and label of a sample, if known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Known {
    pub(super) validity: Option<Validity>,
    pub(super) label: Option<Label>,
}

/// Data about the next sample of each topic.
#[derive(Debug, Default)]
pub(super) struct Sidecar(HashMap<String, (i64, Known)>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Validity,
    Label,
}

/// The topic of the samples that a channel describes, and the kind of data in it.
fn about(channel: &Channel) -> Option<(&str, Kind)> {
    let (suffix, kind) = match channel.message.as_str() {
        "std_msgs/msg/String" => ("/validity", Kind::Validity),
        "std_msgs/msg/Bool" => ("/label", Kind::Label),
        _ => return None,
    };
    let topic = channel.topic.strip_suffix(suffix)?;
    (channel.encoding == "cdr").then_some((topic, kind))
}

/// Returns whether a channel describes samples.
pub(super) fn is_sidecar(channel: &Channel) -> bool {
    about(channel).is_some()
}

impl Sidecar {
    /// Processes a message.
    pub(super) fn take(&mut self, channel: &Channel, log_ns: i64, payload: &[u8]) {
        let Some((topic, kind)) = about(channel) else {
            return;
        };
        let (at_ns, known) = self.0.entry(topic.to_owned()).or_default();
        if *at_ns != log_ns {
            (*at_ns, *known) = (log_ns, Known::default());
        }
        match kind {
            Kind::Validity => {
                let text = decode::<String>(payload).ok();
                known.validity = text.and_then(|text| of_name(&text));
            }
            Kind::Label => {
                known.label = decode(payload).ok().map(|is_stable| match is_stable {
                    true => Label::Stable,
                    false => Label::NotStable,
                });
            }
        }
    }

    /// Data about the sample of a topic that was written at this time.
    pub(super) fn of(&mut self, topic: &str, log_ns: i64) -> Known {
        match self.0.remove(topic) {
            Some((at_ns, known)) if at_ns == log_ns => known,
            _ => Known::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn channel(topic: &str, message: &str) -> Channel {
        Channel {
            topic: topic.to_owned(),
            message: message.to_owned(),
            encoding: "cdr".to_owned(),
            schema: None,
            metadata: BTreeMap::new(),
        }
    }

    #[test]
    fn data_apply_only_to_the_sample_of_their_topic_and_time() {
        let label = channel("/imu/fl/label", "std_msgs/msg/Bool");
        let validity = channel("/imu/fl/validity", "std_msgs/msg/String");
        let stale = [&[0, 1, 0, 0, 6, 0, 0, 0][..], b"stale\0"].concat();
        let mut beside = Sidecar::default();
        beside.take(&label, 5, &[0, 1, 0, 0, 1]);
        beside.take(&validity, 5, &stale);
        assert_eq!(beside.of("/imu/fr", 5), Known::default());
        let both = Known { validity: Some(Validity::Stale), label: Some(Label::Stable) };
        assert_eq!(beside.of("/imu/fl", 5), both);
        assert_eq!(beside.of("/imu/fl", 5), Known::default(), "once");
        beside.take(&label, 6, &[0, 1, 0, 0, 0]);
        assert_eq!(beside.of("/imu/fl", 7), Known::default(), "another time");
        beside.take(&label, 8, &[0, 1, 0, 0, 0]);
        beside.take(&validity, 9, &stale);
        assert_eq!(beside.of("/imu/fl", 9).label, None, "of the sample before");
    }

    #[test]
    fn other_content_under_the_same_name_is_ignored() {
        assert!(!is_sidecar(&channel("/imu/label", "std_msgs/msg/Float64")));
        assert!(!is_sidecar(&channel("/imu", "std_msgs/msg/Bool")));
        let validity = channel("/imu/validity", "std_msgs/msg/String");
        let mut beside = Sidecar::default();
        for payload in [&[0, 1, 0, 0, 3, 0, 0, 0, b'o', b'k', 0][..], &[0, 1], &[]] {
            beside.take(&validity, 1, payload);
            assert_eq!(beside.of("/imu", 1), Known::default());
        }
    }
}
