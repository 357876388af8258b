//! Parser of `ros2msg`: the definition of a type, then those of the types in it, each after a line of `=` and
//! `MSG: package/Name`.

use std::collections::HashMap;

use super::{Count, DEEPEST, Definition, Field, Kind, Number, known};

impl Definition {
    /// Parses the definition of a type such as `unitree_go/msg/LowState`; the error is half a sentence.
    pub(super) fn parse(message: &str, text: &str) -> Result<Self, String> {
        let name = bare(message);
        let mut parser =
            Parser { texts: sections(&name, text), places: HashMap::new(), records: Vec::new() };
        let message = parser.record(&name, 0)?;
        Ok(Self { records: parser.records, message })
    }
}

struct Parser<'a> {
    /// Definitions by name.
    texts: HashMap<String, &'a str>,
    /// Index of each record; `None` while it is parsed.
    places: HashMap<String, Option<usize>>,
    records: Vec<Vec<Field>>,
}

impl Parser<'_> {
    /// Index of the record of a type that is `depth` types deep.
    fn record(&mut self, name: &str, depth: usize) -> Result<usize, String> {
        if depth > DEEPEST {
            return Err(format!("its definition has more than {DEEPEST} types within each other"));
        }
        match self.places.get(name) {
            Some(Some(place)) => return Ok(*place),
            Some(None) => return Err(format!("its definition has {name} within itself")),
            None => {}
        }
        let in_bag = self.texts.get(name).copied();
        let text = in_bag.or_else(|| known::text(&name.replacen('/', "/msg/", 1)));
        let text = text.ok_or_else(|| format!("its definition lacks {name}"))?;
        self.places.insert(name.to_owned(), None);
        let package = name.split('/').next().unwrap_or_default();
        let mut fields = Vec::new();
        for line in text.lines() {
            fields.extend(self.field(line, package, depth + 1)?);
        }
        self.records.push(fields);
        let place = self.records.len() - 1;
        self.places.insert(name.to_owned(), Some(place));
        Ok(place)
    }

    /// Field of a line; `None` for a constant and for a line without a field.
    fn field(&mut self, line: &str, package: &str, depth: usize) -> Result<Option<Field>, String> {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            return Ok(None);
        }
        let unreadable = || format!("its definition has a line that is not a field: {line:?}");
        let (of_type, rest) = line.split_once(char::is_whitespace).ok_or_else(unreadable)?;
        let rest = rest.trim_start();
        let end = rest.find(|letter: char| letter.is_whitespace() || letter == '=');
        let (name, after) = rest.split_at(end.unwrap_or(rest.len()));
        if after.trim_start().starts_with('=') {
            return Ok(None);
        }
        let (base, count) = match of_type.split_once('[') {
            None => (of_type, Count::One),
            Some((base, dimension)) => {
                let dimension = dimension.strip_suffix(']').ok_or_else(unreadable)?;
                let count = if dimension.is_empty() || dimension.starts_with("<=") {
                    Count::Sequence
                } else {
                    Count::Fixed(dimension.parse().map_err(|_| unreadable())?)
                };
                (base, count)
            }
        };
        let base = base.split("<=").next().unwrap_or_default();
        let kind = match (number(base), base) {
            (Some(number), _) => Kind::Number(number),
            (None, "string") => Kind::Text,
            (None, "wstring") => Kind::WideText,
            (None, "Header") => Kind::Record(self.record("std_msgs/Header", depth)?),
            (None, base) if base.contains('/') => Kind::Record(self.record(&bare(base), depth)?),
            (None, base) => Kind::Record(self.record(&format!("{package}/{base}"), depth)?),
        };
        let name = name.to_owned();
        Ok(Some(Field { name, kind, count }))
    }
}

/// Definitions of a text by the names of their types; the first is that of `message`.
fn sections<'a>(message: &str, text: &'a str) -> HashMap<String, &'a str> {
    let mut name = message.to_owned();
    let mut sections = HashMap::new();
    let (mut begin, mut at) = (0, 0);
    let mut lines = text.split_inclusive('\n').peekable();
    while let Some(line) = lines.next() {
        let start = at;
        at += line.len();
        let is_rule = line.starts_with("===");
        let header = lines.peek().and_then(|next| next.trim().strip_prefix("MSG:"));
        if let (true, Some(next)) = (is_rule, header) {
            sections.entry(name).or_insert(&text[begin..start]);
            name = bare(next.trim());
            at += lines.next().map_or(0, str::len);
            begin = at;
        }
    }
    sections.entry(name).or_insert(&text[begin..]);
    sections
}

/// Name of a type without `msg`: `std_msgs/Header`.
fn bare(name: &str) -> String {
    name.replacen("/msg/", "/", 1)
}

fn number(name: &str) -> Option<Number> {
    Some(match name {
        "bool" => Number::Bool,
        "byte" | "char" | "uint8" => Number::U8,
        "int8" => Number::I8,
        "uint16" => Number::U16,
        "int16" => Number::I16,
        "uint32" => Number::U32,
        "int32" => Number::I32,
        "uint64" => Number::U64,
        "int64" => Number::I64,
        "float32" => Number::F32,
        "float64" => Number::F64,
        _ => return None,
    })
}
