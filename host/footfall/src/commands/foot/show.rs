//! Output about a foot as text, or as JSON with a schema.

use std::collections::BTreeMap;

use bootloader::image::Refusal;
use decode::live::{FootKey, Listener};
use live::foot::client::{Client, RequestError};
use live::foot::{Named, update};
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::{Map, Value as Json, json};
use wire::dictionary::index;
use wire::node::State;
use wire::{Address, DataType, Fault, NodeId, Value};

use super::FootArguments;
use crate::error::Error;
use crate::foot_error::FootError;
use crate::schema::{Described, DescribedLine, SchemaKind};

/// Which foot it is, its program, its stage and its faults.
#[derive(Debug, JsonSchema, Serialize)]
pub struct FootInfo {
    /// The foot's name, such as FL.
    foot: &'static str,
    /// Its node id, 1 to 127; null on a serial line.
    node: Option<u8>,
    /// Its device name (object 0x1008).
    device: String,
    /// The version of its program (object 0x100A).
    version: String,
    /// The number of its program (object 0x1F56), hexadecimal, as of the image that was sent; of one that a probe has
    /// written the first digits of its commit, or null where no commit has its sources.
    program: Option<String>,
    /// The same of the program before the last update, of which the foot keeps a copy; null without one.
    previous: Option<String>,
    /// Reason why the last image was refused, or the previous program is back; null without one.
    refused: Option<&'static str>,
    /// Its hardware (object 0x1009).
    hardware: String,
    /// Its serial number (object 0x1018).
    serial: u32,
    /// Its NMT state: operational, pre-operational, stopped or initialising; null where it says none.
    state: Option<&'static str>,
    /// Stage of the board's operation, by name.
    stage: &'static str,
    /// Faults that last, by name.
    faults: Vec<&'static str>,
}

impl Described for FootInfo {
    const KIND: SchemaKind = SchemaKind::FootInfo;
}

/// The feet that are heard.
#[derive(Debug, JsonSchema, Serialize)]
#[serde(transparent)]
pub struct FootScan(Vec<Scanned>);

/// A foot that is heard.
#[derive(Debug, JsonSchema, Serialize)]
struct Scanned {
    /// The line that it is heard on: a CAN interface or a serial port.
    line: String,
    /// Its node id, 1 to 127; null on a serial line.
    node: Option<u8>,
    /// Its name, such as FL; null where nothing says it.
    name: Option<String>,
}

/// The value of an object: a number, or a text such as a word or a duration.
#[derive(JsonSchema)]
#[schemars(untagged)]
#[expect(dead_code, reason = "only its schema is used")]
enum Shown {
    /// A number, in the object's unit; null where it is not finite.
    Number(Option<f64>),
    /// A text.
    Text(String),
}

