//! Sources of the feet that a command reads, with the syntax that all commands share.
//!
//! | written | is |
//! |---|---|
//! | `usb` | all feet on USB |
//! | `usb:FR`, `usb:E66164084332A925` | the foot on USB with this name or serial number |
//! | `uart:/dev/ttyACM*` | all ports of this pattern |
//! | `demo`, `demo:feet=4,speed=10` | simulated feet; keys are [`Demo`]'s |
//! | `ros2:FL=/lf_foot/imu`, `ros2:/*/imu` | topics of ROS 2, see [`topic_source`](crate::topic_source) |
//! | anything else | a line or a file, see [`feet::source`] |

use std::collections::BTreeSet;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use feet::foot::{Client, RequestError, settings};
use feet::source::{SourceError, Speed};
use feet::usb::{self, UsbPort};
use feet::{LineSource, Link, LinkError, Playback};
use options::matches_pattern;
use simulated_robot::{Demo, DemoError};
use thiserror::Error;

use crate::error::Worded;
use crate::feature::{Feature, NotBuilt};
use crate::topic_source::{FootLoad, ROS2, RosDomain, TopicFeet, TopicTextError};

/// Kinds of sources beside lines, before the colon.
const DEMO: &str = "demo";
const USB: &str = "usb";

/// Sources as written in a command; each may be several lines.
#[derive(Clone, Debug, PartialEq)]
pub enum SourceArgument {
    /// One line or file, or simulated feet.
    One(Source),
    /// Serial ports of a pattern, with their rate, Bd.
    Ports {
        /// The pattern, in whose last part `*` matches any text.
        pattern: String,
        /// Rate, Bd.
        baud: u32,
    },
    /// All feet on USB.
    Usb,
    /// The foot on USB with this name or serial number.
    OneOnUsb(String),
}

/// One source of feet.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A line or a file.
    Line(feet::Source),
    /// Simulated feet.
    Demo(Demo),
    /// Topics of ROS 2.
    Topics(TopicFeet),
}

/// Error in the text of a source.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SourceTextError {
    /// The kind of source is unknown.
    #[error(
        "{0:?} is not a source; sources are usb, usb:FR, uart:PORT[@BAUD], can:INTERFACE, slcan:PORT[@KBIT], ros2:[FOOT=]TOPIC, file:PATH[@SPEED] and demo[:feet=4]"
    )]
    Unknown(String),
    /// Several sources are written as one.
    #[error("{0:?} are several sources: separate them by spaces")]
    Several(String),
    /// The text of a topic is invalid.
    #[error(transparent)]
    Topic(#[from] TopicTextError),
    /// The text of a line or a file is invalid.
    #[error(transparent)]
    Line(SourceError),
    /// The options of simulated feet are invalid.
    #[error(transparent)]
    Demo(#[from] DemoError),
}

/// Reason for which sources cannot be found.
#[derive(Debug, Error)]
pub enum FindError {
    /// No foot is on USB.
    #[error(
        "no foot was found on USB: plug one in, or name a source such as uart:/dev/ttyACM0, can:can0 or demo"
    )]
    NoneOnUsb,
    /// Several feet are on USB, and one is needed.
    #[error("there are several feet on USB; name one of them: {}", names(.0))]
    SeveralOnUsb(Vec<UsbPort>),
    /// No foot on USB has this name or serial number.
    #[error("no foot on USB has the name or serial number {wanted:?}; found: {}", list(found))]
    NotOnUsb {
        /// Name or serial number.
        wanted: String,
        /// The feet on USB, or the reasons for which they are unknown.
        found: Vec<String>,
    },
    /// Several feet on USB have this name.
    #[error("several feet on USB are {name}: name one by its serial number, {}", names(ports))]
    SameName {
        /// The name.
        name: String,
        /// Ports of the feet.
        ports: Vec<UsbPort>,
    },
    /// No port has a name of this pattern.
    #[error("uart:{0} matches no port")]
    NoPort(String),
    /// One foot is needed.
    #[error("{0} are several sources: name one")]
    Several(String),
    /// The feature of the source is not built.
    #[error(transparent)]
    NotBuilt(#[from] NotBuilt),
}

impl Worded for FindError {}

fn names(ports: &[UsbPort]) -> String {
    let names = ports.iter().map(|found| format!("{USB}:{}", found.serial));
    names.collect::<Vec<_>>().join(", ")
}

