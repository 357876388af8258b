//! `footfall foot`: requests to one foot over its line.
//!
//! | content | file |
//! |---|---|
//! | actions and arguments | this one |
//! | output as text and as JSON | `show` |
//! | calibration learnt by the foot | `calibrate` |
//! | update of the program | `update` |

mod calibrate;
mod show;
mod update;

use std::fs::File;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

use clap::{Args, Subcommand};
use feet::foot::Named;
use feet::foot::calibration;
use feet::foot::client::Client;
use feet::foot::position;
use feet::foot::self_test::{self, SelfTestResult};
use feet::foot::settings::{self, Lasting, Values};
use feet::{Link, Source, link};
use wire::dictionary::index;
use wire::node::Calibration;
use wire::{Address, NodeId};

use super::options::feet::{parse_node, parse_number};
use super::options::listen::SOURCES;
use crate::error::Error;
use crate::files::{STANDARD, finish_when_interrupted, write_file};
use crate::foot_error::FootError;
use crate::report::print_text;
use crate::targets::{self, Target};

pub(super) use show::Identity;
pub use show::{FootInfo, to_json};
use update::{ImageFile, Which};

/// Arguments of `footfall foot`.
#[derive(Debug, Args)]
pub struct FootArguments {
    /// Where the foot is.
    #[arg(help = SOURCES)]
    pub source: Source,
    /// Which node of a CAN bus, 1 to 127; may be left out where there is only one foot
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
    /// List the feet that are heard
    Scan,
    /// Show which foot it is, its program, its stage and its faults
    Info,
    /// Show objects by name or by address, such as 0x2012:1; all settings where none is named
    Get {
        /// The objects
        #[arg(value_name = "decision.threshold")]
        names: Vec<String>,
    },
    /// Change settings, such as decision.threshold=0.6, all or none; they are lost at a reset unless
    /// they are saved. The foot does not stream meanwhile
    Set {
        /// The settings
        #[arg(required = true, value_name = "NAME=VALUE")]
        settings: Vec<String>,
        /// Store all settings afterwards
        #[arg(long)]
        save: bool,
    },
    /// Store all settings, so that they outlast power-off
    Save,
    /// Erase the stored settings and reset the foot: it is then FL, with all defaults
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
    },
    /// Write the settings of a file to the foot, all or none, read them back, and store them
    Import {
        /// The file, or - for standard input
        file: PathBuf,
    },
    /// Make the board this foot, such as FL, with that foot's node id, and store it. Connect one new
    /// board at a time: all of them are FL
    Id {
        /// The foot: FL, FR, RL, RR, L or R
        #[arg(value_parser = parse_position)]
        foot: wire::Foot,
    },
    /// Let the foot walk until it has learnt its limits of stillness, show them, and have it keep them
    Calibrate {
        /// How long it may take, s
        #[arg(long, value_name = "S", default_value_t = 120.0, value_parser = parse_seconds, conflicts_with = "forget")]
        seconds: f64,
        /// Forget what was learnt instead: the foot starts as if it had learnt nothing
        #[arg(long)]
        forget: bool,
    },
    /// Run the sensor's self-test, for which the foot is reset and must not move: settings that are not
    /// stored are lost
    Selftest,
    /// Replace the foot's program over CAN or the serial line, check that it runs, and wait until it has confirmed itself; the foot is
    /// silent for some seconds
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
    /// Reset the foot, as if it were switched on again: it streams then, also where it did not before
    Reset,
}

impl FootAction {
    /// Returns whether interrupting the action would leave the foot in an intermediate state.
    const fn is_whole(&self) -> bool {
        !matches!(
            self,
            Self::Info
                | Self::Get { .. }
                | Self::Diff { .. }
                | Self::Export { .. }
                | Self::Calibrate { forget: false, .. }
        )
    }
}

/// Longest time accepted, s: one hour.
const MOST_SECONDS: f64 = 3600.0;

