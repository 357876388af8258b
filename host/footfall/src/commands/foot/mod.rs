//! `footfall foot`: requests to one foot over its line, an action each.
//!
//! The actions `update`, which sends a program to one or more feet, and `report` are in files of their own.

mod error;
mod report;
mod update;

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use ::calibration::robot_file::RobotFile;
use bootloader::image::Refusal;
use clap::{Args, Subcommand};
use config::{ConfigFile, Resolved};
use feet::decode::live::LiveDecoder;
use feet::foot::self_test::{self, SelfTestResult};
use feet::foot::settings::{self, Lasting, SettingValues};
use feet::foot::update::programs;
use feet::foot::{Client, Named, RequestError, calibration, scan};
use feet::{LineSource, Link, usb};
use serde::Serialize;
use serde_json::{Map, Value as Json, json};
use wire::dictionary::index;
use wire::node::{Calibration, CalibrationState, NmtState};
use wire::{Address, DataType, Fault, NodeId, Value};

use super::options::{HELP_OF_ONE_SOURCE, OverwriteArguments, parse_node, parse_number};
use crate::error::Error;
use crate::files::{self, STANDARD, Target, write_file};
use crate::interruption::{finish_when_interrupted, is_interrupted};
use crate::messages;
use crate::report::{Described, Document, print_text};
use crate::source::{FindError, Source, SourceArgument, find_all, text_of};
use crate::words::with_hint;
use error::FootError;
use update::{ImageFile, Which};

/// Arguments of `footfall foot`.
#[derive(Debug, Args)]
#[command(subcommand_precedence_over_arg = true)]
pub struct FootArguments {
    /// Source of the foot; a scan takes several.
    #[arg(required = true, value_name = "SOURCE", help = HELP_OF_ONE_SOURCE)]
    pub sources: Vec<SourceArgument>,
    /// Node id on a CAN bus, 1 to 127; not needed if there is only one foot
    #[arg(long, value_name = "ID", value_parser = parse_node, global = true)]
    pub node: Option<NodeId>,
    /// Print JSON
    #[arg(long, global = true)]
    pub json: bool,
    /// Action on the foot.
    #[command(subcommand)]
    pub action: FootAction,
}

/// Actions on a foot.
#[derive(Debug, Subcommand)]
pub enum FootAction {
    /// List the feet on the line
    Scan,
    /// Show the foot's identity, program, stage and faults
    Info,
    /// Show all that the foot knows about itself and its board: paste it into an issue
    Report,
    /// Show objects by name or by address, such as 0x2012:1; without one, all settings
    Get {
        /// The objects
        #[arg(value_name = "decision.threshold")]
        names: Vec<String>,
    },
    /// Change settings, such as decision.threshold=0.6, all or none. They are lost at a reset unless they are
    /// saved. The foot does not stream meanwhile
    Set {
        /// The settings
        #[arg(required = true, value_name = "NAME=VALUE")]
        settings: Vec<String>,
        /// Store all settings afterwards
        #[arg(long)]
        save: bool,
    },
    /// Store all settings, so that they survive a power-off
    Save,
    /// Erase the stored settings and reset the foot, which is then FL with all defaults
    Restore,
    /// Show how the settings differ from the defaults, or from those in a file
    Diff {
        /// The file
        file: Option<PathBuf>,
    },
    /// Write all settings to a file
    Export {
        /// The file, .txt; - is standard output
        file: PathBuf,
        /// Whether existing files are replaced.
        #[command(flatten)]
        overwrite: OverwriteArguments,
    },
    /// Write the settings of a file to the foot, all or none, read them back, and store them
    Import {
        /// The file: settings written by `export`, or a configuration (.toml) with learnt values and axes, written by
        /// `footfall calibrate --output`; - is standard input
        file: PathBuf,
    },
    /// Assign the board to a foot, such as FL, with that foot's node id, and store the assignment. Connect
    /// new boards one at a time: each of them is FL
    Id {
        /// The foot: FL, FR, RL, RR, L or R
        #[arg(value_parser = parse_position)]
        foot: wire::Foot,
    },
    /// Wait until the walking foot has learnt its limits of stillness, show them, and store them on the foot
    Calibrate {
        /// Timeout, s
        #[arg(long, value_name = "S", default_value_t = 120.0, value_parser = parse_timeout, conflicts_with = "forget")]
        seconds: f64,
        /// Erase what the foot has learnt instead, so that it starts cold
        #[arg(long)]
        forget: bool,
    },
    /// Run the sensor's self-test, which resets the foot: settings that are not stored are lost. The foot
    /// must not move
    Selftest,
    /// Replace the foot's program over CAN or the serial line, check that it runs, and wait until it has
    /// confirmed itself. The foot is silent for some seconds
    Update {
        /// The image, .img; for a foot on USB its .uf2, which is copied to its drive
        image: PathBuf,
        /// Update all feet of the bus
        #[arg(long, conflicts_with = "node")]
        all: bool,
        /// Update the feet with these serial numbers, such as 0x1234ABCD, whatever their node ids; `info` shows the number
        #[arg(long, value_name = "NUMBER", value_parser = parse_serial, value_delimiter = ',', conflicts_with_all = ["node", "all"])]
        serial: Vec<u32>,
    },
    /// Reset the foot, as if it were switched on again. It then streams, even if it did not before
    Reset,
}

