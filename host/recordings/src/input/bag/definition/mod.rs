//! Layout of the messages of a type, from its definition in the bag, and the numbers in a message.
//!
//! | part | file |
//! |---|---|
//! | parsing a definition (`ros2msg`) | `definition/parse` |
//! | names of numbers and paths to them | `definition/path` |
//! | numbers of a message in CDR | `definition/walk` |
//! | definitions of types that bags often lack | `definition/known` |
//!
//! Sources: <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html>; the concatenation of definitions
//! is that of <https://mcap.dev/spec/registry#ros2msg>.

mod known;
mod parse;
mod path;
mod walk;

pub(super) use path::{Path, within};

use super::storage::Channel;

/// Most types within each other.
const DEEPEST: usize = 32;

/// Largest number of fields that are looked at in a definition or in a message, with those of nested types: a definition
/// may name each of its types twice.
const MOST_STEPS: usize = 4_000_000;

/// Layout of a type and of all types in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Definition {
    /// Fields of each type, in order.
    records: Vec<Vec<Field>>,
    /// Index of the type itself.
    message: usize,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Field {
    name: String,
    kind: Kind,
    count: Count,
}

/// Type of a field, or of the elements of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Number(Number),
    Text,
    /// `wstring`.
    WideText,
    /// Index of a record.
    Record(usize),
}

/// Number of elements of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Count {
    /// A single value.
    One,
    Fixed(u32),
    /// The message has the number.
    Sequence,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    Bool,
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
}

impl Number {
    /// Size, which is also its alignment, bytes.
    const fn size(self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            Self::U32 | Self::I32 | Self::F32 => 4,
            Self::U64 | Self::I64 | Self::F64 => 8,
        }
    }
}

impl Definition {
    /// Layout of the messages of a channel.
    ///
    /// # Errors
    /// Half a sentence on what the definition lacks.
    pub(super) fn of_channel(channel: &Channel) -> Result<Self, String> {
        let schema = channel.schema.as_deref();
        let text = schema.filter(|schema| schema.encoding == "ros2msg");
        let text = text.map(|schema| String::from_utf8_lossy(&schema.text));
        match (Self::of(&channel.message, text.as_deref()), schema) {
            (Err(_), Some(schema)) if text.is_none() && !schema.encoding.is_empty() => {
                Err(format!("its definition is in {}, and only ros2msg is read", schema.encoding))
            }
            (definition, _) => definition,
        }
    }

    /// Layout of a type: from `text`, its definition in the bag, or from the known ones.
    ///
    /// # Errors
    /// Half a sentence on what the definition lacks.
    pub(super) fn of(message: &str, text: Option<&str>) -> Result<Self, String> {
        match text.or_else(|| known::text(message)) {
            Some(text) => Self::parse(message, text),
            None => Err("its definition is not in the bag".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests;