fn list(found: &[String]) -> String {
    if found.is_empty() { "none".to_owned() } else { found.join(", ") }
}

impl FromStr for SourceArgument {
    type Err = SourceTextError;

    fn from_str(text: &str) -> Result<Self, SourceTextError> {
        let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
        let is_source = |part: &str| part == USB || part.parse::<feet::Source>().is_ok();
        // Names of files may have commas.
        if kind != "file" && text.split(',').skip(1).any(is_source) {
            return Err(SourceTextError::Several(text.to_owned()));
        }
        match kind {
            DEMO => Ok(Self::One(Source::Demo(rest.parse()?))),
            ROS2 => {
                let feet = vec![rest.parse()?];
                Ok(Self::One(Source::Topics(TopicFeet { feet, ..TopicFeet::default() })))
            }
            USB if rest.is_empty() => Ok(Self::Usb),
            USB => Ok(Self::OneOnUsb(rest.to_owned())),
            _ => match text.parse() {
                Ok(feet::Source::Uart { port, baud }) if port.contains('*') => {
                    Ok(Self::Ports { pattern: port, baud })
                }
                Ok(line) => Ok(Self::One(Source::Line(line))),
                Err(SourceError::Unknown(text)) => Err(SourceTextError::Unknown(text)),
                Err(error) => Err(SourceTextError::Line(error)),
            },
        }
    }
}

impl fmt::Display for SourceArgument {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::One(source) => source.fmt(f),
            Self::Ports { pattern, baud } => write!(f, "uart:{pattern}@{baud}"),
            Self::Usb => f.write_str(USB),
            Self::OneOnUsb(which) => write!(f, "{USB}:{which}"),
        }
    }
}

impl SourceArgument {
    /// Path of the file that is played, if the source is a file.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::One(Source::Line(line)) => line.file(),
            _ => None,
        }
    }

    /// Finds all lines of the source.
    ///
    /// # Errors
    /// No line is found, or the foot on USB is not there.
    pub fn find(&self) -> Result<Vec<Source>, FindError> {
        match self {
            Self::One(source) => {
                if matches!(source, Source::Topics(_)) {
                    Feature::Ros2.needed_for(source)?;
                }
                Ok(vec![source.clone()])
            }
            Self::Ports { pattern, baud } => match ports(pattern) {
                ports if ports.is_empty() => Err(FindError::NoPort(pattern.clone())),
                ports => Ok(ports.into_iter().map(|port| uart(port, *baud)).collect()),
            },
            Self::Usb => match usb::foot_ports() {
                ports if ports.is_empty() => Err(FindError::NoneOnUsb),
                ports => Ok(ports.into_iter().map(on_usb).collect()),
            },
            Self::OneOnUsb(which) => Ok(vec![on_usb(one_on_usb(which, usb::foot_ports())?)]),
        }
    }

    /// Finds the line of a source that has one.
    ///
    /// # Errors
    /// No line is found, or several are.
    pub fn find_one(&self) -> Result<Source, FindError> {
        let mut found = self.find()?;
        if found.len() > 1 {
            return Err(match self {
                Self::Usb => FindError::SeveralOnUsb(usb::foot_ports()),
                _ => FindError::Several(text_of(&found)),
            });
        }
        found.pop().ok_or(FindError::NoneOnUsb)
    }
}

/// Finds the lines of all sources, each once.
///
/// # Errors
/// A source has none.
pub fn find_all(sources: &[SourceArgument]) -> Result<Vec<Source>, FindError> {
    let mut found: Vec<Source> = Vec::new();
    let mut ports = BTreeSet::new();
    for source in sources {
        for source in source.find()? {
            // Topics are one line, because they share a participant of DDS.
            if let Source::Topics(TopicFeet { feet, .. }) = &source
                && let Some(Source::Topics(all)) =
                    found.iter_mut().find(|other| matches!(other, Source::Topics(_)))
            {
                let new = feet.iter().filter(|foot| !all.feet.contains(foot));
                let new: Vec<_> = new.cloned().collect();
                all.feet.extend(new);
                continue;
            }
            let is_new = match &source {
                // A port has several names.
                Source::Line(feet::Source::Uart { port, .. }) => {
                    ports.insert(fs::canonicalize(port).unwrap_or_else(|_| PathBuf::from(port)))
                }
                source => !found.contains(source),
            };
            if is_new {
                found.push(source);
            }
        }
    }
    Ok(found)
}

