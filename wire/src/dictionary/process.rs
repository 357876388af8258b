//! From 0x2100 on: measurements, state and commands of the foot.

use estimator_core::Learnt;

use super::configuration::LEARNT_NUMBERS;
use super::index;
use super::object::{Access, Entry, Object, Role, Shape, Text};
use crate::board::Counter;
use crate::pdo::Field;
use crate::value::Value;

/// Number of rows of a frame that belong to an object.
#[allow(clippy::indexing_slicing)] // Evaluated by the compiler only.
pub(super) const fn count(fields: &[Field], index: u16) -> usize {
    let (mut count, mut i) = (0, 0);
    while i < fields.len() {
        count += (fields[i].index == index) as usize;
        i += 1;
    }
    count
}

/// Entries of an object in a frame.
#[allow(clippy::indexing_slicing)] // Evaluated by the compiler only.
pub(super) const fn entries<const N: usize>(fields: &[Field], index: u16) -> [Entry; N] {
    let mut entries = [Entry::live(0, "", Value::U8(0)); N];
    let (mut count, mut i) = (0, 0);
    while i < fields.len() {
        let field = fields[i];
        if field.index == index {
            entries[count] =
                Entry::new(field.subindex, field.name, Role::Process, Access::Ro, field.zero)
                    .unit(field.unit)
                    .doc(field.doc);
            count += 1;
        }
        i += 1;
    }
    entries
}

/// Entries of an object, from the rows of its frame.
macro_rules! process {
    ($pdo:ident, $index:ident) => {{
        const FIELDS: &[crate::pdo::Field] = crate::pdo::Pdo::$pdo.fields();
        const INDEX: u16 = crate::dictionary::index::$index;
        const COUNT: usize = super::process::count(FIELDS, INDEX);
        &super::process::entries::<COUNT>(FIELDS, INDEX)
    }};
}
pub(super) use process;

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

/// Command, state and learnt values. The learnt values are the numbers of 0x2018, as they are now.
#[allow(clippy::indexing_slicing)] // Evaluated by the compiler only.
const CALIBRATION: [Entry; 2 + Learnt::NUMBERS] = {
    let command = Entry::command(1, "Command", Access::Wo, Value::U8(0))
        .range(Value::U8(1), Value::U8(2))
        .doc("1 keep: copies the learnt values to 0x2018, if they have settled; 2 forget: sets 0x2018 to 0, and the foot starts learning again. Both only in pre-operational");
    let state = Entry::live(2, "State", Value::U8(0))
        .doc("0 settling, 1 settled, 2 frozen: 0x2016 disables learning");
    let mut entries = [state; 2 + Learnt::NUMBERS];
    entries[0] = command;
    let mut i = 0;
    while i < LEARNT_NUMBERS.len() {
        entries[2 + i] = LEARNT_NUMBERS[i].as_live(3 + i as u8);
        i += 1;
    }
    entries
};

/// Units of the diagnosis.
const VARIANCE: &str = "1/2000 code^2";
const KILOHERTZ: &str = "kHz";

