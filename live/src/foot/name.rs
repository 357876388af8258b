//! Objects by name, and their values as text.

use std::fmt;

use thiserror::Error;
use wire::dictionary::{self, Entry, Limits, Object, Role, Shape};
use wire::{Address, DataType, NodeId, Value};

/// The bit of a PDO's identifier that switches it off.
const OFF: u32 = 1 << 31;

/// An object of the dictionary, or a part of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Named {
    /// Where it is.
    pub address: Address,
    /// What it is.
    pub entry: &'static Entry,
    object: &'static Object,
}

/// Why a text does not name an object, or is no value of it.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum NameError {
    /// There is none of that name.
    #[error("no object is called {name:?}{}", did_you_mean(near))]
    Unknown {
        /// The name.
        name: String,
        /// Names that are like it.
        near: Vec<String>,
    },
    /// The value does not fit.
    #[error("{name} is {value:?}, but {expected} is expected")]
    Value {
        /// The object's name.
        name: String,
        /// What was written.
        value: String,
        /// What would fit.
        expected: String,
    },
}

fn did_you_mean(near: &[String]) -> String {
    if near.is_empty() {
        return String::new();
    }
    format!("; did you mean {}?", near.join(" or "))
}

/// How much alike two names are at least for one to be suggested for the other, from 0 to 1.
const ALIKE: f64 = 0.8;

/// The names that are most like `text`, or whose last part is, or that contain it: three at most.
fn near(text: &str) -> Vec<String> {
    let last = |name: &str| name.rsplit('.').next().unwrap_or_default().to_owned();
    let likeness = |name: &str| {
        let whole = strsim::normalized_damerau_levenshtein(name, text);
        let parts = strsim::normalized_damerau_levenshtein(&last(name), &last(text));
        let contained = if name.contains(text) { ALIKE } else { 0.0 };
        whole.max(parts).max(contained)
    };
    let names = Named::all().map(|named| named.name());
    let mut near: Vec<_> = names.map(|name| (likeness(&name), name)).collect();
    near.retain(|(likeness, _)| *likeness >= ALIKE);
    // Stable: where two are as much alike, the first in the dictionary comes first.
    near.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    near.into_iter().map(|(_, name)| name).take(3).collect()
}

/// A title as a part of a name: lower case, with `_` between words.
fn part(title: &str) -> String {
    let letters = title.chars().map(|letter| match letter {
        letter if letter.is_alphanumeric() => letter,
        _ => ' ',
    });
    let words: String = letters.collect();
    let words: Vec<_> = words.split_whitespace().map(str::to_lowercase).collect();
    words.join("_")
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

    /// The object that `text` names: `half_width.ax`, or by its address: `0x2012:1`, `0x2010`.
    ///
    /// # Errors
    /// There is none.
    pub fn find(text: &str) -> Result<Self, NameError> {
        let by_address = address(text).and_then(Self::at);
        let found = by_address.or_else(|| Self::all().find(|named| named.name() == text));
        found.ok_or_else(|| NameError::Unknown {
            name: text.to_owned(),
            near: near(text),
        })
    }

    /// Its name, the same for every version that has it: that of the object, and of its part.
    #[must_use]
    pub fn name(&self) -> String {
        let object = part(self.object.name.as_str());
        match self.object.shape {
            Shape::Var => object,
            Shape::Array | Shape::Record => format!("{object}.{}", part(self.entry.name.as_str())),
        }
    }

    /// What it is, in words.
    #[must_use]
    pub fn doc(&self) -> String {
        let texts = [self.object.doc.as_str(), self.entry.doc.as_str()];
        let texts = texts.into_iter().filter(|text| !text.is_empty());
        texts.collect::<Vec<_>>().join("; ")
    }

    /// What may be written, in words.
    #[must_use]
    pub fn range(&self) -> String {
        if self.entry.role == Role::PdoCobId {
            return "on or off".to_owned();
        }
        let unit = match self.entry.unit.as_str() {
            "" => String::new(),
            unit => format!(" {unit}"),
        };
        let text = |value| Shown(value).to_string();
        match self.entry.limits() {
            Limits::Any => format!("a value of type {}", self.entry.data_type().name()),
            Limits::Range(low, high) => format!("{} to {}{unit}", text(low), text(high)),
            Limits::RangeWithout([low, high, from, to]) => format!(
                "{} to {}{unit}, but not {} to {}",
                text(low),
                text(high),
                text(from),
                text(to)
            ),
            Limits::OneOf(values) => {
                let values: Vec<_> = values.iter().map(|value| text(*value)).collect();
                format!("one of {}{unit}", values.join(", "))
            }
        }
    }

    /// Its value at first, on a foot of this id.
    #[must_use]
    pub fn default(&self, node: Option<NodeId>) -> Value {
        match (self.entry.role, self.entry.default) {
            (Role::PdoCobId, Value::U32(base)) => Value::U32(base + id(node)),
            (_, default) => default,
        }
    }

    /// A value as text, without its unit.
    #[must_use]
    pub fn text(&self, value: Value) -> String {
        match (self.entry.role, value) {
            (Role::PdoCobId, Value::U32(cob_id)) if cob_id & OFF != 0 => "off".to_owned(),
            (Role::PdoCobId, _) => "on".to_owned(),
            _ => Shown(value).to_string(),
        }
    }

    /// The value that `text` is, within what may be written, for a foot of this id.
    ///
    /// # Errors
    /// It is none, or not allowed.
    pub fn parse(&self, text: &str, node: Option<NodeId>) -> Result<Value, NameError> {
        let refused = || NameError::Value {
            name: self.name(),
            value: text.to_owned(),
            expected: self.range(),
        };
        if let (Role::PdoCobId, Value::U32(base)) = (self.entry.role, self.entry.default) {
            return match text {
                "on" => Ok(Value::U32(base + id(node))),
                "off" => Ok(Value::U32((base + id(node)) | OFF)),
                _ => Err(refused()),
            };
        }
        let value = number(self.entry.data_type(), text).ok_or_else(refused)?;
        self.entry.limits().check(value).map_err(|_| refused())?;
        Ok(value)
    }
}