/// Text of sources, as on the command line.
#[must_use]
pub fn text_of(sources: &[impl fmt::Display]) -> String {
    sources.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ")
}

fn uart(port: String, baud: u32) -> Source {
    Source::Line(feet::Source::Uart { port, baud })
}

fn on_usb(found: UsbPort) -> Source {
    uart(found.port, feet::source::DEFAULT_BAUD)
}

/// Returns the foot on USB with this serial number, or else the foot that answers with this name.
fn one_on_usb(which: &str, ports: Vec<UsbPort>) -> Result<UsbPort, FindError> {
    let has_number = |found: &&UsbPort| usb::is_serial_number(which, &found.serial);
    if let Some(found) = ports.iter().find(has_number) {
        return Ok(found.clone());
    }
    let (mut named, mut others) = (Vec::new(), Vec::new());
    for found in ports {
        let source = on_usb(found.clone());
        match name_of(&source) {
            Ok(name) if name.eq_ignore_ascii_case(which) => named.push(found),
            Ok(name) => others.push(format!("{name} ({USB}:{})", found.serial)),
            Err(error) => others.push(error.to_string()),
        }
    }
    match (named.pop(), named.len()) {
        (Some(found), 0) => Ok(found),
        (None, _) => Err(FindError::NotOnUsb { wanted: which.to_owned(), found: others }),
        (Some(found), _) => {
            named.push(found);
            Err(FindError::SameName { name: which.to_owned(), ports: named })
        }
    }
}

/// Asks the foot of a serial line for its name.
fn name_of(source: &Source) -> Result<&'static str, RequestError> {
    let mut client = Client::new(source.open()?, None)?;
    Ok(settings::position(&mut client)?.name())
}

/// Ports of a pattern, in the order of their names.
fn ports(pattern: &str) -> Vec<String> {
    let (folder, name) = pattern.rsplit_once('/').unwrap_or((".", pattern));
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let named = entries.filter(|entry| {
        entry.file_name().to_str().is_some_and(|other| matches_pattern(name, other))
    });
    let mut ports: Vec<String> = named.map(|entry| entry.path().display().to_string()).collect();
    ports.sort();
    ports
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => line.fmt(f),
            Self::Demo(demo) => demo.fmt(f),
            Self::Topics(topics) => topics.fmt(f),
        }
    }
}

impl Source {
    /// Path of the file that is played, if the source is a file.
    #[must_use]
    pub fn file(&self) -> Option<&Path> {
        match self {
            Self::Line(line) => line.file(),
            Self::Demo(_) | Self::Topics(_) => None,
        }
    }

    /// Returns the name of the line in messages, if the source is a device: its port or interface.
    #[must_use]
    pub fn device(&self) -> Option<&str> {
        match self {
            Self::Line(feet::Source::Uart { port, .. } | feet::Source::Slcan { port, .. }) => {
                Some(port)
            }
            Self::Line(feet::Source::Can { interface }) => Some(interface),
            Self::Line(feet::Source::File { .. }) | Self::Demo(_) | Self::Topics(_) => None,
        }
    }

    /// Returns whether the feet of the source are estimated here, from the samples of their IMUs.
    #[must_use]
    pub fn is_estimated_here(&self) -> bool {
        matches!(self, Self::Topics(_)) || self.file().is_some()
    }

    /// Sets how the samples of an IMU, recorded or live, are read and estimated. Other sources do not change.
    #[must_use]
    pub fn played_with(self, playback: Playback) -> Self {
        match self {
            Self::Line(line) => Self::Line(line.played_with(playback)),
            Self::Topics(topics) => {
                Self::Topics(TopicFeet { playback: Box::new(playback), ..topics })
            }
            demo @ Self::Demo(_) => demo,
        }
    }

    /// Sets the domain of topics, and the topics of their loads. Other sources do not change.
    #[must_use]
    pub fn with_topics(self, domain: &RosDomain, loads: &[FootLoad]) -> Self {
        match self {
            Self::Topics(topics) => {
                let (domain, loads) = (domain.clone(), loads.to_vec());
                Self::Topics(TopicFeet { domain, loads, ..topics })
            }
            other => other,
        }
    }

