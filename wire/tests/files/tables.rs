//! Tables of `README.md`: from the code's tables, and from the documentation of the files that define
//! the bytes.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use wire::dictionary::{Access, Entry, Limits, OBJECTS, Object, Role, Shape, index};
use wire::pdo::Kind;
use wire::{AbortCode, Fault, Foot, Pdo, Value};

/// Text with every table between `<!-- table NAME -->` and `<!-- end -->` generated again.
pub fn update(readme: &str) -> String {
    let mut parts = readme.split("<!-- table ");
    let mut updated = parts.next().unwrap_or_default().to_string();
    for part in parts {
        let (name, rest) = part.split_once(" -->").expect("a name");
        let (_, rest) = rest.split_once("<!-- end -->").expect("an end");
        let table = table(name);
        let _ = write!(updated, "<!-- table {name} -->\n{table}<!-- end -->{rest}");
    }
    updated
}

fn table(name: &str) -> String {
    match name {
        "objects" => objects(),
        "pdos" => pdos(),
        name if name.starts_with("pdo ") => fields(&name["pdo ".len()..]),
        "feet" => feet(),
        "faults" => faults(),
        "aborts" => aborts(),
        path => documented(path),
    }
}

/// All tables in the documentation at the head of a file or, after `#`, before an item.
fn documented(path: &str) -> String {
    let (path, item) = path.split_once('#').unwrap_or((path, ""));
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(path);
    let source = fs::read_to_string(source).expect("the file is there");
    let (prefix, text) = if item.is_empty() {
        ("//!", source.as_str())
    } else {
        let end = source.find(item).expect("the item is there");
        let start = source[..end].rfind("\n\n").expect("a paragraph before it");
        ("///", &source[start..end])
    };
    text.lines()
        .filter_map(|line| line.trim().strip_prefix(prefix)?.trim().strip_prefix('|'))
        // Links to items have no meaning outside the code's documentation.
        .map(|row| format!("|{}\n", row.replace("[`", "`").replace("`]", "`")))
        .collect()
}

fn objects() -> String {
    let mut table =
        String::from("| object | name | type | access | default | allowed | unit | meaning |\n");
    table.push_str("|---|---|---|---|---|---|---|---|\n");
    for object in OBJECTS {
        if (index::TPDO_MAPPING..index::FOOT).contains(&object.index) {
            let Object { index, name, .. } = object;
            let mapped: Vec<String> = object.entries.iter().map(mapped).collect();
            let _ = writeln!(
                table,
                "| **{index:04X}** | **{name}** | UNSIGNED32 | const | | | | {} |",
                mapped.join(", ")
            );
            continue;
        }
        if object.shape != Shape::Var {
            let Object {
                index, name, doc, ..
            } = object;
            let _ = writeln!(table, "| **{index:04X}** | **{name}** | | | | | | {doc} |");
        }
        for entry in object.entries {
            let address = match object.shape {
                Shape::Var => format!("**{:04X}**", object.index),
                Shape::Array | Shape::Record => format!("{:04X}:{}", object.index, entry.subindex),
            };
            let name = match object.shape {
                Shape::Var => format!("**{}**", entry.name),
                Shape::Array | Shape::Record => entry.name.to_string(),
            };
            let _ = writeln!(
                table,
                "| {address} | {name} | {} | {} | {} | {} | {} | {} |",
                entry.data_type().name(),
                access(entry),
                default(entry),
                allowed(entry),
                entry.unit,
                meaning(object, entry),
            );
        }
    }
    table
}

/// Object in an entry of a mapping parameter.
fn mapped(entry: &Entry) -> String {
    let mapped = entry.default.to_raw();
    let subindex = mapped >> 8 & 0xFF;
    format!("{:04X}:{subindex}", mapped >> 16)
}

fn meaning(object: &Object, entry: &Entry) -> String {
    let about = if object.shape == Shape::Var {
        object.doc.as_str()
    } else {
        ""
    };
    [about, entry.doc.as_str()]
        .into_iter()
        .filter(|text| !text.is_empty())
        .collect::<Vec<_>>()
        .join("; ")
}

fn access(entry: &Entry) -> &'static str {
    match (entry.access, entry.role) {
        (Access::Rw, Role::Setting(_) | Role::PdoCobId) => "setting",
        (access, _) => access.name(),
    }
}

