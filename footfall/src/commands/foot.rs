//! `footfall foot`: one foot, asked and set over its line.

use std::fs;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use decode::live::Listener;
use live::Source;
use live::foot::Named;
use live::foot::client::{self, Client, RequestError};
use live::foot::name::NameError;
use live::foot::settings::{self, SettingsError, Values};
use live::link::{self, pace::Speed};
use serde_json::{Map, Value as Json, json};
use thiserror::Error;
use wire::dictionary::index;
use wire::node::Command;
use wire::{Address, DataType, NodeId, Value};

use super::decode::parse_node;
use super::monitor::SOURCES;
use crate::error::Error;
use crate::files::write_file;
use crate::report::print_text;
use crate::targets::{self, Target};

/// What `footfall foot` takes.
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
    /// What to do with it.
    #[command(subcommand)]
    pub action: Action,
}

/// What can be done with a foot.
#[derive(Debug, Subcommand)]
pub enum Action {
    /// List the feet that are heard
    Scan,
    /// Show which foot it is, its program, its stage and its faults
    Info,
    /// Show objects by name or by address, such as 0x2012:1; all settings where none is named
    Get {
        /// The objects
        #[arg(value_name = "half_width.ax")]
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
    /// Forget the stored settings and reset the foot: it has its defaults then
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
        /// The file
        file: PathBuf,
    },
    /// Reset the foot, as if it were switched on again
    Reset,
}

/// Why a foot could not be asked or set.
#[derive(Debug, Error)]
pub enum FootError {
    /// A request came to nothing.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// A name or a value is none.
    #[error(transparent)]
    Name(#[from] NameError),
    /// Settings were not taken.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// An argument is no setting.
    #[error("{0:?} is no setting: write NAME=VALUE, such as decision.threshold=0.6")]
    NoSetting(String),
    /// What was named cannot be written.
    #[error("{0} is no setting: it cannot be written")]
    NotWritable(String),
    /// A file of settings cannot be used.
    #[error("{file}: {message}")]
    File {
        /// Its name.
        file: String,
        /// What is wrong.
        message: String,
    },
}

impl FootArguments {
    pub(super) fn run(self) -> Result<(), Error> {
        if let Action::Export { file } = &self.action {
            targets::check(&[], &[Target::Settings(file)])?;
        }
        let mut link = link::open(&self.source.clone().at_speed(Speed::REAL))?;
        if let Action::Scan = self.action {
            let mut listener = Listener::default();
            let feet = client::feet(link.as_mut(), &mut listener, client::SCAN)?;
            let mut text = String::new();
            for foot in &feet {
                let name = listener.name(foot);
                let node = foot.node.map(|node| format!("node {node}"));
                let line = &foot.line;
                let words = [
                    Some(line.to_string()),
                    node,
                    name.map(|name| name.to_string()),
                ];
                let words: Vec<_> = words.into_iter().flatten().collect();
                text.push_str(&words.join("  "));
                text.push('\n');
            }
            if feet.is_empty() {
                return Err(FootError::from(RequestError::NoFoot).into());
            }
            return print_text(&text).map_err(Error::Print);
        }
        let mut client = Client::new(link, self.node).map_err(FootError::from)?;
        let text = self.act(&mut client)?;
        print_text(&text).map_err(Error::Print)
    }

    fn act(&self, client: &mut Client) -> Result<String, Error> {
        let node = client.node();
        Ok(match &self.action {
            // Has been done.
            Action::Scan => String::new(),
            Action::Info => self.info(client).map_err(FootError::from)?,
            Action::Get { names } => self.get(client, names)?,
            Action::Set { settings, save } => {
                let mut values = Values::new();
                for setting in settings {
                    let (name, value) = setting
                        .split_once('=')
                        .ok_or_else(|| FootError::NoSetting(setting.clone()))?;
                    let named = Named::find(name).map_err(FootError::from)?;
                    if !named.entry.is_setting() {
                        return Err(FootError::NotWritable(named.name()).into());
                    }
                    let value = named.parse(value, node).map_err(FootError::from)?;
                    values.insert(named.address, value);
                }
                self.write(client, &values, *save)?
            }
            Action::Save => {
                paused(client, Client::store)?;
                "stored\n".to_owned()
            }
            Action::Restore => {
                paused(client, Client::restore)?;
                client
                    .command(Command::ResetNode)
                    .map_err(FootError::from)?;
                "stored settings forgotten; the foot starts again with its defaults\n".to_owned()
            }
            Action::Diff { file } => {
                let own = settings::read(client).map_err(FootError::from)?;
                let other = match file {
                    None => settings::defaults(node),
                    Some(file) => read_file(file, node)?,
                };
                self.changes(&settings::differences(&other, &own))
            }
            Action::Export { file } => {
                let own = settings::read(client).map_err(FootError::from)?;
                let version = client.read_text(Address::new(index::SOFTWARE_VERSION, 0));
                let version = version.map_err(FootError::from)?;
                let about = format!(
                    "settings of a foot, version {version}; footfall foot … import writes them"
                );
                let text = settings::to_text(&own, &about);
                write_file(file, |to| to.write_all(text.as_bytes()))?;
                String::new()
            }
            Action::Import { file } => {
                let values = read_file(file, node)?;
                self.write(client, &values, true)?
            }
            Action::Reset => {
                client
                    .command(Command::ResetNode)
                    .map_err(FootError::from)?;
                "reset\n".to_owned()
            }
        })
    }