impl FootAction {
    /// Returns whether interrupting the action would leave the foot in an intermediate state.
    const fn is_whole(&self) -> bool {
        !matches!(
            self,
            Self::Info
                | Self::Report
                | Self::Get { .. }
                | Self::Diff { .. }
                | Self::Export { .. }
                | Self::Calibrate { forget: false, .. }
        )
    }
}

impl FootArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        if let FootAction::Export { file, overwrite } = &self.action {
            files::check(&[], &[Target::Settings(file)], overwrite.existing())?;
        }
        if matches!(self.action, FootAction::Scan) {
            let text = self.scan(&find_all(&self.sources)?)?;
            return print_text(&text).map_err(Error::Print);
        }
        let source = match &self.sources[..] {
            [source] => source.find_one()?,
            sources => return Err(FindError::Several(text_of(sources)).into()),
        };
        let open = || source.open_for_requests();
        let text = match &self.action {
            FootAction::Update { image, all, serial } => {
                let file = ImageFile::read(image)?;
                let which = if *all {
                    Which::All
                } else if serial.is_empty() {
                    Which::One
                } else {
                    Which::Numbered(serial)
                };
                if file.is_for_usb() {
                    return print_text(&update::copy_over_usb(&self, &source, &file, which)?)
                        .map_err(Error::Print);
                }
                let link = open()?;
                // A foot that is left in its bootloader is silent.
                finish_when_interrupted();
                update::send(&self, &source, link, file, which)?
            }
            action => self.act(action, open()?)?,
        };
        print_text(&text).map_err(Error::Print)
    }

    /// Performs an action on one foot.
    fn act(&self, action: &FootAction, link: Box<dyn Link>) -> Result<String, Error> {
        let client = &mut Client::new(link, self.node)?;
        let node = client.node();
        if action.is_whole() {
            // An interruption would leave the foot with mixed settings and not streaming.
            finish_when_interrupted();
        }
        Ok(match action {
            // `run` performs them, on all feet of the line.
            FootAction::Scan | FootAction::Update { .. } => String::new(),
            FootAction::Info => self.info(client)?,
            FootAction::Report => self.report(client)?,
            FootAction::Get { names } => self.get(client, names)?,
            FootAction::Set { settings, save } => {
                let values = parse_settings(settings, node)?;
                let lasting = if *save { Lasting::Stored } else { Lasting::UntilReset };
                self.write(client, &values, lasting)?
            }
            FootAction::Save => {
                settings::while_paused(client, settings::store)?;
                self.done("stored")
            }
            FootAction::Restore => {
                settings::restore(client)?;
                self.done("stored settings erased; the foot has restarted with its defaults")
            }
            FootAction::Id { foot } => {
                settings::set_position(client, *foot)?;
                self.info(client)?
            }
            FootAction::Calibrate { forget: true, .. } => {
                calibration::store(client, Calibration::Forget)?;
                self.done("the learnt values are erased")
            }
            FootAction::Calibrate { seconds, .. } => self.calibrate(client, *seconds)?,
            FootAction::Selftest => match self_test::run(client)? {
                SelfTestResult::Passed => self.done("the sensor has passed its self-test"),
                SelfTestResult::Failed(axes) => return Err(FootError::TestFailed(axes).into()),
            },
            FootAction::Diff { file } => {
                let own = settings::read(client)?;
                let other = match file {
                    None => settings::defaults(node),
                    Some(file) => read_file(file, client)?,
                };
                self.changes(&settings::differences(&other, &own))
            }
            FootAction::Export { file, overwrite } => {
                let own = settings::read(client)?;
                let version = client.read_text(Address::new(index::SOFTWARE_VERSION, 0))?;
                let about = format!(
                    "settings of a foot, version {version}; footfall foot … import writes them"
                );
                let text = settings::to_text(&own, &about);
                write_file(file, overwrite.existing(), |to| to.write_all(text.as_bytes()))?;
                String::new()
            }
            FootAction::Import { file } => {
                let values = read_file(file, client)?;
                self.write(client, &values, Lasting::Stored)?
            }
            FootAction::Reset => {
                client.restart_streaming()?;
                self.done("the foot has restarted")
            }
        })
    }

    /// Writes settings and stores them if `lasting` requires it.
    fn write(
        &self,
        client: &mut Client,
        values: &SettingValues,
        lasting: Lasting,
    ) -> Result<String, Error> {
        let changes = settings::write(client, values, lasting)?;
        let mut text = self.changes(&changes);
        if !self.json {
            text.push_str(match (changes.is_empty(), lasting) {
                (true, Lasting::UntilReset) => "nothing to change\n",
                (true, Lasting::Stored) => "nothing to change; stored\n",
                (false, Lasting::Stored) => "stored\n",
                (false, Lasting::UntilReset) => {
                    "not stored: footfall foot … save keeps them over a reset\n"
                }
            });
        }
        Ok(text)
    }

    /// Lists the feet on lines.
    fn scan(&self, sources: &[Source]) -> Result<String, Error> {
        let mut feet = Vec::new();
        for source in sources {
            let mut link = source.open_for_requests()?;
            let mut decoder = LiveDecoder::default();
            let heard = scan::feet(link.as_mut(), &mut decoder, scan::SCAN)?;
            let named = heard.iter().map(|foot| Scanned {
                line: foot.line.to_string(),
                node: foot.node,
                name: decoder.name(foot).map(|name| name.to_string()),
                serial: usb::serial_number(&foot.line),
            });
            feet.extend(named);
        }
        if feet.is_empty() {
            return Err(RequestError::NoFoot.into());
        }
        if self.json {
            return Ok(to_json(&feet));
        }
        let line = |foot: Scanned| {
            let node = foot.node.map(|node| format!("node {node}"));
            let serial = foot.serial.map(|serial| format!("usb:{serial}"));
            let words = [Some(foot.line), node, foot.name, serial];
            let words: Vec<_> = words.into_iter().flatten().collect();
            words.join("  ") + "\n"
        };
        Ok(feet.into_iter().map(line).collect())
    }

    /// Returns the report of an action without further results.
    fn done(&self, sentence: &str) -> String {
        if self.json { to_json(&json!({ "done": sentence })) } else { format!("{sentence}\n") }
    }

    /// Returns the names of values that differ, with both values.
    fn changes(&self, changes: &[(Named, Value, Value)]) -> String {
        if self.json {
            // For `diff` the change leads from the default, or from the value in the file, to the value on the foot.
            let changes = changes.iter().map(|(named, before, after)| {
                json!({
                    "name": named.name(),
                    "from": number(named, *before),
                    "to": number(named, *after),
                })
            });
            return to_json(&changes.collect::<Vec<_>>());
        }
        let line = |(named, before, after): &(Named, Value, Value)| {
            let unit = named.unit();
            let (before, after) = (named.text(*before), named.text(*after));
            let line = format!("{}: {before} → {after} {unit}", named.name());
            line.trim_end().to_owned() + "\n"
        };
        changes.iter().map(line).collect()
    }

    /// Reads the objects with these names, or all settings.
    fn get(&self, client: &mut Client, names: &[String]) -> Result<String, Error> {
        let found = names.iter().map(|name| Named::find(name));
        let all: Vec<Named> = match names {
            [] => Named::settings().collect(),
            _ => found.collect::<Result<_, _>>()?,
        };
        let mut object = Map::new();
        let mut text = String::new();
        for named in all {
            let (shown, value) = match named.entry.data_type() {
                DataType::VisibleString => {
                    let shown = client.read_text(named.address)?;
                    (shown.clone(), Json::String(shown))
                }
                data_type => {
                    let value = client.read(named.address, data_type)?;
                    (named.text(value), number(&named, value))
                }
            };
            let unit = named.unit();
            text.push_str(format!("{} = {shown} {unit}", named.name()).trim_end());
            if named.entry.is_setting() && !names.is_empty() {
                text.push_str(&format!("   # {}; {}", named.range(), named.meaning()));
            }
            text.push('\n');
            object.insert(named.name(), value);
        }
        Ok(if self.json { to_json(&object) } else { text })
    }

    /// Reads identity, program, stage and faults.
    fn info(&self, client: &mut Client) -> Result<String, Error> {
        let info = FootInfo::read(client)?;
        Ok(if self.json { to_json(&Document::line(&info)) } else { info.text() })
    }

    /// Waits at most `seconds` until the foot has learnt enough, then stores the calibration.
    fn calibrate(&self, client: &mut Client, seconds: f64) -> Result<String, Error> {
        wait_until_settled(client, seconds, "let the foot walk")?;
        // An interruption while storing would leave the foot not streaming.
        finish_when_interrupted();
        calibration::store(client, Calibration::Keep)?;
        // The stored numbers (0x2018) are reported, because the current numbers (0x2120) keep changing.
        let learnt = calibration::numbers(client, index::LEARNT)?;
        let correction = calibration::numbers(client, index::ACCELEROMETER)?;
        let gyroscope_bias_rad_s = calibration::gyroscope_bias_rad_s(client)?;
        Ok(if self.json {
            to_json(&json!({
                "learnt": by_name(&learnt),
                "accelerometer_correction": by_name(&correction),
                "gyroscope_bias_rad_s": gyroscope_bias_rad_s,
            }))
        } else {
            calibration_text(&learnt, gyroscope_bias_rad_s, &correction)
        })
    }
}