fn id(node: Option<NodeId>) -> u32 {
    node.map_or(0, |node| u32::from(node.get()))
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

/// `0x2012:1` or `0x2010`.
fn address(text: &str) -> Option<Address> {
    let digits = text.strip_prefix("0x")?;
    let (index, subindex) = digits.split_once(':').unwrap_or((digits, "0"));
    let index = u16::from_str_radix(index, 16).ok()?;
    Some(Address::new(index, subindex.parse().ok()?))
}

/// A value as text that reads back as the same.
struct Shown(Value);

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Value::I16(value) => write!(f, "{value}"),
            Value::U8(value) => write!(f, "{value}"),
            Value::U16(value) => write!(f, "{value}"),
            Value::U32(value) => write!(f, "{value}"),
            Value::F32(value) => write!(f, "{value}"),
            Value::Text(text) => f.write_str(text),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_object_has_a_name_of_its_own_by_which_it_is_found() {
        let mut names = BTreeSet::new();
        for named in Named::all() {
            let name = named.name();
            assert!(names.insert(name.clone()), "{name} stands twice");
            assert_eq!(Named::find(&name), Ok(named));
            let Address { index, subindex } = named.address;
            assert_eq!(Named::find(&format!("0x{index:04X}:{subindex}")), Ok(named));
        }
        for known in ["foot", "window", "half_width.ax", "decision.threshold"] {
            assert!(names.contains(known), "{known}: {names:?}");
        }
    }

    #[test]
    fn every_setting_reads_its_own_default_and_nothing_beyond_its_range() {
        let node = NodeId::new(0x12);
        for named in Named::settings() {
            let default = named.default(node);
            assert_eq!(
                named.parse(&named.text(default), node),
                Ok(default),
                "{}",
                named.name()
            );
            assert!(named.parse("x", node).is_err() && named.parse("1e30", node).is_err());
        }
        let threshold = Named::find("decision.threshold").expect("there is one");
        assert_eq!(
            threshold
                .parse("1.5", node)
                .map_err(|error| error.to_string()),
            Err(format!(
                "decision.threshold is \"1.5\", but {} is expected",
                threshold.range()
            ))
        );
    }

    #[test]
    fn a_name_that_is_not_quite_one_is_answered_with_what_is() {
        let error = Named::find("half_width.axx")
            .expect_err("there is none")
            .to_string();
        assert!(
            error.starts_with("no object is called \"half_width.axx\""),
            "{error}"
        );
        let error = Named::find("bandwith.ax")
            .expect_err("there is none")
            .to_string();
        assert!(
            error.contains("did you mean") && error.contains("bandwidth.ax"),
            "{error}"
        );
    }
}
