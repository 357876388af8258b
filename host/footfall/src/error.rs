//! Errors that end a command, each reported as one sentence in the words of the command line: [`enum@Error`] of any command,
//! [`FootError`] of requests to a foot, and the options that errors, findings and notices name.

use std::fmt::Display;
use std::io;

#[cfg(feature = "bags")]
use bags::ReplacementError;
use calibration::CalibrationError;
use config::{ConfigError, NoSuchFoot, ParameterRefusal};
use estimator_core::{Axis, ParamsError};
use feet::FootHint;
use feet::decode::DecodeError;
use feet::decode::known_feet::NamedTwice;
use feet::foot::RequestError;
use feet::foot::accept::AcceptError;
use feet::foot::name::NameError;
use feet::foot::self_test::SelfTestError;
use feet::foot::settings::SettingsError;
use feet::link::{LinkError, RecordingError};
use feet::remedy::Trouble;
use options::hint::{Hint, InWords, Setting, Vocabulary};
use replay::ReplayError;
use stored::error::{InputError, Problem};
use thiserror::Error;
use wire::{Fault, NodeId};

use crate::feature::{Feature, NotBuilt};
use crate::files::OutputError;
use crate::ros::compat::MixedBodies;
use crate::source::FindError;
use crate::stream::SameName;