/// Checks that no orderly end was requested.
///
/// # Errors
/// An orderly end was requested.
pub(super) fn check_interruption() -> Result<(), Error> {
    if is_interrupted() { Err(FootError::Interrupted.into()) } else { Ok(()) }
}

/// Waits at most `seconds` until the foot has learnt enough; `words` ask the person to let it walk.
///
/// # Errors
/// The time is over, the foot does not learn, a request has failed, or an orderly end was requested.
pub(super) fn wait_until_settled(
    client: &mut Client,
    seconds: f64,
    words: &str,
) -> Result<(), Error> {
    let clock = client.clock();
    let end = clock.now() + Duration::from_secs_f64(seconds);
    let mut next_line = clock.now();
    loop {
        check_interruption()?;
        match calibration::state(client)? {
            CalibrationState::Frozen => return Err(FootError::LearnsNothing.into()),
            CalibrationState::Settled => break,
            CalibrationState::Settling => {}
        }
        let is_over = clock.now() >= end;
        if is_over || clock.now() >= next_line {
            let seen = seen(&calibration::numbers(client, index::CALIBRATION)?);
            if is_over {
                return Err(FootError::NotSettled { seconds, seen }.into());
            }
            messages::aside(format!("{words}: {seen}"));
            next_line = clock.now() + PROGRESS;
        }
        client.wait(POLL)?;
    }
    Ok(())
}

