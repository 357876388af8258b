//! Many settings at once: read from a foot or a text, compared, and written, all or none.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use thiserror::Error;
use wire::node::{Command, State};
use wire::{AbortCode, Address, NodeId, Value};

use super::client::{Client, RequestError};
use super::name::{NameError, Named};

/// Settings by address, as the text of a file has them.
pub type Values = BTreeMap<Address, Value>;

/// Why settings cannot be read from a text, or written to a foot.
#[derive(Debug, Error)]
pub enum SettingsError {
    /// A line of the text is none.
    #[error("line {line}: {message}")]
    Line {
        /// Its number, from 1.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// They do not go together.
    #[error("these settings do not go together, from {0} on; nothing was written")]
    Incompatible(String),
    /// The foot did not take all of them.
    #[error("{cause}; {undone}")]
    NotTaken {
        /// What stood in the way.
        cause: RequestError,
        /// What the foot has now.
        undone: Undone,
    },
    /// What was written reads back as something else.
    #[error("{name} was written as {written} and reads back as {read}; {undone}")]
    ReadBack {
        /// The setting.
        name: String,
        /// What was written.
        written: String,
        /// What the foot says.
        read: String,
        /// What the foot has now.
        undone: Undone,
    },
    /// A request came to nothing before anything was written.
    #[error(transparent)]
    Request(#[from] RequestError),
}

/// What a foot has after a failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Undone {
    /// What it had before.
    All,
    /// Some of both, until it is reset: nothing was stored.
    NotStored,
}

impl std::fmt::Display for Undone {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::All => "all settings are as they were",
            Self::NotStored => {
                "the foot has some of the new settings and some of the old until it is reset; none of the new are stored"
            }
        })
    }
}

/// Reads all settings of a foot.
///
/// # Errors
/// A request came to nothing.
pub fn read(client: &mut Client) -> Result<Values, RequestError> {
    let mut values = Values::new();
    for named in Named::settings() {
        let value = client.read(named.address, named.entry.data_type())?;
        values.insert(named.address, value);
    }
    Ok(values)
}

/// The defaults of a foot of this id.
#[must_use]
pub fn defaults(node: Option<NodeId>) -> Values {
    let settings = Named::settings();
    settings
        .map(|named| (named.address, named.default(node)))
        .collect()
}

/// Settings as text: a line each, with unit and range as a comment.
#[must_use]
pub fn to_text(values: &Values, about: &str) -> String {
    let mut text = format!("# {about}\n");
    for (address, value) in values {
        let Some(named) = Named::at(*address) else {
            continue;
        };
        // Writing to a String does not fail.
        let _ = writeln!(
            text,
            "{} = {} # {}",
            named.name(),
            named.text(*value),
            named.range()
        );
    }
    text
}

/// The settings in a text, for a foot of this id. Names and values must be those of this version:
/// what differs is named, and nothing is taken.
///
/// # Errors
/// The first line that is no setting.
pub fn from_text(text: &str, node: Option<NodeId>) -> Result<Values, SettingsError> {
    let mut values = Values::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let wrong = |message: String| SettingsError::Line {
            line: number,
            message,
        };
        let (name, value) = line
            .split_once('=')
            .ok_or_else(|| wrong(format!("{line:?} is no setting, such as window = 50000")))?;
        let by_name = |error: NameError| wrong(error.to_string());
        let named = Named::find(name.trim()).map_err(by_name)?;
        if !named.entry.is_setting() {
            return Err(wrong(format!(
                "{} is no setting: it cannot be written",
                named.name()
            )));
        }
        let value = named.parse(value.trim(), node).map_err(by_name)?;
        if values.insert(named.address, value).is_some() {
            return Err(wrong(format!("{} stands twice", named.name())));
        }
    }
    Ok(values)
}