    /// Sets the speed of a playback if its text has none.
    #[must_use]
    pub fn at_speed(self, speed: Speed) -> Self {
        match self {
            Self::Line(line) => Self::Line(line.at_speed(speed)),
            Self::Demo(demo) => Self::Demo(demo.at_speed(speed)),
            topics @ Self::Topics(_) => topics,
        }
    }

    fn line(&self) -> &dyn LineSource {
        match self {
            Self::Line(line) => line,
            Self::Demo(demo) => demo,
            Self::Topics(topics) => topics,
        }
    }
}

impl LineSource for Source {
    fn open(&self) -> Result<Box<dyn Link>, LinkError> {
        self.line().open()
    }

    fn open_unpaced(&self) -> Result<Box<dyn Link>, LinkError> {
        self.line().open_unpaced()
    }

    fn open_for_requests(&self) -> Result<Box<dyn Link>, LinkError> {
        self.line().open_for_requests()
    }

    fn speed(&self) -> Option<Speed> {
        self.line().speed()
    }

    fn is_in_lock_step(&self) -> bool {
        self.line().is_in_lock_step()
    }
}

impl LineSource for TopicFeet {
    #[cfg(feature = "ros2")]
    fn open(&self) -> Result<Box<dyn Link>, LinkError> {
        let line = crate::ros::subscriber::TopicLine::open(self)?;
        Ok(Box::new(line))
    }

    #[cfg(not(feature = "ros2"))]
    fn open(&self) -> Result<Box<dyn Link>, LinkError> {
        Err(LinkError::Other(Box::new(Feature::Ros2.missing_for(self))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        text.parse::<SourceArgument>().expect_err(text).to_string()
    }

    #[test]
    fn unknown_source_error_lists_all_kinds() {
        assert_eq!(
            error("/dev/ttyACM0"),
            "\"/dev/ttyACM0\" is not a source; sources are usb, usb:FR, uart:PORT[@BAUD], can:INTERFACE, slcan:PORT[@KBIT], ros2:[FOOT=]TOPIC, file:PATH[@SPEED] and demo[:feet=4]"
        );
        let demo = SourceArgument::One(Source::Demo(Demo::default()));
        assert_eq!("demo".parse(), Ok(demo));
        assert_eq!("usb:FR".parse(), Ok(SourceArgument::OneOnUsb("FR".to_owned())));
    }

    #[test]
    fn sources_joined_by_commas_are_refused() {
        for text in ["uart:/dev/ttyACM0,uart:/dev/ttyACM1", "usb:FL,usb", "can:can0,can:can1"] {
            assert_eq!(
                error(text),
                format!("{text:?} are several sources: separate them by spaces")
            );
        }
        for text in ["demo:feet=2,line=uart", "file:a,can:b.log"] {
            assert!(text.parse::<SourceArgument>().is_ok(), "{text}");
        }
    }

    #[test]
    fn pattern_is_all_its_ports_or_an_error() {
        let folder = std::env::temp_dir().join(format!("footfall-ports-{}", std::process::id()));
        fs::create_dir(&folder).expect("a folder");
        for name in ["ttyACM1", "ttyACM0", "ttyUSB0"] {
            fs::write(folder.join(name), "").expect("a file");
        }
        let found = |pattern: &str| {
            let text = format!("uart:{}/{pattern}", folder.display());
            text.parse::<SourceArgument>().expect("a pattern").find()
        };
        let ports = found("ttyACM*@9600").expect("two ports");
        let expected = ["ttyACM0", "ttyACM1"];
        let expected = expected.map(|name| uart(folder.join(name).display().to_string(), 9600));
        assert_eq!(ports, expected);
        let none = found("ttyS*").expect_err("no such port").to_string();
        assert_eq!(none, format!("uart:{}/ttyS* matches no port", folder.display()));
        fs::remove_dir_all(&folder).expect("removed");
    }

    #[test]
    fn port_of_two_names_is_one_source() {
        let arguments = ["uart:/dev/null", "uart:/dev/../dev/null", "demo", "demo"];
        let arguments = arguments.map(|text| text.parse::<SourceArgument>().expect(text));
        assert_eq!(find_all(&arguments).expect("sources").len(), 2);
    }
}
