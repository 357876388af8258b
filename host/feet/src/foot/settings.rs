//! Sets of settings: read from a foot or a text, compared, and written, all or none.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use thiserror::Error;
use wire::dictionary::index;
use wire::node::{NmtCommand, NmtState};
use wire::{AbortCode, Address, Foot, NodeId, Value};

use super::name::{NameError, Named};
use super::request::FootRequest;
use super::{Client, RequestError};
use crate::remedy::FootHint;

/// Settings by address.
pub type SettingValues = BTreeMap<Address, Value>;

/// Error of reading settings from a text, or writing them to a foot.
#[derive(Debug, Error)]
pub enum SettingsError {
    /// A line of the text is invalid.
    #[error("line {line}: {cause}")]
    Line {
        /// Line number, from 1.
        line: usize,
        /// Error of the line.
        cause: LineError,
    },
    /// The settings are incompatible with each other.
    #[error("these settings are incompatible, from {0} on; nothing was written")]
    Incompatible(String),
    /// The foot has not accepted all of them.
    #[error("{cause}; {}", undone.name())]
    NotTaken {
        /// Cause of the failure.
        cause: RequestError,
        /// Settings of the foot after the failure.
        undone: Undone,
    },
    /// A setting reads back as another value.
    #[error("{name} was written as {written} and reads back as {read}; {}", undone.name())]
    ReadBack {
        /// Name of the setting.
        name: String,
        /// Written value.
        written: String,
        /// Value read back.
        read: String,
        /// Settings of the foot after the failure.
        undone: Undone,
    },
    /// A request has failed before anything was written, or after all settings were.
    #[error(transparent)]
    Request(#[from] RequestError),
}

impl SettingsError {
    /// Returns the remedy, if it depends on the program.
    #[must_use]
    pub const fn hint(&self) -> Option<FootHint> {
        match self {
            Self::Line { cause: LineError::Name(error), .. } => error.hint(),
            Self::Request(error) => error.hint(),
            Self::Line { .. }
            | Self::Incompatible(_)
            | Self::NotTaken { .. }
            | Self::ReadBack { .. } => None,
        }
    }
}

/// Error of a line of settings.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum LineError {
    /// The line has another syntax.
    #[error("{0:?} is not a setting, such as window = 50ms")]
    Syntax(String),
    /// The name is unknown, or the value is invalid.
    #[error(transparent)]
    Name(#[from] NameError),
    /// The object of this name cannot be written.
    #[error("{0} is not a setting and cannot be written")]
    NotWritable(String),
    /// The setting of this name has two values.
    #[error("{0} appears twice")]
    Twice(String),
}

samples::named! {
    /// Settings of a foot after a failure, described by its name.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Undone {
        /// The previous settings.
        All = "all settings are as they were",
        /// Some of the new and some of the previous settings until a reset; nothing was stored.
        NotStored = "the foot has some of the new settings and some of the old until it is reset; none of the new are stored",
        /// The settings that were stored before.
        NoneStored = "it has the settings that were stored before",
        /// All new settings; whether they are stored is unknown.
        Unknown = "the foot has the new settings; whether they are stored is seen after a reset",
    }
}

/// Lifetime of written settings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lasting {
    /// Until the foot is reset.
    UntilReset,
    /// Permanently: all settings are stored.
    Stored,
}

/// Reads all settings of a foot.
///
/// # Errors
/// A request has failed.
pub fn read(client: &mut Client) -> Result<SettingValues, RequestError> {
    let mut values = SettingValues::new();
    for named in Named::settings() {
        let value = client.read(named.address, named.entry.data_type())?;
        values.insert(named.address, value);
    }
    Ok(values)
}

/// Default settings of a foot with this id.
#[must_use]
pub fn defaults(node: Option<NodeId>) -> SettingValues {
    let default = |named: Named| (named.address, named.default(node));
    Named::settings().map(default).collect()
}

/// Formats settings as text, one per line, with range and unit as a comment.
#[must_use]
pub fn to_text(values: &SettingValues, about: &str) -> String {
    let mut text = format!("# {about}\n");
    for (address, value) in values {
        let Some(named) = Named::at(*address) else {
            continue;
        };
        let (name, value, range) = (named.name(), named.text(*value), named.range());
        // Writing to a String does not fail.
        let _ = writeln!(text, "{name} = {value} # {range}");
    }
    text
}

