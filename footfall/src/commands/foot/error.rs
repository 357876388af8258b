//! Why a foot could not be asked or set.

use decode::remedy::Trouble;
use estimator_core::Axis;
use live::foot::client::RequestError;
use live::foot::name::NameError;
use live::foot::position::PositionError;
use live::foot::self_test::SelfTestError;
use live::foot::settings::SettingsError;
use live::foot::sync::SyncError;
use thiserror::Error;
use wire::Fault;

/// Why a foot could not be asked or set.
#[derive(Debug, Error)]
pub enum FootError {
    /// A request came to nothing.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// There is no such name, or it does not take this value.
    #[error(transparent)]
    Name(#[from] NameError),
    /// Settings were not taken.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The board cannot be that foot.
    #[error(transparent)]
    Position(#[from] PositionError),
    /// The self-test came to no verdict.
    #[error(transparent)]
    SelfTest(#[from] SelfTestError),
    /// The sensor has failed its self-test.
    #[error("the sensor's self-test has failed{}: {}", failed_axes(axes.as_deref()), Trouble::Fault(Fault::SensorSelfTest).remedy())]
    TestFailed {
        /// The axes; `None` where the foot does not say.
        axes: Option<Vec<Axis>>,
    },
    /// The settings let the foot learn nothing.
    #[error(
        "the foot learns nothing with its settings: set estimation.method=0 estimation.learning=1"
    )]
    LearnsNothing,
    /// The foot has not learnt enough.
    #[error(
        "the foot has not learnt enough in {seconds} s ({seen}): let it walk a few steps; nothing was kept"
    )]
    NotSettled {
        /// How long it was given, s.
        seconds: f64,
        /// What it has seen.
        seen: String,
    },
    /// Somebody sends SYNCs already.
    #[error("this bus has SYNCs already: leave out --send")]
    HasSync,
    /// Clocks cannot be compared.
    #[error(transparent)]
    Clocks(#[from] SyncError),
    /// An argument is no setting.
    #[error("{0:?} is no setting: write NAME=VALUE, such as decision.threshold=0.6")]
    NoSetting(String),
    /// What was named cannot be written.
    #[error("{0} is no setting: it cannot be written")]
    NotWritable(String),
    /// A setting is given two values.
    #[error("{0} is named twice")]
    NamedTwice(String),
    /// A file of settings cannot be used.
    #[error("{file}: {message}")]
    File {
        /// Its name.
        file: String,
        /// What is wrong.
        message: String,
    },
}

fn failed_axes(axes: Option<&[Axis]>) -> String {
    let Some(axes) = axes else {
        return String::new();
    };
    let names: Vec<_> = axes.iter().map(|axis| axis.name()).collect();
    format!(" on {}", names.join(", "))
}
