//! Description of an object: its values with their roles, access, limits and texts.

use estimator_core::parameter::{Parameter, Row, Unit};

use crate::abort::AbortCode;
use crate::value::{DataType, Value};

/// Object of the dictionary. On a microcontroller its texts are empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Object {
    /// Index.
    pub index: u16,
    /// Name.
    pub name: Text,
    /// Structure.
    pub shape: Shape,
    /// Description.
    pub doc: Text,
    /// Values. Sub-index 0 of an array or a record is not listed.
    pub entries: &'static [Entry],
}

impl Object {
    /// The highest sub-index.
    #[must_use]
    pub fn highest_subindex(&self) -> u8 {
        self.entries.last().map_or(0, |entry| entry.subindex)
    }
}

/// Structure of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One value, at sub-index 0.
    Var,
    /// Values of one type from sub-index 1; sub-index 0 is their number.
    Array,
    /// Values of different types from sub-index 1; sub-index 0 is the highest sub-index.
    Record,
}

/// Value in the dictionary. On a microcontroller its texts are empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// Sub-index in its object.
    pub subindex: u8,
    /// Name in an EDS.
    pub name: Text,
    /// Name of the setting in files and commands, as in the estimator's table. Empty for settings that only a foot has.
    pub key: Text,
    /// Role in the device.
    pub role: Role,
    /// Access rights.
    pub access: Access,
    /// Default value. It also determines the type.
    pub default: Value,
    limits: StoredLimits,
    /// Unit; empty if there is none.
    pub unit: Text,
    /// Meaning, if not clear from its name and its object's text.
    pub doc: Text,
}

impl Entry {
    pub(super) const fn new(
        subindex: u8,
        name: &'static str,
        role: Role,
        access: Access,
        default: Value,
    ) -> Self {
        Self {
            subindex,
            name: Text::new(name),
            key: Text::NONE,
            role,
            access,
            default,
            limits: StoredLimits::Any,
            unit: Text::NONE,
            doc: Text::NONE,
        }
    }

    pub(super) const fn constant(subindex: u8, name: &'static str, value: Value) -> Self {
        Self::new(subindex, name, Role::Constant, Access::Const, value)
    }

    pub(super) const fn cob_id(subindex: u8, name: &'static str, base: u32) -> Self {
        Self::new(subindex, name, Role::CobId, Access::Ro, Value::U32(base))
    }

    pub(super) const fn setting(
        subindex: u8,
        name: &'static str,
        concern: Concern,
        default: Value,
    ) -> Self {
        Self::new(subindex, name, Role::Setting(concern), Access::Rw, default)
    }

    pub(super) const fn switch(
        subindex: u8,
        name: &'static str,
        concern: Concern,
        default: u8,
    ) -> Self {
        Self::setting(subindex, name, concern, Value::U8(default)).range(Value::U8(0), Value::U8(1))
    }

    /// Creates a REAL32 number from its row in the estimator's table.
    pub(super) const fn row(subindex: u8, name: &'static str, concern: Concern, row: Row) -> Self {
        Self::setting(subindex, name, concern, Value::F32(row.default))
            .range(Value::F32(row.least), Value::F32(row.most))
            .unit(row.unit.symbol())
            .key(row.name)
    }

    /// Creates a duration in whole µs from its row in the estimator's table.
    pub(super) const fn row_in_micros(
        subindex: u8,
        name: &'static str,
        concern: Concern,
        row: Row,
    ) -> Self {
        assert!(matches!(row.unit, Unit::Second));
        Self::setting(subindex, name, concern, micros(row.default))
            .range(micros(row.least), micros(row.most))
            .unit("µs")
            .key(row.name)
    }

    pub(super) const fn parameter(subindex: u8, name: &'static str, parameter: Parameter) -> Self {
        Self::row(subindex, name, Concern::Parameter(parameter), parameter.row())
    }

    pub(super) const fn parameter_in_micros(
        subindex: u8,
        name: &'static str,
        parameter: Parameter,
    ) -> Self {
        Self::row_in_micros(subindex, name, Concern::Parameter(parameter), parameter.row())
    }

    pub(super) const fn live(subindex: u8, name: &'static str, default: Value) -> Self {
        Self::new(subindex, name, Role::Live, Access::Ro, default)
    }

