//! Objects by name, and their values as text. If a configuration file has the setting, the notation is the same.

use config::{LEARNINGS, METHODS, parse_window, window_text, word_of};
use estimator_core::Learning;
use estimator_core::any::Method;
use estimator_core::half_widths::WindowLength;
use estimator_core::mounting::{MountingParams, SensorAxis};
use estimator_core::parameter;
use samples::mounting::parse_axes;
use samples::number::shown;
use thiserror::Error;
use wire::dictionary::{self, Entry, Limits, Object, Role, Shape, code_of_axes, index};
use wire::{Address, DataType, NodeId, Value};

use crate::remedy::FootHint;

/// Object of the dictionary, or a part of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Named {
    /// Index and subindex.
    pub address: Address,
    /// Dictionary entry.
    pub entry: &'static Entry,
    object: &'static Object,
}

/// Error in the name or the value of an object.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum NameError {
    /// No object has this name.
    #[error("no object has the name {0:?}")]
    Unknown(String),
    /// The value is invalid.
    #[error("{name} is {value:?}, but {expected} is expected")]
    Value {
        /// Name of the object.
        name: String,
        /// Text of the value.
        value: String,
        /// Expected values.
        expected: String,
    },
}

impl NameError {
    /// Returns the remedy, if it depends on the program.
    #[must_use]
    pub const fn hint(&self) -> Option<FootHint> {
        match self {
            Self::Unknown(_) => Some(FootHint::ListObjects),
            Self::Value { .. } => None,
        }
    }
}

/// Converts a title to a part of a name: lower case, with `_` between words.
fn part(title: &str) -> String {
    let words = title.split(|letter: char| !letter.is_alphanumeric());
    let words = words.filter(|word| !word.is_empty());
    words.map(str::to_lowercase).collect::<Vec<_>>().join("_")
}

impl Named {
    /// All objects, in the order of their addresses.
    pub fn all() -> impl Iterator<Item = Self> {
        dictionary::OBJECTS.iter().flat_map(|object| {
            object.entries.iter().map(move |entry| Self {
                address: Address::new(object.index, entry.subindex),
                entry,
                object,
            })
        })
    }

    /// All settings.
    pub fn settings() -> impl Iterator<Item = Self> {
        Self::all().filter(|named| named.entry.is_setting())
    }

    /// The object at an address.
    #[must_use]
    pub fn at(address: Address) -> Option<Self> {
        Self::all().find(|named| named.address == address)
    }

    /// Finds an object by its name, `decision.threshold`, or by its address, `0x2012:1` or `0x2010`.
    ///
    /// # Errors
    /// There is no such object.
    pub fn find(text: &str) -> Result<Self, NameError> {
        let by_address = address(text).and_then(Self::at);
        let found = by_address.or_else(|| Self::all().find(|named| named.name() == text));
        found.ok_or_else(|| NameError::Unknown(text.to_owned()))
    }

    /// Name: the key of the configuration file if it has the setting, else the titles of the object and its part.
    #[must_use]
    pub fn name(&self) -> String {
        match self.entry.key.as_str() {
            "" => self.title(),
            key => key.to_owned(),
        }
    }

    /// Titles of the object and its part in the dictionary, in lower case.
    fn title(&self) -> String {
        let object = part(self.object.name.as_str());
        match self.object.shape {
            Shape::Var => object,
            Shape::Array | Shape::Record => format!("{object}.{}", part(self.entry.name.as_str())),
        }
    }

    /// Meaning of the value. If the estimator has a parameter of this name, it is the parameter's meaning, because it
    /// describes a single value. Otherwise it is that of the object and its part.
    #[must_use]
    pub fn meaning(&self) -> String {
        let name = self.name();
        let row = parameter::rows().find(|row| row.name == name);
        row.map_or_else(|| self.doc(), |row| row.about.to_owned())
    }