/// Parses the settings in a text, for a foot with this id. Unknown names and invalid values are errors.
///
/// # Errors
/// The first invalid line.
pub fn from_text(text: &str, node: Option<NodeId>) -> Result<SettingValues, SettingsError> {
    let mut values = SettingValues::new();
    // Windows programs write a byte order mark.
    let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or("").trim();
        if line.is_empty() {
            continue;
        }
        let (named, value) =
            parse_line(line, node).map_err(|cause| SettingsError::Line { line: number, cause })?;
        if values.insert(named.address, value).is_some() {
            let cause = LineError::Twice(named.name());
            return Err(SettingsError::Line { line: number, cause });
        }
    }
    Ok(values)
}

/// Settings of a configuration file that a foot has, and the names of the others.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OfConfiguration {
    /// Settings of the foot.
    pub values: SettingValues,
    /// Names of the settings that only hosts have, such as the bias of the gyroscope, which a foot finds itself.
    pub left_out: Vec<String>,
}

/// Takes the settings of a configuration file, by name and value, for a foot with this id.
///
/// # Errors
/// A setting of the foot does not accept its value.
pub fn from_configuration(
    settings: impl IntoIterator<Item = (String, String)>,
    node: Option<NodeId>,
) -> Result<OfConfiguration, NameError> {
    let mut taken = OfConfiguration::default();
    for (name, value) in settings {
        match Named::find(&name) {
            Ok(named) if named.entry.is_setting() => {
                taken.values.insert(named.address, named.parse(&value, node)?);
            }
            _ => taken.left_out.push(name),
        }
    }
    Ok(taken)
}

/// Parses a line without its comment.
fn parse_line(line: &str, node: Option<NodeId>) -> Result<(Named, Value), LineError> {
    let (name, value) = line.split_once('=').ok_or_else(|| LineError::Syntax(line.to_owned()))?;
    let named = Named::find(name.trim())?;
    if !named.entry.is_setting() {
        return Err(LineError::NotWritable(named.name()));
    }
    Ok((named, named.parse(value.trim(), node)?))
}

/// Returns the settings whose values differ, with both values; settings missing in one are skipped.
#[must_use]
pub fn differences(from: &SettingValues, to: &SettingValues) -> Vec<(Named, Value, Value)> {
    let both = from.iter().filter_map(|(address, before)| {
        let after = to.get(address)?;
        let named = Named::at(*address)?;
        (named.text(*before) != named.text(*after)).then_some((named, *before, *after))
    });
    both.collect()
}

/// Node id of a foot with these settings after its next start.
fn node_of(settings: &SettingValues) -> Option<NodeId> {
    let number = |index| Some(settings.get(&Address::new(index, 0))?.to_raw());
    let id = number(index::NODE_ID)?;
    if id != 0 {
        return NodeId::new(u8::try_from(id).ok()?);
    }
    let code = u8::try_from(number(index::FOOT)?).ok()?;
    Foot::from_code(code).map(Foot::default_node_id)
}

/// Stores all settings, and reads them back. A foot that has restarted during that has lost `settings`.
///
/// # Errors
/// Another board has the new id of the foot, or the foot refuses the request, does not respond or has restarted.
fn store_these(client: &mut Client, settings: &SettingValues) -> Result<(), RequestError> {
    if let Some(node) = node_of(settings) {
        client.check_free(node)?;
    }
    client.store()?;
    if differences(settings, &read(client)?).is_empty() {
        return Ok(());
    }
    Err(RequestError::StartedAgain(client.foot()))
}

/// Stores the current settings; the foot must not stream meanwhile.
///
/// # Errors
/// Another board has the new id of the foot, or the foot refuses the request, does not respond or has restarted.
pub fn store(client: &mut Client) -> Result<(), RequestError> {
    let settings = read(client)?;
    store_these(client, &settings)
}