/// Identity, program, stage and faults of a foot.
#[derive(Debug, Serialize)]
pub struct FootInfo {
    #[serde(flatten)]
    identity: Identity,
    /// NMT state of the foot: operational, pre-operational, stopped or initialising; null if it reports none.
    state: Option<&'static str>,
    /// Stage of the board's operation, by name.
    stage: &'static str,
    /// Present faults, by name.
    faults: Vec<&'static str>,
}

impl Described for FootInfo {
    const SCHEMA: &'static str = "urn:footfall:foot-info:1";
}

impl FootInfo {
    /// Reads it from a foot.
    fn read(client: &mut Client) -> Result<Self, Error> {
        let identity = Identity::read(client)?;
        let stage = wire::Stage::ALL.get(client.read_number(index::STAGE, 0)? as usize);
        let faults = wire::Faults::from_bits(client.read_number(index::FAULTS, 0)?);
        let state = match client.state() {
            Ok(state) => Some(state_name(state)),
            Err(RequestError::NoAnswer { .. }) => None,
            Err(error) => return Err(error.into()),
        };
        Ok(Self {
            identity,
            state,
            stage: stage.map_or("?", |stage| stage.name()),
            faults: faults.iter().map(Fault::name).collect(),
        })
    }

    fn text(&self) -> String {
        let (identity, stage) = (&self.identity, self.stage);
        let node = identity.node.map(|node| format!("node {node}"));
        let node = node.unwrap_or_else(|| "serial line".to_owned());
        let program = identity.program.as_ref().map(|number| format!(", program {number}"));
        let previous =
            identity.previous.as_ref().map(|number| format!("previous program {number}, kept\n"));
        let refused = identity.refused.map(|why| format!("update   {why}\n"));
        let state = self.state.filter(|state| *state != "operational");
        let state = state.map(|state| {
            format!("state    {state}: it sends no contacts until it is started or reset\n")
        });
        let [program, previous, refused, state] =
            [program, previous, refused, state].map(Option::unwrap_or_default);
        let faults = match self.faults.as_slice() {
            [] => "none".to_owned(),
            faults => faults.join(", "),
        };
        format!(
            "foot     {}, {node}\ndevice   {}, {}, serial number 0x{:08X}\nversion  {}{program}\n{previous}{refused}stage    {stage}\n{state}faults   {faults}\n",
            identity.foot, identity.device, identity.hardware, identity.serial, identity.version
        )
    }
}