    pub(super) const fn command(
        subindex: u8,
        name: &'static str,
        access: Access,
        default: Value,
    ) -> Self {
        Self::new(subindex, name, Role::Command, access, default)
    }

    pub(super) const fn key(mut self, key: &'static str) -> Self {
        self.key = Text::new(key);
        self
    }

    pub(super) const fn range(mut self, low: Value, high: Value) -> Self {
        let data_type = self.default.data_type() as u8;
        assert!(low.data_type() as u8 == data_type && high.data_type() as u8 == data_type);
        self.limits = StoredLimits::Range(low.to_raw(), high.to_raw());
        self
    }

    pub(super) const fn range_without(mut self, ends: &'static [Value; 4]) -> Self {
        self.limits = StoredLimits::RangeWithout(ends);
        self
    }

    pub(super) const fn one_of(mut self, values: &'static [Value]) -> Self {
        self.limits = StoredLimits::OneOf(values);
        self
    }

    pub(super) const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = Text::new(unit);
        self
    }

    pub(super) const fn doc(mut self, doc: &'static str) -> Self {
        self.doc = Text::new(doc);
        self
    }

    /// Returns the same entry, read-only, under another sub-index.
    pub(super) const fn as_live(self, subindex: u8) -> Self {
        Self {
            subindex,
            key: Text::NONE,
            role: Role::Live,
            access: Access::Ro,
            limits: StoredLimits::Any,
            ..self
        }
    }

    /// Allowed values.
    #[must_use]
    pub const fn limits(&self) -> Limits {
        let data_type = self.default.data_type();
        match self.limits {
            StoredLimits::Any => Limits::Any,
            StoredLimits::Range(low, high) => {
                match (Value::from_raw(data_type, low), Value::from_raw(data_type, high)) {
                    (Some(low), Some(high)) => Limits::Range(low, high),
                    // Only a text, which has no range.
                    _ => Limits::Any,
                }
            }
            StoredLimits::RangeWithout(ends) => Limits::RangeWithout(ends),
            StoredLimits::OneOf(values) => Limits::OneOf(values),
        }
    }

    /// Data type of the value.
    #[must_use]
    pub const fn data_type(&self) -> DataType {
        self.default.data_type()
    }

    /// Returns whether the value survives power-off.
    #[must_use]
    pub const fn is_setting(&self) -> bool {
        matches!(self.role, Role::Setting(_) | Role::PdoCobId)
    }

    /// Area affected by the entry, if it is a setting.
    #[must_use]
    pub const fn concern(&self) -> Option<Concern> {
        match self.role {
            Role::Setting(concern) => Some(concern),
            Role::PdoCobId => Some(Concern::Stream),
            _ => None,
        }
    }

    /// Returns whether the entry can be mapped to a PDO.
    #[must_use]
    pub const fn is_mappable(&self) -> bool {
        matches!(self.role, Role::Process | Role::Input)
    }
}

/// Role of an entry in the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The value is the default.
    Constant,
    /// The value is the default plus the node id.
    CobId,
    /// Configuration: kept, stored and restored. Written only in pre-operational state.
    Setting(Concern),
    /// Configuration: the identifier of a PDO. The value is the default plus the node id. Only bit 31 (set: the PDO is
    /// off) can be changed.
    PdoCobId,
    /// Process data: the value is that of the PDO that maps it.
    Process,
    /// Current state of the device.
    Live,
    /// Received process data.
    Input,
    /// Action that a write executes.
    Command,
}

/// Access rights of an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Never changes.
    Const,
    /// Can be read.
    Ro,
    /// Can be written.
    Wo,
    /// Can be read and written.
    Rw,
}

impl Access {
    /// The access type's name in an EDS.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Const => "const",
            Self::Ro => "ro",
            Self::Wo => "wo",
            Self::Rw => "rw",
        }
    }
}

/// Area affected by a setting. It determines which parts restart with the new value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Concern {
    /// The node itself: position of the foot, id, bit rates, autostart, lock.
    Node,
    /// Messages that are sent and received, and their timing.
    Stream,
    /// The sensor's start.
    Sensor,
    /// Processing of a sample before the estimate: the correction of the accelerometer, the mounting.
    Correction,
    /// The load input.
    Load,
    /// The estimator, except its numbers: method, learning, window.
    Estimator,
    /// A number of the estimator.
    Parameter(Parameter),
    /// Learnt values with which the estimator starts.
    Learnt,
}

