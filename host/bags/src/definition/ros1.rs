//! Converts messages of ROS 1 to messages of ROS 2, so that all other code reads only messages of ROS 2.
//!
//! | | ROS 1 | ROS 2 |
//! |---|---|---|
//! | name of a type | `sensor_msgs/Imu` | `sensor_msgs/msg/Imu` |
//! | definition | `ros1msg`: types `time`, `duration`, `Header`; `byte` is signed | `ros2msg` |
//! | header | begins with `uint32 seq` | stamp and frame alone |
//! | message | little endian, without alignment; texts end without a zero | CDR |
//!
//! Sources: <http://wiki.ros.org/msg>, <https://mcap.dev/spec/registry#ros1>.

use std::collections::HashMap;
use std::fmt::Write;
use std::sync::Arc;

use crate::definition::{Count, Definition, Kind, MOST_STEPS, Parser, bare, known_text, sections};
use crate::messages::{Channel, ENCODING, Schema};

/// Type whose messages lack their first field in ROS 2.
const HEADER: &str = "std_msgs/Header";

/// The field that they lack.
const SEQ: (&str, &str) = ("uint32", "seq");

/// Types of fields that have another name in ROS 2.
const RENAMED: [(&str, &str); 4] = [
    ("time", "builtin_interfaces/Time"),
    ("duration", "builtin_interfaces/Duration"),
    ("byte", "int8"),
    ("Header", HEADER),
];

/// Converts the messages of a type.
pub(crate) struct Converter {
    /// Layout in ROS 2.
    definition: Definition,
    /// Index of the record that has the number of the message before its fields in ROS 1.
    numbered: Option<usize>,
}

/// Returns a channel as one of ROS 2, and how to convert its messages if it is one of ROS 1. Without a valid definition
/// it stays as it is, in `ros1`.
pub(crate) fn as_ros2(channel: Channel) -> (Channel, Option<Converter>) {
    match converted(&channel) {
        Some((converted, converter)) => (converted, Some(converter)),
        None => (channel, None),
    }
}

fn converted(channel: &Channel) -> Option<(Channel, Converter)> {
    let schema = channel.schema.as_deref().filter(|_| channel.encoding == "ros1")?;
    let name = bare(&channel.message);
    let (package, short_name) = name.split_once('/')?;
    let text = String::from_utf8_lossy(&schema.text);
    if text.trim().is_empty() {
        return None;
    }
    let is_numbered = is_seq_first(sections(&name, &text).get(HEADER).copied());
    let text = definition_in_ros2(&name, &text);
    let mut parser =
        Parser { texts: sections(&name, &text), indices: HashMap::new(), records: Vec::new() };
    let message = parser.record(&name, 0).ok()?;
    let header = parser.indices.get(HEADER).copied().flatten();
    let definition = Definition { records: parser.records, message };
    let schema = Schema { encoding: "ros2msg".to_owned(), text: text.into_bytes() };
    let converted = Channel {
        topic: channel.topic.clone(),
        message: format!("{package}/msg/{short_name}"),
        encoding: "cdr".to_owned(),
        schema: Some(Arc::new(schema)),
        metadata: channel.metadata.clone(),
    };
    Some((converted, Converter { definition, numbered: header.filter(|_| is_numbered) }))
}

/// Returns whether a header begins with the number of the message, by the definition of the header; true without a
/// definition.
fn is_seq_first(header: Option<&str>) -> bool {
    let Some(header) = header else {
        return true;
    };
    let mut fields = header.lines().map(without_comment).filter(|line| !line.is_empty());
    fields
        .next()
        .and_then(|line| line.split_once(char::is_whitespace))
        .is_some_and(|(type_name, rest)| (type_name, rest.trim_start()) == SEQ)
}

fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or_default().trim()
}