    /// Description of the object, and that of its part as a second sentence.
    fn doc(&self) -> String {
        let (object, part) = (self.object.doc.as_str(), self.entry.doc.as_str());
        let mut rest = part.chars();
        match rest.next() {
            Some(first) if !object.is_empty() => {
                format!("{object}. {}{}", first.to_uppercase(), rest.as_str())
            }
            Some(_) => part.to_owned(),
            None => object.to_owned(),
        }
    }

    fn notation(&self) -> ValueNotation {
        ValueNotation::of(self.address, self.entry)
    }

    /// Unit after a value; empty if there is none, or if the value includes it.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        self.notation().unit(self.entry)
    }

    /// Description of the values that may be written.
    #[must_use]
    pub fn range(&self) -> String {
        let text = |value| self.text(value);
        match self.notation() {
            ValueNotation::Pdo => return "on or off".to_owned(),
            ValueNotation::Words([one, other]) => return format!("{one} or {other}"),
            ValueNotation::Axes => {
                return "three right-handed axes such as x,-z,y, or quaternion".to_owned();
            }
            ValueNotation::Number | ValueNotation::Seconds | ValueNotation::Milliseconds => {}
        }
        let unit = format!(" {}", self.unit());
        let unit = unit.trim_end();
        match self.entry.limits() {
            Limits::Any => format!("a value of type {}", self.entry.data_type().name()),
            Limits::Range(low, high) => format!("{} to {}{unit}", text(low), text(high)),
            Limits::RangeWithout(limits) => {
                let [low, high, from, to] = limits.map(text);
                format!("{low} to {high}{unit}, but not {from} to {to}")
            }
            Limits::OneOf(values) => {
                let values: Vec<_> = values.iter().map(|value| text(*value)).collect();
                format!("one of {}{unit}", values.join(", "))
            }
        }
    }

    /// Default value on a foot with this id.
    #[must_use]
    pub fn default(&self, node: Option<NodeId>) -> Value {
        match (self.entry.role, self.entry.default) {
            (Role::PdoCobId, Value::U32(base)) => Value::U32(base + id(node)),
            (_, default) => default,
        }
    }

    /// Formats a value without its unit.
    #[must_use]
    pub fn text(&self, value: Value) -> String {
        self.notation().text(value)
    }

    /// Parses a value and checks its range, for a foot with this id.
    ///
    /// # Errors
    /// The text is not a value of this type, or is out of range.
    pub fn parse(&self, text: &str, node: Option<NodeId>) -> Result<Value, NameError> {
        let refused = || NameError::Value {
            name: self.name(),
            value: text.to_owned(),
            expected: self.range(),
        };
        let value = self.notation().parse(text, self.entry, node);
        let value = value.ok_or_else(refused)?;
        if self.notation() != ValueNotation::Pdo {
            self.entry.limits().check(value).map_err(|_| refused())?;
        }
        Ok(value)
    }
}

/// Parses an address: `0x2012:1` or `0x2010`.
fn address(text: &str) -> Option<Address> {
    let digits = text.strip_prefix("0x")?;
    let (index, subindex) = digits.split_once(':').unwrap_or((digits, "0"));
    let index = u16::from_str_radix(index, 16).ok()?;
    Some(Address::new(index, subindex.parse().ok()?))
}

/// Bit of a PDO's identifier that disables it.
const OFF: u32 = 1 << 31;

const MICROS_PER_SECOND: f64 = 1.0e6;

/// Word for a mounting that the quaternion of the same object gives.
const QUATERNION: &str = "quaternion";

/// Notation of the values of an entry.
#[derive(Clone, Copy, Debug, PartialEq)]
enum ValueNotation {
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

impl ValueNotation {
    fn of(address: Address, entry: &Entry) -> Self {
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
            // Version and CRC are not times.
            (index::LEARNT, _) => Self::Number,
            _ if is_key && entry.data_type() == DataType::Unsigned32 => Self::Seconds,
            _ => Self::Number,
        }
    }