/// [`Limits`] as an entry stores them. A range has the bits of its ends, whose type is that of the default, because 284
/// entries with two values each would take 4 KB more of a microcontroller's flash.
#[derive(Clone, Copy, Debug, PartialEq)]
enum StoredLimits {
    Any,
    Range(u32, u32),
    RangeWithout(&'static [Value; 4]),
    OneOf(&'static [Value]),
}

/// Allowed values. A value outside a [`Range`](Self::Range) is too high or too low. A value that the other two refuse is
/// invalid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limits {
    /// Any value of the type.
    Any,
    /// From the first to the second value.
    Range(Value, Value),
    /// From the first to the second value, except those from the third to the fourth, inclusive.
    RangeWithout(&'static [Value; 4]),
    /// One of these.
    OneOf(&'static [Value]),
}

impl Limits {
    /// Checks whether `value`, which must have the right type, is allowed.
    ///
    /// # Errors
    /// The reason, as an abort code.
    pub fn check(self, value: Value) -> Result<(), AbortCode> {
        match self {
            Self::Any => Ok(()),
            Self::Range(low, high) => in_range(value, low, high),
            Self::RangeWithout(&[low, high, from, to]) => {
                if in_range(value, low, high).is_err() || in_range(value, from, to).is_ok() {
                    return Err(AbortCode::InvalidValue);
                }
                Ok(())
            }
            Self::OneOf(values) => {
                if values.contains(&value) {
                    Ok(())
                } else {
                    Err(AbortCode::InvalidValue)
                }
            }
        }
    }

    /// Minimum and maximum, if there are any.
    #[must_use]
    pub fn range(self) -> Option<(Value, Value)> {
        match self {
            Self::Any => None,
            Self::Range(low, high) | Self::RangeWithout(&[low, high, ..]) => Some((low, high)),
            Self::OneOf(values) => Some((*values.first()?, *values.last()?)),
        }
    }
}

/// Text for people and files. A foot does not use it, so on a microcontroller it is empty and takes no memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text(#[cfg(not(target_os = "none"))] &'static str);

impl Text {
    pub(super) const NONE: Self = Self::new("");

    #[cfg(not(target_os = "none"))]
    pub(super) const fn new(text: &'static str) -> Self {
        Self(text)
    }

    #[cfg(target_os = "none")]
    pub(super) const fn new(_: &'static str) -> Self {
        Self()
    }

    /// The text.
    #[must_use]
    pub const fn as_str(self) -> &'static str {
        #[cfg(not(target_os = "none"))]
        return self.0;
        #[cfg(target_os = "none")]
        return "";
    }
}

impl core::ops::Deref for Text {
    type Target = str;

    fn deref(&self) -> &str {
        self.as_str()
    }
}

impl core::fmt::Display for Text {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.pad(self.as_str())
    }
}

/// Converts a time in s to whole µs.
const fn micros(seconds: f32) -> Value {
    Value::U32((seconds as f64 * 1.0e6 + 0.5) as u32)
}

fn in_range(value: Value, low: Value, high: Value) -> Result<(), AbortCode> {
    use core::cmp::Ordering::{Greater, Less};
    match (value.compare(low), value.compare(high)) {
        (Some(Less), _) => Err(AbortCode::TooLow),
        (_, Some(Greater)) => Err(AbortCode::TooHigh),
        (Some(_), Some(_)) => Ok(()),
        // NaN.
        _ => Err(AbortCode::InvalidValue),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_outside_the_limits_return_abort_codes() {
        let limits =
            Limits::RangeWithout(&[Value::U8(1), Value::U8(255), Value::U8(128), Value::U8(254)]);
        assert_eq!(limits.check(Value::U8(0)), Err(AbortCode::InvalidValue));
        assert_eq!(limits.check(Value::U8(128)), Err(AbortCode::InvalidValue));
        assert_eq!(limits.check(Value::U8(255)), Ok(()));
        let limits = Limits::Range(Value::F32(0.0), Value::F32(1.0));
        assert_eq!(limits.check(Value::F32(1.1)), Err(AbortCode::TooHigh));
        assert_eq!(limits.check(Value::F32(f32::NAN)), Err(AbortCode::InvalidValue));
    }
}
