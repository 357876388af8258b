//! Topics of the feet and of their loads in a bag, and other names of feet.

use std::fmt;
use std::str::FromStr;

use crate::problem::OptionProblem;

/// Options of a bag. The default reads its only IMU.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BagOptions {
    /// Topics of the feet.
    pub topics: Topics,
    /// Topics that are left out; `*` matches any text.
    pub excluded: Vec<String>,
    /// Frames (`header.frame_id`) of the feet, if one topic has the frames of several feet; empty for all.
    pub frames: Vec<String>,
    /// Topics of their loads, in the same order: empty, one for each foot, or a single one in which `{foot}` is
    /// replaced by the name of each.
    pub loads: Vec<LoadTopic>,
    /// Other names of feet.
    pub renames: Vec<Rename>,
}

impl BagOptions {
    /// Returns whether a topic is excluded.
    #[must_use]
    pub fn excludes(&self, topic: &str) -> bool {
        self.excluded.iter().any(|pattern| matches_pattern(&absolute(pattern), topic))
    }
}

/// Returns whether a name matches a pattern, in which `*` matches any text.
#[must_use]
pub fn matches_pattern(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = name.strip_prefix(first) else {
        return false;
    };
    let mut last = None;
    for part in parts {
        if let Some(between) = last.replace(part) {
            match rest.find(between) {
                Some(at) => rest = &rest[at + between.len()..],
                None => return false,
            }
        }
    }
    last.map_or(rest.is_empty(), |last| rest.ends_with(last))
}

/// Selects all topics with samples of an IMU.
const ALL: &str = "all";

/// Selection of the topics of feet.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Topics {
    /// The only topic with samples of an IMU; several are an error.
    #[default]
    TheOnly,
    /// These topics, in this order.
    Named(Vec<String>),
    /// All topics with samples of an IMU, by name.
    All,
}

impl Topics {
    /// Topics given in options; `all` selects all.
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

/// Placeholder for the name of the foot in a [`LoadTopic`].
const FOOT: &str = "{foot}";

/// Topic of the load of a foot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LoadTopic {
    /// Name of the topic.
    pub topic: String,
    /// Field of its messages, if not the default.
    pub field: Option<String>,
}

impl FromStr for LoadTopic {
    type Err = OptionProblem;

    /// Reads `TOPIC`, `TOPIC:FIELD` or `TOPIC.FIELD`: topics of ROS have no dot.
    fn from_str(text: &str) -> Result<Self, OptionProblem> {
        let split = text.split_once(':').or_else(|| text.split_once('.'));
        let (topic, field) = match split {
            Some((topic, field)) => (topic, Some(field)),
            None => (text, None),
        };
        if topic.is_empty() || field == Some("") {
            return Err(OptionProblem::LoadTopic(text.to_owned()));
        }
        Ok(Self { topic: absolute(topic), field: field.map(str::to_owned) })
    }
}

impl LoadTopic {
    /// Returns whether the topic depends on the foot.
    #[must_use]
    pub fn is_pattern(&self) -> bool {
        let field = self.field.as_deref().unwrap_or_default();
        self.topic.contains(FOOT) || field.contains(FOOT)
    }

    /// Returns the load of the foot with this name.
    #[must_use]
    pub fn of_foot(&self, name: &str) -> Self {
        let field = self.field.as_ref();
        Self {
            topic: self.topic.replace(FOOT, name),
            field: field.map(|field| field.replace(FOOT, name)),
        }
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

/// Another name of a foot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rename {
    /// Name of the foot, its topic, or a part of its topic.
    pub old: String,
    /// The name that it gets.
    pub new: String,
}

impl FromStr for Rename {
    type Err = OptionProblem;

    /// Reads `OLD=NEW`.
    fn from_str(text: &str) -> Result<Self, OptionProblem> {
        match text.split_once('=') {
            Some((old, new)) if !old.is_empty() && !new.is_empty() => {
                Ok(Self { old: old.to_owned(), new: new.to_owned() })
            }
            _ => Err(OptionProblem::Rename(text.to_owned())),
        }
    }
}

/// Absolute name of a topic, as in a bag.
fn absolute(name: &str) -> String {
    if name.starts_with('/') { name.to_owned() } else { format!("/{name}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn topics_are_absolute_and_unique() {
        let named = |names: &[&str]| {
            Topics::from_names(&names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>())
        };
        assert_eq!(named(&[]), Topics::TheOnly);
        assert_eq!(named(&["all"]), Topics::All);
        let both = Topics::Named(vec!["/imu/fl".to_owned(), "/imu/fr".to_owned()]);
        assert_eq!(named(&["imu/fl", "/imu/fr", "/imu/fl"]), both);
    }

    #[test]
    fn excluded_topics_may_have_stars() {
        let bag = |pattern: &str| BagOptions {
            excluded: vec![pattern.to_owned()],
            ..BagOptions::default()
        };
        for (pattern, excluded) in [
            ("/trunk/imu", [true, false, false]),
            ("trunk/imu", [true, false, false]),
            ("/trunk*", [true, true, false]),
            ("*imu", [true, false, true]),
            ("*r*n*u*", [true, true, false]),
            ("/trunk", [false, false, false]),
            ("*", [true, true, true]),
        ] {
            let topics = ["/trunk/imu", "/trunk/imu/raw", "/fl/imu"];
            assert_eq!(topics.map(|topic| bag(pattern).excludes(topic)), excluded, "{pattern}");
        }
        assert!(!bag("/a*a").excludes("/a"));
    }

    #[test]
    fn load_topic_may_depend_on_the_foot() {
        let load: LoadTopic = "/ft/{foot}:force.z".parse().unwrap();
        assert!(load.is_pattern());
        assert_eq!(load.of_foot("fl").to_string(), "/ft/fl:force.z");
        assert!(!load.of_foot("fl").is_pattern());
    }

    #[test]
    fn load_topic_may_have_a_field() {
        let load: LoadTopic = "/ft/fl:force.z".parse().unwrap();
        assert_eq!((load.topic.as_str(), load.field.as_deref()), ("/ft/fl", Some("force.z")));
        assert_eq!(load.to_string(), "/ft/fl:force.z");
        assert_eq!("ft".parse::<LoadTopic>().unwrap().to_string(), "/ft");
        let dotted: LoadTopic = "/lowstate.foot_force[0]".parse().unwrap();
        assert_eq!(dotted.to_string(), "/lowstate:foot_force[0]");
        for wrong in ["", ":force", "/ft:"] {
            assert!(wrong.parse::<LoadTopic>().is_err(), "{wrong}");
        }
    }
}
