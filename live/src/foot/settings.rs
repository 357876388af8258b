//! Many settings at once: read from a foot or a text, compared, and written, all or none.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use thiserror::Error;
use wire::dictionary::index;
use wire::node::{Command, State};
use wire::{AbortCode, Address, Foot, NodeId, Value};

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
    /// What was stored before.
    NoneStored,
    /// All new settings; whether they are stored is not known.
    Unknown,
}

/// How long settings that are written are to last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lasting {
    /// Until the foot is reset.
    UntilReset,
    /// For good: all settings are stored.
    Stored,
}

impl std::fmt::Display for Undone {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::All => "all settings are as they were",
            Self::NotStored => {
                "the foot has some of the new settings and some of the old until it is reset; none of the new are stored"
            }
            Self::NoneStored => "it has the settings that were stored before",
            Self::Unknown => {
                "the foot has the new settings; whether they are stored is seen after a reset"
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
    // As Windows writes it.
    let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
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

/// The id of a foot with these settings from its next start on.
fn node_of(settings: &Values) -> Option<NodeId> {
    let number = |index| Some(settings.get(&Address::new(index, 0))?.to_raw());
    let id = number(index::NODE_ID)?;
    if id != 0 {
        return NodeId::new(u8::try_from(id).ok()?);
    }
    let code = u8::try_from(number(index::FOOT)?).ok()?;
    Foot::from_code(code).map(Foot::default_node_id)
}

/// Stores all settings, which are these: a foot that has started again meanwhile has others, so they are
/// read back.
///
/// # Errors
/// Another board has the id that the foot would have, the foot refuses it, does not answer, or has started
/// again.
fn store_these(client: &mut Client, settings: &Values) -> Result<(), RequestError> {
    if let Some(node) = node_of(settings) {
        client.is_free(node)?;
    }
    client.store()?;
    if differences(settings, &read(client)?).is_empty() {
        return Ok(());
    }
    Err(RequestError::StartedAgain {
        foot: client.foot(),
    })
}

/// Stores all settings as they are; the foot does not stream meanwhile.
///
/// # Errors
/// Another board has the id that the foot would have, the foot refuses it, does not answer, or has started
/// again.
pub fn store(client: &mut Client) -> Result<(), RequestError> {
    let settings = read(client)?;
    store_these(client, &settings)
}

/// Has the foot forget what it has stored, and start again with its defaults: as the front left one.
///
/// # Errors
/// Another board has the id of that foot, the foot refuses it, or does not come back.
pub fn restore(client: &mut Client) -> Result<(), RequestError> {
    let node = Foot::default().default_node_id();
    client.is_free(node)?;
    while_paused(client, Client::restore)?;
    client.restart(Some(node))
}

/// Writes settings that differ from those of the foot, all or none, reads them back, and stores them
/// where they are to last. The foot does not stream meanwhile. Returns what was changed.
///
/// # Errors
/// They do not go together, or the foot does not take or store them: then what was written is put back.
pub fn write(
    client: &mut Client,
    values: &Values,
    lasting: Lasting,
) -> Result<Vec<(Named, Value, Value)>, SettingsError> {
    let before = read(client)?;
    let changes = differences(&before, values);
    if changes.is_empty() && lasting == Lasting::UntilReset {
        return Ok(changes);
    }
    let state = pause(client)?;
    if let Err(cause) = write_all(client, &changes) {
        let undone = put_back(client, &changes, state);
        return Err(with_undone(cause, undone));
    }
    if lasting == Lasting::Stored {
        let mut settings = before;
        settings.extend(
            changes
                .iter()
                .map(|(named, _, value)| (named.address, *value)),
        );
        if let Err(cause) = store_these(client, &settings) {
            let undone = match cause {
                RequestError::NoAnswer { .. } | RequestError::Link(_) => Undone::Unknown,
                RequestError::StartedAgain { .. } => {
                    // It has begun by itself, in the state that its settings say.
                    let _ = client.bring_to(state);
                    Undone::NoneStored
                }
                _ => put_back(client, &changes, state),
            };
            return Err(SettingsError::NotTaken { cause, undone });
        }
    }
    client.bring_to(state)?;
    Ok(changes)
}

/// Puts a foot into pre-operational state, in which it takes settings and does not stream; returns the
/// state before.
///
/// # Errors
/// Several boards answer as this foot, or it does not say in which state it is.
fn pause(client: &mut Client) -> Result<State, RequestError> {
    client.is_alone()?;
    let before = client.state()?;
    client.command(Command::EnterPreOperational)?;
    Ok(before)
}

/// Does something for which the foot must not stream, and brings it back to its state before.
///
/// # Errors
/// What was done has failed, the foot has started again meanwhile, or does not say in which state it is.
pub fn while_paused(
    client: &mut Client,
    action: impl FnOnce(&mut Client) -> Result<(), RequestError>,
) -> Result<(), RequestError> {
    let before = pause(client)?;
    let starts = client.starts();
    let done = action(client);
    client.bring_to(before)?;
    if done.is_ok() && client.starts() != starts {
        return Err(RequestError::StartedAgain {
            foot: client.foot(),
        });
    }
    done
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
fn put_back(client: &mut Client, changes: &[(Named, Value, Value)], state: State) -> Undone {
    let backwards: Vec<_> = changes
        .iter()
        .map(|(named, before, after)| (*named, *after, *before))
        .collect();
    let put_back = write_all(client, &backwards);
    let started = client.bring_to(state);
    if put_back.is_ok() && started.is_ok() {
        Undone::All
    } else {
        Undone::NotStored
    }
}