    /// Writes settings, and stores them where they are to be saved.
    fn write(&self, client: &mut Client, values: &Values, save: bool) -> Result<String, Error> {
        let changes = settings::write(client, values).map_err(FootError::from)?;
        if save {
            paused(client, Client::store)?;
        }
        let mut text = self.changes(&changes);
        if !self.json {
            text.push_str(match (changes.is_empty(), save) {
                (true, false) => "nothing to change\n",
                (true, true) => "nothing to change; stored\n",
                (false, true) => "stored\n",
                (false, false) => "not stored: footfall foot … save keeps them over a reset\n",
            });
        }
        Ok(text)
    }

    fn changes(&self, changes: &[(Named, Value, Value)]) -> String {
        if self.json {
            let changes = changes.iter().map(|(named, before, after)| {
                json!({ "name": named.name(), "from": number(named, *before), "to": number(named, *after) })
            });
            return format!("{:#}\n", Json::Array(changes.collect()));
        }
        let line = |(named, before, after): &(Named, Value, Value)| {
            let unit = named.entry.unit.as_str();
            let (before, after) = (named.text(*before), named.text(*after));
            format!("{}: {before} → {after} {unit}", named.name())
                .trim_end()
                .to_owned()
                + "\n"
        };
        changes.iter().map(line).collect()
    }

    fn get(&self, client: &mut Client, names: &[String]) -> Result<String, Error> {
        let all: Vec<Named> = if names.is_empty() {
            Named::settings().collect()
        } else {
            let found = names.iter().map(|name| Named::find(name));
            found.collect::<Result<_, _>>().map_err(FootError::from)?
        };
        let mut object = Map::new();
        let mut text = String::new();
        for named in all {
            let data_type = named.entry.data_type();
            let (shown, value) = if data_type == DataType::VisibleString {
                let shown = client.read_text(named.address).map_err(FootError::from)?;
                (shown.clone(), Json::String(shown))
            } else {
                let value = client
                    .read(named.address, data_type)
                    .map_err(FootError::from)?;
                (named.text(value), number(&named, value))
            };
            let unit = named.entry.unit.as_str();
            text.push_str(format!("{} = {shown} {unit}", named.name()).trim_end());
            if named.entry.is_setting() && !names.is_empty() {
                text.push_str(&format!("   # {}; {}", named.range(), named.doc()));
            }
            text.push('\n');
            object.insert(named.name(), value);
        }
        Ok(if self.json {
            format!("{:#}\n", Json::Object(object))
        } else {
            text
        })
    }

    fn info(&self, client: &mut Client) -> Result<String, RequestError> {
        let text = |client: &mut Client, index| client.read_text(Address::new(index, 0));
        let device = text(client, index::DEVICE_NAME)?;
        let version = text(client, index::SOFTWARE_VERSION)?;
        let hardware = text(client, index::HARDWARE_VERSION)?;
        let mut number = |index, subindex| {
            let address = Address::new(index, subindex);
            let data_type = client::type_of(address).unwrap_or(DataType::Unsigned32);
            client.read(address, data_type).map(Value::to_raw)
        };
        let foot = number(index::FOOT, 0)?;
        let serial = number(index::IDENTITY, 4)?;
        let stage = number(index::STAGE, 0)?;
        let faults = wire::Faults::from_bits(number(index::FAULTS, 0)?);
        let foot = wire::Foot::from_code(foot as u8).map_or("?", wire::Foot::name);
        let stage = wire::Stage::ALL
            .get(stage as usize)
            .map_or("?", |stage| stage.name());
        let faults: Vec<_> = faults.iter().map(wire::Fault::name).collect();
        let node = client.node().map(NodeId::get);
        if self.json {
            let object = json!({
                "foot": foot, "node": node, "device": device, "version": version,
                "hardware": hardware, "serial": serial, "stage": stage, "faults": faults,
            });
            return Ok(format!("{object:#}\n"));
        }
        let node = node.map_or_else(|| "serial line".to_owned(), |node| format!("node {node}"));
        let faults = match faults.as_slice() {
            [] => "none".to_owned(),
            faults => faults.join(", "),
        };
        Ok(format!(
            "foot     {foot}, {node}\ndevice   {device}, {hardware}, serial number 0x{serial:08X}\nversion  {version}\nstage    {stage}\nfaults   {faults}\n"
        ))
    }
}

/// Does something for which the foot must not stream.
fn paused(
    client: &mut Client,
    action: impl FnOnce(&mut Client) -> Result<(), RequestError>,
) -> Result<(), FootError> {
    let after = settings::paused(client)?;
    let done = action(client);
    client.command(after)?;
    Ok(done?)
}

fn number(named: &Named, value: Value) -> Json {
    match (named.entry.role, value) {
        (wire::dictionary::Role::PdoCobId, _) => Json::String(named.text(value)),
        (_, Value::F32(number)) => json!(number),
        (_, Value::I16(number)) => json!(number),
        (_, value) => json!(value.to_raw()),
    }
}

fn read_file(path: &std::path::Path, node: Option<NodeId>) -> Result<Values, FootError> {
    let error = |message: String| FootError::File {
        file: path.display().to_string(),
        message,
    };
    let text = fs::read_to_string(path).map_err(|e| error(e.to_string()))?;
    settings::from_text(&text, node).map_err(|e| error(e.to_string()))
}
