//! The object dictionary: every object, once. This table makes the SDO server's answers and range
//! checks, the UART's configuration messages, `footfall.eds` and the tables of `README.md`.
//!
//! To add a setting, add an entry with `Entry::setting` and read it in
//! [`settings`](crate::settings); the files are made anew by
//! `FOOTFALL_UPDATE=1 cargo test -p wire --test files`.

use estimator_core::{AttitudeParams, Params, PerAxis, WindowLength};

use crate::abort::AbortCode;
use crate::counter::Counter;
use crate::foot::Foot;
use crate::pdo::{self, Pdo};
use crate::value::{DataType, Value};

/// Where an object or a part of it is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Address {
    /// The object.
    pub index: u16,
    /// Its part; 0 for an object of one value.
    pub subindex: u8,
}

impl Address {
    /// An address.
    #[must_use]
    pub const fn new(index: u16, subindex: u8) -> Self {
        Self { index, subindex }
    }
}

/// The indices of the objects.
pub mod index {
    #![allow(missing_docs)]

    pub const DEVICE_TYPE: u16 = 0x1000;
    pub const ERROR_REGISTER: u16 = 0x1001;
    pub const ERROR_HISTORY: u16 = 0x1003;
    pub const SYNC_COB_ID: u16 = 0x1005;
    pub const DEVICE_NAME: u16 = 0x1008;
    pub const HARDWARE_VERSION: u16 = 0x1009;
    pub const SOFTWARE_VERSION: u16 = 0x100A;
    pub const STORE: u16 = 0x1010;
    pub const RESTORE: u16 = 0x1011;
    pub const TIME_COB_ID: u16 = 0x1012;
    pub const EMCY_COB_ID: u16 = 0x1014;
    pub const HEARTBEAT: u16 = 0x1017;
    pub const IDENTITY: u16 = 0x1018;
    pub const SDO_SERVER: u16 = 0x1200;
    pub const RPDO: u16 = 0x1400;
    pub const RPDO_MAPPING: u16 = 0x1600;
    pub const TPDO: u16 = 0x1800;
    pub const TPDO_MAPPING: u16 = 0x1A00;

    pub const FOOT: u16 = 0x2000;
    pub const NODE_ID: u16 = 0x2001;
    pub const CAN_BIT_RATE: u16 = 0x2002;
    pub const UART_RATE: u16 = 0x2003;
    pub const AUTOSTART: u16 = 0x2004;
    pub const LOCK: u16 = 0x2005;
    pub const LOG_LEVEL: u16 = 0x2006;
    pub const SELF_TEST: u16 = 0x2007;
    pub const UART_STREAMS: u16 = 0x2008;
    pub const WINDOW: u16 = 0x2010;
    pub const BANDWIDTH: u16 = 0x2011;
    pub const HALF_WIDTH: u16 = 0x2012;
    pub const ATTITUDE_FILTER: u16 = 0x2013;
    pub const DECISION: u16 = 0x2014;
    pub const LOAD_INPUT: u16 = 0x2015;

