//! `footfall foot … report`: one text about a foot and its board, to paste into an issue. Every line is read from the foot,
//! so that somebody who does not have the board can judge it.

use std::fmt::Write as _;

use feet::foot::settings;
use feet::foot::{Client, Named, RequestError};
use serde::Serialize;
use serde_json::{Map, Value as Json, json};
use wire::dictionary::index;
use wire::{AbortCode, Address, Counter, Diagnosis, Fault, Value};

use super::{FootArguments, FootInfo, number, to_json};
use crate::error::Error;

/// Report of a foot and its board.
#[derive(Debug, Serialize)]
struct FootReport {
    #[serde(flatten)]
    info: FootInfo,
    /// Crash before this start; null without one.
    crash: Option<Crash>,
    /// Faults since power-up, by name, the newest first.
    history: Vec<String>,
    /// Level of the brown-out reset in effect; 0 if it is off, or if the chip has no levels.
    brown_out_level: u32,
    /// Largest time from the data-ready edge to the contact in its mailbox, µs.
    edge_to_mailbox_us: u32,
    /// Longest tick, from the data-ready edge to the end of its work, µs, and the period of the ticks.
    longest_tick_us: u32,
    tick_period_us: u32,
    /// Deepest use of the stack, bytes.
    stack_bytes: u32,
    /// Counters since the start, by name.
    counters: Map<String, Json>,
    /// Values of object 0x2117 by name; null if the foot's program does not have it.
    diagnosis: Option<Map<String, Json>>,
    /// Settings that differ from the defaults, with their values.
    settings: Map<String, Json>,
    /// The settings as lines of text.
    #[serde(skip)]
    lines: Lines,
}

/// Parts of the text.
#[derive(Debug)]
struct Lines {
    diagnosis: Option<Diagnosis>,
    settings: Vec<String>,
}

/// Cause and location of a crash.
#[derive(Debug, Serialize)]
struct Crash {
    fault: &'static str,
    program_counter: u32,
}

impl FootArguments {
    /// Reads everything about the foot and its board.
    pub(super) fn report(&self, client: &mut Client) -> Result<String, Error> {
        let report = FootReport::read(client)?;
        Ok(if self.json { to_json(&report) } else { report.text() })
    }
}

impl FootReport {
    fn read(client: &mut Client) -> Result<Self, Error> {
        let info = FootInfo::read(client)?;
        let crash = match client.read_number(index::LAST_CRASH, 1)? {
            0 => None,
            code => Some(Crash {
                fault: fault_of(code).map_or("unknown", Fault::name),
                program_counter: client.read_number(index::LAST_CRASH, 2)?,
            }),
        };
        let mut history = Vec::new();
        for entry in 1..=client.read_number(index::ERROR_HISTORY, 0)? as u8 {
            let fault = client.read_number(index::ERROR_HISTORY, entry)?;
            let code = fault & 0xFFFF;
            let name = fault_of(code).map_or("unknown", Fault::name);
            history.push(format!("{name} (0x{code:04X})"));
        }
        let mut counters = Map::new();
        for (counter, subindex) in Counter::ALL.into_iter().zip(1..) {
            let count = client.read_number(index::COUNTERS, subindex)?;
            counters.insert(counter.name().to_owned(), json!(count));
        }
        let mut cost = |subindex| client.read_number(index::COSTS, subindex);
        let [edge_to_mailbox_us, longest_tick_us, stack_bytes, tick_period_us] =
            [cost(1)?, cost(2)?, cost(3)?, cost(4)?];
        let diagnosis = read_diagnosis(client)?;
        let own = settings::read(client)?;
        let changed = settings::differences(&settings::defaults(client.node()), &own);
        let line = |(named, _, value): &(Named, _, _)| {
            format!("{} = {} {}", named.name(), named.text(*value), named.unit())
                .trim_end()
                .to_owned()
        };
        let lines = Lines { diagnosis, settings: changed.iter().map(line).collect() };
        let setting = |(named, _, value): &(Named, _, _)| (named.name(), number(named, *value));
        Ok(Self {
            info,
            crash,
            history,
            brown_out_level: client.read_number(index::SUPPLY, 1)?,
            edge_to_mailbox_us,
            longest_tick_us,
            tick_period_us,
            stack_bytes,
            counters,
            diagnosis: diagnosis.as_ref().map(by_name),
            settings: changed.iter().map(setting).collect(),
            lines,
        })
    }

    fn text(self) -> String {
        let mut text = self.info.text();
        let mut line = |name: &str, value: &str| {
            // Writing to a string does not fail.
            let _ = writeln!(text, "{name:<8} {value}");
        };
        match self.crash {
            None => line("crash", "none"),
            Some(Crash { fault, program_counter }) => {
                line("crash", &format!("{fault} at 0x{program_counter:08X}"));
            }
        }
        line("history", &list(&self.history));
        match self.lines.diagnosis {
            Some(diagnosis) => {
                for of_board in diagnosis.to_string().lines() {
                    let (name, value) = of_board.split_at_checked(8).unwrap_or((of_board, ""));
                    line(name, value.trim_start());
                }
            }
            None => line("board", "unknown: its program is older than object 0x2117"),
        }
        line(
            "supply",
            &match self.brown_out_level {
                0 => "no brown-out level".to_owned(),
                level => format!("brown-out level {level}"),
            },
        );
        line(
            "costs",
            &format!(
                "edge to mailbox {} µs, longest tick {} of {} µs, stack {} bytes",
                self.edge_to_mailbox_us,
                self.longest_tick_us,
                self.tick_period_us,
                self.stack_bytes
            ),
        );
        let counted = self.counters.iter().map(|(name, count)| format!("{name} {count}"));
        line("counters", &list(&counted.collect::<Vec<_>>()));
        line("settings", &list(&self.lines.settings));
        text
    }
}

/// Fault with this code of its emergency.
fn fault_of(code: u32) -> Option<Fault> {
    Fault::ALL.into_iter().find(|fault| u32::from(fault.code()) == code)
}

/// Items with commas between them, or "none".
fn list(items: &[String]) -> String {
    if items.is_empty() { "none".to_owned() } else { items.join(", ") }
}

/// Reads object 0x2117; `None` if the foot's program does not have it.
fn read_diagnosis(client: &mut Client) -> Result<Option<Diagnosis>, RequestError> {
    let mut diagnosis = Diagnosis::default();
    for subindex in 1..=Diagnosis::HIGHEST_SUBINDEX {
        let raw = match client.read_number(index::DIAGNOSIS, subindex) {
            Err(error) if error.is_refusal(AbortCode::NoObject) => return Ok(None),
            read => read?,
        };
        diagnosis.set_raw(subindex, raw);
    }
    Ok(Some(diagnosis))
}

/// Values of the object by their names.
fn by_name(diagnosis: &Diagnosis) -> Map<String, Json> {
    let values = (1..=Diagnosis::HIGHEST_SUBINDEX).filter_map(|subindex| {
        let named = Named::at(Address::new(index::DIAGNOSIS, subindex))?;
        let value = Value::from_raw(named.entry.data_type(), diagnosis.raw(subindex)?)?;
        Some((named.name(), number(&named, value)))
    });
    values.collect()
}
