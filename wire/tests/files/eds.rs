//! `footfall.eds`: the object dictionary in the format of CiA 306.

use std::fmt::Write;

use wire::dictionary::{Entry, OBJECTS, Object, PRODUCT_CODE, REVISION, Role, Shape, VENDOR_ID};
use wire::pdo::PDOS;
use wire::{AbortCode, DataType, Value};

use super::tables::variable_meaning;

const MANDATORY: [u16; 3] = [0x1000, 0x1001, 0x1018];

pub fn generate() -> String {
    let mut eds = head();
    let (optional, manufacturer): (Vec<&Object>, Vec<&Object>) = OBJECTS
        .iter()
        .filter(|object| !MANDATORY.contains(&object.index))
        .partition(|object| object.index < 0x2000);
    let mandatory: Vec<&Object> =
        OBJECTS.iter().filter(|object| MANDATORY.contains(&object.index)).collect();
    for (name, objects) in [
        ("MandatoryObjects", &mandatory),
        ("OptionalObjects", &optional),
        ("ManufacturerObjects", &manufacturer),
    ] {
        let _ = writeln!(eds, "\n[{name}]\nSupportedObjects={}", objects.len());
        for (i, object) in objects.iter().enumerate() {
            let _ = writeln!(eds, "{}=0x{:04X}", i + 1, object.index);
        }
        for object in objects {
            write_object(&mut eds, object);
        }
    }
    eds
}

fn head() -> String {
    let rates: String = [10, 20, 50, 125, 250, 500, 800, 1000]
        .map(|rate| {
            let supported = u8::from(matches!(rate, 125 | 250 | 500 | 1000));
            format!("BaudRate_{rate}={supported}\n")
        })
        .concat();
    format!(
        "[FileInfo]
FileName=footfall.eds
FileVersion={major}
FileRevision={minor}
EDSVersion=4.0
Description=Stable-contact probability of a robot's foot
CreationTime=12:00AM
CreationDate=01-01-2026
CreatedBy=footfall
ModificationTime=12:00AM
ModificationDate=01-01-2026
ModifiedBy=footfall

[DeviceInfo]
VendorName=footfall
VendorNumber=0x{VENDOR_ID:08X}
ProductName=footfall
ProductNumber=0x{PRODUCT_CODE:08X}
RevisionNumber=0x{REVISION:08X}
OrderCode=footfall
{rates}SimpleBootUpMaster=0
SimpleBootUpSlave=1
Granularity=8
DynamicChannelsSupported=0
CompactPDO=0
GroupMessaging=0
NrOfRXPDO=1
NrOfTXPDO={PDOS}
LSS_Supported=1

[DummyUsage]
Dummy0001=0
Dummy0002=0
Dummy0003=0
Dummy0004=0
Dummy0005=0
Dummy0006=0
Dummy0007=0

[Comments]
Lines=2
Line1=Generated from wire/src/dictionary: change that, not this.
Line2=Comments below a value have its meaning; wire/README.md says how to use it.
",
        major = REVISION >> 16,
        minor = REVISION & 0xFFFF,
    )
}

fn write_object(eds: &mut String, object: &Object) {
    let index = object.index;
    let _ = writeln!(eds, "\n[{index:04X}]\nParameterName={}", object.name);
    let kind = match object.shape {
        Shape::Var => {
            for entry in object.entries {
                write_value(eds, entry);
                write_comment(eds, &variable_meaning(object, entry));
            }
            return;
        }
        Shape::Array => 8,
        Shape::Record => 9,
    };
    // An array that clears itself has its own entry at sub-index 0.
    let own_count = object.entries.iter().any(|entry| entry.subindex == 0);
    let entries = object.entries.len() + usize::from(!own_count);
    let _ = writeln!(eds, "ObjectType=0x{kind}\nSubNumber={entries}");
    write_comment(eds, &object.doc);
    if !own_count {
        let _ = writeln!(
            eds,
            "\n[{index:04X}sub0]
ParameterName=Highest sub-index supported
ObjectType=0x7
DataType=0x0005
AccessType=const
DefaultValue={}
PDOMapping=0",
            object.highest_subindex()
        );
    }
    for entry in object.entries {
        let sub = entry.subindex;
        let _ = writeln!(eds, "\n[{index:04X}sub{sub:X}]\nParameterName={}", entry.name);
        write_value(eds, entry);
        write_comment(eds, &entry.doc);
    }
}

/// Writes the meaning, for which CiA 306 has no key.
fn write_comment(eds: &mut String, text: &str) {
    if !text.is_empty() {
        let _ = writeln!(eds, "; {}", ascii(text));
    }
}

fn write_value(eds: &mut String, entry: &Entry) {
    let access = match entry.role {
        Role::Input => "rww",
        _ => entry.access.name(),
    };
    let _ = writeln!(
        eds,
        "ObjectType=0x7\nDataType=0x{:04X}\nAccessType={access}",
        entry.data_type().index()
    );
    let default = match entry.role {
        Role::CobId | Role::PdoCobId => format!("$NODEID+0x{:X}", entry.default.to_raw()),
        _ => number(entry.default),
    };
    let _ = writeln!(eds, "DefaultValue={default}");
    write_limits(eds, entry);
    let _ = writeln!(eds, "PDOMapping={}", u8::from(entry.is_mappable()));
    // The bits above as readable numbers.
    if let Value::F32(default) = entry.default {
        let _ = write!(eds, "; Default: {default:?}");
        if let Some((Value::F32(low), Value::F32(high))) = entry.limits().range() {
            let _ = write!(eds, ", {low:?} to {high:?}");
        }
        eds.push('\n');
    }
    // CiA 306 has no key for a unit, and Lely's tools warn of unknown keys.
    if !entry.unit.is_empty() {
        let _ = writeln!(eds, "; Unit: {}", ascii(&entry.unit));
    }
}

fn write_limits(eds: &mut String, entry: &Entry) {
    let Some((low, high)) = entry.limits().range() else {
        return;
    };
    // Keys may be written in either case. python-canopen knows the usual one only, and would take
    // the bits of a REAL32 as its value.
    let (low_key, high_key) = match entry.data_type() {
        DataType::Real32 => ("lowlimit", "highlimit"),
        _ => ("LowLimit", "HighLimit"),
    };
    // Readers report a default below the low limit as an underflow, so such a command has no low limit here.
    if entry.limits().check(entry.default) != Err(AbortCode::TooLow) {
        let _ = writeln!(eds, "{low_key}={}", number(low));
    }
    let _ = writeln!(eds, "{high_key}={}", number(high));
}

fn number(value: Value) -> String {
    match value {
        Value::I16(value) => value.to_string(),
        Value::U8(value) => value.to_string(),
        Value::U16(value) => value.to_string(),
        Value::U32(value) => format!("0x{value:X}"),
        // Lely reads bits, and other readers a number. Both read 0 as 0.
        Value::F32(0.0) => "0".into(),
        Value::F32(value) => format!("0x{:08X}", value.to_bits()),
        Value::Text(text) => text.to_string(),
    }
}

fn ascii(text: &str) -> String {
    [
        ('²', "^2"),
        ('µ', "u"),
        ('°', "deg"),
        ('−', "-"),
        ('→', "->"),
        ('×', "x"),
        ('±', "+-"),
        ('δ', "delta"),
        ('σ', "sigma"),
        ('ω', "omega"),
    ]
    .into_iter()
    .fold(text.to_string(), |text, (sign, name)| text.replace(sign, name))
}