/// Converts a definition of ROS 1 to one of ROS 2. Constants of type string are left out, because ROS 2 quotes their
/// values.
fn definition_in_ros2(name: &str, text: &str) -> String {
    let mut section = name.to_owned();
    let mut named = vec![section.clone()];
    let mut lines = String::new();
    for line in text.lines() {
        if let Some(next) = line.trim().strip_prefix("MSG:") {
            section = bare(next.trim());
            named.push(section.clone());
        } else if let Some((type_name, rest)) =
            without_comment(line).split_once(char::is_whitespace)
        {
            let is_number = section == HEADER && (type_name, rest.trim_start()) == SEQ;
            if is_number || (type_name == "string" && rest.contains('=')) {
                continue;
            }
            let (base, dimension) =
                type_name.split_at(type_name.find('[').unwrap_or(type_name.len()));
            let renamed = RENAMED.iter().find(|(old, _)| *old == base).map(|(_, new)| *new);
            let comment = line.find('#').map_or("", |at| &line[at..]);
            let gap = if comment.is_empty() { "" } else { "  " };
            let base = renamed.unwrap_or(base);
            let _ = writeln!(lines, "{base}{dimension} {}{gap}{comment}", rest.trim_start());
            continue;
        }
        lines.push_str(line);
        lines.push('\n');
    }
    // Readers of other programs need the definitions of all types.
    for part in [HEADER, RENAMED[0].1, RENAMED[1].1] {
        let known = known_text(&part.replacen('/', "/msg/", 1)).unwrap_or_default();
        let is_used = lines.lines().any(|line| {
            let base = line.split([' ', '[']).next();
            base == Some(part)
        });
        if is_used && !named.iter().any(|name| name == part) {
            let _ = writeln!(lines, "{}\nMSG: {part}\n{known}", "=".repeat(80));
        }
    }
    lines
}

impl Converter {
    /// Returns a message in CDR. If the message is shorter than its type, the result is shorter as well. Bytes after
    /// the end of its type stay at the end. The reader of the result then finds the error.
    pub(crate) fn cdr(&self, message: &[u8]) -> Vec<u8> {
        let mut conversion = Conversion {
            converter: self,
            rest: message,
            cdr: Vec::with_capacity(message.len() + message.len() / 8 + 16),
            steps: 0,
        };
        conversion.cdr.extend_from_slice(&[0, 1, 0, 0]);
        if conversion.record(self.definition.message).is_some() {
            let rest = conversion.rest;
            conversion.cdr.extend_from_slice(rest);
        }
        conversion.cdr
    }
}

struct Conversion<'a> {
    converter: &'a Converter,
    /// Bytes not yet converted.
    rest: &'a [u8],
    cdr: Vec<u8>,
    steps: usize,
}

impl<'a> Conversion<'a> {
    /// Converts a record; `None` if the message ends within it.
    fn record(&mut self, record: usize) -> Option<()> {
        let fields = &self.converter.definition.records[record];
        self.step(fields.len().max(1))?;
        if self.converter.numbered == Some(record) {
            self.take(4)?;
        }
        if fields.is_empty() {
            // An empty record has a byte in CDR.
            self.cdr.push(0);
        }
        for field in fields {
            let elements = match field.count {
                Count::One => 1,
                Count::Fixed(elements) => elements,
                Count::Sequence => {
                    let elements = self.length()?;
                    self.put_length(elements);
                    elements
                }
            };
            match field.kind {
                Kind::Number(number) => {
                    let bytes = self.take(number.size().checked_mul(elements as usize)?)?;
                    if elements > 0 {
                        self.align(number.size());
                    }
                    self.cdr.extend_from_slice(bytes);
                }
                Kind::Text => {
                    for _ in 0..elements {
                        self.step(1)?;
                        let length = self.length()?;
                        let text = self.take(length as usize)?;
                        self.put_length(length.checked_add(1)?);
                        self.cdr.extend_from_slice(text);
                        self.cdr.push(0);
                    }
                }
                // ROS 1 has none.
                Kind::WideText => return None,
                Kind::Record(record) => {
                    for _ in 0..elements {
                        self.record(record)?;
                    }
                }
            }
        }
        Some(())
    }

