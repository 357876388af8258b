//! The object dictionary: every object, once. This table makes the SDO server's answers and range
//! checks, the UART's configuration messages, `footfall.eds` and the tables of `README.md`.
//!
//! `communication` holds the objects of CiA 301, `settings` the configuration of the foot, `process`
//! what it measures and knows.
//!
//! To add a setting, add an entry with `Entry::setting` to `settings` and read it in
//! [`settings`](crate::settings); the files are written by
//! `FOOTFALL_UPDATE=1 cargo test -p wire --test files`.

mod communication;
mod process;
mod settings;

pub use crate::address::{Address, index};
pub use settings::WINDOW_CAPACITY;

use estimator_core::{Parameter, Row, Unit};

use crate::abort::AbortCode;
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
    /// The correction of the accelerometer.
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

/// What may be written. A value outside a range is too high or too low, one that a list or a range
/// with a hole in it lacks is not allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limits {
    /// Any value of the type.
    Any,
    /// From the first to the second.
    Range(Value, Value),
    /// From the first to the second, but nothing between the third and the fourth, themselves
    /// included.
    RangeWithout([Value; 4]),
    /// One of these.
    OneOf(&'static [Value]),
}

impl Limits {
    /// Whether `value`, which has the right type, may be written.
    ///
    /// # Errors
    /// The reason, as an abort code.
    pub fn check(self, value: Value) -> Result<(), AbortCode> {
        match self {
            Self::Any => Ok(()),
            Self::Range(low, high) => in_range(value, low, high),
            Self::RangeWithout([low, high, from, to]) => {
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

    /// The least and the greatest value, where there are any.
    #[must_use]
    pub fn range(self) -> Option<(Value, Value)> {
        match self {
            Self::Any => None,
            Self::Range(low, high) | Self::RangeWithout([low, high, ..]) => Some((low, high)),
            Self::OneOf(values) => Some((*values.first()?, *values.last()?)),
        }
    }
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
enum Choice {
    CanBitRate,
}

impl Choice {
    const fn values(self) -> &'static [Value] {
        match self {
            Self::CanBitRate => settings::CAN_BIT_RATES,
        }
    }
}

/// A time in s as whole µs.
const fn micros(seconds: f32) -> Value {
    Value::U32((seconds as f64 * 1.0e6 + 0.5) as u32)
}

fn in_range(value: Value, low: Value, high: Value) -> Result<(), AbortCode> {
    use core::cmp::Ordering::{Greater, Less};
    match (value.compare(low), value.compare(high)) {
        (Some(Less), _) => Err(AbortCode::TooLow),
        (_, Some(Greater)) => Err(AbortCode::TooHigh),
        (Some(_), Some(_)) => Ok(()),
        // Not a number.
        _ => Err(AbortCode::InvalidValue),
    }
}

/// Text for people and files. A foot has no use for it: on a microcontroller it is empty and takes
/// no room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text(#[cfg(not(target_os = "none"))] &'static str);

impl Text {
    const NONE: Self = Self::new("");

    #[cfg(not(target_os = "none"))]
    const fn new(text: &'static str) -> Self {
        Self(text)
    }

    #[cfg(target_os = "none")]
    const fn new(_: &'static str) -> Self {
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
    const fn new(
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

    const fn constant(subindex: u8, name: &'static str, value: Value) -> Self {
        Self::new(subindex, name, Role::Constant, Access::Const, value)
    }

    const fn cob_id(subindex: u8, name: &'static str, base: u32) -> Self {
        Self::new(subindex, name, Role::CobId, Access::Ro, Value::U32(base))
    }

    const fn setting(subindex: u8, name: &'static str, concern: Concern, default: Value) -> Self {
        Self::new(subindex, name, Role::Setting(concern), Access::Rw, default)
    }

    const fn switch(subindex: u8, name: &'static str, concern: Concern, default: u8) -> Self {
        Self::setting(subindex, name, concern, Value::U8(default)).range(Value::U8(0), Value::U8(1))
    }

    /// A number by its row in the estimator's table, as REAL32.
    const fn row(subindex: u8, name: &'static str, concern: Concern, row: Row) -> Self {
        Self::setting(subindex, name, concern, Value::F32(row.default))
            .range(Value::F32(row.least), Value::F32(row.most))
            .unit(row.unit.symbol())
    }

    /// A duration by its row in the estimator's table, as whole µs.
    const fn row_in_micros(subindex: u8, name: &'static str, concern: Concern, row: Row) -> Self {
        assert!(matches!(row.unit, Unit::Second));
        Self::setting(subindex, name, concern, micros(row.default))
            .range(micros(row.least), micros(row.most))
            .unit("µs")
    }

    const fn parameter(subindex: u8, name: &'static str, parameter: Parameter) -> Self {
        Self::row(
            subindex,
            name,
            Concern::Parameter(parameter),
            parameter.row(),
        )
    }

    const fn parameter_in_micros(subindex: u8, name: &'static str, parameter: Parameter) -> Self {
        Self::row_in_micros(
            subindex,
            name,
            Concern::Parameter(parameter),
            parameter.row(),
        )
    }

    const fn live(subindex: u8, name: &'static str, default: Value) -> Self {
        Self::new(subindex, name, Role::Live, Access::Ro, default)
    }

    const fn command(subindex: u8, name: &'static str, access: Access, default: Value) -> Self {
        Self::new(subindex, name, Role::Command, access, default)
    }

    const fn range(mut self, low: Value, high: Value) -> Self {
        self.bounds = Bounds::Range;
        self.numbers = [low.to_raw(), high.to_raw()];
        self
    }

    /// From the first byte to the second, but nothing between the third and the fourth.
    const fn range_without(mut self, bytes: [u8; 4]) -> Self {
        assert!(matches!(self.default, Value::U8(_)));
        self.bounds = Bounds::RangeWithout;
        self.numbers = [u32::from_le_bytes(bytes), 0];
        self
    }

    const fn one_of(mut self, choice: Choice) -> Self {
        self.bounds = Bounds::OneOf(choice);
        self
    }

    const fn unit(mut self, unit: &'static str) -> Self {
        self.unit = Text::new(unit);
        self
    }

    const fn doc(mut self, doc: &'static str) -> Self {
        self.doc = Text::new(doc);
        self
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

/// How an object is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One value, at sub-index 0.
    Var,
    /// Values of one type from sub-index 1; their number at sub-index 0.
    Array,
    /// Values of different types from sub-index 1; the highest sub-index at sub-index 0.
    Record,
}

/// An object. On a microcontroller its texts are empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Object {
    /// Its index.
    pub index: u16,
    /// Its name.
    pub name: Text,
    /// How it is built.
    pub shape: Shape,
    /// What it is.
    pub doc: Text,
    /// Its values; those of an array or a record without the one at sub-index 0.
    pub entries: &'static [Entry],
}

impl Object {
    /// The highest sub-index.
    #[must_use]
    pub fn highest_subindex(&self) -> u8 {
        self.entries.last().map_or(0, |entry| entry.subindex)
    }
}

/// What is found at an address.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// A value, and its place among the settings where it is one.
    Entry(&'static Entry, Option<usize>),
    /// The highest sub-index of an object.
    Highest(u8),
}

/// Looks up an address.
///
/// # Errors
/// [`AbortCode::NoObject`] and [`AbortCode::NoSubindex`].
pub fn find(address: Address) -> Result<Place, AbortCode> {
    let position = OBJECTS
        .binary_search_by_key(&address.index, |object| object.index)
        .map_err(|_| AbortCode::NoObject)?;
    let (Some(object), Some(&first)) = (OBJECTS.get(position), FIRST_SETTING.get(position)) else {
        return Err(AbortCode::NoObject);
    };
    let mut slot = usize::from(first);
    for entry in object.entries {
        if entry.subindex == address.subindex {
            return Ok(Place::Entry(entry, entry.is_setting().then_some(slot)));
        }
        slot += usize::from(entry.is_setting());
    }
    // An array that clears itself when 0 is written (0x1003) has its count among its entries.
    if address.subindex == 0 {
        Ok(Place::Highest(object.highest_subindex()))
    } else {
        Err(AbortCode::NoSubindex)
    }
}

/// What the setting at an address changes; `None` where there is no setting.
#[must_use]
pub fn concern(address: Address) -> Option<Concern> {
    match find(address) {
        Ok(Place::Entry(entry, _)) => entry.concern(),
        Ok(Place::Highest(_)) | Err(_) => None,
    }
}

/// Every value, in the order of the addresses.
pub fn entries() -> impl Iterator<Item = (Address, &'static Entry)> {
    OBJECTS.iter().flat_map(|object| {
        let of = move |entry: &'static Entry| (Address::new(object.index, entry.subindex), entry);
        object.entries.iter().map(of)
    })
}

/// Every setting, in the order of the addresses.
pub fn settings() -> impl Iterator<Item = (Address, &'static Entry)> {
    entries().filter(|(_, entry)| entry.is_setting())
}

/// The place among the settings of the one at an address. Evaluated by the compiler only, which
/// would report a setting that there is not.
#[allow(clippy::indexing_slicing, clippy::panic)]
pub(crate) const fn slot_of(index: u16, subindex: u8) -> usize {
    let (mut slot, mut i) = (0, 0);
    while i < OBJECTS.len() {
        let object = &OBJECTS[i];
        let mut j = 0;
        while j < object.entries.len() {
            let entry = &object.entries[j];
            if entry.is_setting() && object.index == index && entry.subindex == subindex {
                return slot;
            }
            slot += entry.is_setting() as usize;
            j += 1;
        }
        i += 1;
    }
    panic!("there is no such setting")
}

/// How many settings there are.
pub const SETTINGS: usize = count_settings(OBJECTS.len());

/// The number of settings before each object. Evaluated by the compiler only, which would report
/// an index out of range.
#[allow(clippy::indexing_slicing)]
const FIRST_SETTING: [u16; OBJECTS.len()] = {
    let mut first = [0; OBJECTS.len()];
    let mut i = 0;
    while i < OBJECTS.len() {
        first[i] = count_settings(i) as u16;
        i += 1;
    }
    first
};

#[allow(clippy::indexing_slicing)]
const fn count_settings(objects: usize) -> usize {
    let (mut count, mut i) = (0, 0);
    while i < objects {
        let entries = OBJECTS[i].entries;
        let mut j = 0;
        while j < entries.len() {
            count += entries[j].is_setting() as usize;
            j += 1;
        }
        i += 1;
    }
    count
}

/// "save" and "load": what must be written to store and to restore.
pub const SIGNATURE_STORE: u32 = u32::from_le_bytes(*b"save");
/// See [`SIGNATURE_STORE`].
pub const SIGNATURE_RESTORE: u32 = u32::from_le_bytes(*b"load");

/// "bor3": what must be written to have the chip reset itself below 2.7 V.
pub const SIGNATURE_BROWN_OUT: u32 = u32::from_le_bytes(*b"bor3");

/// Bit 31 of a PDO's identifier: the PDO is off.
pub const PDO_OFF: u32 = 1 << 31;
/// Bit 30 of a PDO's identifier: remote frames are not answered.
pub const PDO_NO_REMOTE: u32 = 1 << 30;

/// Tells the device from others of the same vendor: "foot".
pub const PRODUCT_CODE: u32 = u32::from_be_bytes(*b"foot");
/// No vendor id has been assigned to this project.
pub const VENDOR_ID: u32 = 0;
/// The revision of this dictionary: major in the upper, minor in the lower 16 bits. The major
/// number changes when an object changes its meaning.
pub const REVISION: u32 = 0x0001_0000;

/// How many past emergencies 0x1003 remembers.
pub const ERROR_HISTORY: usize = 8;

/// All objects, in the order of their indices. Put together by the compiler, which would report an
/// index out of range.
#[allow(clippy::indexing_slicing)]
pub const OBJECTS: &[Object] = &{
    const PARTS: [&[Object]; 3] = [communication::OBJECTS, settings::OBJECTS, process::OBJECTS];
    const COUNT: usize = PARTS[0].len() + PARTS[1].len() + PARTS[2].len();
    let mut all = [PARTS[0][0]; COUNT];
    let (mut count, mut part) = (0, 0);
    while part < PARTS.len() {
        let mut i = 0;
        while i < PARTS[part].len() {
            all[count] = PARTS[part][i];
            count += 1;
            i += 1;
        }
        part += 1;
    }
    all
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pdo::PDOS;
    use crate::pdo::Pdo;
    use std::vec::Vec;

    #[test]
    fn addresses_rise() {
        let addresses: Vec<Address> = entries().map(|(address, _)| address).collect();
        assert!(addresses.is_sorted_by(|a, b| a < b));
    }

    #[test]
    fn every_entry_is_found_and_settings_have_each_their_slot() {
        let mut slots = Vec::new();
        for (address, entry) in entries() {
            let Ok(Place::Entry(found, slot)) = find(address) else {
                panic!("{address:?} is not found");
            };
            assert_eq!(found, entry);
            assert_eq!(slot.is_some(), entry.is_setting());
            slots.extend(slot);
        }
        assert!(slots.into_iter().eq(0..SETTINGS));
        assert_eq!(settings().count(), SETTINGS);
    }

    #[test]
    fn what_is_not_there_is_said_to_be_so() {
        assert_eq!(find(Address::new(0x1FFF, 0)), Err(AbortCode::NoObject));
        assert_eq!(find(Address::new(0x1018, 9)), Err(AbortCode::NoSubindex));
        assert_eq!(find(Address::new(0x1018, 0)), Ok(Place::Highest(4)));
        assert_eq!(find(Address::new(0x1800, 0)), Ok(Place::Highest(5)));
    }

    #[test]
    fn defaults_lie_within_their_limits() {
        for (address, entry) in settings() {
            assert_eq!(entry.limits().check(entry.default), Ok(()), "{address:?}");
            if let Limits::OneOf(values) = entry.limits() {
                assert!(
                    values
                        .is_sorted_by(|a, b| a.compare(*b).is_some_and(core::cmp::Ordering::is_lt))
                );
            }
        }
    }

    #[test]
    fn values_beyond_the_limits_have_their_abort_codes() {
        let limits =
            Limits::RangeWithout([Value::U8(1), Value::U8(255), Value::U8(128), Value::U8(254)]);
        assert_eq!(limits.check(Value::U8(0)), Err(AbortCode::InvalidValue));
        assert_eq!(limits.check(Value::U8(128)), Err(AbortCode::InvalidValue));
        assert_eq!(limits.check(Value::U8(255)), Ok(()));
        let limits = Limits::Range(Value::F32(0.0), Value::F32(1.0));
        assert_eq!(limits.check(Value::F32(1.1)), Err(AbortCode::TooHigh));
        assert_eq!(
            limits.check(Value::F32(f32::NAN)),
            Err(AbortCode::InvalidValue)
        );
    }

    #[test]
    fn what_a_pdo_maps_is_mappable_and_as_long_as_the_mapping_says() {
        for pdo in Pdo::ALL {
            for mapped in pdo.mapping() {
                let Ok(Place::Entry(entry, _)) = find(mapped.address) else {
                    panic!("{mapped:?} is not found");
                };
                assert!(entry.is_mappable(), "{mapped:?}");
                let size = entry.data_type().size().expect("a number");
                assert_eq!(usize::from(mapped.bits), 8 * size, "{mapped:?}");
            }
        }
        assert_eq!(Pdo::ALL.len(), PDOS);
    }

    #[test]
    fn all_process_data_is_in_a_pdo() {
        for (address, entry) in entries().filter(|(_, entry)| entry.role == Role::Process) {
            let mapped = Pdo::ALL
                .iter()
                .flat_map(|pdo| pdo.mapping())
                .any(|mapped| mapped.address == address);
            assert!(mapped, "{address:?} {} is in no PDO", entry.name);
        }
    }
}