/// The settings whose values differ, with both; a setting that one lacks does not differ.
#[must_use]
pub fn differences(from: &Values, to: &Values) -> Vec<(Named, Value, Value)> {
    let both = from.iter().filter_map(|(address, before)| {
        let after = to.get(address)?;
        let named = Named::at(*address)?;
        (named.text(*before) != named.text(*after)).then_some((named, *before, *after))
    });
    both.collect()
}

/// Writes settings that differ from those of the foot, all or none, and reads them back; nothing is
/// stored. The foot does not stream meanwhile. Returns what was changed.
///
/// # Errors
/// They do not go together, or the foot does not take them: then what was written is put back.
pub fn write(
    client: &mut Client,
    values: &Values,
) -> Result<Vec<(Named, Value, Value)>, SettingsError> {
    let before = read(client)?;
    let changes = differences(&before, values);
    if changes.is_empty() {
        return Ok(changes);
    }
    let after = paused(client)?;
    if let Err(cause) = write_all(client, &changes) {
        let undone = put_back(client, &changes, after);
        return Err(with_undone(cause, undone));
    }
    client.command(after)?;
    Ok(changes)
}

/// Puts a foot into pre-operational state, in which it takes settings and does not stream; the command
/// that brings it back to its state before.
///
/// # Errors
/// It does not say in which state it is.
pub fn paused(client: &mut Client) -> Result<Command, RequestError> {
    let after = match client.state()? {
        State::Operational => Command::StartRemoteNode,
        State::Stopped => Command::StopRemoteNode,
        State::Initialising | State::PreOperational => Command::EnterPreOperational,
    };
    client.command(Command::EnterPreOperational)?;
    Ok(after)
}

/// What went wrong while a foot was written.
enum Cause {
    Request(RequestError),
    ReadBack {
        name: String,
        written: String,
        read: String,
    },
    Incompatible(String),
}

fn with_undone(cause: Cause, undone: Undone) -> SettingsError {
    match cause {
        Cause::Request(cause) => SettingsError::NotTaken { cause, undone },
        Cause::Incompatible(name) if undone == Undone::All => SettingsError::Incompatible(name),
        Cause::Incompatible(name) => SettingsError::NotTaken {
            cause: RequestError::Refused {
                what: format!("writing {name}"),
                reason: AbortCode::Incompatible,
            },
            undone,
        },
        Cause::ReadBack {
            name,
            written,
            read,
        } => SettingsError::ReadBack {
            name,
            written,
            read,
            undone,
        },
    }
}

fn write_all(client: &mut Client, changes: &[(Named, Value, Value)]) -> Result<(), Cause> {
    // A setting may fit only after another: as long as any is taken, the others are tried again.
    let mut left: Vec<_> = changes.iter().collect();
    while !left.is_empty() {
        let mut refused = Vec::new();
        let before = left.len();
        for change in left {
            let (named, _, value) = change;
            match client.write(named.address, *value) {
                Ok(()) => {}
                Err(RequestError::Refused {
                    reason: AbortCode::Incompatible,
                    ..
                }) => refused.push(change),
                Err(error) => return Err(Cause::Request(error)),
            }
        }
        if refused.len() == before {
            let first = refused.first().map(|(named, ..)| named.name());
            return Err(Cause::Incompatible(first.unwrap_or_default()));
        }
        left = refused;
    }
    for (named, _, value) in changes {
        let read = client
            .read(named.address, named.entry.data_type())
            .map_err(Cause::Request)?;
        if read != *value {
            return Err(Cause::ReadBack {
                name: named.name(),
                written: named.text(*value),
                read: named.text(read),
            });
        }
    }
    Ok(())
}

/// Writes what there was before; what cannot be written is left.
fn put_back(client: &mut Client, changes: &[(Named, Value, Value)], after: Command) -> Undone {
    let backwards: Vec<_> = changes
        .iter()
        .map(|(named, before, after)| (*named, *after, *before))
        .collect();
    let put_back = write_all(client, &backwards);
    let started = client.command(after);
    if put_back.is_ok() && started.is_ok() {
        Undone::All
    } else {
        Undone::NotStored
    }
}