    /// Unit after a value; empty if there is none, or if the value includes it.
    fn unit(self, entry: &Entry) -> &'static str {
        match self {
            Self::Number => entry.unit.as_str(),
            Self::Seconds => "s",
            Self::Pdo | Self::Words(_) | Self::Milliseconds | Self::Axes => "",
        }
    }

    /// Formats a value so that it parses back to the same value, without its unit.
    fn text(self, value: Value) -> String {
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
    fn parse(self, text: &str, entry: &Entry, node: Option<NodeId>) -> Option<Value> {
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
fn id(node: Option<NodeId>) -> u32 {
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_object_is_found_by_its_unique_name_and_address() {
        let mut names = BTreeSet::new();
        for named in Named::all() {
            let name = named.name();
            assert!(names.insert(name.clone()), "{name} appears twice");
            assert_eq!(Named::find(&name), Ok(named));
            let Address { index, subindex } = named.address;
            assert_eq!(Named::find(&format!("0x{index:04X}:{subindex}")), Ok(named));
        }
        for known in ["foot", "window", "half_width.acceleration_m_s2.ax", "decision.threshold"] {
            assert!(names.contains(known), "{known}: {names:?}");
        }
    }

    #[test]
    fn settings_parse_defaults_and_reject_values_out_of_range() {
        let node = NodeId::new(0x12);
        for named in Named::settings() {
            let default = named.default(node);
            assert_eq!(named.parse(&named.text(default), node), Ok(default), "{}", named.name());
            assert!(named.parse("x", node).is_err() && named.parse("1e30", node).is_err());
        }
        for text in ["0x0", "-1ms", "50samples", "x,z,y", "0.8,0.6,0,0", "ON"] {
            let of_words = ["window", "axes", "method", "learning"];
            let mut named = of_words.map(|name| Named::find(name).expect("there is one"));
            assert!(named.iter_mut().all(|named| named.parse(text, node).is_err()), "{text}");
        }
        let threshold = Named::find("decision.threshold").expect("there is one");
        assert_eq!(
            threshold.parse("1.5", node).map_err(|error| error.to_string()),
            Err(format!("decision.threshold is \"1.5\", but {} is expected", threshold.range()))
        );
    }

    #[test]
    fn unknown_name_is_an_error_that_names_it() {
        let error = Named::find("half_width.axx").expect_err("there is none");
        assert!(error.to_string().starts_with("no object has the name \"half_width.axx\""));
    }

    #[test]
    fn values_have_the_notation_of_a_configuration_file() {
        for (name, text, value) in [
            ("method", "half_widths", Value::U8(1)),
            ("learning", "frozen", Value::U8(0)),
            ("window", "12.5ms", Value::U32(12_500)),
            ("decision.on_delay_s", "0.000001", Value::U32(1)),
            ("decision.off_delay_s", "0.2", Value::U32(200_000)),
            ("axes", "x,-z,y", Value::U16(162)),
            ("axes", "quaternion", Value::U16(0)),
            ("accelerometer.bias_m_s2.ay", "-0.25", Value::F32(-0.25)),
        ] {
            let named = Named::find(name).expect("there is one");
            assert_eq!(named.parse(text, None), Ok(value), "{name}");
            assert_eq!(named.text(value), text, "{name}");
        }
    }

    #[test]
    fn every_setting_of_the_estimator_has_the_key_of_a_file() {
        for key in config::keys() {
            for address in key.objects() {
                let name = Named::at(address).expect("an object").name();
                let path = key.path.trim_start_matches("feet.FL.");
                assert!(name == path || name.starts_with(&format!("{path}.")), "{name}");
            }
        }
        let named = Named::settings().filter(|named| !named.entry.key.is_empty());
        // 29 numbers, window, method, learning, 7 learnt, 6 of the accelerometer, axes.
        assert_eq!(named.count(), 46);
    }
}
