//! 0x1000 to 0x1FFF: objects of CiA 301, and those of CiA 302-3 for programs.

use super::index;
use super::object::{Access, Concern, Entry, Object, Role, Shape, Text};
use super::process::process;
use crate::foot::cob_id;
use crate::pdo::{self, Pdo};
use crate::value::Value;

/// Bit 31 of a PDO's identifier: the PDO is off.
pub const PDO_OFF: u32 = 1 << 31;
/// Bit 30 of a PDO's identifier: remote frames are not answered.
pub const PDO_NO_REMOTE: u32 = 1 << 30;

/// "foot": distinguishes the product from other devices of the vendor.
pub const PRODUCT_CODE: u32 = u32::from_be_bytes(*b"foot");
/// Vendor id. None has been assigned to this project.
pub const VENDOR_ID: u32 = 0;
/// Revision of this dictionary: major in the upper, minor in the lower 16 bits. The major number changes when an object
/// changes its meaning.
pub const REVISION: u32 = 0x0002_0001;

/// Number of past emergencies that 0x1003 keeps.
pub const ERROR_HISTORY: usize = 8;

const fn tpdo(pdo: Pdo) -> [Entry; 3] {
    [
        Entry::new(
            1,
            "COB-ID",
            Role::PdoCobId,
            Access::Rw,
            Value::U32(PDO_NO_REMOTE | pdo.base() as u32),
        )
        .doc("bit 31 set: not sent; the other bits cannot be changed"),
        Entry::setting(2, "Transmission type", Concern::Stream, Value::U8(254))
            .range_without(&[Value::U8(1), Value::U8(255), Value::U8(241), Value::U8(253)])
            .doc("1 to 240: with every n-th SYNC; 254 and 255: by the event timer"),
        Entry::setting(5, "Event timer", Concern::Stream, Value::U16(pdo.default_period_ms()))
            .range(Value::U16(0), Value::U16(10_000))
            .unit("ms")
            .doc("one frame in N ms; 0: not sent by the timer"),
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
    let mut entries = [Entry::constant(1, NAMES[0], Value::U32(0)); N];
    let mut i = 0;
    while i < N {
        let mapped = Value::U32(pdo.mapping()[i].to_u32());
        entries[i] = Entry::constant(i as u8 + 1, NAMES[i], mapped);
        i += 1;
    }
    entries
}

/// Communication parameter: sets when a frame is sent.
macro_rules! communication_parameter {
    ($pdo:ident, $number:literal) => {
        Object {
            index: index::TPDO + Pdo::$pdo as u16,
            name: Text::new(concat!($number, " communication parameter")),
            shape: Shape::Record,
            doc: Text::new(Pdo::$pdo.title()),
            entries: &tpdo(Pdo::$pdo),
        }
    };
}

/// Mapping parameter: lists the contents of a frame.
macro_rules! mapping_parameter {
    ($pdo:ident, $number:literal) => {
        Object {
            index: index::TPDO_MAPPING + Pdo::$pdo as u16,
            name: Text::new(concat!($number, " mapping parameter")),
            shape: Shape::Record,
            doc: Text::new(Pdo::$pdo.title()),
            entries: &mapping::<{ Pdo::$pdo.mapping().len() }>(Pdo::$pdo),
        }
    };
}

const fn error(sub: u8, name: &'static str) -> Entry {
    Entry::live(sub, name, Value::U32(0))
        .doc("emergency code in the lower 16 bits, number of the fault above; newest first")
}

pub(super) const OBJECTS: &[Object] = &[
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
        entries: process!(Health, ERROR_REGISTER),
    },
    Object {
        index: index::ERROR_HISTORY,
        name: Text::new("Pre-defined error field"),
        shape: Shape::Array,
        doc: Text::new("the last emergencies"),
        entries: &[
            Entry::command(0, "Number of errors", Access::Rw, Value::U8(0))
                .doc("writing 0 clears the history; any other value is refused"),
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
        doc: Text::new("received, never sent"),
        entries: &[Entry::constant(0, "COB-ID SYNC message", Value::U32(cob_id::SYNC as u32))],
    },
    Object {
        index: index::DEVICE_NAME,
        name: Text::new("Manufacturer device name"),
        shape: Shape::Var,
        doc: Text::new(""),
        entries: &[Entry::constant(
            0,
            "Manufacturer device name",
            Value::Text("footfall"),
        )],
    },
    Object {
        index: index::HARDWARE_VERSION,
        name: Text::new("Manufacturer hardware version"),
        shape: Shape::Var,
        doc: Text::new("name of the board"),
        entries: &[Entry::live(0, "Manufacturer hardware version", Value::Text(""))],
    },
    Object {
        index: index::SOFTWARE_VERSION,
        name: Text::new("Manufacturer software version"),
        shape: Shape::Var,
        doc: Text::new(""),
        entries: &[Entry::constant(
            0,
            "Manufacturer software version",
            Value::Text(env!("CARGO_PKG_VERSION")),
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
        doc: Text::new("deletes the stored settings; the defaults apply from the next reset"),
        entries: &[
            Entry::command(1, "Restore all default parameters", Access::Rw, Value::U32(1))
                .doc("write \"load\" (0x64616F6C); reads 1: can be restored"),
        ],
    },
    Object {
        index: index::TIME_COB_ID,
        name: Text::new("COB-ID time stamp object"),
        shape: Shape::Var,
        doc: Text::new("received, never sent"),
        entries: &[Entry::constant(
            0,
            "COB-ID time stamp object",
            Value::U32(1 << 31 | cob_id::TIME as u32),
        )],
    },
    Object {
        index: index::EMCY_COB_ID,
        name: Text::new("COB-ID EMCY"),
        shape: Shape::Var,
        doc: Text::new(""),
        entries: &[Entry::cob_id(0, "COB-ID EMCY", cob_id::EMERGENCY as u32)],
    },
    Object {
        index: index::HEARTBEAT,
        name: Text::new("Producer heartbeat time"),
        shape: Shape::Var,
        doc: Text::new("0: no heartbeat"),
        entries: &[
            Entry::setting(0, "Producer heartbeat time", Concern::Stream, Value::U16(500)).unit("ms"),
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
            Entry::cob_id(1, "COB-ID client to server", cob_id::SDO_REQUEST as u32),
            Entry::cob_id(2, "COB-ID server to client", cob_id::SDO_RESPONSE as u32),
        ],
    },
    Object {
        index: index::RPDO,
        name: Text::new("RPDO1 communication parameter"),
        shape: Shape::Record,
        doc: Text::new("the load, from a robot that measures it"),
        entries: &[
            Entry::cob_id(1, "COB-ID", pdo::Load::BASE as u32),
            Entry::constant(2, "Transmission type", Value::U8(255)),
            Entry::setting(5, "Event timer", Concern::Stream, Value::U16(100))
                .range(Value::U16(1), Value::U16(1_000))
                .unit("ms")
                .doc("a load older than this is ignored; emergency 0x8250 follows if the load source is CAN"),
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
    communication_parameter!(Contact, "TPDO1"),
    communication_parameter!(Axes, "TPDO2"),
    communication_parameter!(Attitude, "TPDO3"),
    communication_parameter!(Acceleration, "TPDO4"),
    communication_parameter!(Rate, "TPDO5"),
    communication_parameter!(Bias, "TPDO6"),
    communication_parameter!(Health, "TPDO7"),
    mapping_parameter!(Contact, "TPDO1"),
    mapping_parameter!(Axes, "TPDO2"),
    mapping_parameter!(Attitude, "TPDO3"),
    mapping_parameter!(Acceleration, "TPDO4"),
    mapping_parameter!(Rate, "TPDO5"),
    mapping_parameter!(Bias, "TPDO6"),
    mapping_parameter!(Health, "TPDO7"),
    Object {
        index: index::PROGRAM_CONTROL,
        name: Text::new("Program control"),
        shape: Shape::Array,
        doc: Text::new("commands that stop, start and replace the program (CiA 302-3)"),
        entries: &[
            Entry::command(1, "Program control 1", Access::Rw, Value::U8(1)).doc(
                "0: stop (the bootloader answers from then on); 1: start; 2: reset; 3: clear; 128: confirm",
            ),
        ],
    },
    Object {
        index: index::PROGRAM_ID,
        name: Text::new("Program software identification"),
        shape: Shape::Array,
        doc: Text::new("the first four bytes of the program's hash; for a program written by a debug probe the first eight digits of its commit, or 0"),
        entries: &[
            Entry::live(1, "Program software identification 1", Value::U32(0)),
            Entry::live(2, "Program software identification 2", Value::U32(0))
                .doc("the kept copy of the program before the last update; 0 if there is none"),
        ],
    },
    Object {
        index: index::FLASH_STATUS,
        name: Text::new("Flash status identification"),
        shape: Shape::Array,
        doc: Text::new("0: the last update succeeded; otherwise bits 16 to 23 are the reason why it failed"),
        entries: &[Entry::live(1, "Flash status identification 1", Value::U32(0))],
    },
];
