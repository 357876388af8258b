//! Values of settings as text, in the notation of a configuration file where it has the setting.

use estimator_core::{Learning, Method, MountingParams, SensorAxis, WindowLength};
use recordings::config::{LEARNINGS, METHODS, parse_axes, parse_window, window_text, word_of};
use recordings::number::shown;
use wire::dictionary::code_of_axes;
use wire::dictionary::{Entry, Role, index};
use wire::{Address, DataType, NodeId, Value};

/// Bit of a PDO's identifier that disables it.
const OFF: u32 = 1 << 31;

const MICROS_PER_SECOND: f64 = 1.0e6;

/// Word for a mounting that the quaternion of the same object gives.
const QUATERNION: &str = "quaternion";

/// Notation of the values of an entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Notation {
    /// A number in the unit of the entry.
    Number,
    /// `on` or `off`, for the identifier of a PDO.
    Pdo,
    /// A word for each of the codes 0 and 1.
    Words([&'static str; 2]),
    /// Seconds, of an entry in whole µs.
    Seconds,
    /// A duration such as `50ms`, of an entry in whole µs.
    Milliseconds,
    /// The sensor's axes along the foot's, such as `x,-z,y`.
    Axes,
}

impl Notation {
    pub(super) fn of(address: Address, entry: &Entry) -> Self {
        let is_key = !entry.key.is_empty();
        match (address.index, address.subindex) {
            _ if entry.role == Role::PdoCobId => Self::Pdo,
            (index::ESTIMATION, 1) => {
                let methods = [Method::SelfCalibrating, Method::HalfWidths];
                Self::Words(methods.map(|method| word_of(&METHODS, method)))
            }
            (index::ESTIMATION, 2) => {
                let learnings = [Learning::Frozen, Learning::On];
                Self::Words(learnings.map(|learning| word_of(&LEARNINGS, learning)))
            }
            (index::MOUNTING, 1) => Self::Axes,
            (index::WINDOW, _) => Self::Milliseconds,
            _ if is_key && entry.data_type() == DataType::Unsigned32 => Self::Seconds,
            _ => Self::Number,
        }
    }

    /// Unit after a value; empty if there is none, or if the value includes it.
    pub(super) fn unit(self, entry: &Entry) -> &'static str {
        match self {
            Self::Number => entry.unit.as_str(),
            Self::Seconds => "s",
            Self::Pdo | Self::Words(_) | Self::Milliseconds | Self::Axes => "",
        }
    }

    /// Formats a value so that it parses back to the same value, without its unit.
    pub(super) fn text(self, value: Value) -> String {
        match (self, value) {
            (Self::Pdo, Value::U32(cob_id)) if cob_id & OFF != 0 => "off".to_owned(),
            (Self::Pdo, _) => "on".to_owned(),
            (Self::Words(words), Value::U8(code)) if usize::from(code) < words.len() => {
                words[usize::from(code)].to_owned()
            }
            (Self::Seconds, Value::U32(micros)) => {
                (f64::from(micros) / MICROS_PER_SECOND).to_string()
            }
            (Self::Milliseconds, Value::U32(micros)) => {
                let seconds = f64::from(micros) / MICROS_PER_SECOND;
                window_text(WindowLength::Duration(seconds as f32))
            }
            (Self::Axes, Value::U16(code)) => axes_text(code),
            _ => raw_text(value),
        }
    }

    /// Parses a value, for a foot with this id; `None` if the text has another notation.
    pub(super) fn parse(self, text: &str, entry: &Entry, node: Option<NodeId>) -> Option<Value> {
        match self {
            Self::Number => number(entry.data_type(), text),
            Self::Pdo => {
                let cob_id = entry.default.to_raw() + id(node);
                match text {
                    "on" => Some(Value::U32(cob_id)),
                    "off" => Some(Value::U32(cob_id | OFF)),
                    _ => None,
                }
            }
            Self::Words(words) => {
                let code = words.iter().position(|word| *word == text)?;
                u8::try_from(code).ok().map(Value::U8)
            }
            Self::Seconds => micros(text.parse().ok()?),
            Self::Milliseconds => match parse_window(text).ok()? {
                WindowLength::Duration(seconds) => micros(f64::from(seconds)),
                WindowLength::Samples(_) => None,
            },
            Self::Axes if text == QUATERNION => Some(Value::U16(0)),
            Self::Axes => match parse_axes(text).ok()?.params() {
                MountingParams::Axes(axes) => Some(Value::U16(code_of_axes(axes))),
                MountingParams::Rotation(_) => None,
            },
        }
    }
}

/// Node id as an offset of identifiers; 0 without one.
pub(super) fn id(node: Option<NodeId>) -> u32 {
    node.map_or(0, |node| u32::from(node.get()))
}

/// Converts a time in s to whole µs; `None` if it does not fit.
fn micros(seconds: f64) -> Option<Value> {
    let micros = (seconds * MICROS_PER_SECOND).round();
    let fits = (0.0..=f64::from(u32::MAX)).contains(&micros);
    fits.then_some(Value::U32(micros as u32))
}

/// Formats the code of a mounting.
fn axes_text(code: u16) -> String {
    let axis = |digit: u16| SensorAxis::ALL.get(usize::from(digit).wrapping_sub(1));
    match [axis(code / 100), axis(code / 10 % 10), axis(code % 10)] {
        [Some(x), Some(y), Some(z)] => [x, y, z].map(|axis| axis.name()).join(","),
        _ => QUATERNION.to_owned(),
    }
}

fn number(data_type: DataType, text: &str) -> Option<Value> {
    fn whole<T: TryFrom<i64>>(text: &str) -> Option<T> {
        let number = match text.strip_prefix("0x") {
            Some(digits) => i64::from_str_radix(digits, 16).ok()?,
            None => text.parse().ok()?,
        };
        T::try_from(number).ok()
    }
    Some(match data_type {
        DataType::Integer16 => Value::I16(whole(text)?),
        DataType::Unsigned8 => Value::U8(whole(text)?),
        DataType::Unsigned16 => Value::U16(whole(text)?),
        DataType::Unsigned32 => Value::U32(whole(text)?),
        DataType::Real32 => {
            let number: f32 = text.parse().ok()?;
            number.is_finite().then_some(Value::F32(number))?
        }
        DataType::VisibleString => return None,
    })
}

/// Formats a number so that it parses back to the same value.
fn raw_text(value: Value) -> String {
    match value {
        Value::I16(value) => value.to_string(),
        Value::U8(value) => value.to_string(),
        Value::U16(value) => value.to_string(),
        Value::U32(value) => value.to_string(),
        Value::F32(value) => shown(value),
        Value::Text(text) => text.to_owned(),
    }
}
