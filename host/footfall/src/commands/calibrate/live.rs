//! Calibration of feet while they stand and walk.
//!
//! A foot learns by itself. Here it is asked to stand, which shows its axes, and to walk until it has learnt enough; then
//! both are written to it, and to a configuration file. All feet of a robot learn from the same walk.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::time::Duration;

use estimator_core::Learnt;
use feet::LineSource;
use feet::foot::accept::{self, Person};
use feet::foot::settings::{self, Lasting, SettingValues};
use feet::foot::{Client, calibration};
use recordings::mounting::{MountingReport, RestingUp, settings_of};
use serde::{Serialize, Serializer};
use wire::node::Calibration;

use super::CalibrateArguments;
use crate::commands::foot::{name_of, wait_until_settled};
use crate::error::{Error, FootError};
use crate::interruption::{finish_when_interrupted, is_interrupted};
use crate::messages;
use crate::report::Described;
use crate::source::{Source, SourceArgument, find_all};

/// Returns the inputs as sources of walking feet, or `None` if all of them are files.
///
/// # Errors
/// Some are files and some are not, or a source is not found.
pub(super) fn sources(inputs: &[PathBuf]) -> Result<Option<Vec<Source>>, Error> {
    let source = |input: &PathBuf| {
        let text = input.to_str().filter(|_| !input.exists())?;
        let source: SourceArgument = text.parse().ok()?;
        source.file().is_none().then_some(source)
    };
    let sources: Vec<SourceArgument> = inputs.iter().filter_map(source).collect();
    if sources.is_empty() {
        return Ok(None);
    }
    if sources.len() < inputs.len() {
        return Err(Error::FilesAndFeet);
    }
    Ok(Some(find_all(&sources)?))
}

/// A foot that is calibrated.
struct Walking {
    client: Client,
    name: &'static str,
    mounting: Option<MountingReport>,
}

/// Calibrates the feet of these lines.
pub(super) fn calibrate(arguments: &CalibrateArguments, sources: &[Source]) -> Result<(), Error> {
    arguments.check_output(&[])?;
    let resolved = arguments.recording.resolved(None)?;
    // Settings of the feet are changed and put back.
    finish_when_interrupted();
    let mut feet = Vec::new();
    for source in sources {
        feet.push(stand(arguments, source)?);
    }
    let mut report = LiveReport { feet: BTreeMap::new(), written: false };
    for foot in &mut feet {
        let words = format!("{}: let the foot walk", foot.name);
        wait_until_settled(&mut foot.client, arguments.seconds.into(), &words)?;
        let learnt = calibration::learnt(&mut foot.client).map_err(FootError::from)?;
        let walked = WalkedFoot { learnt, mounting: foot.mounting.clone() };
        report.feet.insert(foot.name.to_owned(), walked);
    }
    report.written = arguments.write || agrees(&report);
    if report.written {
        for foot in &mut feet {
            write(foot)?;
        }
    } else {
        messages::aside("not written to the foot: `footfall calibrate SOURCE --write` writes it");
    }
    arguments.write_outputs(&resolved, &report, |file| {
        report.feet.iter().fold(file, |file, (name, walked)| {
            let mut file = file.of_foot(Some(name.clone()));
            file.set_learnt_by_foot(name, &walked.learnt);
            file.set_mounting(walked.mounting.as_ref());
            file
        })
    })
}

/// Waits until a foot stands still, and finds its axes.
fn stand(arguments: &CalibrateArguments, source: &Source) -> Result<Walking, Error> {
    let link = source.open_for_requests()?;
    let mut client = Client::new(link, arguments.node).map_err(FootError::from)?;
    let name = name_of(&mut client)?;
    let given = calibration::mounting(&mut client).map_err(FootError::from)?;
    let mut person = Person {
        patience: Duration::from_secs(arguments.seconds.into()),
        tell: &mut |words| messages::aside(format!("{name}: {words}")),
        has_left: &is_interrupted,
    };
    let up = accept::force_at_rest(&mut client, &given, &mut person).map_err(FootError::from)?;
    if is_interrupted() {
        return Err(FootError::Interrupted.into());
    }
    let mut rest = RestingUp::default();
    if up.is_none() {
        messages::warn(format!("{name} has not stood still, so its axes are not known"));
    }
    rest.add(up);
    let mounting = MountingReport::of(&rest, &given);
    Ok(Walking { client, name, mounting })
}

/// Asks whether to write the report's values to the feet. Without a terminal the answer is no.
fn agrees(report: &LiveReport) -> bool {
    if !io::stdin().is_terminal() || !io::stderr().is_terminal() {
        return false;
    }
    let names: Vec<&str> = report.feet.keys().map(String::as_str).collect();
    messages::aside(format!("{report}\nwrite this to {}? [y/N]", names.join(", ")));
    let mut answer = String::new();
    let is_read = io::stdin().read_line(&mut answer).is_ok();
    is_read && matches!(answer.trim().to_lowercase().as_str(), "y" | "yes")
}

/// Makes a foot keep its learnt values and its axes.
fn write(foot: &mut Walking) -> Result<(), FootError> {
    calibration::store(&mut foot.client, Calibration::Keep)?;
    let Some(mounting) = &foot.mounting else {
        return Ok(());
    };
    // A new mounting starts a new estimate, with the values that are kept.
    let values = settings_of(&mounting.axes);
    let values = values.into_iter().map(|(name, value)| (name.to_owned(), value));
    let values: SettingValues = settings::from_configuration(values, foot.client.node())?.values;
    settings::write(&mut foot.client, &values, Lasting::Stored)?;
    Ok(())
}

/// Report on feet that have walked.
#[derive(Debug, Serialize)]
struct LiveReport {
    /// The feet by name.
    feet: BTreeMap<String, WalkedFoot>,
    /// Whether the feet keep it.
    written: bool,
}

/// Result of a foot.
#[derive(Debug, Serialize)]
struct WalkedFoot {
    /// Learnt values.
    #[serde(serialize_with = "serialize_learnt")]
    learnt: Learnt,
    /// Mounting of its sensor; null if the sensor's axes are those of the foot.
    mounting: Option<MountingReport>,
}

fn serialize_learnt<S: Serializer>(learnt: &Learnt, to: S) -> Result<S::Ok, S::Error> {
    let rows = Learnt::ROWS.iter().map(|row| row.name.trim_start_matches("learnt."));
    to.collect_map(rows.zip(learnt.to_array()))
}

impl Described for LiveReport {
    const SCHEMA: &'static str = "urn:footfall:calibrate-live:1";
}

impl fmt::Display for LiveReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, (name, walked)) in self.feet.iter().enumerate() {
            let gap = if k > 0 { "\n" } else { "" };
            let [still, moving, _, still_s, moving_s] = walked.learnt.to_array();
            write!(
                f,
                "{gap}foot {name}\nlearnt from {still_s:.1} s of stillness and {moving_s:.1} s of motion\n\
                 acceleration at rest {:.3}, in motion {:.2} m/s²",
                still.exp(),
                moving.exp()
            )?;
            match &walked.mounting {
                Some(mounting) => write!(f, "\n{mounting}")?,
                None => f.write_str("\naxes x,y,z: z is up")?,
            }
        }
        if self.written { f.write_str("\nkept and stored on the foot") } else { Ok(()) }
    }
}
