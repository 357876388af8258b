//! A value in the dictionary: what it is, who may do what with it, and what may be written.

use estimator_core::{Parameter, Row, Unit};

use super::limits::Limits;
use super::mounting;
use super::settings::CAN_BIT_RATES;
use super::text::Text;
use crate::value::{DataType, Value};

/// Who may do what with an entry.
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

/// What an entry is to the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Its default is its value.
    Constant,
    /// Its default plus the node id is its value.
    CobId,
    /// Configuration: kept, stored and restored, written in pre-operational only.
    Setting(Concern),
    /// Configuration: the identifier of a PDO. Its default plus the node id is its value, and
    /// only bit 31 (set: the PDO is off) can be changed.
    PdoCobId,
    /// Process data: what the PDO it is mapped to holds.
    Process,
    /// Something that the device knows.
    Live,
    /// Process data that comes in.
    Input,
    /// Something that is done when it is written.
    Command,
}

/// What a setting changes: what has to begin again with its new value follows from it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Concern {
    /// The node itself: which foot, its id, its bit rates, its start, its lock.
    Node,
    /// What is sent and received, and when.
    Stream,
    /// The sensor's start.
    Sensor,
    /// What is done to a sample before the estimate: the correction of the accelerometer, the mounting.
    Correction,
    /// The load input.
    Load,
    /// The estimator, beside its numbers: method, learning, window.
    Estimator,
    /// A number of the estimator.
    Parameter(Parameter),
    /// What the estimator starts with.
    Learnt,
}

/// Limits as an entry holds them, in a byte beside eight bytes of numbers: the numbers' type is that
/// of the entry's default.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bounds {
    Any,
    /// The numbers are the least and the greatest value.
    Range,
    /// The bytes of the first number are those of [`Limits::RangeWithout`].
    RangeWithout,
    OneOf(Choice),
}

/// Lists of the values that may be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Choice {
    CanBitRate,
    Axes,
}

impl Choice {
    const fn values(self) -> &'static [Value] {
        match self {
            Self::CanBitRate => CAN_BIT_RATES,
            Self::Axes => mounting::AXES,
        }
    }
}

/// A time in s as whole µs.
const fn micros(seconds: f32) -> Value {
    Value::U32((seconds as f64 * 1.0e6 + 0.5) as u32)
}

// The dictionary lies in the foot's flash.
#[cfg(target_os = "none")]
const _: () = assert!(size_of::<Entry>() <= 20);

/// A value in the dictionary. On a microcontroller its texts are empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// The part of its object that it is.
    pub subindex: u8,
    /// Its name.
    pub name: Text,
    /// What it is to the device.
    pub role: Role,
    /// Who may do what with it.
    pub access: Access,
    /// Its value at first, which also fixes its type.
    pub default: Value,
    bounds: Bounds,
    numbers: [u32; 2],
    /// The unit; empty where there is none.
    pub unit: Text,
    /// What it means, where its name and its object's text do not say it all.
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
            role,
            access,
            default,
            bounds: Bounds::Any,
            numbers: [0; 2],
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

    /// A number by its row in the estimator's table, as REAL32.
    pub(super) const fn row(subindex: u8, name: &'static str, concern: Concern, row: Row) -> Self {
        Self::setting(subindex, name, concern, Value::F32(row.default))
            .range(Value::F32(row.least), Value::F32(row.most))
            .unit(row.unit.symbol())
    }

    /// A duration by its row in the estimator's table, as whole µs.
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
    }

    pub(super) const fn parameter(subindex: u8, name: &'static str, parameter: Parameter) -> Self {
        Self::row(
            subindex,
            name,
            Concern::Parameter(parameter),
            parameter.row(),
        )
    }

    pub(super) const fn parameter_in_micros(
        subindex: u8,
        name: &'static str,
        parameter: Parameter,
    ) -> Self {
        Self::row_in_micros(
            subindex,
            name,
            Concern::Parameter(parameter),
            parameter.row(),
        )
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

    pub(super) const fn range(mut self, low: Value, high: Value) -> Self {
        self.bounds = Bounds::Range;
        self.numbers = [low.to_raw(), high.to_raw()];
        self
    }

    /// From the first byte to the second, but nothing between the third and the fourth.
    pub(super) const fn range_without(mut self, bytes: [u8; 4]) -> Self {
        assert!(matches!(self.default, Value::U8(_)));
        self.bounds = Bounds::RangeWithout;
        self.numbers = [u32::from_le_bytes(bytes), 0];
        self
    }

    pub(super) const fn one_of(mut self, choice: Choice) -> Self {
        self.bounds = Bounds::OneOf(choice);
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

    /// The same, not to be written, under another sub-index.
    pub(super) const fn as_live(self, subindex: u8) -> Self {
        Self {
            subindex,
            role: Role::Live,
            access: Access::Ro,
            bounds: Bounds::Any,
            ..self
        }
    }

    /// What may be written.
    #[must_use]
    pub fn limits(&self) -> Limits {
        match self.bounds {
            Bounds::Any => Limits::Any,
            Bounds::Range => {
                let [low, high] = self.numbers;
                let number = |raw| Value::from_raw(self.data_type(), raw);
                // Text has no range.
                number(low)
                    .zip(number(high))
                    .map_or(Limits::Any, |(low, high)| Limits::Range(low, high))
            }
            Bounds::RangeWithout => {
                let [bytes, _] = self.numbers;
                Limits::RangeWithout(bytes.to_le_bytes().map(Value::U8))
            }
            Bounds::OneOf(choice) => Limits::OneOf(choice.values()),
        }
    }

    /// The type of its value.
    #[must_use]
    pub const fn data_type(&self) -> DataType {
        self.default.data_type()
    }

    /// Whether it is kept over power-off.
    #[must_use]
    pub const fn is_setting(&self) -> bool {
        matches!(self.role, Role::Setting(_) | Role::PdoCobId)
    }

    /// What it changes, where it is a setting.
    #[must_use]
    pub const fn concern(&self) -> Option<Concern> {
        match self.role {
            Role::Setting(concern) => Some(concern),
            Role::PdoCobId => Some(Concern::Stream),
            _ => None,
        }
    }

    /// Whether it can stand in a PDO.
    #[must_use]
    pub const fn is_mappable(&self) -> bool {
        matches!(self.role, Role::Process | Role::Input)
    }
}