pub(super) const OBJECTS: &[Object] = &[
    Object {
        index: index::CONTACT,
        name: Text::new("Contact"),
        shape: Shape::Record,
        doc: Text::new("TPDO1"),
        entries: process!(Contact, CONTACT),
    },
    Object {
        index: index::AXES,
        name: Text::new("Axis probabilities"),
        shape: Shape::Array,
        doc: Text::new("TPDO2"),
        entries: process!(Axes, AXES),
    },
    Object {
        index: index::ATTITUDE,
        name: Text::new("Attitude"),
        shape: Shape::Array,
        doc: Text::new("TPDO3: quaternion, foot → world"),
        entries: process!(Attitude, ATTITUDE),
    },
    Object {
        index: index::ACCELERATION,
        name: Text::new("Linear acceleration"),
        shape: Shape::Array,
        doc: Text::new("TPDO4: without gravity, frame of the foot"),
        entries: process!(Acceleration, ACCELERATION),
    },
    Object {
        index: index::RATE,
        name: Text::new("Angular rate"),
        shape: Shape::Array,
        doc: Text::new("TPDO5: without bias, frame of the foot"),
        entries: process!(Rate, RATE),
    },
    Object {
        index: index::BIAS,
        name: Text::new("Gyroscope bias"),
        shape: Shape::Array,
        doc: Text::new("TPDO6: frame of the foot"),
        entries: process!(Bias, BIAS),
    },
    Object {
        index: index::TEMPERATURE,
        name: Text::new("Sensor temperature"),
        shape: Shape::Var,
        doc: Text::new("TPDO6"),
        entries: process!(Bias, TEMPERATURE),
    },
    Object {
        index: index::HEALTH,
        name: Text::new("Health"),
        shape: Shape::Record,
        doc: Text::new("TPDO7"),
        entries: process!(Health, HEALTH),
    },
    Object {
        index: index::LOAD,
        name: Text::new("Load"),
        shape: Shape::Var,
        doc: Text::new("RPDO1; used with load source 2; reads as NaN if none was received within the event timer"),
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
        doc: Text::new("date in the last TIME message, and its reception time on the foot's clock; all 0 before the first message"),
        entries: &[
            Entry::live(1, "Days", Value::U16(0)).doc("since 1 January 1984"),
            Entry::live(2, "Milliseconds", Value::U32(0))
                .unit("ms")
                .doc("since midnight"),
            Entry::live(3, "Foot's clock", Value::U32(0))
                .unit("10 µs")
                .doc("the low 16 bits are a timestamp of 0x2100:4"),
        ],
    },
    Object {
        index: index::VELOCITY_SIGMA,
        name: Text::new("Zero-velocity sigma"),
        shape: Shape::Var,
        doc: Text::new("standard deviation of the foot's velocity about zero, per axis, by 0x201A; 100 in doubt or with a fault"),
        entries: &[Entry::live(0, "Zero-velocity sigma", Value::F32(0.0)).unit("m/s")],
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
        doc: Text::new("the last crash, as recorded in RAM"),
        entries: &[
            Entry::live(1, "Reason", Value::U16(0))
                .doc("its emergency code; 0: none"),
            Entry::live(2, "Program counter", Value::U32(0)),
        ],
    },
    Object {
        index: index::SUPPLY,
        name: Text::new("Supply"),
        shape: Shape::Record,
        doc: Text::new("reset of the chip while its supply is too low for its clock and its flash"),
        entries: &[
            Entry::live(1, "Brown-out level", Value::U8(0))
                .doc("as found at the start: 0 off (as delivered) or not available; 1 to 3: the chip resets itself below 2.19, 2.50 or 2.83 V, typically"),
            Entry::command(2, "Set brown-out level", Access::Wo, Value::U32(0))
                .doc("write \"bor3\" (0x33726F62) in pre-operational: level 3 from the next power-up on; the chip keeps it permanently"),
        ],
    },
    Object {
        index: index::SETTINGS_HASH,
        name: Text::new("Settings hash"),
        shape: Shape::Var,
        doc: Text::new("of all present settings, stored or not: h = (h rotated left by 5, xor value) × 0x9E3779B9 for each, in the order of addresses, starting from 0"),
        entries: &[Entry::live(0, "Settings hash", Value::U32(0))],
    },
    Object {
        index: index::COSTS,
        name: Text::new("Costs"),
        shape: Shape::Record,
        doc: Text::new("the largest values since power-up, measured by the board; storing settings increases the first two"),
        entries: &[
            Entry::live(1, "Edge to mailbox", Value::U16(0))
                .unit("µs")
                .doc("from the data-ready edge to the contact in its CAN mailbox"),
            Entry::live(2, "Edge to end", Value::U16(0))
                .unit("µs")
                .doc("from the data-ready edge to the end of the tick's work"),
            Entry::live(3, "Stack", Value::U16(0)).unit("bytes"),
            Entry::live(4, "Period", Value::U16(0)).unit("µs").doc("of the ticks; constant"),
        ],
    },
    Object {
        index: index::DIAGNOSIS,
        name: Text::new("Diagnosis"),
        shape: Shape::Record,
        doc: Text::new("of the board and its sensor, for reports"),
        entries: &[
            Entry::live(1, "Reset", Value::U8(0))
                .doc("cause of the start: 0 unknown, 1 power-up or a dip of the supply, 2 reset pin, 3 by the program, 4 watchdog"),
            Entry::live(2, "Clock", Value::U32(0)).unit(KILOHERTZ).doc("of the processor"),
            Entry::live(3, "Crystal used", Value::U8(0)).doc("1: it drives the clock"),
            Entry::live(4, "Crystal", Value::U16(0))
                .unit(KILOHERTZ)
                .doc("as measured; 0: not measured, or it does not start"),
            Entry::live(5, "Option bytes", Value::U32(0))
                .doc("in effect, of an STM32F405: nWRP in the high half, RDP and USER in the low one; 0 on a chip without them"),
            Entry::live(6, "Identifier 1", Value::U32(0))
                .doc("of the chip or its flash, unique to the board; 0 beyond its length"),
            Entry::live(7, "Identifier 2", Value::U32(0)),
            Entry::live(8, "Identifier 3", Value::U32(0)),
            Entry::live(9, "Identifier 4", Value::U32(0)),
            Entry::live(10, "Slow bus clock", Value::U16(0)).unit(KILOHERTZ).doc("of the sensor"),
            Entry::live(11, "Middle bus clock", Value::U16(0)).unit(KILOHERTZ),
            Entry::live(12, "Fast bus clock", Value::U16(0)).unit(KILOHERTZ),
            Entry::live(13, "Bus clock in use", Value::U8(0)).doc("0 slow, 1 middle, 2 fast"),
            Entry::live(14, "Errors at slow clock", Value::U16(0))
                .doc("since the start: failed transfers of the sensor, and wrong readings"),
            Entry::live(15, "Errors at middle clock", Value::U16(0)),
            Entry::live(16, "Errors at fast clock", Value::U16(0)),
            Entry::live(17, "Sensor identity", Value::U8(0))
                .doc("WHO_AM_I as last read, 0x6C if right; 0 before the first reading"),
            Entry::live(18, "Edges", Value::U16(0))
                .doc("data-ready edges in the last 1000 ticks; 0 if the board does not count them"),
            Entry::live(19, "Noise of x", Value::U32(0))
                .unit(VARIANCE)
                .doc("its variance, and the mean, in the quietest 1000 ticks since the start"),
            Entry::live(20, "Noise of y", Value::U32(0)).unit(VARIANCE),
            Entry::live(21, "Noise of z", Value::U32(0)).unit(VARIANCE),
            Entry::live(22, "Noise about x", Value::U32(0)).unit(VARIANCE),
            Entry::live(23, "Noise about y", Value::U32(0)).unit(VARIANCE),
            Entry::live(24, "Noise about z", Value::U32(0)).unit(VARIANCE),
            Entry::live(25, "Mean of x", Value::I16(0)).unit("codes"),
            Entry::live(26, "Mean of y", Value::I16(0)).unit("codes"),
            Entry::live(27, "Mean of z", Value::I16(0)).unit("codes"),
            Entry::live(28, "Mean about x", Value::I16(0)).unit("codes"),
            Entry::live(29, "Mean about y", Value::I16(0)).unit("codes"),
            Entry::live(30, "Mean about z", Value::I16(0)).unit("codes"),
        ],
    },
    Object {
        index: index::CALIBRATION,
        name: Text::new("Calibration"),
        shape: Shape::Record,
        doc: Text::new("values that the foot has learnt while walking, as they are now"),
        entries: &CALIBRATION,
    },
];