fn default(entry: &Entry) -> String {
    match entry.role {
        Role::CobId | Role::PdoCobId => format!("0x{:X} + id", entry.default.to_raw()),
        Role::Process | Role::Live | Role::Input => String::new(),
        _ => number(entry.default),
    }
}

fn allowed(entry: &Entry) -> String {
    match entry.limits() {
        Limits::Any => String::new(),
        Limits::Range(low, high) => format!("{} to {}", number(low), number(high)),
        Limits::RangeWithout([low, high, from, to]) => format!(
            "{} to {}, not {} to {}",
            number(low),
            number(high),
            number(from),
            number(to)
        ),
        Limits::OneOf(values) => values
            .iter()
            .map(|value| number(*value))
            .collect::<Vec<_>>()
            .join(", "),
    }
}

fn number(value: Value) -> String {
    match value {
        Value::I16(value) => value.to_string(),
        Value::U8(value) => value.to_string(),
        Value::U16(value) => value.to_string(),
        Value::U32(value) if value > 10_000_000 => format!("0x{value:08X}"),
        Value::U32(value) => value.to_string(),
        Value::F32(value) => format!("{value:?}"),
        Value::Text(text) => format!("\"{text}\""),
    }
}

fn pdos() -> String {
    let mut table = String::from("| frame | identifier | every | contents |\n|---|---|---|---|\n");
    for pdo in Pdo::ALL {
        let contents: Vec<&str> = pdo.signals().map(|(_, signal)| signal.name).collect();
        let _ = writeln!(
            table,
            "| TPDO{} {} | 0x{:X} + id | {} ms | {} |",
            pdo as u8 + 1,
            pdo.name(),
            pdo.base(),
            pdo.default_period_ms(),
            contents.join(", ")
        );
    }
    table
}

/// Positions of the fields in a frame.
fn fields(name: &str) -> String {
    let mut table =
        String::from("| bytes | object | signal | step | meaning |\n|---|---|---|---|---|\n");
    let pdo = Pdo::ALL.into_iter().find(|pdo| pdo.name() == name);
    for (field, signal) in pdo.expect("a frame's name").signals() {
        let step = match signal.kind {
            Kind::Named(names) if names.len() > 2 => names
                .iter()
                .map(|(code, name)| format!("{code} {name}"))
                .collect::<Vec<_>>()
                .join(", "),
            Kind::Named(_) => String::new(),
            Kind::Unsigned { .. } | Kind::Signed { .. } => field.unit.to_string(),
        };
        let _ = writeln!(
            table,
            "| {} | {:04X}:{} | {} | {step} | {} |",
            place(signal.start, signal.length),
            field.index,
            field.subindex,
            signal.name,
            signal.comment,
        );
    }
    table
}

/// Position in bytes, or in the bits of one.
fn place(start: u8, length: u8) -> String {
    let (byte, bit) = (start / 8, start % 8);
    match (length, length / 8) {
        (1, _) => format!("{byte}, bit {bit}"),
        (2..8, _) => format!("{byte}, bits {bit} to {}", bit + length - 1),
        (_, 1) => byte.to_string(),
        (_, 2) => format!("{byte}, {}", byte + 1),
        (_, bytes) => format!("{byte} to {}", byte + bytes - 1),
    }
}

fn feet() -> String {
    let mut table = String::from("| foot | code | node id | TPDO1 |\n|---|---|---|---|\n");
    for foot in Foot::ALL {
        let id = foot.default_node_id();
        let _ = writeln!(
            table,
            "| {} | {} | 0x{:02X} | 0x{:03X} |",
            foot.name(),
            foot.code(),
            id.get(),
            Pdo::Contact.cob_id(id)
        );
    }
    table
}

fn faults() -> String {
    let mut table = String::from(
        "| code | number | fault | error register | voids the estimate | detail |\n|---|---|---|---|---|---|\n",
    );
    for fault in Fault::ALL {
        let _ = writeln!(
            table,
            "| 0x{:04X} | {} | {} | 0x{:02X} | {} | {} |",
            fault.code(),
            fault.number(),
            fault.name(),
            fault.register_bits() | 1,
            if fault.voids_estimate() { "yes" } else { "no" },
            fault.detail()
        );
    }
    table
}

fn aborts() -> String {
    let mut table = String::from("| code | meaning |\n|---|---|\n");
    for abort in AbortCode::ALL {
        let code = abort.code();
        let _ = writeln!(
            table,
            "| 0x{:04X} {:04X} | {} |",
            code >> 16,
            code & 0xFFFF,
            abort.name()
        );
    }
    table
}
