//! Errors of the actions on a foot.

use estimator_core::Axis;
use feet::remedy::Trouble;
use thiserror::Error;
use wire::{Fault, NodeId};

use crate::error::Worded;

/// Reason an action on a foot failed, beside those of its requests.
#[derive(Debug, Error)]
pub enum FootError {
    /// The sensor has failed its self-test, on these axes; `None` if the foot does not report them.
    #[error("the sensor's self-test has failed{}: {}", failed_axes(.0.as_deref()), Trouble::Fault(Fault::SensorSelfTest).remedy())]
    TestFailed(Option<Vec<Axis>>),
    /// Simulated feet are to be updated.
    #[error(
        "demo feet have no bootloader and cannot be updated: name a line such as can:can0 or uart:/dev/ttyACM0"
    )]
    NoBootloader,
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
    /// Some feet were not updated.
    #[error("{0}")]
    NotUpdated(String),
    /// A file of settings cannot be used.
    #[error("{file}: {message}")]
    File {
        /// Name of the file.
        file: String,
        /// Error message.
        message: String,
    },
}

impl Worded for FootError {}

fn failed_axes(axes: Option<&[Axis]>) -> String {
    let Some(axes) = axes else {
        return String::new();
    };
    let names: Vec<_> = axes.iter().map(|axis| axis.name()).collect();
    format!(" on {}", names.join(", "))
}