fn parse_seconds(text: &str) -> Result<f64, String> {
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

impl FootArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        if let FootAction::Export { file } = &self.action {
            targets::check(&[], &[Target::Settings(file)])?;
        }
        let open = || link::open_for_requests(&self.source);
        let text = match &self.action {
            FootAction::Scan => self.scan(open()?.as_mut())?,
            FootAction::Update { image, all, serial } => {
                let file = ImageFile::read(image)?;
                let which = match (all, serial.as_slice()) {
                    (true, _) => Which::All,
                    (false, []) => Which::One,
                    (false, numbers) => Which::Numbered(numbers),
                };
                if file.is_for_usb() {
                    return print_text(&self.copy(&file, which)?).map_err(Error::Print);
                }
                let link = open()?;
                // A foot that is left in its bootloader is silent.
                finish_when_interrupted();
                self.update(link, file, which)?
            }
            action => self.act(action, open()?)?,
        };
        print_text(&text).map_err(Error::Print)
    }

    /// Performs an action on one foot.
    fn act(&self, action: &FootAction, link: Box<dyn Link>) -> Result<String, FootError> {
        let client = &mut Client::new(link, self.node)?;
        let node = client.node();
        if action.is_whole() {
            // An interruption would leave the foot with mixed settings and not streaming.
            finish_when_interrupted();
        }
        Ok(match action {
            // These are on all feet.
            FootAction::Scan | FootAction::Update { .. } => String::new(),
            FootAction::Info => self.info(client)?,
            FootAction::Get { names } => self.get(client, names)?,
            FootAction::Set { settings, save } => {
                let mut values = Values::new();
                for setting in settings {
                    let (name, value) = setting
                        .split_once('=')
                        .filter(|(name, _)| !name.trim().is_empty())
                        .ok_or_else(|| FootError::NoSetting(setting.clone()))?;
                    let named = Named::find(name)?;
                    if !named.entry.is_setting() {
                        return Err(FootError::NotWritable(named.name()));
                    }
                    let value = named.parse(value, node)?;
                    if values.insert(named.address, value).is_some() {
                        return Err(FootError::NamedTwice(named.name()));
                    }
                }
                let lasting = if *save { Lasting::Stored } else { Lasting::UntilReset };
                self.write(client, &values, lasting)?
            }
            FootAction::Save => {
                settings::while_paused(client, settings::store)?;
                "stored\n".to_owned()
            }
            FootAction::Restore => {
                settings::restore(client)?;
                "stored settings forgotten; the foot has started again with its defaults\n"
                    .to_owned()
            }
            FootAction::Id { foot } => {
                position::set(client, *foot)?;
                self.info(client)?
            }
            FootAction::Calibrate { forget: true, .. } => {
                calibration::store(client, Calibration::Forget)?;
                "what was learnt is forgotten\n".to_owned()
            }
            FootAction::Calibrate { seconds, .. } => self.calibrate(client, *seconds)?,
            FootAction::Selftest => match self_test::run(client)? {
                SelfTestResult::Passed => "the sensor has passed its self-test\n".to_owned(),
                SelfTestResult::Failed(axes) => return Err(FootError::TestFailed(axes)),
            },
            FootAction::Diff { file } => {
                let own = settings::read(client)?;
                let other = match file {
                    None => settings::defaults(node),
                    Some(file) => read_file(file, node)?,
                };
                self.changes(&settings::differences(&other, &own))
            }
            FootAction::Export { file } => {
                let own = settings::read(client)?;
                let version = client.read_text(Address::new(index::SOFTWARE_VERSION, 0))?;
                let about = format!(
                    "settings of a foot, version {version}; footfall foot … import writes them"
                );
                let text = settings::to_text(&own, &about);
                write_file(file, |to| to.write_all(text.as_bytes()))?;
                String::new()
            }
            FootAction::Import { file } => {
                let values = read_file(file, node)?;
                self.write(client, &values, Lasting::Stored)?
            }
            FootAction::Reset => {
                client.start_again()?;
                "the foot has started again\n".to_owned()
            }
        })
    }

    /// Writes settings and stores them if `lasting` requires it.
    fn write(
        &self,
        client: &mut Client,
        values: &Values,
        lasting: Lasting,
    ) -> Result<String, FootError> {
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
}

/// Maximum size of a settings file, bytes; an export has 5 kB.
const MOST_BYTES: u64 = 1 << 20;

/// Reads the settings of a file or of standard input.
fn read_file(path: &Path, node: Option<NodeId>) -> Result<Values, FootError> {
    let error = |message: String| FootError::File { file: path.display().to_string(), message };
    // Up to one byte beyond the maximum size.
    let text = match path == Path::new(STANDARD) {
        true => io::read_to_string(io::stdin().take(MOST_BYTES + 1)),
        false => File::open(path).and_then(|file| io::read_to_string(file.take(MOST_BYTES + 1))),
    };
    let text = text.map_err(|e| error(e.to_string()))?;
    if text.len() as u64 > MOST_BYTES {
        return Err(error(format!("settings are {MOST_BYTES} bytes at most")));
    }
    let values = settings::from_text(&text, node).map_err(|e| error(e.to_string()))?;
    if values.is_empty() {
        return Err(error("it holds no setting".to_owned()));
    }
    Ok(values)
}