    pub const CONTACT: u16 = 0x2100;
    pub const AXES: u16 = 0x2101;
    pub const ATTITUDE: u16 = 0x2102;
    pub const ACCELERATION: u16 = 0x2103;
    pub const RATE: u16 = 0x2104;
    pub const BIAS: u16 = 0x2105;
    pub const TEMPERATURE: u16 = 0x2106;
    pub const HEALTH: u16 = 0x2107;
    pub const LOAD: u16 = 0x2108;
    pub const TIME: u16 = 0x2109;
    pub const STAGE: u16 = 0x2110;
    pub const FAULTS: u16 = 0x2111;
    pub const COUNTERS: u16 = 0x2112;
    pub const LAST_CRASH: u16 = 0x2113;
    pub const CALIBRATION: u16 = 0x2120;
}

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
    Setting,
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
    RangeWithout(&'static [Value; 4]),
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

    /// The least and the greatest value, where there are any.
    #[must_use]
    pub fn range(self) -> Option<(Value, Value)> {
        match self {
            Self::Any => None,
            Self::Range(low, high) | Self::RangeWithout(&[low, high, ..]) => Some((low, high)),
            Self::OneOf(values) => Some((*values.first()?, *values.last()?)),
        }
    }
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
const _: () = assert!(size_of::<Entry>() <= 28);

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
    /// What may be written.
    pub limits: Limits,
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
            limits: Limits::Any,
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

    const fn setting(subindex: u8, name: &'static str, default: Value) -> Self {
        Self::new(subindex, name, Role::Setting, Access::Rw, default)
    }

    const fn switch(subindex: u8, name: &'static str, default: u8) -> Self {
        Self::setting(subindex, name, Value::U8(default)).range(Value::U8(0), Value::U8(1))
    }

    const fn live(subindex: u8, name: &'static str, default: Value) -> Self {
        Self::new(subindex, name, Role::Live, Access::Ro, default)
    }

    const fn process(subindex: u8, name: &'static str, default: Value) -> Self {
        Self::new(subindex, name, Role::Process, Access::Ro, default)
    }

    const fn command(subindex: u8, name: &'static str, access: Access, default: Value) -> Self {
        Self::new(subindex, name, Role::Command, access, default)
    }

    const fn range(self, low: Value, high: Value) -> Self {
        self.limits(Limits::Range(low, high))
    }

    const fn limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
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

    /// The type of its value.
    #[must_use]
    pub const fn data_type(&self) -> DataType {
        self.default.data_type()
    }

    /// Whether it is kept over power-off.
    #[must_use]
    pub const fn is_setting(&self) -> bool {
        matches!(self.role, Role::Setting | Role::PdoCobId)
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

const MEANING_OF_FOOT: &str = "1 FL, 2 FR, 3 RL, 4 RR, 5 L, 6 R; a label for people and files, and the node id where none is set";
const RESTART: &str = "takes effect with the next reset of the node or of its communication";

/// A time in s as whole µs.
const fn micros(seconds: f32) -> Value {
    Value::U32((seconds as f64 * 1.0e6 + 0.5) as u32)
}

const WINDOW_US: Value = match Params::DEFAULT.window {
    WindowLength::Duration(seconds) => micros(seconds),
    WindowLength::Samples(samples) => micros(samples as f32 / Params::DEFAULT.sample_rate),
};

const fn per_axis(defaults: PerAxis<f32>, high: f32, units: [&'static str; 2]) -> [Entry; 6] {
    const fn axis(sub: u8, name: &'static str, value: f32, high: f32, unit: &'static str) -> Entry {
        Entry::setting(sub, name, Value::F32(value))
            .range(Value::F32(1.0e-6), Value::F32(high))
            .unit(unit)
    }
    let [acceleration, rate] = units;
    [
        axis(1, "ax", defaults.ax, high, acceleration),
        axis(2, "ay", defaults.ay, high, acceleration),
        axis(3, "az", defaults.az, high, acceleration),
        axis(4, "wx", defaults.wx, high, rate),
        axis(5, "wy", defaults.wy, high, rate),
        axis(6, "wz", defaults.wz, high, rate),
    ]
}

const SI: [&str; 2] = ["m/s²", "rad/s"];

const fn tpdo(pdo: Pdo) -> [Entry; 3] {
    [
        Entry::new(
            1,
            "COB-ID",
            Role::PdoCobId,
            Access::Rw,
            Value::U32(PDO_NO_REMOTE | pdo.base() as u32),
        )
        .doc("bit 31 set: not sent; the identifier itself cannot be changed"),
        Entry::setting(2, "Transmission type", Value::U8(254))
            .limits(Limits::RangeWithout(&[
                Value::U8(1),
                Value::U8(255),
                Value::U8(241),
                Value::U8(253),
            ]))
            .doc("1 to 240: with every n-th SYNC; 254 and 255: by the event timer"),
        Entry::setting(5, "Event timer", Value::U16(pdo.default_period_ms()))
            .range(Value::U16(0), Value::U16(10_000))
            .unit("ms")
            .doc("one frame in so many ticks; 0: not sent by the timer"),
    ]
}

#[allow(clippy::indexing_slicing)] // Evaluated by the compiler only.
const fn mapping<const N: usize>(pdo: Pdo) -> [Entry; N] {
    const NAMES: [&str; 8] = [
        "Mapped object 1",
        "Mapped object 2",
        "Mapped object 3",
        "Mapped object 4",
        "Mapped object 5",
        "Mapped object 6",
        "Mapped object 7",
        "Mapped object 8",
    ];
    assert!(pdo.mapping().len() == N);
    let mut entries = [Entry::constant(1, NAMES[0], Value::U32(0)); N];
    let mut i = 0;
    while i < N {
        let mapped = Value::U32(pdo.mapping()[i].to_u32());
        entries[i] = Entry::constant(i as u8 + 1, NAMES[i], mapped);
        i += 1;
    }
    entries
}

const fn axes_of<const N: usize>(names: [&'static str; N], unit: &'static str) -> [Entry; N] {
    let mut entries = [Entry::process(0, "", Value::I16(0)).unit(unit); N];
    let mut i = 0;
    while i < N {
        #[allow(clippy::indexing_slicing)] // Evaluated by the compiler only.
        {
            entries[i].subindex = i as u8 + 1;
            entries[i].name = Text::new(names[i]);
        }
        i += 1;
    }
    entries
}

const XYZ: [&str; 3] = ["x", "y", "z"];

const fn probability_of(sub: u8, name: &'static str) -> Entry {
    Entry::process(sub, name, Value::U8(0)).unit("1/255")
}

const fn error(sub: u8, name: &'static str) -> Entry {
    Entry::live(sub, name, Value::U32(0))
        .doc("emergency code in the lower 16 bits, number of the fault above; newest first")
}

/// How many past emergencies 0x1003 remembers.
pub const ERROR_HISTORY: usize = 8;

#[allow(clippy::indexing_slicing)] // Evaluated by the compiler only.
const fn counters() -> [Entry; Counter::ALL.len()] {
    let mut entries = [Entry::live(0, "", Value::U32(0)); Counter::ALL.len()];
    let mut i = 0;
    while i < Counter::ALL.len() {
        entries[i].subindex = i as u8 + 1;
        entries[i].name = Text::new(Counter::ALL[i].name());
        i += 1;
    }
    entries
}

const fn proposed(sub: u8, name: &'static str, unit: &'static str) -> Entry {
    Entry::live(sub, name, Value::F32(0.0)).unit(unit)
}

/// A duration of the decision.
const fn delay(sub: u8, name: &'static str, seconds: f32) -> Entry {
    Entry::setting(sub, name, micros(seconds))
        .range(Value::U32(0), Value::U32(10_000_000))
        .unit("µs")
}

const fn load_threshold(sub: u8, name: &'static str, default: f32) -> Entry {
    Entry::setting(sub, name, Value::F32(default))
        .range(Value::F32(-1.0e9), Value::F32(1.0e9))
        .unit("N")
}

/// The settings of the attitude filter: those of `estimator_core::AttitudeParams` and its
/// `RestParams`, but for the gyroscope's timing, which belongs to the board's sensor.
const ATTITUDE_FILTER: &[Entry] = {
    const FILTER: AttitudeParams = AttitudeParams::DEFAULT;
    &[
        real(
            1,
            "Motion time constant",
            FILTER.motion_time_constant,
            0.1,
            100.0,
        )
        .unit("s"),
        real(2, "Quiet gain", FILTER.quiet_gain, 1.0, 1.0e4),
        real(
            3,
            "Quiet acceleration",
            FILTER.quiet_acceleration,
            1.0e-3,
            10.0,
        )
        .unit("m/s²"),
        real(4, "Quiet rate", FILTER.quiet_rate, 1.0e-4, 1.0).unit("rad/s"),
        real(5, "Rest duration", FILTER.rest.duration, 0.1, 100.0).unit("s"),
        real(
            6,
            "Rest acceleration",
            FILTER.rest.acceleration,
            1.0e-3,
            10.0,
        )
        .unit("m/s²"),
        real(7, "Rest rate", FILTER.rest.rate, 1.0e-4, 1.0).unit("rad/s"),
        real(8, "Bias limit", FILTER.rest.bias_limit, 0.0, 1.0).unit("rad/s"),
        real(
            9,
            "Bias time constant",
            FILTER.rest.bias_time_constant,
            0.1,
            1.0e3,
        )
        .unit("s"),
    ]
};

const fn real(sub: u8, name: &'static str, default: f32, low: f32, high: f32) -> Entry {
    Entry::setting(sub, name, Value::F32(default)).range(Value::F32(low), Value::F32(high))
}

/// All objects, in the order of their indices.
pub const OBJECTS: &[Object] = &[
    Object {
        index: index::DEVICE_TYPE,
        name: Text::new("Device type"),
        shape: Shape::Var,
        doc: Text::new("0: no device profile"),
        entries: &[Entry::constant(0, "Device type", Value::U32(0))],
    },
    Object {
        index: index::ERROR_REGISTER,
        name: Text::new("Error register"),
        shape: Shape::Var,
        doc: Text::new("bit 0 any error, bit 4 communication, bit 7 everything else"),
        entries: &[Entry::process(0, "Error register", Value::U8(0))],
    },
    Object {
        index: index::ERROR_HISTORY,
        name: Text::new("Pre-defined error field"),
        shape: Shape::Array,
        doc: Text::new("the last emergencies"),
        entries: &[
            Entry::command(0, "Number of errors", Access::Rw, Value::U8(0))
                .doc("writing 0 forgets them, nothing else can be written"),
            error(1, "Standard error field 1"),
            error(2, "Standard error field 2"),
            error(3, "Standard error field 3"),
            error(4, "Standard error field 4"),
            error(5, "Standard error field 5"),
            error(6, "Standard error field 6"),
            error(7, "Standard error field 7"),
            error(8, "Standard error field 8"),
        ],
    },
    Object {
        index: index::SYNC_COB_ID,
        name: Text::new("COB-ID SYNC message"),
        shape: Shape::Var,
        doc: Text::new("listened to, never sent"),
        entries: &[Entry::constant(0, "COB-ID SYNC message", Value::U32(0x80))],
    },
    Object {
        index: index::DEVICE_NAME,
        name: Text::new("Manufacturer device name"),
        shape: Shape::Var,
        doc: Text::new(""),
        entries: &[Entry::constant(
            0,
            "Manufacturer device name",
            Value::Text(&"footfall"),
        )],
    },
    Object {
        index: index::HARDWARE_VERSION,
        name: Text::new("Manufacturer hardware version"),
        shape: Shape::Var,
        doc: Text::new(""),
        entries: &[Entry::constant(
            0,
            "Manufacturer hardware version",
            Value::Text(&"STM32F405RG + LSM6DSOX"),
        )],
    },
    Object {
        index: index::SOFTWARE_VERSION,
        name: Text::new("Manufacturer software version"),
        shape: Shape::Var,
        doc: Text::new(""),
        entries: &[Entry::constant(
            0,
            "Manufacturer software version",
            Value::Text(&env!("CARGO_PKG_VERSION")),
        )],
    },
    Object {
        index: index::STORE,
        name: Text::new("Store parameters"),
        shape: Shape::Array,
        doc: Text::new("stores all settings"),
        entries: &[
            Entry::command(1, "Save all parameters", Access::Rw, Value::U32(1))
                .doc("write \"save\" (0x65766173); reads 1: saved on command"),
        ],
    },
    Object {
        index: index::RESTORE,
        name: Text::new("Restore default parameters"),
        shape: Shape::Array,
        doc: Text::new("forgets what was stored; defaults apply from the next reset"),
        entries: &[
            Entry::command(1, "Restore all default parameters", Access::Rw, Value::U32(1))
                .doc("write \"load\" (0x64616F6C); reads 1: can be restored"),
        ],
    },
    Object {
        index: index::TIME_COB_ID,
        name: Text::new("COB-ID time stamp object"),
        shape: Shape::Var,
        doc: Text::new("listened to, never sent"),
        entries: &[Entry::constant(
            0,
            "COB-ID time stamp object",
            Value::U32(0x8000_0100),
        )],
    },
    Object {
        index: index::EMCY_COB_ID,
        name: Text::new("COB-ID EMCY"),
        shape: Shape::Var,
        doc: Text::new(""),
        entries: &[Entry::cob_id(0, "COB-ID EMCY", 0x80)],
    },
    Object {
        index: index::HEARTBEAT,
        name: Text::new("Producer heartbeat time"),
        shape: Shape::Var,
        doc: Text::new("0: no heartbeat"),
        entries: &[
            Entry::setting(0, "Producer heartbeat time", Value::U16(500)).unit("ms"),
        ],
    },
    Object {
        index: index::IDENTITY,
        name: Text::new("Identity object"),
        shape: Shape::Record,
        doc: Text::new("also the LSS address"),
        entries: &[
            Entry::constant(1, "Vendor-ID", Value::U32(VENDOR_ID)).doc("0: none assigned"),
            Entry::constant(2, "Product code", Value::U32(PRODUCT_CODE)).doc("\"foot\""),
            Entry::constant(3, "Revision number", Value::U32(REVISION))
                .doc("of this dictionary, major and minor"),
            Entry::live(4, "Serial number", Value::U32(0)).doc("of the microcontroller"),
        ],
    },
    Object {
        index: index::SDO_SERVER,
        name: Text::new("SDO server parameter"),
        shape: Shape::Record,
        doc: Text::new(""),
        entries: &[
            Entry::cob_id(1, "COB-ID client to server", 0x600),
            Entry::cob_id(2, "COB-ID server to client", 0x580),
        ],
    },
    Object {
        index: index::RPDO,
        name: Text::new("RPDO1 communication parameter"),
        shape: Shape::Record,
        doc: Text::new("the load, from a robot that knows it"),
        entries: &[
            Entry::cob_id(1, "COB-ID", pdo::Load::BASE as u32),
            Entry::constant(2, "Transmission type", Value::U8(255)),
            Entry::setting(5, "Event timer", Value::U16(100))
                .unit("ms")
                .doc("how long a load is believed; after it emergency 0x8250 where the load source is CAN; 0: for ever"),
        ],
    },
    Object {
        index: index::RPDO_MAPPING,
        name: Text::new("RPDO1 mapping parameter"),
        shape: Shape::Record,
        doc: Text::new(""),
        entries: &[Entry::constant(
            1,
            "Mapped object 1",
            Value::U32((index::LOAD as u32) << 16 | 32),
        )],
    },
    Object {
        index: index::TPDO,
        name: Text::new("TPDO1 communication parameter"),
        shape: Shape::Record,
        doc: Text::new("contact"),
        entries: &tpdo(Pdo::Contact),
    },
    Object {
        index: index::TPDO + 1,
        name: Text::new("TPDO2 communication parameter"),
        shape: Shape::Record,
        doc: Text::new("axes"),
        entries: &tpdo(Pdo::Axes),
    },
    Object {
        index: index::TPDO + 2,
        name: Text::new("TPDO3 communication parameter"),
        shape: Shape::Record,
        doc: Text::new("attitude"),
        entries: &tpdo(Pdo::Attitude),
    },
    Object {
        index: index::TPDO + 3,
        name: Text::new("TPDO4 communication parameter"),
        shape: Shape::Record,
        doc: Text::new("acceleration"),
        entries: &tpdo(Pdo::Acceleration),
    },
    Object {
        index: index::TPDO + 4,
        name: Text::new("TPDO5 communication parameter"),
        shape: Shape::Record,
        doc: Text::new("rate"),
        entries: &tpdo(Pdo::Rate),
    },
    Object {
        index: index::TPDO + 5,
        name: Text::new("TPDO6 communication parameter"),
        shape: Shape::Record,
        doc: Text::new("bias and temperature"),
        entries: &tpdo(Pdo::Bias),
    },
    Object {
        index: index::TPDO + 6,
        name: Text::new("TPDO7 communication parameter"),
        shape: Shape::Record,
        doc: Text::new("health"),
        entries: &tpdo(Pdo::Health),
    },
    Object {
        index: index::TPDO_MAPPING,
        name: Text::new("TPDO1 mapping parameter"),
        shape: Shape::Record,
        doc: Text::new("contact"),
        entries: &mapping::<6>(Pdo::Contact),
    },
    Object {
        index: index::TPDO_MAPPING + 1,
        name: Text::new("TPDO2 mapping parameter"),
        shape: Shape::Record,
        doc: Text::new("axes"),
        entries: &mapping::<7>(Pdo::Axes),
    },
    Object {
        index: index::TPDO_MAPPING + 2,
        name: Text::new("TPDO3 mapping parameter"),
        shape: Shape::Record,
        doc: Text::new("attitude"),
        entries: &mapping::<4>(Pdo::Attitude),
    },
    Object {
        index: index::TPDO_MAPPING + 3,
        name: Text::new("TPDO4 mapping parameter"),
        shape: Shape::Record,
        doc: Text::new("acceleration"),
        entries: &mapping::<4>(Pdo::Acceleration),
    },
    Object {
        index: index::TPDO_MAPPING + 4,
        name: Text::new("TPDO5 mapping parameter"),
        shape: Shape::Record,
        doc: Text::new("rate"),
        entries: &mapping::<4>(Pdo::Rate),
    },
    Object {
        index: index::TPDO_MAPPING + 5,
        name: Text::new("TPDO6 mapping parameter"),
        shape: Shape::Record,
        doc: Text::new("bias and temperature"),
        entries: &mapping::<4>(Pdo::Bias),
    },
    Object {
        index: index::TPDO_MAPPING + 6,
        name: Text::new("TPDO7 mapping parameter"),
        shape: Shape::Record,
        doc: Text::new("health"),
        entries: &mapping::<5>(Pdo::Health),
    },
    Object {
        index: index::FOOT,
        name: Text::new("Foot"),
        shape: Shape::Var,
        doc: Text::new(MEANING_OF_FOOT),
        entries: &[
            Entry::setting(0, "Foot", Value::U8(Foot::FrontLeft.code()))
                .range(Value::U8(1), Value::U8(6)),
        ],
    },
    Object {
        index: index::NODE_ID,
        name: Text::new("Node id"),
        shape: Shape::Var,
        doc: Text::new("0: that of the foot, 0x10 + 0x2000; 255: none, waits for LSS"),
        entries: &[
            Entry::setting(0, "Node id", Value::U8(0))
            .limits(Limits::RangeWithout(&[Value::U8(0), Value::U8(255), Value::U8(128), Value::U8(254)]))
            .doc(RESTART),
        ],
    },
    Object {
        index: index::CAN_BIT_RATE,
        name: Text::new("CAN bit rate"),
        shape: Shape::Var,
        doc: Text::new("125, 250, 500 or 1000; what is sent must not take more than three quarters of it"),
        entries: &[
            Entry::setting(0, "CAN bit rate", Value::U16(1000))
                .limits(Limits::OneOf(&[
                    Value::U16(125),
                    Value::U16(250),
                    Value::U16(500),
                    Value::U16(1000),
                ]))
                .unit("kbit/s")
                .doc(RESTART),
        ],
    },
    Object {
        index: index::UART_RATE,
        name: Text::new("UART rate"),
        shape: Shape::Var,
        doc: Text::new(""),
        entries: &[
            Entry::setting(0, "UART rate", Value::U32(1_000_000))
                .range(Value::U32(9_600), Value::U32(3_000_000))
                .unit("baud")
                .doc(RESTART),
        ],
    },
    Object {
        index: index::AUTOSTART,
        name: Text::new("Autostart"),
        shape: Shape::Var,
        doc: Text::new("1: operational, and so streaming, by itself after power-up"),
        entries: &[Entry::switch(0, "Autostart", 1)],
    },
    Object {
        index: index::LOCK,
        name: Text::new("Configuration lock"),
        shape: Shape::Var,
        doc: Text::new("1: no other setting can be changed or restored. Guards against accidents, not against intent"),
        entries: &[Entry::switch(0, "Configuration lock", 0)],
    },
    Object {
        index: index::LOG_LEVEL,
        name: Text::new("Log level"),
        shape: Shape::Var,
        doc: Text::new("what is logged over UART: 0 nothing, 1 errors, 2 warnings, 3 information, 4 debugging"),
        entries: &[
            Entry::setting(0, "Log level", Value::U8(3)).range(Value::U8(0), Value::U8(4)),
        ],
    },
    Object {
        index: index::SELF_TEST,
        name: Text::new("Self-test at start"),
        shape: Shape::Var,
        doc: Text::new("1: the sensor's self-test runs at each start"),
        entries: &[Entry::switch(0, "Self-test at start", 0)],
    },
    Object {
        index: index::UART_STREAMS,
        name: Text::new("UART streams"),
        shape: Shape::Array,
        doc: Text::new("one message in so many ticks; 0: none"),
        entries: &[
            Entry::setting(1, "Contact", Value::U16(1)).unit("ms"),
            Entry::setting(2, "Raw sample", Value::U16(0)).unit("ms"),
            Entry::setting(3, "Health", Value::U16(100)).unit("ms"),
        ],
    },
    Object {
        index: index::WINDOW,
        name: Text::new("Window"),
        shape: Shape::Var,
        doc: Text::new("how far back the estimate looks"),
        entries: &[
            Entry::setting(0, "Window", WINDOW_US)
                .range(Value::U32(1_000), Value::U32(256_000))
                .unit("µs"),
        ],
    },
    Object {
        index: index::BANDWIDTH,
        name: Text::new("Bandwidth"),
        shape: Shape::Array,
        doc: Text::new("kernel standard deviation h: the sensor's noise"),
        entries: &per_axis(Params::DEFAULT.bandwidth, 1.0e3, SI),
    },
    Object {
        index: index::HALF_WIDTH,
        name: Text::new("Half-width"),
        shape: Shape::Array,
        doc: Text::new("motion within ±δ counts as rest"),
        entries: &per_axis(Params::DEFAULT.half_width, 1.0e4, SI),
    },
    Object {
        index: index::ATTITUDE_FILTER,
        name: Text::new("Attitude filter"),
        shape: Shape::Record,
        doc: Text::new("how gravity and the gyroscope's bias are found"),
        entries: ATTITUDE_FILTER,
    },
    Object {
        index: index::DECISION,
        name: Text::new("Decision"),
        shape: Shape::Record,
        doc: Text::new("when the probability becomes a yes or a no"),
        entries: &[
            Entry::setting(1, "Threshold", Value::F32(Params::DEFAULT.decision.threshold))
                .range(Value::F32(0.01), Value::F32(0.99)),
            delay(2, "On delay", Params::DEFAULT.decision.on_delay),
            delay(3, "Off delay", Params::DEFAULT.decision.off_delay),
        ],
    },
    Object {
        index: index::LOAD_INPUT,
        name: Text::new("Load input"),
        shape: Shape::Record,
        doc: Text::new("load = scale × (reading − offset)"),
        entries: &[
            Entry::setting(1, "Source", Value::U8(0))
                .range(Value::U8(0), Value::U8(2))
                .doc("0 none, 1 analog input, 2 CAN (RPDO1)"),
            Entry::setting(2, "Scale", Value::F32(1.0))
                .range(Value::F32(-1.0e6), Value::F32(1.0e6))
                .unit("N")
                .doc("per step of the analog reading"),
            Entry::setting(3, "Offset", Value::F32(0.0))
                .range(Value::F32(-1.0e6), Value::F32(1.0e6))
                .doc("the analog reading without load"),
            load_threshold(4, "On threshold", Params::DEFAULT.load.on_threshold)
                .doc("loaded from here on; not below the off threshold"),
            load_threshold(5, "Off threshold", Params::DEFAULT.load.off_threshold)
                .doc("no longer loaded below; not above the on threshold"),
        ],
    },
    Object {
        index: index::CONTACT,
        name: Text::new("Contact"),
        shape: Shape::Record,
        doc: Text::new("TPDO1"),
        entries: &[
            Entry::process(1, "Stable contact probability", Value::U16(0)).unit("1/65535"),
            probability_of(2, "Tangential probability"),
            probability_of(3, "Vertical probability"),
            Entry::process(4, "Timestamp", Value::U16(0))
                .unit("10 µs")
                .doc("of the sample; wraps every 655.36 ms"),
            Entry::process(5, "Sequence", Value::U8(0)),
            Entry::process(6, "Status", Value::U8(0)).doc("bits as in TPDO1"),
        ],
    },
    Object {
        index: index::AXES,
        name: Text::new("Axis probabilities"),
        shape: Shape::Array,
        doc: Text::new("TPDO2"),
        entries: &[
            probability_of(1, "P(ax)"),
            probability_of(2, "P(ay)"),
            probability_of(3, "P(az)"),
            probability_of(4, "P(wx)"),
            probability_of(5, "P(wy)"),
            probability_of(6, "P(wz)"),
        ],
    },
    Object {
        index: index::ATTITUDE,
        name: Text::new("Attitude"),
        shape: Shape::Array,
        doc: Text::new("TPDO3: quaternion, sensor → world"),
        entries: &axes_of(["w", "x", "y", "z"], "1/32767"),
    },
    Object {
        index: index::ACCELERATION,
        name: Text::new("Linear acceleration"),
        shape: Shape::Array,
        doc: Text::new("TPDO4: without gravity, sensor frame"),
        entries: &axes_of(XYZ, "0.01 m/s²"),
    },
    Object {
        index: index::RATE,
        name: Text::new("Angular rate"),
        shape: Shape::Array,
        doc: Text::new("TPDO5: without bias, sensor frame"),
        entries: &axes_of(XYZ, "0.00125 rad/s"),
    },
    Object {
        index: index::BIAS,
        name: Text::new("Gyroscope bias"),
        shape: Shape::Array,
        doc: Text::new("TPDO6: sensor frame"),
        entries: &axes_of(XYZ, "0.00001 rad/s"),
    },
    Object {
        index: index::TEMPERATURE,
        name: Text::new("Sensor temperature"),
        shape: Shape::Var,
        doc: Text::new("TPDO6"),
        entries: &[Entry::process(0, "Sensor temperature", Value::I16(0)).unit("0.01 °C")],
    },
    Object {
        index: index::HEALTH,
        name: Text::new("Health"),
        shape: Shape::Record,
        doc: Text::new("TPDO7"),
        entries: &[
            Entry::process(1, "Flags", Value::U8(0))
                .doc("of the estimator: bit 0 window not full, 1 up not known, 2 saturated, 3 stale, 4 invalid sample, 5 time gap"),
            Entry::process(2, "Dropped frames", Value::U8(0)).doc("modulo 256; all of them in 0x2112"),
            Entry::process(3, "Counter of the last SYNC", Value::U8(0))
                .doc("0: it had none"),
            Entry::process(4, "Time of the last SYNC", Value::U32(0))
                .unit("10 µs")
                .doc("on the foot's clock; the low 16 bits are a timestamp of 0x2100:4"),
        ],
    },
    Object {
        index: index::LOAD,
        name: Text::new("Load"),
        shape: Shape::Var,
        doc: Text::new("RPDO1; used with load source 2; reads as not a number where none came within the event timer"),
        entries: &[
            Entry::new(0, "Load", Role::Input, Access::Rw, Value::F32(0.0))
                .range(Value::F32(-1.0e9), Value::F32(1.0e9))
                .unit("N"),
        ],
    },
    Object {
        index: index::TIME,
        name: Text::new("Last time stamp"),
        shape: Shape::Record,
        doc: Text::new("the date of the last TIME message, and when it came on the foot's clock; all 0 before the first"),
        entries: &[
            Entry::live(1, "Days", Value::U16(0)).doc("since the first of January 1984"),
            Entry::live(2, "Milliseconds", Value::U32(0))
                .unit("ms")
                .doc("since midnight"),
            Entry::live(3, "Foot's clock", Value::U32(0))
                .unit("10 µs")
                .doc("the low 16 bits are a timestamp of 0x2100:4"),
        ],
    },
    Object {
        index: index::STAGE,
        name: Text::new("Stage"),
        shape: Shape::Var,
        doc: Text::new("0 starting, 1 self-test, 2 hold the foot still, 3 running, 4 recovering"),
        entries: &[Entry::live(0, "Stage", Value::U8(0))],
    },
    Object {
        index: index::FAULTS,
        name: Text::new("Active faults"),
        shape: Shape::Var,
        doc: Text::new("bit i: the fault of number i"),
        entries: &[Entry::live(0, "Active faults", Value::U32(0))],
    },
    Object {
        index: index::COUNTERS,
        name: Text::new("Counters"),
        shape: Shape::Array,
        doc: Text::new("since power-up"),
        entries: &counters(),
    },
    Object {
        index: index::LAST_CRASH,
        name: Text::new("Last crash"),
        shape: Shape::Record,
        doc: Text::new("what RAM remembers of it"),
        entries: &[
            Entry::live(1, "Reason", Value::U16(0))
                .doc("its emergency code; 0: none"),
            Entry::live(2, "Program counter", Value::U32(0)),
        ],
    },
    Object {
        index: index::CALIBRATION,
        name: Text::new("Calibration"),
        shape: Shape::Record,
        doc: Text::new("half-widths from steps on good ground"),
        entries: &[
            Entry::command(1, "Command", Access::Wo, Value::U8(0))
                .range(Value::U8(1), Value::U8(3))
                .doc("1 collect, 2 accept the proposal (in pre-operational), 3 give up"),
            Entry::live(2, "State", Value::U8(0))
                .doc("0 idle, 1 collecting, 2 proposal ready, 3 failed"),
            proposed(3, "Proposed half-width ax", "m/s²"),
            proposed(4, "Proposed half-width ay", "m/s²"),
            proposed(5, "Proposed half-width az", "m/s²"),
            proposed(6, "Proposed half-width wx", "rad/s"),
            proposed(7, "Proposed half-width wy", "rad/s"),
            proposed(8, "Proposed half-width wz", "rad/s"),
        ],
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pdo::PDOS;
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
            assert_eq!(entry.limits.check(entry.default), Ok(()), "{address:?}");
            if let Limits::OneOf(values) = entry.limits {
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
            Limits::RangeWithout(&[Value::U8(1), Value::U8(255), Value::U8(128), Value::U8(254)]);
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