/// Identity of a foot that runs its program.
#[derive(Debug, Serialize)]
pub(super) struct Identity {
    /// The foot's name, such as FL.
    pub(super) foot: &'static str,
    /// Node id of the foot, 1 to 127; null on a serial line.
    pub(super) node: Option<u8>,
    /// Device name of the foot (object 0x1008).
    device: String,
    /// The version of its program (object 0x100A).
    pub(super) version: String,
    /// Number of the foot's program (object 0x1F56), hexadecimal: the number of the image from which it was installed. For a
    /// program written by a probe, the first digits of its commit, or null if no commit has its sources.
    pub(super) program: Option<String>,
    /// Number of the program before the last update, whose copy the foot keeps; null without a copy.
    previous: Option<String>,
    /// Reason the last image was refused or the previous program was restored; null without one.
    refused: Option<&'static str>,
    /// Hardware of the board (object 0x1009).
    pub(super) hardware: String,
    /// Serial number of the board (object 0x1018).
    pub(super) serial: u32,
}

impl Identity {
    /// Reads the identity.
    ///
    /// # Errors
    /// The foot runs its bootloader, or a request has failed.
    pub(super) fn read(client: &mut Client) -> Result<Self, Error> {
        let text = |client: &mut Client, index| client.read_text(Address::new(index, 0));
        let device = text(client, index::DEVICE_NAME)?;
        if device == bootloader::DEVICE_NAME {
            return Err(FootError::InBootloader(client.node()).into());
        }
        let version = text(client, index::SOFTWARE_VERSION)?;
        let hardware = text(client, index::HARDWARE_VERSION)?;
        let programs = programs(client)?;
        let foot = settings::position(client)?.name();
        Ok(Self {
            foot,
            node: client.node().map(NodeId::get),
            device,
            version,
            program: programs.running.map(hex),
            previous: programs.previous.map(hex),
            refused: programs.refused.map(Refusal::words),
            hardware,
            serial: client.serial_number()?,
        })
    }
}

