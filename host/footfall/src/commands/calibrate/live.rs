//! Calibration of feet while they stand and walk.
//!
//! A foot learns by itself. The person first lets each foot stand, which shows its sensor's axes, and then walk until it
//! has learnt enough. Then the axes and the learnt values are written to the feet, and to a configuration file. All feet
//! of a robot learn from the same walk.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, IsTerminal};
use std::path::PathBuf;
use std::time::Duration;

use ::calibration::robot_file::RobotFile;
use estimator_core::mounting::Mounting;
use estimator_core::{Learnt, Vec3};
use feet::LineSource;
use feet::foot::accept::{self, Person};
use feet::foot::settings::{self, Lasting, SettingValues};
use feet::foot::{Client, calibration};
use samples::mounting::{MountingReport, RestingUp, settings_of};
use serde::{Serialize, Serializer};
use wire::Foot;
use wire::node::Calibration;

use super::{CalibrateArguments, CalibrateError};
use crate::commands::foot::{check_interruption, wait_until_settled};
use crate::error::Error;
use crate::interruption::{finish_when_interrupted, is_interrupted};
use crate::messages;
use crate::report::Described;
use crate::source::{Source, SourceArgument, find_all};
use crate::stream::SameName;

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
        return Err(CalibrateError::FilesAndFeet.into());
    }
    Ok(Some(find_all(&sources)?))
}

/// A foot that is calibrated.
struct Walking {
    client: Client,
    name: &'static str,
    /// Index of its source.
    source: usize,
    /// Mounting of its sensor before the calibration.
    given: Mounting,
    axes: FoundAxes,
}

/// Mounting of a sensor as gravity shows it.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
enum FoundAxes {
    /// The foot has not stood still.
    Unknown,
    /// The foot stood still; `None` if the sensor's axes are the axes of the foot.
    #[serde(untagged)]
    Known(Option<MountingReport>),
}

impl FoundAxes {
    /// Returns the mounting for a foot with the mounting `given` and this gravity at rest, m/s², if it is known.
    fn of(gravity: Option<Vec3>, given: &Mounting) -> Self {
        let Some(gravity) = gravity else {
            return Self::Unknown;
        };
        let mut rest = RestingUp::default();
        rest.add(Some(gravity));
        Self::Known(MountingReport::of(&rest, given))
    }

    /// Sentence about the foot with this name, if its axes are unknown.
    fn warning(&self, name: &str) -> Option<String> {
        matches!(self, Self::Unknown)
            .then(|| format!("{name} has not stood still, so its axes are not known"))
    }
}

/// Calibrates the feet of these lines.
pub(super) fn calibrate(arguments: &CalibrateArguments, sources: &[Source]) -> Result<(), Error> {
    arguments.check_output(&[])?;
    let resolved = arguments.recording.resolved(None)?;
    // An interruption must not end the program while settings of the feet are changed for the calibration.
    finish_when_interrupted();
    let mut feet = open(arguments, sources)?;
    for foot in &mut feet {
        stand(arguments, foot)?;
    }
    let mut report = LiveReport { feet: BTreeMap::new(), written: false };
    for foot in &mut feet {
        let words = format!("{}: let the foot walk", foot.name);
        wait_until_settled(&mut foot.client, arguments.walking.seconds.into(), &words)?;
        let learnt = calibration::learnt(&mut foot.client)?;
        let walked = WalkedFoot { learnt, mounting: foot.axes.clone() };
        report.feet.insert(foot.name.to_owned(), walked);
    }
    report.written = arguments.walking.write || agrees(&report);
    check_interruption()?;
    if report.written {
        for foot in &mut feet {
            write(foot)?;
        }
    } else {
        messages::aside("not written to the foot: `footfall calibrate SOURCE --write` writes it");
    }
    arguments.write_outputs(&resolved, &report, |file| report.set_in(file))
}

/// Connects to the feet.
///
/// # Errors
/// A foot does not respond, or two boards have the same name, so that one result would replace the other.
fn open(arguments: &CalibrateArguments, sources: &[Source]) -> Result<Vec<Walking>, Error> {
    let mut feet: Vec<Walking> = Vec::new();
    for (index, source) in sources.iter().enumerate() {
        let link = source.open_for_requests()?;
        for mut client in Client::each(link, arguments.walking.node)? {
            let name = settings::position(&mut client)?.name();
            let given = calibration::mounting(&mut client)?;
            let axes = FoundAxes::Unknown;
            feet.push(Walking { client, name, source: index, given, axes });
        }
    }
    check_names(&feet, sources)?;
    Ok(feet)
}

