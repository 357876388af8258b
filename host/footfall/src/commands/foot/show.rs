//! Output about a foot as text, or as JSON with a schema.

use bootloader::image::Refusal;
use feet::Link;
use feet::decode::live::Listener;
use feet::foot::client::{Client, RequestError};
use feet::foot::update;
use feet::foot::{Named, scan};
use serde::Serialize;
use serde_json::{Map, Value as Json, json};
use wire::dictionary::index;
use wire::node::State;
use wire::{Address, DataType, Fault, NodeId, Value};

use super::FootArguments;
use crate::foot_error::FootError;
use crate::json::{Described, Document};

/// Which foot it is, its program, its stage and its faults.
#[derive(Debug, Serialize)]
pub struct FootInfo {
    #[serde(flatten)]
    identity: Identity,
    /// Its NMT state: operational, pre-operational, stopped or initialising; null where it says none.
    state: Option<&'static str>,
    /// Stage of the board's operation, by name.
    stage: &'static str,
    /// Faults that last, by name.
    faults: Vec<&'static str>,
}

impl Described for FootInfo {
    const SCHEMA: &'static str = "urn:footfall:foot-info:1";
}

/// A foot that is heard.
#[derive(Debug, Serialize)]
struct Scanned {
    /// The line that it is heard on: a CAN interface or a serial port.
    line: String,
    /// Its node id, 1 to 127; null on a serial line.
    node: Option<u8>,
    /// Its name, such as FL; null where nothing says it.
    name: Option<String>,
}

impl FootArguments {
    pub(super) fn scan(&self, link: &mut dyn Link) -> Result<String, FootError> {
        let mut listener = Listener::default();
        let feet = scan::feet(link, &mut listener, scan::SCAN)?;
        if feet.is_empty() {
            return Err(RequestError::NoFoot.into());
        }
        let feet = feet.iter().map(|foot| Scanned {
            line: foot.line.to_string(),
            node: foot.node,
            name: listener.name(foot).map(|name| name.to_string()),
        });
        if self.json {
            return Ok(to_json(&feet.collect::<Vec<_>>()));
        }
        let line = |foot: Scanned| {
            let node = foot.node.map(|node| format!("node {node}"));
            let words = [Some(foot.line), node, foot.name];
            let words: Vec<_> = words.into_iter().flatten().collect();
            words.join("  ") + "\n"
        };
        Ok(feet.map(line).collect())
    }

    pub(super) fn changes(&self, changes: &[(Named, Value, Value)]) -> String {
        if self.json {
            // With diff, from the default or the file's value to the foot's own.
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

    pub(super) fn get(&self, client: &mut Client, names: &[String]) -> Result<String, FootError> {
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
                text.push_str(&format!("   # {}; {}", named.range(), named.doc()));
            }
            text.push('\n');
            object.insert(named.name(), value);
        }
        Ok(if self.json { to_json(&object) } else { text })
    }

    pub(super) fn info(&self, client: &mut Client) -> Result<String, FootError> {
        let identity = Identity::read(client)?;
        let stage = wire::Stage::ALL.get(client.read_number(index::STAGE, 0)? as usize);
        let faults = wire::Faults::from_bits(client.read_number(index::FAULTS, 0)?);
        let state = match client.state() {
            Ok(state) => Some(state_name(state)),
            Err(RequestError::NoAnswer { .. }) => None,
            Err(error) => return Err(error.into()),
        };
        let info = FootInfo {
            identity,
            state,
            stage: stage.map_or("?", |stage| stage.name()),
            faults: faults.iter().map(Fault::name).collect(),
        };
        Ok(if self.json { to_json(&Document::line(&info)) } else { info.text() })
    }
}

impl FootInfo {
    fn text(self) -> String {
        let (identity, stage) = (self.identity, self.stage);
        let node = identity.node.map(|node| format!("node {node}"));
        let node = node.unwrap_or_else(|| "serial line".to_owned());
        let program = identity.program.map(|number| format!(", program {number}"));
        let previous = identity.previous.map(|number| format!("previous program {number}, kept\n"));
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

/// Formats the number of a program.
pub(super) fn hex(number: u32) -> String {
    format!("{number:08X}")
}

/// Identity of a foot that runs its program.
#[derive(Debug, Serialize)]
pub(in crate::commands) struct Identity {
    /// The foot's name, such as FL.
    pub(in crate::commands) foot: &'static str,
    /// Its node id, 1 to 127; null on a serial line.
    pub(in crate::commands) node: Option<u8>,
    /// Its device name (object 0x1008).
    device: String,
    /// The version of its program (object 0x100A).
    pub(in crate::commands) version: String,
    /// The number of its program (object 0x1F56), hexadecimal, as of the image that was sent; of one that a probe has
    /// written the first digits of its commit, or null where no commit has its sources.
    pub(in crate::commands) program: Option<String>,
    /// The same of the program before the last update, of which the foot keeps a copy; null without one.
    previous: Option<String>,
    /// Reason why the last image was refused, or the previous program is back; null without one.
    refused: Option<&'static str>,
    /// Its hardware (object 0x1009).
    pub(in crate::commands) hardware: String,
    /// Its serial number (object 0x1018).
    pub(in crate::commands) serial: u32,
}

impl Identity {
    /// Reads the identity.
    ///
    /// # Errors
    /// The foot runs its bootloader, or a request has failed.
    pub(in crate::commands) fn read(client: &mut Client) -> Result<Self, FootError> {
        let text = |client: &mut Client, index| client.read_text(Address::new(index, 0));
        let device = text(client, index::DEVICE_NAME)?;
        if device == bootloader::DEVICE_NAME {
            return Err(FootError::InBootloader(client.node()));
        }
        let version = text(client, index::SOFTWARE_VERSION)?;
        let hardware = text(client, index::HARDWARE_VERSION)?;
        let programs = update::programs(client)?;
        let code = client.read_number(index::FOOT, 0)? as u8;
        Ok(Self {
            foot: wire::Foot::from_code(code).map_or("?", wire::Foot::name),
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

const fn state_name(state: State) -> &'static str {
    match state {
        State::Initialising => "initialising",
        State::Stopped => "stopped",
        State::Operational => "operational",
        State::PreOperational => "pre-operational",
    }
}

/// Formats a value as JSON with a final newline. All keys are strings.
pub fn to_json(printed: &impl Serialize) -> String {
    format!("{:#}\n", json!(printed))
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