/// A foot on a line.
#[derive(Debug, Serialize)]
struct Scanned {
    /// Line of the foot: a CAN interface or a serial port.
    line: String,
    /// Node id of the foot, 1 to 127; null on a serial line.
    node: Option<u8>,
    /// Name of the foot, such as FL; null if it is unknown.
    name: Option<String>,
    /// Serial number of its board on USB; null on other lines.
    serial: Option<String>,
}

/// Polling interval of the foot.
const POLL: Duration = Duration::from_millis(200);

/// Interval of the progress lines.
const PROGRESS: Duration = Duration::from_secs(2);

/// Returns how much stillness and motion the foot has observed, as text.
fn seen(learnt: &[(Named, f32)]) -> String {
    let seconds = |name: &str| {
        let of_name = learnt.iter().find(|(named, _)| named.name() == name);
        of_name.map_or(0.0, |(_, seconds)| *seconds)
    };
    format!(
        "{:.1} s of stillness and {:.1} s of motion observed",
        seconds("calibration.stillness_learnt_from"),
        seconds("calibration.motion_learnt_from")
    )
}

/// Returns the name without its table.
fn last_parts(named: &Named) -> String {
    let name = named.name();
    let parts = name.split_once('.').map(|(_, parts)| parts.to_owned());
    parts.unwrap_or(name)
}

fn calibration_text(
    learnt: &[(Named, f32)],
    gyroscope_bias_rad_s: [Option<f32>; 3],
    correction: &[(Named, f32)],
) -> String {
    let mut text = String::from("kept and stored\n");
    for (named, value) in learnt {
        // Amplitudes are stored as logarithms and printed as amplitudes.
        let (value, unit) = match named.entry.unit.as_str() {
            "ln(m/s²)" => (value.exp(), "m/s²"),
            "ln(rad/s)" => (value.exp(), "rad/s"),
            unit => (*value, unit),
        };
        text.push_str(&calibration_line(&last_parts(named), value, unit));
    }
    for (axis, bias) in ["x", "y", "z"].into_iter().zip(gyroscope_bias_rad_s) {
        let name = format!("gyroscope_bias_{axis}");
        text.push_str(&match bias {
            Some(bias) => calibration_line(&name, bias.to_degrees(), "°/s"),
            None => format!("{name:<26} not known yet\n"),
        });
    }
    for (named, value) in correction {
        text.push_str(&calibration_line(&named.name(), *value, named.entry.unit.as_str()));
    }
    text
}

fn by_name(numbers: &[(Named, f32)]) -> Map<String, Json> {
    numbers.iter().map(|(named, value)| (last_parts(named), json!(value))).collect()
}

fn calibration_line(name: &str, value: f32, unit: &str) -> String {
    let line = format!("{name:<26} {value:.4} {unit}");
    line.trim_end().to_owned() + "\n"
}

/// Parses settings, each as `NAME=VALUE`.
fn parse_settings(settings: &[String], node: Option<NodeId>) -> Result<SettingValues, Error> {
    let mut values = SettingValues::new();
    for setting in settings {
        let (name, value) = setting
            .split_once('=')
            .filter(|(name, _)| !name.trim().is_empty())
            .ok_or_else(|| FootError::NoSetting(setting.clone()))?;
        let named = Named::find(name.trim())?;
        if !named.entry.is_setting() {
            return Err(FootError::NotWritable(named.name()).into());
        }
        let value = named.parse(value.trim(), node)?;
        if values.insert(named.address, value).is_some() {
            return Err(FootError::NamedTwice(named.name()).into());
        }
    }
    Ok(values)
}

