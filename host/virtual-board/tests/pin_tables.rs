//! Tables and pictures of the boards in the documents come from their `pins.toml`, by which this virtual board is
//! wired too.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use host_tests::committed::{assert_block, assert_current, workspace};
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

    fn title(&self) -> &str {
        self.table["title"].as_str().expect("a text")
    }

    fn rows(&self, kind: &str) -> Vec<&Table> {
        let rows = self.table.get(kind).and_then(toml::Value::as_array);
        let rows = rows.into_iter().flatten();
        rows.map(|row| row.as_table().expect("a row")).collect()
    }

    /// Page of the board in the documents.
    fn page(&self) -> String {
        format!("docs/boards/{}.md", self.name)
    }
}

/// Text of a field; empty if the row has none.
fn field<'a>(row: &'a Table, name: &str) -> &'a str {
    row.get(name)
        .and_then(toml::Value::as_str)
        .unwrap_or_default()
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

/// The page's blocks: wires, what else the parts need, what to buy, sources.
fn blocks(pins: &Pins) -> [(&'static str, String); 4] {
    let wires = pins.rows("wire");
    // A board on sale prints labels; of a bare chip the pins of the package count.
    let place = match wires.iter().any(|row| row.contains_key("label")) {
        true => ("printed", "label"),
        false => ("LQFP64", "package"),
    };
    let wiring = [
        ("pin", "pin"),
        place,
        ("function", "function"),
        ("goes to", "part"),
        ("there", "to"),
        ("notes", "note"),
    ];
    let other = [
        ("part", "part"),
        ("pin", "pin"),
        ("goes to", "to"),
        ("notes", "note"),
    ];
    let needs = [
        ("part", "part"),
        ("number", "number"),
        ("property", "property"),
    ];
    let sources = pins.table["sources"].as_array().expect("a list");
    let sources = sources.iter().filter_map(toml::Value::as_str);
    [
        ("wires", markdown(&wiring, &wires)),
        ("other-pins", markdown(&other, &pins.rows("other"))),
        ("parts", markdown(&needs, &pins.rows("need"))),
        (
            "sources",
            sources.map(|source| format!("* {source}\n")).collect(),
        ),
    ]
}

const ROW: usize = 24;
const TOP: usize = 70;
const GAP: usize = 22;
/// Left and right edge of the chip's box and of those of the other parts.
const CHIP: [usize; 2] = [20, 330];
const PARTS: [usize; 2] = [500, 800];

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

/// Colour of a wire by its function.
fn colour(function: &str) -> &'static str {
    match function {
        "supply" | "core supply" => "#c0392b",
        "ground" => "#222222",
        name if name.starts_with("SPI") || name.starts_with("TIM") || name == "output" => "#1f5fa8",
        name if name.starts_with("CAN") => "#2e8b57",
        name if name.starts_with("USART") => "#b8860b",
        _ => "#777777",
    }
}

/// Picture of the wiring: a row a wire, grouped by the part at its other end.
fn picture(pins: &Pins) -> String {
    let wires = pins.rows("wire");
    let mut parts: Vec<&str> = Vec::new();
    for wire in &wires {
        let part = field(wire, "part");
        if !parts.contains(&part) {
            parts.push(part);
        }
    }
    let mut body = String::new();
    let mut y = TOP;
    for part in parts {
        let rows: Vec<_> = wires.iter().filter(|w| field(w, "part") == part).collect();
        let height = rows.len() * ROW + ROW;
        let [left, right] = PARTS;
        let _ = writeln!(
            body,
            "<rect x=\"{left}\" y=\"{y}\" width=\"{}\" height=\"{height}\" rx=\"6\" fill=\"#f4f4f4\" stroke=\"#888\"/>\n\
             <text x=\"{}\" y=\"{}\" font-weight=\"bold\">{}</text>",
            right - left,
            left + 10,
            y + 17,
            escaped(part)
        );
        y += ROW;
        for wire in rows {
            let middle = y + ROW / 2;
            let label = match field(wire, "label") {
                "" => field(wire, "package").to_owned(),
                label => label.to_owned(),
            };
            let function = field(wire, "function");
            let _ = writeln!(
                body,
                "<line x1=\"{}\" y1=\"{middle}\" x2=\"{left}\" y2=\"{middle}\" stroke=\"{}\" stroke-width=\"2\"/>\n\
                 <text x=\"{}\" y=\"{}\">{}</text>\n\
                 <text x=\"{}\" y=\"{}\" text-anchor=\"end\" font-weight=\"bold\">{}</text>\n\
                 <text x=\"{}\" y=\"{}\">{}</text>",
                CHIP[1],
                colour(function),
                CHIP[0] + 10,
                middle + 4,
                escaped(&format!("{} ({function})", field(wire, "pin"))),
                CHIP[1] - 10,
                middle + 4,
                escaped(&label),
                left + 10,
                middle + 4,
                escaped(field(wire, "to"))
            );
            y += ROW;
        }
        y += GAP;
    }
    let height = y - TOP;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"820\" height=\"{}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"20\" y=\"28\" font-size=\"17\" font-weight=\"bold\">{}</text>\n\
         <text x=\"20\" y=\"50\">A row is a wire. Left: pin, function, and its number or print in bold. Not tried on silicon.</text>\n\
         <rect x=\"{}\" y=\"{TOP}\" width=\"{}\" height=\"{}\" rx=\"6\" fill=\"#eaf1fa\" stroke=\"#888\"/>\n{body}</svg>\n",
        y + 10,
        escaped(pins.title()),
        CHIP[0],
        CHIP[1] - CHIP[0],
        height - GAP,
    )
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
        let path = workspace().join(format!("docs/boards/{}.svg", pins.name));
        assert_current(&path, &picture(&pins));
    }
}

#[test]
fn every_folder_of_a_board_has_a_table_here() {
    let folder = workspace().join("firmware/src/board");
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

#[test]
fn every_row_has_the_fields_of_its_columns() {
    for pins in Pins::all() {
        for (kind, needed) in [
            ("wire", &["pin", "function", "part", "to", "note"][..]),
            ("other", &["part", "pin", "to", "note"]),
            ("need", &["part", "number", "property"]),
        ] {
            let rows = pins.rows(kind);
            assert!(!rows.is_empty(), "{}: no {kind}", pins.name);
            for row in rows {
                for name in needed {
                    assert!(row.contains_key(*name), "{}: {row:?}: {name}", pins.name);
                }
            }
        }
    }
}
