//! The documents' tables of the boards come from their `pins.toml`, from which this virtual board is wired as well.
//! Their pictures show its wires.

use std::collections::BTreeSet;

use host_tests::committed::{assert_block, workspace};
use toml::Table;
use virtual_board::emulator::wiring::{TABLES, Wiring};

/// Rows of a table of a board, as fields by their names.
struct Pins {
    name: &'static str,
    table: Table,
}

impl Pins {
    fn all() -> impl Iterator<Item = Self> {
        TABLES.into_iter().map(|(name, text)| {
            let table = text.parse().expect("it is TOML");
            Self { name, table }
        })
    }

    fn rows(&self, kind: &str) -> Vec<&Table> {
        let rows = self.table.get(kind).and_then(toml::Value::as_array);
        let rows = rows.into_iter().flatten();
        rows.map(|row| row.as_table().expect("a row")).collect()
    }

    /// Page of the board in the documents.
    fn page(&self) -> String {
        format!("docs/reference/boards/{}.md", self.name)
    }
}

/// Text of a field; empty if the row has none.
fn field<'a>(row: &'a Table, name: &str) -> &'a str {
    row.get(name).and_then(toml::Value::as_str).unwrap_or_default()
}

/// A Markdown table with these columns: heading and field.
fn markdown(columns: &[(&str, &str)], rows: &[&Table]) -> String {
    let mut text = String::new();
    for (heading, _) in columns {
        text += &format!("| {heading} ");
    }
    text += "|\n";
    text += &"|---".repeat(columns.len());
    text += "|\n";
    for row in rows {
        for (_, name) in columns {
            // An empty cell has one space.
            text += &format!("| {} ", field(row, name)).replace("|  ", "| ");
        }
        text += "|\n";
    }
    text
}

/// The page's blocks: wires, other needs of the parts, parts to buy, sources.
fn blocks(pins: &Pins) -> [(&'static str, String); 4] {
    let wires = pins.rows("wire");
    // A board on sale prints labels; of a bare chip the pins of the package count.
    let place = if wires.iter().any(|row| row.contains_key("label")) {
        ("printed", "label")
    } else {
        ("LQFP64", "package")
    };
    let wiring = [
        ("pin", "pin"),
        place,
        ("function", "function"),
        ("goes to", "part"),
        ("there", "to"),
        ("notes", "note"),
    ];
    let other = [("part", "part"), ("pin", "pin"), ("goes to", "to"), ("notes", "note")];
    let needs = [("part", "part"), ("number", "number"), ("property", "property")];
    let sources = pins.table["sources"].as_array().expect("a list");
    let sources = sources.iter().filter_map(toml::Value::as_str);
    [
        ("wires", markdown(&wiring, &wires)),
        ("other-pins", markdown(&other, &pins.rows("other"))),
        ("parts", markdown(&needs, &pins.rows("need"))),
        ("sources", sources.map(|source| format!("* {source}\n")).collect()),
    ]
}

#[test]
fn pages_show_the_tables_of_their_boards() {
    for pins in Pins::all() {
        for (block, content) in blocks(&pins) {
            assert_block(&pins.page(), block, &content);
        }
    }
}

#[test]
fn pictures_show_the_wires_of_their_boards() {
    for pins in Pins::all() {
        let path = workspace().join(format!("docs/reference/boards/{}.svg", pins.name));
        let picture = std::fs::read_to_string(path).expect("a picture");
        // Texts of a row: pin and function, label, end of the wire.
        let texts = picture.split("<line").skip(1).map(|row| {
            let texts = row.split("</text>").take(3);
            texts.filter_map(|text| text.rsplit('>').next()).collect()
        });
        let mut drawn: Vec<Vec<&str>> = texts.collect();
        let mut wires: Vec<[String; 3]> = pins
            .rows("wire")
            .into_iter()
            .map(|wire| {
                let label = [field(wire, "label"), field(wire, "package")];
                let label = label.into_iter().find(|label| !label.is_empty());
                let first = format!("{} ({})", field(wire, "pin"), field(wire, "function"));
                [first, label.unwrap_or_default().into(), field(wire, "to").into()]
            })
            .collect();
        drawn.sort();
        wires.sort();
        assert!(drawn == wires, "{}: {drawn:?} is not {wires:?}", pins.name);
    }
}

#[test]
fn every_folder_of_a_board_has_a_table_here() {
    let folder = workspace().join("firmware/boards/stm32f405/src/wiring");
    let entries = std::fs::read_dir(folder).expect("it can be read");
    let folders = entries.filter_map(|entry| {
        let entry = entry.expect("it can be read");
        let name = entry.file_name().into_string().expect("a plain name");
        entry.path().is_dir().then_some(name)
    });
    let known: BTreeSet<String> = TABLES.iter().map(|(name, _)| (*name).into()).collect();
    assert_eq!(folders.collect::<BTreeSet<_>>(), known);
}

#[test]
fn no_pin_of_the_chip_has_two_wires_or_is_tied() {
    for (pins, wiring) in Pins::all().zip(Wiring::all()) {
        let mut seen = BTreeSet::new();
        let tied: Vec<String> = wiring.tied.iter().map(|pin| pin.name()).collect();
        for wire in pins.rows("wire") {
            for pin in field(wire, "pin").split(", ") {
                let is_supply = matches!(pin, "3V3" | "GND");
                assert!(is_supply || seen.insert(pin), "{}: {pin}", pins.name);
                assert!(!tied.iter().any(|tied| tied == pin), "{}: {pin}", pins.name);
            }
        }
    }
}