/// Maximum size of a settings file, bytes; an export has 5 kB.
const MOST_BYTES: u64 = 1 << 20;

/// Reads the settings of a file or of standard input.
fn read_file(path: &Path, client: &mut Client) -> Result<SettingValues, Error> {
    let node = client.node();
    let error = |message: String| FootError::File { file: path.display().to_string(), message };
    // One byte more than the maximum size shows that the text is too long.
    let text = if path == Path::new(STANDARD) {
        io::read_to_string(io::stdin().take(MOST_BYTES + 1))
    } else {
        File::open(path).and_then(|file| io::read_to_string(file.take(MOST_BYTES + 1)))
    };
    let text = text.map_err(|e| error(e.to_string()))?;
    if text.len() as u64 > MOST_BYTES {
        return Err(error(format!("settings are {MOST_BYTES} bytes at most")).into());
    }
    let is_configuration = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("toml"));
    let values = if is_configuration {
        let foot = settings::position(client)?.name();
        of_configuration(path, text, foot, node)?
    } else {
        let values = settings::from_text(&text, node);
        values.map_err(|e| error(with_hint(&e, e.hint())))?
    };
    if values.is_empty() {
        return Err(error("it holds no setting".to_owned()).into());
    }
    Ok(values)
}

/// Reads the settings of this foot in a configuration.
fn of_configuration(
    path: &Path,
    text: String,
    foot: &str,
    node: Option<NodeId>,
) -> Result<SettingValues, Error> {
    let error = |message: String| FootError::File { file: path.display().to_string(), message };
    let file = RobotFile::keeping(&text).map_err(|e| error(e.to_string()))?;
    // Names and values are checked as for a replay.
    Resolved::of_file(ConfigFile { name: path.display().to_string(), text })?;
    let taken = settings::from_configuration(file.settings_of_foot(foot), node);
    let taken = taken.map_err(|e| error(with_hint(&e, e.hint())))?;
    if !taken.left_out.is_empty() {
        messages::warn(format!(
            "{}: a foot has no setting {}; left out",
            path.display(),
            taken.left_out.join(", ")
        ));
    }
    Ok(taken.values)
}

/// Longest accepted timeout, s: one hour.
const MOST_SECONDS: f64 = 3600.0;

/// Parses a timeout, s.
fn parse_timeout(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok();
    let seconds = seconds.filter(|seconds| *seconds > 0.0 && *seconds <= MOST_SECONDS);
    seconds.ok_or_else(|| format!("write seconds above 0 and up to {MOST_SECONDS}"))
}

/// Parses a serial number, decimal or hexadecimal with 0x.
fn parse_serial(text: &str) -> Result<u32, &'static str> {
    parse_number(text).ok_or("write a serial number, such as 0x1234ABCD")
}

fn parse_position(text: &str) -> Result<wire::Foot, String> {
    let mut all = wire::Foot::ALL.into_iter();
    let foot = all.find(|foot| foot.name().eq_ignore_ascii_case(text));
    let names = wire::Foot::ALL.map(wire::Foot::name).join(", ");
    foot.ok_or_else(|| format!("write one of {names}"))
}

/// Formats a value as JSON with a final newline. All keys are strings.
pub fn to_json(printed: &impl Serialize) -> String {
    format!("{:#}\n", json!(printed))
}

/// Formats the number of a program.
pub(super) fn hex(number: u32) -> String {
    format!("{number:08X}")
}

const fn state_name(state: NmtState) -> &'static str {
    match state {
        NmtState::Initialising => "initialising",
        NmtState::Stopped => "stopped",
        NmtState::Operational => "operational",
        NmtState::PreOperational => "pre-operational",
    }
}

fn number(named: &Named, value: Value) -> Json {
    match value {
        Value::F32(number) => json!(number),
        Value::I16(number) => json!(number),
        value => {
            let text = named.text(value);
            // A number in the unit of the text, or a word.
            text.parse().map_or(Json::String(text), Json::Number)
        }
    }
}
