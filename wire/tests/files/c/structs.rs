//! Structures in C, and the functions that read them from bytes.

use std::fmt::Write;

use super::comment;

/// Type of a member.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Type {
    Bool,
    U8,
    I16,
    U32,
    U64,
    Float,
    /// One of `enums`.
    Enum(&'static str),
    /// The bits of a byte, as one of [`super::frames::bytes`].
    Bits(&'static str),
}

impl Type {
    fn in_c(self) -> String {
        match self {
            Self::Bool => "bool".into(),
            Self::U8 => "uint8_t".into(),
            Self::I16 => "int16_t".into(),
            Self::U32 => "uint32_t".into(),
            Self::U64 => "uint64_t".into(),
            Self::Float => "float".into(),
            Self::Enum(name) => format!("enum footfall_{name}"),
            Self::Bits(name) => format!("struct footfall_{name}"),
        }
    }
}

/// Member of a structure.
#[derive(Clone, Debug)]
pub struct Member {
    pub name: String,
    pub kind: Type,
    pub about: String,
    /// Expression in C for its value, of `data` or, in a byte, of `bits`.
    pub value: String,
    /// Expression in C that must hold, otherwise the bytes are invalid.
    pub condition: Option<String>,
}

/// Whether bytes may be invalid for a structure: CAN frames are valid whatever their eight bytes are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refusal {
    Never,
    /// If the payload has a different number of bytes, or a value is invalid.
    UnlessLength(usize),
}

/// Structure.
#[derive(Clone, Debug)]
pub struct Struct {
    pub name: String,
    pub about: String,
    pub members: Vec<Member>,
    pub refusal: Refusal,
}

impl Struct {
    pub fn declare(&self) -> String {
        let Self { name, about, .. } = self;
        let mut code = format!("{}struct footfall_{name} {{\n", comment("", about));
        for member in &self.members {
            code += &comment("    ", &member.about);
            let _ = writeln!(code, "    {} {};", member.kind.in_c(), member.name);
        }
        code + "};\n\n"
    }

    /// Function that takes the structure out of a byte.
    pub fn define_bits(&self) -> String {
        let Self { name, members, .. } = self;
        let mut code = format!(
            "static struct footfall_{name} {name}_bits(uint32_t bits)\n{{\n    struct footfall_{name} {name};\n"
        );
        for member in members {
            let _ = writeln!(code, "    {name}.{} = {};", member.name, member.value);
        }
        let _ = write!(code, "    return {name};\n}}\n\n");
        code
    }

    /// Function that reads the structure from bytes.
    pub fn define_read(&self) -> String {
        let Self { name, members, .. } = self;
        let values: String = members
            .iter()
            .map(|member| format!("    out->{} = {};\n", member.name, member.value))
            .collect();
        let Refusal::UnlessLength(length) = self.refusal else {
            return format!(
                "static void read_{name}(const uint8_t *data, struct footfall_{name} *out)\n{{\n{values}}}\n\n"
            );
        };
        let conditions: String = members
            .iter()
            .filter_map(|member| member.condition.as_ref())
            .map(|condition| format!("    if (!({condition})) {{\n        return false;\n    }}\n"))
            .collect();
        let indent = " ".repeat(format!("static bool read_{name}(").len());
        format!(
            "static bool read_{name}(const uint8_t *data, size_t length,\n{indent}struct footfall_{name} *out)\n{{\n    \
             if (length != {length}u) {{\n        return false;\n    }}\n{conditions}{values}    return true;\n}}\n\n"
        )
    }
}
