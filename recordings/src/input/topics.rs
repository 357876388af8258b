//! Which topics of a bag are read.

use std::fmt;
use std::str::FromStr;

/// Selects all topics with samples of an IMU.
const ALL: &str = "all";

/// What is known about a bag of ROS beyond its topics. The default takes the only IMU.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagOptions {
    /// The feet.
    pub topics: Topics,
    /// Their loads, in the same order; none, or as many as there are feet.
    pub loads: Vec<LoadTopic>,
}

/// Which topics are feet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Topics {
    /// The only one with samples of an IMU; several are an error.
    #[default]
    TheOnly,
    /// These, in this order.
    Named(Vec<String>),
    /// All with samples of an IMU, by name.
    All,
}

impl Topics {
    /// The topics that are named in options, of which `all` means all.
    #[must_use]
    pub fn from_names(names: &[String]) -> Self {
        if names.is_empty() {
            Self::TheOnly
        } else if names.iter().any(|name| name == ALL) {
            Self::All
        } else {
            let mut named: Vec<String> = Vec::new();
            for name in names.iter().map(|name| absolute(name)) {
                if !named.contains(&name) {
                    named.push(name);
                }
            }
            Self::Named(named)
        }
    }
}

/// A topic that has the load of a foot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadTopic {
    /// Its name.
    pub topic: String,
    /// The field of its messages, where it is not the one that is taken by itself.
    pub field: Option<String>,
}

impl FromStr for LoadTopic {
    type Err = String;

    /// Reads `TOPIC` or `TOPIC:FIELD`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (topic, field) = match text.split_once(':') {
            Some((topic, field)) => (topic, Some(field)),
            None => (text, None),
        };
        if topic.is_empty() || field == Some("") {
            return Err(format!(
                "{text:?} is no topic: write TOPIC or TOPIC:FIELD, such as /foot/wrench:force.z"
            ));
        }
        Ok(Self {
            topic: absolute(topic),
            field: field.map(str::to_owned),
        })
    }
}

impl fmt::Display for LoadTopic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.field {
            Some(field) => write!(f, "{}:{field}", self.topic),
            None => f.write_str(&self.topic),
        }
    }
}

/// A topic's name as a bag has it: from the root.
fn absolute(name: &str) -> String {
    if name.starts_with('/') {
        name.to_owned()
    } else {
        format!("/{name}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_are_named_from_the_root_and_once() {
        let named = |names: &[&str]| {
            Topics::from_names(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(named(&[]), Topics::TheOnly);
        assert_eq!(named(&["all"]), Topics::All);
        let both = Topics::Named(vec!["/imu/fl".to_owned(), "/imu/fr".to_owned()]);
        assert_eq!(named(&["imu/fl", "/imu/fr", "/imu/fl"]), both);
    }

    #[test]
    fn a_load_is_a_topic_with_or_without_a_field() {
        let load: LoadTopic = "/ft/fl:force.z".parse().unwrap();
        assert_eq!(
            (load.topic.as_str(), load.field.as_deref()),
            ("/ft/fl", Some("force.z"))
        );
        assert_eq!(load.to_string(), "/ft/fl:force.z");
        assert_eq!("ft".parse::<LoadTopic>().unwrap().to_string(), "/ft");
        for wrong in ["", ":force", "/ft:"] {
            assert!(wrong.parse::<LoadTopic>().is_err(), "{wrong}");
        }
    }
}