    /// Counts the fields; `None` if there are too many.
    fn step(&mut self, fields: usize) -> Option<()> {
        self.steps += fields;
        (self.steps <= MOST_STEPS).then_some(())
    }

    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        Some(taken)
    }

    /// Number of elements of a sequence, or of bytes of a text.
    fn length(&mut self) -> Option<u32> {
        let bytes = self.take(4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?))
    }

    fn put_length(&mut self, length: u32) {
        self.align(4);
        self.cdr.extend_from_slice(&length.to_le_bytes());
    }

    /// Fills up to a multiple of a size, from the end of the encoding.
    fn align(&mut self, size: usize) {
        let length = (self.cdr.len() - ENCODING).next_multiple_of(size);
        self.cdr.resize(ENCODING + length, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    const DEFINITION: &str = "# A state.
Header header
string NAME=of # all
byte LOWEST=-3
time[2] times  # of both
byte[] offsets
legs/Empty nothing
string[] names
float64 last
================================================================================
MSG: std_msgs/Header
# Number of the message.
uint32 seq
time stamp
string frame_id
================================================================================
MSG: legs/Empty
";

    fn channel(encoding: &str, definition: &str) -> Channel {
        let schema = Schema { encoding: "ros1msg".to_owned(), text: definition.into() };
        Channel {
            topic: "/state".to_owned(),
            message: "legs/State".to_owned(),
            encoding: encoding.to_owned(),
            schema: Some(schema.into()),
            metadata: BTreeMap::new(),
        }
    }

    /// A message of [`DEFINITION`].
    fn message() -> Vec<u8> {
        let mut bytes = Vec::new();
        for number in [7_u32, 100, 5] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend([2, 0, 0, 0]);
        bytes.extend(b"fl");
        for number in [1_u32, 2, 3, 4] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend([3, 0, 0, 0, 255, 254, 1]);
        bytes.extend([2, 0, 0, 0, 1, 0, 0, 0, b'a', 0, 0, 0, 0]);
        bytes.extend((-2.25_f64).to_le_bytes());
        bytes
    }

    #[test]
    fn definition_of_ros_1_becomes_one_of_ros_2() {
        let (state, converter) = as_ros2(channel("ros1", DEFINITION));
        assert!(converter.is_some());
        assert_eq!((state.message.as_str(), state.encoding.as_str()), ("legs/msg/State", "cdr"));
        let schema = state.schema.expect("a definition");
        assert_eq!(schema.encoding, "ros2msg");
        let rule = "=".repeat(80);
        let expected = format!(
            "# A state.
std_msgs/Header header
int8 LOWEST=-3
builtin_interfaces/Time[2] times  # of both
int8[] offsets
legs/Empty nothing
string[] names
float64 last
{rule}
MSG: std_msgs/Header
# Number of the message.
builtin_interfaces/Time stamp
string frame_id
{rule}
MSG: legs/Empty
{rule}
MSG: builtin_interfaces/Time
int32 sec\nuint32 nanosec
"
        );
        assert_eq!(String::from_utf8_lossy(&schema.text), expected);
    }

    #[test]
    fn numbers_of_a_converted_message_are_found_by_name() {
        let (state, converter) = as_ros2(channel("ros1", DEFINITION));
        let cdr = converter.expect("a converter").cdr(&message());
        let definition = Definition::of_channel(&state).expect("a definition");
        let names = ["header.stamp.sec", "times[1].nanosec", "offsets[1]", "last"];
        let paths = names.map(|name| definition.number(name).expect("a number"));
        let frame = definition.frame("");
        let decoded = definition.decode(&cdr, &paths.each_ref(), frame.as_ref());
        let decoded = decoded.expect("the numbers");
        let values: Vec<f64> = decoded.numbers.iter().map(|number| number.value).collect();
        assert_eq!(values, [100.0, 4.0, -2.0, -2.25]);
        assert_eq!(decoded.frame, "fl");
    }

    #[test]
    fn header_without_number_keeps_its_first_bytes() {
        let plain =
            "std_msgs/Header header\n===\nMSG: std_msgs/Header\ntime stamp\nstring frame_id";
        let (_, converter) = as_ros2(channel("ros1", plain));
        let cdr = converter.expect("a converter").cdr(&[1, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(cdr, [0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 0]);
    }

    #[test]
    fn cut_and_overlong_messages_stay_cut_and_overlong() {
        let (state, converter) = as_ros2(channel("ros1", DEFINITION));
        let converter = converter.expect("a converter");
        let definition = Definition::of_channel(&state).expect("a definition");
        let last = definition.number("last").expect("a number");
        let whole = message();
        for length in 0..whole.len() {
            let cut = converter.cdr(&whole[..length]);
            assert!(definition.values(&cut, &[&last]).is_err(), "{length}");
        }
        let longer = converter.cdr(&[&whole[..], &[0; 4]].concat());
        let said = definition.values(&longer, &[&last]).expect_err("an error").to_string();
        assert!(said.contains("more than its type has"), "{said}");
        // Lengths beyond the message, and very many elements without bytes.
        let mut hostile = whole;
        hostile[36..40].fill(0xFF);
        assert!(definition.values(&converter.cdr(&hostile), &[&last]).is_err());
        let (_, converter) =
            as_ros2(channel("ros1", "legs/Empty[] all\n===\nMSG: legs/Empty\n# nothing"));
        let cdr = converter.expect("a converter").cdr(&[0xFF; 4]);
        assert!(cdr.len() <= MOST_STEPS + 16, "{}", cdr.len());
    }

    #[test]
    fn channel_without_valid_definition_stays_as_it_is() {
        for (encoding, definition) in
            [("cdr", DEFINITION), ("ros1", ""), ("ros1", "Header"), ("ros1", "legs/Other other")]
        {
            let before = channel(encoding, definition);
            let (after, converter) = as_ros2(before.clone());
            assert!(converter.is_none(), "{definition}");
            assert_eq!(after, before);
        }
    }
}