/// Reason a command failed.
#[derive(Debug, Error)]
pub enum Error {
    /// A feature required by the command is not built.
    #[error(transparent)]
    NotBuilt(#[from] NotBuilt),
    /// The recording cannot be used.
    #[error("{}", in_words(.0))]
    Input(InputError),
    /// The input of a decoding cannot be used.
    #[error(transparent)]
    Decode(#[from] DecodeError),
    /// Names of feet contradict each other.
    #[error(transparent)]
    Names(#[from] NamedTwice),
    /// The configuration file cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// No fault, flag or refusal has this name.
    #[error(
        "{0:?} is unknown; footfall explain lists all faults, flags, refusals, states and findings"
    )]
    NothingToExplain(String),
    /// The parameters are invalid; described by the estimator.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
    /// The parameters are invalid; described by the option or key that sets them.
    #[error("{}", in_words(.0))]
    Refused(#[from] ParameterRefusal),
    /// The recordings do not contain the data a calibration needs.
    #[error("{}", in_words(.0))]
    Calibration(#[from] CalibrationError),
    /// Files and walking feet are to be calibrated at once.
    #[error("files and walking feet are calibrated separately: name one kind")]
    FilesAndFeet,
    /// Options are given that only the other kind of input uses.
    #[error("the calibration of {inputs} does not use {options}")]
    UnusedOptions {
        /// Kind of the inputs.
        inputs: &'static str,
        /// The options.
        options: String,
    },
    /// A source has no line.
    #[error(transparent)]
    Find(#[from] FindError),
    /// Two boards are one foot.
    #[error(transparent)]
    SameName(#[from] SameName),
    /// No foot has sent anything that could be recorded.
    #[error("nothing was recorded, and no file is written")]
    NothingHeard,
    /// A recording is implausible and `--strict` is given.
    #[error("{file}: --strict rejects {count} of the findings above")]
    Implausible {
        /// Recording as given.
        file: String,
        /// Number of findings.
        count: usize,
    },
    /// The requested span ends before it begins.
    #[error("--to {to} is not after --from {from}")]
    EmptySpan {
        /// Start of the span, s.
        from: f64,
        /// End of the span, s.
        to: f64,
    },
    /// The requested span begins after the end of the recording.
    #[error("{file}: --from {from} is after its end; the recording lasts {duration:.3} s")]
    BeyondTheEnd {
        /// Recording as given.
        file: String,
        /// Requested start, s since the first sample.
        from: f64,
        /// Duration from the first to the last sample, s.
        duration: f64,
    },
    /// The requested span lies in a gap of the recording.
    #[error("{0}: there is no sample from --from to --to")]
    NothingInSpan(String),
    /// The samples or rows cannot be stored temporarily.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// A result cannot be written.
    #[error(transparent)]
    Output(OutputError),
    /// A request to a foot failed.
    #[error(transparent)]
    Foot(#[from] FootError),
    /// The ROS 2 node failed.
    #[cfg(feature = "ros2")]
    #[error("ROS 2: {0}")]
    Ros2(#[from] crate::ros::node::NodeError),
    /// The source failed.
    #[error("{}", with_hint(.0, .0.hint()))]
    Source(LinkError),
    /// A conversion has no output.
    #[error("no output is given: name it after the recordings, or with --output")]
    NoOutput,
    /// Two recordings of a robot have the same foot.
    #[error(
        "{name} is in both {} and {}, but a robot has each foot once; convert one of them with --rename {name}=OTHER first", files[0], files[1]
    )]
    FootTwice {
        /// Name of the foot.
        name: String,
        /// The recordings.
        files: [String; 2],
    },
    /// Several feet cannot be written to one table.
    #[error(
        "{file} has several feet, but a table holds one: {}; choose one with --topic, or write .mcap",
        feet.join(", ")
    )]
    OneFootOnly {
        /// Recording as given.
        file: String,
        /// Names of the feet.
        feet: Vec<String>,
    },
    /// A foot is calibrated where there are settings of single feet, and it is not named.
    #[error(
        "the configuration has settings only of the foot {0}: name the foot to calibrate with --foot"
    )]
    WhichFoot(String),
    /// One of several feet cannot be calibrated.
    #[error("foot {foot}: {source}")]
    OfFoot {
        /// Name of the foot.
        foot: String,
        /// Reason.
        source: Box<Error>,
    },
    /// A variable of the environment has no valid value.
    #[error("environment variable {name}: {reason}")]
    Variable {
        /// Name of the variable.
        name: &'static str,
        /// Reason, with the value.
        reason: String,
    },
    /// Options about recordings of an IMU are given for feet that stream.
    #[error(
        "{0} is not a recording of an IMU: --config, --topic, --load-topic, --axes, --units and similar options apply only to file: and ros2:"
    )]
    NotPlayed(String),
    /// Topics and feet are to be calibrated together.
    #[error(
        "{0} and feet with a program of their own are calibrated one after the other: the former is estimated here"
    )]
    TopicsAndFeet(String),
    /// Loads on topics are given for other sources.
    #[error(
        "{0} has no topics of ROS 2, for which --load names the loads of feet: use ros2:FOOT=TOPIC"
    )]
    LoadOfNoTopic(String),
    /// Forms of messages are of different numbers of feet.
    #[error(transparent)]
    MixedBodies(#[from] MixedBodies),
    /// A bag has a topic that contacts are written to.
    #[error(
        "{file} already has the topic {topic}, from an earlier estimate or from another program; --estimate-again replaces its messages"
    )]
    TopicTaken {
        /// Bag as given.
        file: String,
        /// Topic of the contacts of a foot, or of messages of all feet.
        topic: String,
    },
    /// An option asks for messages of all feet, but the contacts of the bag are copied unchanged.
    #[error("{file} has contacts, which are copied unchanged: {option} needs --estimate-again")]
    CopiedContacts {
        /// Bag as given.
        file: String,
        /// Option of the messages.
        option: &'static str,
    },
    /// A foot has no place in messages of all feet.
    #[error(
        "the foot {name} has no place of its own in the messages of all feet, which are those of {names}: {}leave its topic out with --not-topic",
        free.map(|free| format!("name it, as in --rename {name}={free}, or ")).unwrap_or_default()
    )]
    NoPlace {
        /// Name of the foot.
        name: String,
        /// Names of all feet.
        names: String,
        /// The first of these names that no foot has, if any.
        free: Option<&'static str>,
    },
    /// Messages of all feet are to be written, and feet are missing.
    #[error(
        "missing feet: {absent}; {option} writes messages of {names}, and a missing foot may be standing; --compat bool and wrench have a topic for each foot"
    )]
    AbsentFeet {
        /// Option that requests the messages.
        option: &'static str,
        /// Names of the missing feet.
        absent: String,
        /// Names of all feet.
        names: String,
    },
    /// Messages whose forces are to be replaced have none.
    #[cfg(feature = "bags")]
    #[error("{file}, topic {topic}: no forces of four feet to replace: {cause}")]
    NoForces {
        /// Bag as given.
        file: String,
        /// Topic of the robot's states.
        topic: String,
        /// Reason.
        cause: NoForcesCause,
    },
    /// Axes are given for a foot that is not in the recordings.
    #[error("{}", in_words(.0))]
    NoSuchFoot(#[from] NoSuchFoot),
    /// The viewer server failed.
    #[cfg(feature = "foxglove")]
    #[error(transparent)]
    View(#[from] crate::commands::view::server::ViewError),
    /// Standard output cannot be written.
    #[error("standard output cannot be written: {0}")]
    Print(#[source] io::Error),
}

/// Reason why messages have no forces that could be replaced.
#[cfg(feature = "bags")]
#[derive(Debug, Error)]
pub enum NoForcesCause {
    /// The topic has no message.
    #[error("the bag has no message on it")]
    NoMessage,
    /// The numbers are not found in a message.
    #[error(transparent)]
    Replacement(#[from] ReplacementError),
}

/// An error of another kind that has ended the writing is that error.
impl From<OutputError> for Error {
    fn from(error: OutputError) -> Self {
        match error {
            OutputError::Unwritable { file, source } => source
                .downcast()
                .unwrap_or_else(|source| Self::Output(OutputError::Unwritable { file, source })),
            error => Self::Output(error),
        }
    }
}

/// An error of the recording that a source plays is that error.
impl From<LinkError> for Error {
    fn from(error: LinkError) -> Self {
        match error {
            LinkError::Recording(error) => match *error {
                RecordingError::Input(error) => error.into(),
                RecordingError::Parameters(error) => error.into(),
                RecordingError::NoSuchFoot(error) => error.into(),
            },
            error => Self::Source(error),
        }
    }
}

/// An unsupported format is reported as a missing feature.
impl From<InputError> for Error {
    fn from(error: InputError) -> Self {
        if let Problem::NotBuilt { feature, .. } = error.problem
            && let Some(feature) = Feature::of_name(feature)
        {
            Self::NotBuilt(feature.missing_for(error.file))
        } else {
            Self::Input(error)
        }
    }
}

/// Reason a request to a foot failed.
#[derive(Debug, Error)]
pub enum FootError {
    /// A request failed.
    #[error("{}", with_hint(.0, .0.hint()))]
    Request(#[from] RequestError),
    /// The name is unknown, or the value is not accepted.
    #[error("{}", with_hint(.0, .0.hint()))]
    Name(#[from] NameError),
    /// Settings were rejected.
    #[error("{}", with_hint(.0, .0.hint()))]
    Settings(#[from] SettingsError),
    /// A board cannot be measured further.
    #[error("{}", with_hint(.0, .0.hint()))]
    Accept(#[from] AcceptError),
    /// The self-test gave no verdict.
    #[error("{}", with_hint(.0, .0.hint()))]
    SelfTest(#[from] SelfTestError),
    /// The sensor has failed its self-test, on these axes; `None` if the foot does not report them.
    #[error("the sensor's self-test has failed{}: {}", failed_axes(.0.as_deref()), Trouble::Fault(Fault::SensorSelfTest).remedy())]
    TestFailed(Option<Vec<Axis>>),
    /// Simulated feet are to be updated.
    #[error(
        "demo feet have no bootloader and cannot be updated: name a line such as can:can0 or uart:/dev/ttyACM0"
    )]
    NoBootloader,
    /// A configuration cannot be used.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The command was interrupted.
    #[error("interrupted: nothing was written")]
    Interrupted,
    /// Learning is disabled by the settings of the foot.
    #[error("the settings of the foot disable learning: set method=self_calibrating learning=on")]
    LearnsNothing,
    /// The foot has not learnt enough in the given time.
    #[error(
        "the foot has not learnt enough in {seconds} s ({seen}): let it walk a few steps; nothing was stored"
    )]
    NotSettled {
        /// Timeout, s.
        seconds: f64,
        /// Observed stillness and motion.
        seen: String,
    },
    /// An argument does not have the form of a setting.
    #[error("{0:?} is not a setting: write NAME=VALUE, such as decision.threshold=0.6")]
    NoSetting(String),
    /// The named entry is not writable.
    #[error("{0} is not a setting and cannot be written")]
    NotWritable(String),
    /// A setting is given two values.
    #[error("{0} is named twice")]
    NamedTwice(String),
    /// The foot runs its bootloader, which has no settings.
    #[error("{} runs its bootloader, because it has no program or waits for one; footfall foot SOURCE update FILE sends one", .0.map_or_else(|| "the foot".to_owned(), |node| format!("node {}", node.get())))]
    InBootloader(Option<NodeId>),
    /// Figures of a board are out of their limits.
    #[error("not accepted: {0}")]
    NotAccepted(String),
    /// Some feet were not updated.
    #[error("{0}")]
    NotUpdated(String),
    /// The line does not work.
    #[error("{}", with_hint(.0, .0.hint()))]
    Link(#[from] LinkError),
    /// A file cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// Standard output cannot be written.
    #[error("standard output cannot be written: {0}")]
    Print(#[source] io::Error),
    /// A file of settings cannot be used.
    #[error("{file}: {message}")]
    File {
        /// Name of the file.
        file: String,
        /// Error message.
        message: String,
    },
}

/// Returns an error or a notice of [`feet`] with its hint, in the options and commands of this program.
pub(crate) fn with_hint(message: impl Display, hint: Option<FootHint>) -> String {
    match hint {
        None => message.to_string(),
        Some(FootHint::NameOneFoot) => format!("{message}: name one with --node"),
        Some(FootHint::NameNodeAsFoot(node)) => format!("{message}: --node {node}"),
        Some(FootHint::ListObjects) => format!("{message}; `footfall foot SOURCE get` lists all"),
        Some(FootHint::SwitchSelfTestOff) => {
            format!("{message} until footfall foot … set self_test_at_start=0 --save")
        }
        Some(FootHint::OmitEstimateOptions) => format!(
            "{message}: --config, --topic, --load-topic, --axes, --units and similar options apply only to recordings of an IMU"
        ),
        Some(FootHint::MountDrive) => format!(
            "{message}; where none appears, lsblk --output NAME,LABEL names its partition: sudo mount it, and repeat this command"
        ),
    }
}

fn failed_axes(axes: Option<&[Axis]>) -> String {
    let Some(axes) = axes else {
        return String::new();
    };
    let names: Vec<_> = axes.iter().map(|axis| axis.name()).collect();
    format!(" on {}", names.join(", "))
}

/// Options of the command line.
#[derive(Clone, Copy, Debug)]
pub struct CommandLine;

impl Vocabulary for CommandLine {
    fn name(&self, setting: Setting) -> String {
        format!("--{}", setting.name().replace(' ', "-"))
    }

    fn set(&self, setting: Setting, value: &dyn Display) -> String {
        format!("{} {value}", self.name(setting))
    }

    fn remedy(&self, hint: &Hint) -> Option<String> {
        let convert = "for readers that refuse such a file, footfall convert writes a whole one";
        matches!(hint, Hint::WholeCopy).then(|| convert.to_owned())
    }
}

/// Returns the text of an error, a finding or a notice, with options in it.
pub fn in_words(what: &impl InWords) -> String {
    what.in_words(&CommandLine)
}

#[cfg(test)]
mod tests {
    use super::*;
    #[cfg(target_os = "linux")]
    use feet::usb::CopyError;

    #[test]
    fn errors_name_options_and_commands_of_this_program() {
        for (error, expected) in [
            (
                FootError::from(RequestError::SeveralFeet(vec![17, 18])),
                "there are several feet, 17, 18: name one with --node",
            ),
            (
                NameError::Unknown("windw".to_owned()).into(),
                "no object has the name \"windw\"; `footfall foot SOURCE get` lists all",
            ),
            (
                SelfTestError::StaysOn(RequestError::NoFoot).into(),
                "no foot was found on this line; the self-test stays on at each start until footfall foot … set self_test_at_start=0 --save",
            ),
            (RequestError::NoFoot.into(), "no foot was found on this line"),
        ] {
            assert_eq!(error.to_string(), expected);
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn missing_drive_error_names_the_commands_that_mount_it() {
        let error = CopyError::NoDrive {
            port: "/dev/ttyACM0".to_owned(),
            drive: "RPI-RP2",
            by_hand: "press the board's button twice",
        };
        assert_eq!(
            with_hint(&error, error.hint()),
            "no drive RPI-RP2 is mounted 30 s after /dev/ttyACM0 was asked for it: press the board's button twice, and copy the file to the drive that appears; where none appears, lsblk --output NAME,LABEL names its partition: sudo mount it, and repeat this command"
        );
    }

    #[test]
    fn hint_names_the_option_with_its_value() {
        assert_eq!(in_words(&Hint::Units("g,dps".parse().unwrap())), "--units g,dps");
        assert_eq!(
            in_words(&Hint::ChooseTopic { topics: true, frames: true }),
            "choose with --topic and --frame, or --topic all"
        );
        assert_eq!(in_words(&Hint::SampleRate), "--sample-rate HZ");
    }

    #[test]
    fn hint_names_the_command_that_writes_a_whole_file() {
        assert_eq!(
            in_words(&Hint::WholeCopy),
            "for readers that refuse such a file, footfall convert writes a whole one"
        );
    }
}
