//! Errors of requests to a foot.

use std::fmt;

use estimator_core::Axis;
use feet::FootHint;
use feet::decode::remedy::Trouble;
use feet::foot::RequestError;
use feet::foot::accept::AcceptError;
use feet::foot::name::NameError;
use feet::foot::self_test::SelfTestError;
use feet::foot::settings::SettingsError;
use feet::link::LinkError;
use thiserror::Error;
use wire::{Fault, NodeId};

use crate::files::OutputError;

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
    /// Learning is disabled by the settings of the foot.
    #[error("the foot learns nothing with its settings: set method=self_calibrating learning=on")]
    LearnsNothing,
    /// The foot has not learnt enough in the given time.
    #[error(
        "the foot has not learnt enough in {seconds} s ({seen}): let it walk a few steps; nothing was kept"
    )]
    NotSettled {
        /// Timeout, s.
        seconds: f64,
        /// Observed stillness and motion.
        seen: String,
    },
    /// An argument does not have the form of a setting.
    #[error("{0:?} is no setting: write NAME=VALUE, such as decision.threshold=0.6")]
    NoSetting(String),
    /// The named entry is not writable.
    #[error("{0} is no setting: it cannot be written")]
    NotWritable(String),
    /// A setting is given two values.
    #[error("{0} is named twice")]
    NamedTwice(String),
    /// The foot runs its bootloader, which has no settings.
    #[error("{} runs its bootloader: it has no program, or waits for one; footfall foot SOURCE update FILE sends it", .0.map_or_else(|| "the foot".to_owned(), |node| format!("node {}", node.get())))]
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
    #[error(transparent)]
    Print(std::io::Error),
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
pub(crate) fn with_hint(message: impl fmt::Display, hint: Option<FootHint>) -> String {
    match hint {
        None => message.to_string(),
        Some(FootHint::NameOneFoot) => format!("{message}: name one with --node"),
        Some(FootHint::NameNodeAsFoot(node)) => format!("{message}: --node {node}"),
        Some(FootHint::ListObjects) => format!("{message}; `footfall foot SOURCE get` lists all"),
        Some(FootHint::SwitchSelfTestOff) => {
            format!("{message} until footfall foot … set self_test_at_start=0 --save")
        }
        Some(FootHint::OmitEstimateOptions) => format!(
            "{message}: --config, --topic, --load-topic, --axes, --units and their like are for recordings of an IMU"
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_name_options_and_commands_of_this_program() {
        for (error, expected) in [
            (
                FootError::from(RequestError::SeveralFeet(vec![17, 18])),
                "there are several feet, 17, 18: name one with --node",
            ),
            (
                NameError::Unknown("windw".to_owned()).into(),
                "no object is called \"windw\"; `footfall foot SOURCE get` lists all",
            ),
            (
                SelfTestError::StaysOn(RequestError::NoFoot).into(),
                "no foot is heard on this line; the self-test stays on at each start until footfall foot … set self_test_at_start=0 --save",
            ),
            (RequestError::NoFoot.into(), "no foot is heard on this line"),
        ] {
            assert_eq!(error.to_string(), expected);
        }
    }
}