/// Erases the stored settings and restarts the foot with its defaults, as the front left foot.
///
/// # Errors
/// Another board has the id of that foot, or the foot refuses the request or does not restart.
pub fn restore(client: &mut Client) -> Result<(), RequestError> {
    let node = Foot::default().default_node_id();
    client.check_free(node)?;
    while_paused(client, Client::restore)?;
    client.restart(Some(node))
}

/// Writes the settings that differ from the foot's, all or none, reads them back, and stores them
/// if requested. The foot does not stream meanwhile. Returns the changes.
///
/// # Errors
/// The settings are incompatible, or the foot does not accept or store them; the previous ones are restored
/// as far as [`Undone`] reports.
pub fn write(
    client: &mut Client,
    values: &SettingValues,
    lasting: Lasting,
) -> Result<Vec<(Named, Value, Value)>, SettingsError> {
    let before = read(client)?;
    let changes = differences(&before, values);
    if changes.is_empty() && lasting == Lasting::UntilReset {
        return Ok(changes);
    }
    let state = pause(client)?;
    let axes_before = before.get(&AXES).copied();
    let axes_after = values.get(&AXES).copied().or(axes_before);
    if let Err(failure) = write_all(client, &changes, axes_after) {
        let undone = put_back(client, &changes, axes_before, state);
        return Err(failure.into_error(undone));
    }
    if lasting == Lasting::Stored {
        let mut settings = before;
        let new = changes.iter();
        settings.extend(new.map(|(named, _, value)| (named.address, *value)));
        if let Err(cause) = store_these(client, &settings) {
            let undone = match cause {
                RequestError::NoAnswer { .. } | RequestError::Link(_) => Undone::Unknown,
                RequestError::StartedAgain(_) => {
                    // After a reset of its own, the foot is in the state of its settings.
                    let _ = client.bring_to(state);
                    Undone::NoneStored
                }
                _ => put_back(client, &changes, axes_before, state),
            };
            return Err(SettingsError::NotTaken { cause, undone });
        }
    }
    client.bring_to(state)?;
    Ok(changes)
}

/// Puts a foot into the pre-operational state, in which it accepts settings and does not stream; returns
/// the previous state.
///
/// # Errors
/// Several boards respond as this foot, or it does not report its state.
fn pause(client: &mut Client) -> Result<NmtState, RequestError> {
    client.check_alone()?;
    let before = client.state()?;
    client.command(NmtCommand::EnterPreOperational)?;
    Ok(before)
}

/// Runs an action while the foot does not stream, and restores its previous state.
///
/// # Errors
/// The action has failed, or the foot has restarted meanwhile or does not report its state.
pub fn while_paused(
    client: &mut Client,
    action: impl FnOnce(&mut Client) -> Result<(), RequestError>,
) -> Result<(), RequestError> {
    let before = pause(client)?;
    let starts = client.starts();
    let done = action(client);
    client.bring_to(before)?;
    if done.is_ok() && client.starts() != starts {
        return Err(RequestError::StartedAgain(client.foot()));
    }
    done
}

/// Reason why settings were not written. The foot may have some of them.
enum WriteFailure {
    /// A request has failed.
    NotTaken(RequestError),
    /// The foot refuses a setting, whatever else it has.
    Incompatible(Named),
    /// A setting has another value than was written.
    ReadBack { setting: Named, written: Value, read: Value },
}

impl WriteFailure {
    /// Returns the error for the user, after the previous settings were restored as far as `undone` reports.
    fn into_error(self, undone: Undone) -> SettingsError {
        match self {
            Self::NotTaken(cause) => SettingsError::NotTaken { cause, undone },
            Self::Incompatible(setting) if undone == Undone::All => {
                SettingsError::Incompatible(setting.name())
            }
            Self::Incompatible(setting) => SettingsError::NotTaken {
                cause: RequestError::Refused {
                    request: FootRequest::Write(setting.address),
                    reason: AbortCode::Incompatible,
                },
                undone,
            },
            Self::ReadBack { setting, written, read } => SettingsError::ReadBack {
                name: setting.name(),
                written: setting.text(written),
                read: setting.text(read),
                undone,
            },
        }
    }
}

