//! `c/footfall.h` and `c/footfall.c`: a decoder for programs in C and C++. The tables fill in
//! `footfall.h.in` and `footfall.c.in`, which contain the rest: COBS, CRC, the rules of a status.
//!
//! | what | file |
//! |---|---|
//! | enumerations, their names and which codes they have | `enums` |
//! | structures, and the functions that read them from bytes | `structs` |
//! | CAN frames as such structures, from the signals | `frames` |
//! | messages of the serial line as such structures | `messages` |
//! | `tests/c/print.c`, which prints every member for the tests | `printer` |

mod enums;
mod frames;
mod messages;
pub mod printer;
mod structs;

use wire::foot::cob_id;
use wire::pdo::Load;
use wire::uart::{MAX_FRAME, MAX_LOG, MAX_VALUE, VERSION};

use enums::Enum;
use structs::Struct;

const HEADER: &str = include_str!("footfall.h.in");
const SOURCE: &str = include_str!("footfall.c.in");

/// Bytes added to a frame by COBS and the zeros at both ends.
const CODING: usize = 3;

pub fn header() -> String {
    let structs: String = all_structs().iter().map(Struct::declare).collect();
    let enums: String = enums::all().iter().map(Enum::declare).collect();
    fill(
        HEADER,
        &[
            ("enums", enums),
            ("structs", structs),
            ("frame_members", frames::members()),
            ("message_members", messages::members()),
            ("max_value", MAX_VALUE.to_string()),
            ("max_log", MAX_LOG.to_string()),
            ("max_decoded", (MAX_FRAME - CODING).to_string()),
        ],
    )
}

pub fn source() -> String {
    let id = |base: u16| format!("0x{base:03X}");
    let read = frames::structs().into_iter().chain(messages::structs());
    fill(
        SOURCE,
        &[
            (
                "enum_functions",
                enums::all().iter().map(Enum::define).collect(),
            ),
            ("fault_functions", enums::fault_functions()),
            (
                "bit_functions",
                frames::bytes().iter().map(Struct::define_bits).collect(),
            ),
            (
                "read_functions",
                read.map(|read| read.define_read()).collect(),
            ),
            ("frame_cases", frames::cases()),
            ("emergency", id(cob_id::EMERGENCY)),
            ("heartbeat", id(cob_id::HEARTBEAT)),
            ("load", id(Load::BASE)),
            ("version", VERSION.to_string()),
        ],
    )
}

/// All structures generated from tables, members first.
fn all_structs() -> Vec<Struct> {
    [frames::bytes(), frames::structs(), messages::structs()].concat()
}

/// Replaces every `@name@` in the template; one that is alone in its line, with the end of the line.
fn fill(template: &str, parts: &[(&str, String)]) -> String {
    let mut text = template.to_owned();
    for (name, part) in parts {
        let mark = format!("@{name}@");
        assert!(text.contains(&mark), "no {mark} in the template");
        text = text.replace(&format!("{mark}\n"), part);
        text = text.replace(&mark, part);
    }
    text
}

/// `StableContactProbability` as `stable_contact_probability`.
fn snake(name: &str) -> String {
    let mut snake = String::new();
    for character in name.chars() {
        if character.is_ascii_uppercase() && !snake.is_empty() {
            snake.push('_');
        }
        snake.push(character.to_ascii_lowercase());
    }
    snake
}

/// Formats a comment in lines of at most 100 characters; empty if there is no text.
fn comment(indent: &str, text: &str) -> String {
    if text.is_empty() {
        return String::new();
    }
    let mut comment = format!("{indent}/*");
    let mut column = comment.len();
    for word in text.split_whitespace() {
        // The last word is followed by the end.
        if column + 1 + word.len() + " */".len() > 100 {
            comment += &format!("\n{indent} *");
            column = indent.len() + " *".len();
        }
        comment += &format!(" {word}");
        column += 1 + word.len();
    }
    comment + " */\n"
}
