//! Tables of `README.md`: from the code's tables, and from the documentation of the files that define
//! the bytes.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use wire::dictionary::{Entry, OBJECTS, Object, Role, Shape, index};
use wire::pdo::SignalKind;
use wire::{DataType, Foot, Pdo, Value};

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

/// Objects that a master writes. `footfall.eds` has all objects, with types, limits and numbers.
fn objects() -> String {
    let mut table = String::from("| object | name | default | meaning |\n|---|---|---|---|\n");
    for object in OBJECTS.iter().filter(|object| is_written(object)) {
        let Object { index, name, .. } = object;
        let (default, meaning) = match (object.shape, object.entries) {
            (Shape::Var, [entry]) => {
                (default(entry), vec![object.doc.to_string(), entry.doc.to_string()])
            }
            _ => (String::new(), record_meaning(object)),
        };
        let meaning = sentences(&meaning).replace('|', "\\|");
        let _ = writeln!(table, "| {index:04X} | {name} | {default} | {meaning} |");
    }
    table
}

fn is_written(object: &Object) -> bool {
    let of_streams = (index::TPDO..index::TPDO_MAPPING).contains(&object.index);
    !of_streams && object.entries.iter().any(accepts)
}

fn accepts(entry: &Entry) -> bool {
    matches!(entry.role, Role::Setting(_) | Role::Command | Role::Input)
}

fn default(entry: &Entry) -> String {
    match entry.role {
        Role::Setting(_) if entry.unit.is_empty() => number(entry.default),
        Role::Setting(_) => format!("{} {}", number(entry.default), entry.unit),
        _ => entry.unit.to_string(),
    }
}

/// Meaning of an object that is one value.
pub fn variable_meaning(object: &Object, entry: &Entry) -> String {
    [object.doc.as_str(), entry.doc.as_str()]
        .into_iter()
        .filter(|text| !text.is_empty())
        .collect::<Vec<_>>()
        .join("; ")
}

/// Meaning of an object with sub-indices, and of those that take a code or a count.
fn record_meaning(object: &Object) -> Vec<String> {
    let entries = object.entries.iter();
    let explained = entries
        .filter(|entry| accepts(entry) && entry.data_type() != DataType::Real32)
        .filter(|entry| !entry.doc.is_empty())
        .map(|entry| format!("`:{}` {}", entry.subindex, entry.doc));
    [object.doc.to_string()].into_iter().chain(explained).collect()
}

/// Sentences with a capital and a full stop. Parts that begin with a digit or a sub-index keep their first letter.
fn sentences(parts: &[String]) -> String {
    let parts = parts.iter().filter(|part| !part.is_empty());
    let sentence = |part: &String| {
        let mut letters = part.chars();
        let first = letters.next().map(|letter| letter.to_ascii_uppercase().to_string());
        format!("{}{}.", first.unwrap_or_default(), letters.as_str())
    };
    parts.map(sentence).collect::<Vec<_>>().join(" ")
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
    let mut table = String::from("| frame | identifier | every |\n|---|---|---|\n");
    for pdo in Pdo::ALL {
        let (name, base, period) = (pdo.name(), pdo.base(), pdo.default_period_ms());
        let number = pdo as u8 + 1;
        let _ = writeln!(table, "| TPDO{number} {name} | 0x{base:X} + id | {period} ms |");
    }
    table
}

/// Positions of the fields in frames, whose names commas separate.
fn fields(names: &str) -> String {
    let mut table = String::from("| bytes | signal | step | meaning |\n|---|---|---|---|\n");
    for name in names.split(", ") {
        let pdo = Pdo::ALL.into_iter().find(|pdo| pdo.name() == name);
        write_fields(&mut table, pdo.expect("a frame's name"));
    }
    table
}

/// Signals in a row that differ in their names alone share a line.
fn write_fields(table: &mut String, pdo: Pdo) {
    let signals: Vec<_> = pdo.signals().collect();
    let alike = signals.chunk_by(|(before, a), (after, b)| {
        let shared = (before.index, &before.unit, a.length, a.comment);
        shared == (after.index, &after.unit, b.length, b.comment)
    });
    for group in alike {
        let ([(field, signal), ..], [.., (_, last)]) = (group, group) else {
            continue;
        };
        let step = match signal.kind {
            SignalKind::Named(names) if names.len() > 2 => names
                .iter()
                .map(|(code, name)| format!("{code} {name}"))
                .collect::<Vec<_>>()
                .join(", "),
            SignalKind::Named(_) => String::new(),
            SignalKind::Unsigned { .. } | SignalKind::Signed { .. } => field.unit.to_string(),
        };
        let names: Vec<&str> = group.iter().map(|(_, signal)| signal.name).collect();
        let _ = writeln!(
            table,
            "| {} | {} | {step} | {} |",
            place(signal.start, last.start + last.length - signal.start),
            names.join(", "),
            signal.comment,
        );
    }
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
