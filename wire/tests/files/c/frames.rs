//! CAN frames in C: a member for each signal, in SI units.

use std::fmt::Write;

use wire::Pdo;
use wire::pdo::{Field, Kind, Signal};

use super::snake;
use super::structs::{Member, Refusal, Struct, Type};

/// Fields of one byte whose bits are signals of their own: name, type in C, description.
const BYTES: [(Pdo, &str, &str, &str); 2] = [
    (
        Pdo::Contact,
        "Status",
        "status",
        "What the probability rests on.",
    ),
    (
        Pdo::Health,
        "Flags",
        "flags",
        "Reasons of the estimator to doubt.",
    ),
];

/// Structures of those bytes.
pub fn bytes() -> Vec<Struct> {
    BYTES
        .map(|(pdo, field, name, about)| {
            let fields = pdo.fields();
            let field = fields.iter().find(|row| row.name == field);
            let mut start = 0;
            let members = field.expect("a field of the frame").signals.iter();
            let members = members
                .map(|signal| {
                    let member = bits(signal, start);
                    start += signal.length;
                    member
                })
                .collect();
            Struct {
                name: name.to_owned(),
                about: about.to_owned(),
                members,
                refusal: Refusal::Never,
            }
        })
        .to_vec()
}

/// Signal in a byte, from its bit `start` on.
fn bits(signal: &Signal, start: u8) -> Member {
    let Kind::Named(names) = signal.kind else {
        panic!("{} is a quantity in a byte of others", signal.name);
    };
    let shifted = match start {
        0 => "bits".to_owned(),
        start => format!("bits >> {start}"),
    };
    let code = format!("({shifted} & 0x{:02X}u)", (1_u32 << signal.length) - 1);
    let (kind, value) = match signal.name {
        "State" => (
            Type::Enum("state"),
            format!(
                "is_state{code} ? (enum footfall_state){code}\n\
                 \x20                                          : FOOTFALL_STATE_UNKNOWN"
            ),
        ),
        "Decision" => (
            Type::Enum("decision"),
            format!("(enum footfall_decision){code}"),
        ),
        name => {
            let flag = [(0, "no"), (1, "yes")];
            assert_eq!(names, flag, "{name} needs an enumeration in C");
            (Type::Bool, format!("{code} != 0u"))
        }
    };
    Member {
        name: snake(signal.name),
        kind,
        about: signal.comment.to_owned(),
        value,
        condition: None,
    }
}

/// Structure of each frame.
pub fn structs() -> Vec<Struct> {
    Pdo::ALL
        .map(|pdo| {
            let mut members: Vec<Member> = Vec::new();
            for (field, signal) in pdo.signals() {
                match BYTES
                    .iter()
                    .find(|byte| (byte.0, byte.1) == (pdo, field.name))
                {
                    Some((_, _, name, about)) => {
                        if members.last().is_none_or(|last| last.name != *name) {
                            members.push(byte(&field, name, about, signal.start));
                        }
                    }
                    None => members.push(member(&signal)),
                }
            }
            Struct {
                name: snake(pdo.name()),
                about: format!("TPDO{}: {}", pdo as u8 + 1, pdo.about()),
                members,
                refusal: Refusal::Never,
            }
        })
        .to_vec()
}

fn byte(field: &Field, name: &'static str, about: &str, start: u8) -> Member {
    assert_eq!(field.zero.data_type().size(), Some(1), "{name}");
    // A status has rules beyond its bits.
    let read = if name == "status" {
        "status_of"
    } else {
        "flags_bits"
    };
    Member {
        name: name.to_owned(),
        kind: Type::Bits(name),
        about: about.to_owned(),
        value: format!("{read}(data[{}])", start / 8),
        condition: None,
    }
}

/// Signal of whole bytes.
fn member(signal: &Signal) -> Member {
    let name = snake(signal.name);
    assert_eq!(signal.start % 8, 0, "{name}");
    let byte = signal.start / 8;
    let code = match signal.length {
        8 => format!("data[{byte}]"),
        16 => format!("u16_at(data + {byte})"),
        32 => format!("u32_at(data + {byte})"),
        bits => panic!("{name} has {bits} bits"),
    };
    let (suffix, kind, value) = match signal.kind {
        Kind::Signed { factor } => (
            unit(signal.unit),
            Type::Float,
            quantity(signal.start / 8, factor),
        ),
        Kind::Unsigned { factor } if signal.unit == "ms" => {
            // Exact in whole microseconds.
            let micros = (factor * 1000.0).round();
            assert!((factor * 1000.0 - micros).abs() < 1.0e-9, "{name}");
            let (kind, of) = if signal.length == 32 {
                (Type::U64, "(uint64_t)")
            } else {
                (Type::U32, "(uint32_t)")
            };
            ("_us", kind, format!("{of}{code} * {micros}u"))
        }
        Kind::Unsigned { factor } if signal.unit.is_empty() && factor < 1.0 => {
            let steps = (1.0 / factor).round();
            assert!((1.0 / factor - steps).abs() < 1.0e-9, "{name}");
            ("", Type::Float, format!("(float){code} / {steps:.1}f"))
        }
        Kind::Unsigned { .. } => {
            assert_eq!((signal.factor(), signal.length), (1.0, 8), "{name}");
            (unit(signal.unit), Type::U8, code)
        }
        Kind::Named(_) => panic!("{name} needs an enumeration in C"),
    };
    Member {
        name: format!("{name}{suffix}"),
        kind,
        about: signal.comment.to_owned(),
        value,
        condition: None,
    }
}

/// A 16-bit code at this byte times a step, which the decoders treat as an f32.
pub fn quantity(byte: impl Into<usize>, step: f64) -> String {
    format!(
        "quantity(i16_at(data + {}), {:?}f)",
        byte.into(),
        step as f32
    )
}

/// Suffix of a member's name for its unit.
fn unit(unit: &str) -> &'static str {
    match unit {
        "" => "",
        "m/s^2" => "_m_s2",
        "rad/s" => "_rad_s",
        "degC" => "_deg_c",
        other => panic!("no name in C for {other}"),
    }
}

/// Frames as members of a union.
pub fn members() -> String {
    Pdo::ALL
        .map(|pdo| {
            let name = snake(pdo.name());
            format!("        struct footfall_{name} {name};\n")
        })
        .concat()
}

/// Frames as cases of their function codes.
pub fn cases() -> String {
    let mut code = String::new();
    for pdo in Pdo::ALL {
        let name = snake(pdo.name());
        let _ = write!(
            code,
            "    case 0x{:03X}u:
        if (length != 8u) {{
            return FOOTFALL_WRONG_LENGTH;
        }}
        out->kind = FOOTFALL_FRAME_KIND_{};
        read_{name}(data, &out->content.{name});
        return FOOTFALL_OK;
",
            pdo.base(),
            name.to_ascii_uppercase()
        );
    }
    code
}