/// Axes of the mounting as a code, or 0 if the quaternion of the same object gives them.
const AXES: Address = Address::new(index::MOUNTING, 1);

/// Code of a sensor whose axes are the axes of the foot.
const IDENTITY: Value = Value::U16(123);

/// Writes `changes` in an order that the foot accepts. `axes` is the value that [`AXES`] must have afterwards.
fn write_all(
    client: &mut Client,
    changes: &[(Named, Value, Value)],
    axes: Option<Value>,
) -> Result<(), WriteFailure> {
    let mut steps: Vec<(Named, Value)> =
        changes.iter().map(|(named, _, new)| (*named, *new)).collect();
    // While a quaternion is selected, the foot refuses each part of it that does not fit the other parts. So a code
    // is selected before the parts are written, and the wanted axes after them.
    let is_part = |named: &Named| named.address.index == AXES.index && named.address != AXES;
    let rotates = steps.iter().any(|(named, _)| is_part(named));
    if let (true, Some(axes), Some(named)) = (rotates, axes, Named::at(AXES)) {
        steps.retain(|(named, _)| named.address != AXES);
        steps.extend([(named, IDENTITY), (named, axes)]);
    }
    // A locked foot accepts no setting but the lock, so it is unlocked first and locked last.
    steps.sort_by_key(|(named, value)| match named.address {
        Address { index: index::LOCK, .. } if *value == Value::U8(0) => 0,
        AXES if rotates && *value == IDENTITY => 1,
        AXES => 3,
        Address { index: index::LOCK, .. } => 4,
        _ => 2,
    });
    // A refused setting may become compatible once another is written, so refused settings are retried as long as any
    // setting is accepted.
    while !steps.is_empty() {
        let mut refused = Vec::new();
        let before = steps.len();
        for (named, value) in steps {
            match client.write(named.address, value) {
                Ok(()) => {}
                Err(error) if error.is_refusal(AbortCode::Incompatible) => {
                    refused.push((named, value));
                }
                Err(error) => return Err(WriteFailure::NotTaken(error)),
            }
        }
        if let Some((first, _)) = refused.first()
            && refused.len() == before
        {
            return Err(WriteFailure::Incompatible(*first));
        }
        steps = refused;
    }
    for (named, _, value) in changes {
        let read = client.read(named.address, named.entry.data_type());
        let read = read.map_err(WriteFailure::NotTaken)?;
        if read != *value {
            return Err(WriteFailure::ReadBack { setting: *named, written: *value, read });
        }
    }
    Ok(())
}

/// Restores the previous settings as far as possible.
fn put_back(
    client: &mut Client,
    changes: &[(Named, Value, Value)],
    axes: Option<Value>,
    state: NmtState,
) -> Undone {
    let backwards = changes.iter();
    let backwards = backwards.map(|(named, before, after)| (*named, *after, *before));
    let written = write_all(client, &backwards.collect::<Vec<_>>(), axes);
    let started = client.bring_to(state);
    match (written, started) {
        (Ok(()), Ok(())) => Undone::All,
        _ => Undone::NotStored,
    }
}

/// Reads the position of the board.
///
/// # Errors
/// A request has failed, or the code of the position is unknown.
pub fn position(client: &mut Client) -> Result<Foot, RequestError> {
    let code = client.read_number(index::FOOT, 0)?;
    let foot = u8::try_from(code).ok().and_then(Foot::from_code);
    foot.ok_or(RequestError::Unknown { what: "the foot", code })
}

/// Sets and stores the position of the board, with the default node id of that position, and restarts the board. A new
/// board is the front left foot.
///
/// # Errors
/// Another board has this id, or the board does not accept the settings.
pub fn set_position(client: &mut Client, foot: Foot) -> Result<(), SettingsError> {
    client.check_alone()?;
    let node = foot.default_node_id();
    client.check_free(node)?;
    let values = SettingValues::from([
        (Address::new(index::FOOT, 0), Value::U8(foot.code())),
        // 0: the default id of the position.
        (Address::new(index::NODE_ID, 0), Value::U8(0)),
    ]);
    write(client, &values, Lasting::Stored)?;
    client.restart(Some(node))?;
    Ok(())
}
