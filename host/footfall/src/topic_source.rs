//! Topics of ROS 2 as sources: the IMU of a foot, and its load.
//!
//! | written | is |
//! |---|---|
//! | `ros2:FL=/lf_foot/imu` | the foot FL |
//! | `ros2:/lf_foot/imu` | a foot that is named by its topic, as in a bag |
//! | `ros2:/*/imu` | each topic of this pattern with samples of an IMU |
//! | `ros2:FL=/feet.imu[0]` | a part of the messages of a topic |
//! | `--load FL=/foot_forces:normal[0]` | the load of FL, as in `--load-topic` |
//! | `--load /{foot}/wrench` | the loads of all feet |
//!
//! All topics of a command are one line, because they share a participant of DDS.

use std::env;
use std::fmt;
use std::net::{IpAddr, Ipv4Addr};
use std::str::FromStr;

use feet::Playback;
use feet::decode::known_feet::Name;
use options::LoadTopic;

use crate::error::Worded;

/// Kind of these sources, before the colon.
pub const ROS2: &str = "ros2";

/// Topics of one robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TopicFeet {
    /// Topics of the feet, in the order of the command.
    pub feet: Vec<FootTopic>,
    /// Topics of their loads.
    pub loads: Vec<FootLoad>,
    /// Domain of DDS.
    pub domain: RosDomain,
    /// Units, mounting and parameters, as of a recording that is played.
    pub playback: Box<Playback>,
}

/// Topic with the samples of a foot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FootTopic {
    /// Name of the foot, if given.
    pub name: Option<String>,
    /// Name of the topic, absolute; in a pattern `*` matches any text.
    pub topic: String,
    /// Part of the messages that is an IMU, such as `imu[0]`; empty for the whole message.
    pub part: String,
}

/// Topic with the load of a foot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FootLoad {
    /// Name of the foot; `None` if the topic is a pattern with `{foot}`.
    pub foot: Option<String>,
    /// The topic and the number in its messages.
    pub topic: LoadTopic,
}

/// Domain of DDS, and the interfaces in it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RosDomain {
    /// 0 to 232; other domains do not see the topics.
    pub id: u16,
    /// Addresses of the interfaces to use; empty uses all.
    pub networks: Vec<IpAddr>,
}

/// Highest domain: higher ones would use ports above 65535.
pub const LAST_DOMAIN: u16 = 232;

impl RosDomain {
    /// Returns the domain and the interfaces that are given, else the values of the variables of ROS.
    ///
    /// # Errors
    /// The variable has no domain.
    pub fn or_environment(id: Option<u16>, networks: Vec<IpAddr>) -> Result<Self, VariableError> {
        let name = "ROS_DOMAIN_ID";
        let id = match (id, env::var_os(name)) {
            (Some(id), _) => id,
            (None, None) => 0,
            (None, Some(text)) => parse_domain(&text.to_string_lossy())
                .map_err(|reason| VariableError { name, reason })?,
        };
        let is = |variable, value| env::var(variable).is_ok_and(|text| text == value);
        let stays_here =
            is("ROS_LOCALHOST_ONLY", "1") || is("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST");
        if networks.is_empty() && stays_here {
            return Ok(Self { id, networks: vec![Ipv4Addr::LOCALHOST.into()] });
        }
        Ok(Self { id, networks })
    }
}

/// Parses a domain. Scripts set `ROS_DOMAIN_ID` to an empty text for the default.
///
/// # Errors
/// A sentence that states the range.
pub fn parse_domain(text: &str) -> Result<u16, String> {
    if text.is_empty() {
        return Ok(0);
    }
    match text.parse() {
        Ok(domain @ 0..=LAST_DOMAIN) => Ok(domain),
        _ => Err(format!("{text} is not in 0..={LAST_DOMAIN}")),
    }
}

/// A variable of the environment has no valid value.
#[derive(Debug, thiserror::Error)]
#[error("environment variable {name}: {reason}")]
pub struct VariableError {
    name: &'static str,
    /// Reason, with the value.
    reason: String,
}

impl Worded for VariableError {}

/// The text of a topic is invalid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{:?}: {reason}", format!("{ROS2}:{text}"))]
pub struct TopicTextError {
    /// The text after the kind.
    text: String,
    /// Reason, with the expected form.
    reason: &'static str,
}

impl FromStr for FootTopic {
    type Err = TopicTextError;