/// Values of objects by their names, such as decision.threshold.
#[derive(Debug, JsonSchema, Serialize)]
#[serde(transparent)]
pub struct FootValues(#[schemars(with = "BTreeMap<String, Shown>")] Map<String, Json>);

/// Settings that differ.
#[derive(Debug, JsonSchema, Serialize)]
#[serde(transparent)]
pub struct FootChanges(Vec<Change>);

/// A setting that differs.
#[derive(Debug, JsonSchema, Serialize)]
struct Change {
    /// Its name, such as decision.threshold.
    name: String,
    /// The value before; with diff, the default or that in the file.
    #[schemars(with = "Shown")]
    from: Json,
    /// The value afterwards; with diff, the foot's own.
    #[schemars(with = "Shown")]
    to: Json,
}

impl FootArguments {
    pub(super) fn feet<'a>(
        &self,
        feet: impl Iterator<Item = &'a FootKey>,
        listener: &Listener,
    ) -> String {
        let feet = feet.map(|foot| Scanned {
            line: foot.line.to_string(),
            node: foot.node,
            name: listener.name(foot).map(|name| name.to_string()),
        });
        if self.json {
            return to_json(&FootScan(feet.collect()));
        }
        let line = |foot: Scanned| {
            let node = foot.node.map(|node| format!("node {node}"));
            let words = [Some(foot.line), node, foot.name];
            let words: Vec<_> = words.into_iter().flatten().collect();
            words.join("  ") + "\n"
        };
        feet.map(line).collect()
    }

    pub(super) fn changes(&self, changes: &[(Named, Value, Value)]) -> String {
        if self.json {
            let changes = changes.iter().map(|(named, before, after)| Change {
                name: named.name(),
                from: number(named, *before),
                to: number(named, *after),
            });
            return to_json(&FootChanges(changes.collect()));
        }
        let line = |(named, before, after): &(Named, Value, Value)| {
            let unit = named.unit();
            let (before, after) = (named.text(*before), named.text(*after));
            format!("{}: {before} → {after} {unit}", named.name())
                .trim_end()
                .to_owned()
                + "\n"
        };
        changes.iter().map(line).collect()
    }

    pub(super) fn get(&self, client: &mut Client, names: &[String]) -> Result<String, Error> {
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
            let unit = named.unit();
            text.push_str(format!("{} = {shown} {unit}", named.name()).trim_end());
            if named.entry.is_setting() && !names.is_empty() {
                text.push_str(&format!("   # {}; {}", named.range(), named.doc()));
            }
            text.push('\n');
            object.insert(named.name(), value);
        }
        Ok(if self.json {
            to_json(&FootValues(object))
        } else {
            text
        })
    }

    pub(super) fn info(&self, client: &mut Client) -> Result<String, FootError> {
        let text = |client: &mut Client, index| client.read_text(Address::new(index, 0));
        let device = text(client, index::DEVICE_NAME)?;
        if device == bootloader::DEVICE_NAME {
            return Err(FootError::InBootloader(client.node()));
        }
        let version = text(client, index::SOFTWARE_VERSION)?;
        let hardware = text(client, index::HARDWARE_VERSION)?;
        let programs = update::programs(client)?;
        let mut number = |index, subindex| {
            let address = Address::new(index, subindex);
            let named = Named::at(address);
            let data_type = named.map_or(DataType::Unsigned32, |named| named.entry.data_type());
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
        let faults: Vec<_> = faults.iter().map(Fault::name).collect();
        let node = client.node().map(NodeId::get);
        let state = match client.state() {
            Ok(state) => Some(state_name(state)),
            Err(RequestError::NoAnswer { .. }) => None,
            Err(error) => return Err(error.into()),
        };
        if self.json {
            return Ok(to_json(&DescribedLine::of(&FootInfo {
                foot,
                node,
                device,
                version,
                program: programs.running.map(|number| format!("{number:08X}")),
                previous: programs.previous.map(|number| format!("{number:08X}")),
                refused: programs.refused.map(Refusal::words),
                hardware,
                serial,
                state,
                stage,
                faults,
            })));
        }
        let or_nothing = |words: Option<String>| words.unwrap_or_default();
        let program = or_nothing(
            programs
                .running
                .map(|number| format!(", program {number:08X}")),
        );
        let previous = or_nothing(
            programs
                .previous
                .map(|number| format!("previous program {number:08X}, kept\n")),
        );
        let refused = or_nothing(
            programs
                .refused
                .map(|why| format!("update   {}\n", why.words())),
        );
        let node = node.map_or_else(|| "serial line".to_owned(), |node| format!("node {node}"));
        let faults = match faults.as_slice() {
            [] => "none".to_owned(),
            faults => faults.join(", "),
        };
        let state = match state {
            None | Some("operational") => String::new(),
            Some(state) => {
                format!("state    {state}: it sends no contacts until it is started or reset\n")
            }
        };
        Ok(format!(
            "foot     {foot}, {node}\ndevice   {device}, {hardware}, serial number 0x{serial:08X}\nversion  {version}{program}\n{previous}{refused}stage    {stage}\n{state}faults   {faults}\n"
        ))
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
