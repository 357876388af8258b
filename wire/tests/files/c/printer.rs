//! `tests/c/print.c`: prints every member of every structure.

use wire::Pdo;

use super::structs::{Struct, Type};
use super::{all_structs, fill, messages, snake};

const PRINT: &str = include_str!("print.c.in");

pub fn generate() -> String {
    let frames = Pdo::ALL
        .map(|pdo| snake(pdo.name()))
        .map(|name| case("FRAME", "frame", &name, &name));
    let messages = messages::structs();
    let messages = messages.iter().map(|of| {
        let member = messages::member(of);
        case("MESSAGE", "message", member, &of.name)
    });
    fill(
        PRINT,
        &[
            ("functions", all_structs().iter().map(function).collect()),
            ("frames", frames.concat()),
            ("messages", messages.collect()),
        ],
    )
}

fn case(kind: &str, from: &str, member: &str, name: &str) -> String {
    let constant = member.to_ascii_uppercase();
    format!(
        "    case FOOTFALL_{kind}_KIND_{constant}:\n        print_{name}(\"\", &{from}->content.{member});\n        break;\n"
    )
}

fn function(of: &Struct) -> String {
    let prints: String = of
        .members
        .iter()
        .map(|member| {
            let name = &member.name;
            let call = match member.kind {
                Type::Bool | Type::U8 | Type::U32 | Type::U64 => {
                    format!("print_unsigned(prefix, \"{name}\", of->{name})")
                }
                Type::I16 => format!("print_integer(prefix, \"{name}\", of->{name})"),
                Type::Float => format!("print_float(prefix, \"{name}\", of->{name})"),
                Type::Enum(kind) => format!(
                    "print_enum(prefix, \"{name}\", of->{name}, footfall_{kind}_name(of->{name}))"
                ),
                Type::Bits(kind) => format!("print_{kind}(\"{name}.\", &of->{name})"),
            };
            format!("    {call};\n")
        })
        .collect();
    let name = &of.name;
    format!(
        "static void print_{name}(const char *prefix, const struct footfall_{name} *of)\n{{\n{prints}}}\n\n"
    )
}