    /// Reads `[FOOT=]TOPIC[.PART]`.
    fn from_str(text: &str) -> Result<Self, TopicTextError> {
        let invalid = |reason| TopicTextError { text: text.to_owned(), reason };
        let (name, address) = match text.split_once('=') {
            Some((name, address)) => (Some(name), address),
            None => (None, text),
        };
        // Topics of ROS have no dot.
        let (topic, part) = address.split_once('.').unwrap_or((address, ""));
        let is_valid = |c: char| c.is_ascii_alphanumeric() || "_/*".contains(c);
        if topic.trim_matches('/').is_empty() || !topic.chars().all(is_valid) {
            return Err(invalid("write a topic after it, such as ros2:FL=/lf_foot/imu"));
        }
        if topic.contains('*') && (name.is_some() || !part.is_empty()) {
            return Err(invalid(
                "a pattern names its feet by their topics, and takes whole messages",
            ));
        }
        if let Some(name) = name {
            Name::new(name).map_err(|_| {
                invalid("the name of a foot has up to 32 letters, digits or signs, without spaces")
            })?;
        }
        Ok(Self {
            name: name.map(str::to_owned),
            topic: format!("/{}", topic.trim_matches('/')),
            part: part.to_owned(),
        })
    }
}

impl FootTopic {
    /// Returns whether it is the pattern of several topics.
    #[must_use]
    pub fn is_pattern(&self) -> bool {
        self.topic.contains('*')
    }
}

impl fmt::Display for FootTopic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{ROS2}:")?;
        if let Some(name) = &self.name {
            write!(f, "{name}=")?;
        }
        f.write_str(&self.topic)?;
        if self.part.is_empty() { Ok(()) } else { write!(f, ".{}", self.part) }
    }
}

impl FromStr for FootLoad {
    type Err = String;

    /// Reads `FOOT=TOPIC[:FIELD]`, or a pattern with `{foot}` instead of the name of each foot.
    fn from_str(text: &str) -> Result<Self, String> {
        let expected = || {
            format!(
                "{text:?} is not the load of a foot: write FL=/foot_forces:normal[0], or /{{foot}}/wrench for all feet"
            )
        };
        let (foot, topic) = match text.split_once('=') {
            Some((foot, topic)) if !foot.is_empty() => (Some(foot.to_owned()), topic),
            Some(_) => return Err(expected()),
            None => (None, text),
        };
        let topic: LoadTopic = topic.parse().map_err(|_| expected())?;
        if foot.is_none() != topic.is_pattern() {
            return Err(expected());
        }
        Ok(Self { foot, topic })
    }
}

impl fmt::Display for TopicFeet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let feet: Vec<String> = self.feet.iter().map(ToString::to_string).collect();
        f.write_str(&feet.join(" "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn topic(text: &str) -> FootTopic {
        text.parse().unwrap_or_else(|error| panic!("{error}"))
    }

    #[test]
    fn topics_are_named_by_the_foot_or_not() {
        let foot = topic("FL=lf_foot/imu");
        assert_eq!((foot.name.as_deref(), &*foot.topic), (Some("FL"), "/lf_foot/imu"));
        assert_eq!(foot.to_string(), "ros2:FL=/lf_foot/imu");
        let part = topic("/feet.imu[0]");
        assert_eq!((&*part.topic, &*part.part), ("/feet", "imu[0]"));
        assert!(topic("/*/imu").is_pattern());
        for text in ["", "/", "FL=", "=/imu", "FL=/*/imu", "a b=/imu", "/imu data", "/im{u}"] {
            let error = text.parse::<FootTopic>().expect_err(text).to_string();
            assert!(error.contains(&format!("\"ros2:{text}\"")), "{error}");
        }
    }

    #[test]
    fn loads_name_their_foot_or_are_patterns() {
        let load: FootLoad = "FL=/foot_forces:normal[0]".parse().expect("a load");
        assert_eq!(load.foot.as_deref(), Some("FL"));
        assert_eq!(load.topic.field.as_deref(), Some("normal[0]"));
        let pattern: FootLoad = "/{foot}/wrench".parse().expect("a pattern");
        assert_eq!(pattern.topic.of_foot("FL").topic, "/FL/wrench");
        for text in ["/wrench", "FL=/{foot}/wrench", "=/wrench", "FL=", ""] {
            assert!(text.parse::<FootLoad>().is_err(), "{text}");
        }
    }
}