/// Checks that each of the feet of these sources has a name of its own.
fn check_names(feet: &[Walking], sources: &[Source]) -> Result<(), SameName> {
    let has_name = |name: &str| feet.iter().position(|foot| foot.name == name);
    for (second, foot) in feet.iter().enumerate() {
        if let Some(first) = has_name(foot.name)
            && first < second
        {
            let unused =
                Foot::ALL.map(Foot::name).into_iter().find(|name| has_name(name).is_none());
            let board = |foot: usize| (&sources[feet[foot].source], feet[foot].client.node());
            let boards = [board(first), board(second)];
            return Err(SameName::of_asked(foot.name, boards, unused.unwrap_or("R")));
        }
    }
    Ok(())
}

/// Waits until a foot stands still, and finds its axes.
fn stand(arguments: &CalibrateArguments, foot: &mut Walking) -> Result<(), Error> {
    let name = foot.name;
    let mut person = Person {
        patience: Duration::from_secs(arguments.walking.seconds.into()),
        tell: &mut |words| messages::aside(format!("{name}: {words}")),
        has_left: &is_interrupted,
    };
    let up = accept::force_at_rest(&mut foot.client, &foot.given, &mut person)?;
    check_interruption()?;
    foot.axes = FoundAxes::of(up, &foot.given);
    foot.axes.warning(name).into_iter().for_each(messages::warn);
    Ok(())
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
fn write(foot: &mut Walking) -> Result<(), Error> {
    calibration::store(&mut foot.client, Calibration::Keep)?;
    let FoundAxes::Known(Some(mounting)) = &foot.axes else {
        return Ok(());
    };
    // The mounting is written last, because it restarts the estimate, which begins with the stored values.
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
    /// Mounting of the foot's sensor: null if the sensor's axes are those of the foot, `unknown` if the foot has not
    /// stood still.
    mounting: FoundAxes,
}

impl LiveReport {
    /// Sets the learnt values and the mounting of each foot in a configuration file.
    fn set_in(&self, file: RobotFile) -> RobotFile {
        self.feet.iter().fold(file, |file, (name, walked)| {
            let mut file = file.of_foot(Some(name.clone()));
            file.set_learnt_by_foot(name, &walked.learnt);
            // Unknown axes leave the axes of the configuration as they are.
            if let FoundAxes::Known(mounting) = &walked.mounting {
                file.set_mounting(mounting.as_ref());
            }
            file
        })
    }
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
                FoundAxes::Known(Some(mounting)) => write!(f, "\n{mounting}")?,
                FoundAxes::Known(None) => f.write_str("\naxes x,y,z: z is up")?,
                FoundAxes::Unknown => {
                    f.write_str("\naxes not known: the foot has not stood still")?;
                }
            }
        }
        if self.written { f.write_str("\nkept and stored on the foot") } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "axes = \"x,y,z\"\n[feet.FL]\naxes = \"x,-z,y\"\n";

    /// Returns the report on a foot FL with identity axes on the board and this gravity at rest.
    fn report_with(gravity: Option<Vec3>) -> LiveReport {
        let learnt = Learnt::from_array([0.0; Learnt::NUMBERS]);
        let mounting = FoundAxes::of(gravity, &Mounting::IDENTITY);
        let feet = BTreeMap::from([("FL".to_owned(), WalkedFoot { learnt, mounting })]);
        LiveReport { feet, written: true }
    }

    /// Returns the axes of FL in the file that is written.
    fn axes_in(report: &LiveReport) -> String {
        let file = report.set_in(RobotFile::keeping(FILE).expect("TOML"));
        let mut settings = file.settings_of_foot("FL").into_iter();
        settings.find(|(name, _)| name == "axes").expect("axes").1
    }

    #[test]
    fn unknown_axes_leave_the_configured_ones() {
        let report = report_with(None);
        let warning = report.feet["FL"].mounting.warning("FL");
        assert_eq!(warning.as_deref(), Some("FL has not stood still, so its axes are not known"));
        assert_eq!(axes_in(&report), "x,-z,y");
        let text = report.to_string();
        assert!(text.contains("\naxes not known: the foot has not stood still\n"), "{text}");
        let json = serde_json::to_value(&report).expect("JSON");
        assert_eq!(json["feet"]["FL"]["mounting"], "unknown");
    }

    #[test]
    fn axes_with_z_up_replace_the_configured_ones() {
        let report = report_with(Some(Vec3::new(0.0, 0.0, 9.81)));
        assert_eq!(report.feet["FL"].mounting.warning("FL"), None);
        assert_eq!(axes_in(&report), "x,y,z");
        assert!(report.to_string().contains("\naxes x,y,z: z is up\n"), "{report}");
        let json = serde_json::to_value(&report).expect("JSON");
        assert!(json["feet"]["FL"]["mounting"].is_null(), "{json}");
        let turned = report_with(Some(Vec3::new(0.0, 9.81, 0.0)));
        let json = serde_json::to_value(&turned).expect("JSON");
        assert_eq!(json["feet"]["FL"]["mounting"]["axes"], "x,-z,y");
    }
}
