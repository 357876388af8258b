//! Layout of the messages of a type, from its definition in the bag, and the numbers in a message.
//!
//! A definition (`ros2msg`) is parsed into records of fields. A name such as `imu_state.accelerometer[0]` is a path
//! through them. The numbers of a message in CDR are found by walking through all of it.
//!
//! Messages of ROS 1 are converted to CDR first: see `ros1`.
//!
//! Sources: <https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html>; the concatenation of definitions
//! follows <https://mcap.dev/spec/registry#ros2msg>.

mod ros1;

use std::collections::HashMap;

use crate::messages::{Channel, ENCODING, LONGEST_PADDING, Order, content};
use stored::error::{DefinitionProblem, MessageProblem};

pub(super) use ros1::{Converter, as_ros2};

/// Most types within each other.
const DEEPEST: usize = 32;

/// Largest number of fields visited in a definition or in a message, including the fields of nested types. Thirty types
/// that each contain the next one twice have a billion fields.
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
    pub(super) fn of_channel(channel: &Channel) -> Result<Self, DefinitionProblem> {
        let schema = channel.schema.as_deref();
        let text = schema.filter(|schema| schema.encoding == "ros2msg");
        let text = text.map(|schema| String::from_utf8_lossy(&schema.text));
        match (Self::of(&channel.message, text.as_deref()), schema) {
            (Err(_), Some(schema)) if text.is_none() && !schema.encoding.is_empty() => {
                Err(DefinitionProblem::Language(schema.encoding.clone()))
            }
            (definition, _) => definition,
        }
    }

    /// Layout of a type: from `text`, its definition in the bag, or from the known definitions.
    pub(super) fn of(message: &str, text: Option<&str>) -> Result<Self, DefinitionProblem> {
        match text.or_else(|| known_text(message)) {
            Some(text) => Self::parse(message, text),
            None => Err(DefinitionProblem::Absent),
        }
    }
}

// Parser of `ros2msg`: the definition of a type, then the definitions of the types in it, each after a line of `=` and
// `MSG: package/Name`.
impl Definition {
    /// Parses the definition of a type such as `unitree_go/msg/LowState`.
    fn parse(message: &str, text: &str) -> Result<Self, DefinitionProblem> {
        let name = bare(message);
        let mut parser =
            Parser { texts: sections(&name, text), indices: HashMap::new(), records: Vec::new() };
        let message = parser.record(&name, 0)?;
        Ok(Self { records: parser.records, message })
    }
}

struct Parser<'a> {
    /// Definitions by name.
    texts: HashMap<String, &'a str>,
    /// Index of each record; `None` while it is parsed.
    indices: HashMap<String, Option<usize>>,
    records: Vec<Vec<Field>>,
}

impl Parser<'_> {
    /// Index of the record of a type that is `depth` types deep.
    fn record(&mut self, name: &str, depth: usize) -> Result<usize, DefinitionProblem> {
        if depth > DEEPEST {
            return Err(DefinitionProblem::TooDeep { most: DEEPEST });
        }
        match self.indices.get(name) {
            Some(Some(index)) => return Ok(*index),
            Some(None) => return Err(DefinitionProblem::Recursion(name.to_owned())),
            None => {}
        }
        let in_bag = self.texts.get(name).copied();
        let text = in_bag.or_else(|| known_text(&name.replacen('/', "/msg/", 1)));
        let text = text.ok_or_else(|| DefinitionProblem::NoType(name.to_owned()))?;
        self.indices.insert(name.to_owned(), None);
        let package = name.split('/').next().unwrap_or_default();
        let mut fields = Vec::new();
        for line in text.lines() {
            fields.extend(self.field(line, package, depth + 1)?);
        }
        self.records.push(fields);
        let index = self.records.len() - 1;
        self.indices.insert(name.to_owned(), Some(index));
        Ok(index)
    }

    /// Field of a line; `None` for a constant and for a line without a field.
    fn field(
        &mut self,
        line: &str,
        package: &str,
        depth: usize,
    ) -> Result<Option<Field>, DefinitionProblem> {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            return Ok(None);
        }
        let not_a_field = || DefinitionProblem::Line(line.to_owned());
        let (type_name, rest) = line.split_once(char::is_whitespace).ok_or_else(not_a_field)?;
        let rest = rest.trim_start();
        let end = rest.find(|letter: char| letter.is_whitespace() || letter == '=');
        let (name, after) = rest.split_at(end.unwrap_or(rest.len()));
        if after.trim_start().starts_with('=') {
            return Ok(None);
        }
        let (base, count) = match type_name.split_once('[') {
            None => (type_name, Count::One),
            Some((base, dimension)) => {
                let dimension = dimension.strip_suffix(']').ok_or_else(not_a_field)?;
                let count = if dimension.is_empty() || dimension.starts_with("<=") {
                    Count::Sequence
                } else {
                    Count::Fixed(dimension.parse().map_err(|_| not_a_field())?)
                };
                (base, count)
            }
        };
        let base = base.split("<=").next().unwrap_or_default();
        let kind = match (number_type(base), base) {
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

/// Definitions of a text by the names of their types; the first defines `message`.
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

fn number_type(name: &str) -> Option<Number> {
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

/// Types with their definitions, for bags that have none, such as bags of rosbag2 before ROS 2 Iron.
///
/// Sources: <https://github.com/ros2/common_interfaces>, and `unitree_go` of
/// <https://github.com/unitreerobotics/unitree_ros2>.
const KNOWN: [(&str, &str); 14] = [
    ("builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec"),
    ("builtin_interfaces/msg/Duration", "int32 sec\nuint32 nanosec"),
    ("std_msgs/msg/Header", "builtin_interfaces/Time stamp\nstring frame_id"),
    (
        "sensor_msgs/msg/JointState",
        "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort",
    ),
    ("std_msgs/msg/Float32", "float32 data"),
    ("std_msgs/msg/Float64", "float64 data"),
    ("std_msgs/msg/Float32MultiArray", "MultiArrayLayout layout\nfloat32[] data"),
    ("std_msgs/msg/Float64MultiArray", "MultiArrayLayout layout\nfloat64[] data"),
    ("std_msgs/msg/MultiArrayLayout", "MultiArrayDimension[] dim\nuint32 data_offset"),
    ("std_msgs/msg/MultiArrayDimension", "string label\nuint32 size\nuint32 stride"),
    ("geometry_msgs/msg/WrenchStamped", "std_msgs/Header header\nWrench wrench"),
    ("geometry_msgs/msg/Wrench", "Vector3 force\nVector3 torque"),
    ("geometry_msgs/msg/Vector3", "float64 x\nfloat64 y\nfloat64 z"),
    // State of a Go2, and of a GO1 that speaks ROS 2.
    ("unitree_go/msg/LowState", include_str!("low_state.msg")),
];

/// Definition of a type, if known.
fn known_text(message: &str) -> Option<&'static str> {
    let (_, text) = KNOWN.iter().find(|(name, _)| *name == message)?;
    Some(text)
}

/// Largest number of names that are listed.
const MOST_NAMES: usize = 10_000;

/// Path to a part of a message: a field of each record, and the element if it is an array.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct FieldPath(Vec<Step>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Step {
    field: usize,
    /// 0 for a single value.
    element: u32,
}

/// Names of numbers with their paths, and the number of fields visited.
#[derive(Default)]
struct Listing {
    numbers: Vec<(String, FieldPath)>,
    steps: usize,
}

/// Part of a message at the end of a path.
enum Target {
    Number,
    /// Index of a record.
    Record(usize),
    Text,
    Other,
}

impl Definition {
    /// Path to a number.
    pub(super) fn number(&self, name: &str) -> Result<FieldPath, DefinitionProblem> {
        match self.part(name)? {
            (path, Target::Number) => Ok(path),
            (_, Target::Record(_)) => {
                let numbers = self.names(name);
                Err(DefinitionProblem::SeveralNumbers { name: name.to_owned(), numbers })
            }
            (_, Target::Text | Target::Other) => Err(DefinitionProblem::NoNumber(name.to_owned())),
        }
    }

    /// Names of the numbers in a part of the message, which is all of it for an empty name, and their paths.
    /// Elements of sequences are not listed, because each message has its own number of them.
    pub(super) fn numbers(
        &self,
        part: &str,
    ) -> Result<Vec<(String, FieldPath)>, DefinitionProblem> {
        let (path, record) = match self.part(part)? {
            (path, Target::Record(record)) => (path, record),
            _ => return Err(DefinitionProblem::NoFields(part.to_owned())),
        };
        let mut listing = Listing::default();
        self.list(record, "", &path, &mut listing);
        Ok(listing.numbers)
    }

    /// Paths to the seconds and nanoseconds of the header in a part of the message, if it has one.
    pub(super) fn stamp(&self, part: &str) -> Option<[FieldPath; 2]> {
        let number = |name| self.number(&within(part, name)).ok();
        Some([number("header.stamp.sec")?, number("header.stamp.nanosec")?])
    }

    /// Path to the frame of the header in a part of the message, if it has one.
    pub(super) fn frame(&self, part: &str) -> Option<FieldPath> {
        match self.part(&within(part, "header.frame_id")) {
            Ok((path, Target::Text)) => Some(path),
            _ => None,
        }
    }

    /// Paths to the first covariances of the rates and the accelerations in a part of the message, if it has them.
    pub(super) fn covariances(&self, part: &str) -> Option<[FieldPath; 2]> {
        let number = |name| self.number(&within(part, name)).ok();
        Some([
            number("angular_velocity_covariance[0]")?,
            number("linear_acceleration_covariance[0]")?,
        ])
    }

    /// Names of the numbers in a part of the message; none if it is not a part with fields.
    pub(super) fn names(&self, part: &str) -> Vec<String> {
        let numbers = self.numbers(part).unwrap_or_default();
        numbers.into_iter().map(|(name, _)| name).collect()
    }

    /// Appends the numbers of a record to a list.
    fn list(&self, record: usize, prefix: &str, path: &FieldPath, to: &mut Listing) {
        for (index, field) in self.records[record].iter().enumerate() {
            let elements = match field.count {
                Count::One => 1,
                Count::Fixed(elements) => elements,
                Count::Sequence => 0,
            };
            for element in 0..elements {
                to.steps += 1;
                if to.numbers.len() >= MOST_NAMES || to.steps > MOST_STEPS {
                    return;
                }
                let index_text = match field.count {
                    Count::One => String::new(),
                    _ => format!("[{element}]"),
                };
                let name = within(prefix, &format!("{}{index_text}", field.name));
                let mut path = path.clone();
                path.0.push(Step { field: index, element });
                let before = to.numbers.len();
                match field.kind {
                    Kind::Number(_) => to.numbers.push((name, path)),
                    Kind::Record(record) => self.list(record, &name, &path, to),
                    Kind::Text | Kind::WideText => {}
                }
                if to.numbers.len() == before {
                    break;
                }
            }
        }
    }

    /// Part of the message with a name; the message itself for an empty one.
    fn part(&self, name: &str) -> Result<(FieldPath, Target), DefinitionProblem> {
        let mut path = FieldPath::default();
        let mut part = Target::Record(self.message);
        for word in name.split('.').filter(|_| !name.is_empty()) {
            let Target::Record(record) = part else {
                let (name, field) = (name.to_owned(), word.to_owned());
                return Err(DefinitionProblem::NoFieldsBefore { name, field });
            };
            let (bare, element) = match word.split_once('[') {
                None => (word, None),
                Some((bare, index)) => {
                    let index = index.strip_suffix(']').and_then(|index| index.parse().ok());
                    let no_index = || DefinitionProblem::Index(word.to_owned());
                    (bare, Some(index.ok_or_else(no_index)?))
                }
            };
            let fields = &self.records[record];
            let Some(index) = fields.iter().position(|field| field.name == bare) else {
                let fields = fields.iter().map(|field| field.name.clone()).collect();
                return Err(DefinitionProblem::NoField { name: bare.to_owned(), fields });
            };
            path.0.push(Step { field: index, element: element.unwrap_or(0) });
            let field = &fields[index];
            part = match (field.kind, field.count, element) {
                (_, Count::One, Some(_)) => {
                    return Err(DefinitionProblem::NoArray(bare.to_owned()));
                }
                (_, Count::Fixed(length), Some(element)) if element >= length => {
                    let last = length.saturating_sub(1);
                    return Err(DefinitionProblem::NoElement { name: bare.to_owned(), last });
                }
                (_, Count::Fixed(_) | Count::Sequence, None) => Target::Other,
                (Kind::Text, ..) => Target::Text,
                (Kind::WideText, ..) => Target::Other,
                (Kind::Number(_), ..) => Target::Number,
                (Kind::Record(record), ..) => Target::Record(record),
            };
        }
        Ok((path, part))
    }
}

/// Name of a field in a part of a message, which is all of it for an empty name.
pub(super) fn within(part: &str, field: &str) -> String {
    if part.is_empty() { field.to_owned() } else { format!("{part}.{field}") }
}

/// Place of a number in a message that is not compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Place {
    /// First byte, from the beginning of the message.
    at: usize,
    number: Number,
    order: Order,
}

impl Place {
    /// Writes a value, rounded and limited to the range of the number; `None` if the message is too short.
    pub(super) fn write(self, value: f64, message: &mut [u8]) -> Option<()> {
        let rounded = value.round();
        let bits = match self.number {
            Number::Bool => u64::from(rounded != 0.0),
            Number::U8 => u64::from(rounded as u8),
            Number::U16 => u64::from(rounded as u16),
            Number::U32 => u64::from(rounded as u32),
            Number::U64 => rounded as u64,
            Number::I8 => u64::from((rounded as i8).cast_unsigned()),
            Number::I16 => u64::from((rounded as i16).cast_unsigned()),
            Number::I32 => u64::from((rounded as i32).cast_unsigned()),
            Number::I64 => (rounded as i64).cast_unsigned(),
            Number::F32 => u64::from((value as f32).to_bits()),
            Number::F64 => value.to_bits(),
        };
        let size = self.number.size();
        let mut bytes = bits.to_le_bytes();
        if self.order == Order::Big {
            bytes[..size].reverse();
        }
        let stored = message.get_mut(self.at..self.at + size)?;
        stored.copy_from_slice(&bytes[..size]);
        Some(())
    }
}

/// A number of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PlacedNumber {
    pub(super) place: Place,
    pub(super) value: f64,
}

/// The wanted fields of a message.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Decoded {
    /// In the order of their paths.
    pub(super) numbers: Vec<PlacedNumber>,
    /// Empty if no frame is wanted.
    pub(super) frame: String,
}

impl Definition {
    /// Numbers of a message at these paths.
    pub(super) fn values(
        &self,
        payload: &[u8],
        paths: &[&FieldPath],
    ) -> Result<Vec<f64>, MessageProblem> {
        let Decoded { numbers, .. } = self.decode(payload, paths, None)?;
        Ok(numbers.into_iter().map(|number| number.value).collect())
    }

    /// Places of the numbers of a message at these paths.
    pub(super) fn places(
        &self,
        payload: &[u8],
        paths: &[&FieldPath],
    ) -> Result<Vec<Place>, MessageProblem> {
        let Decoded { numbers, .. } = self.decode(payload, paths, None)?;
        Ok(numbers.into_iter().map(|number| number.place).collect())
    }

    /// Numbers of a message at these paths, and the text at the path of its frame.
    pub(super) fn decode(
        &self,
        payload: &[u8],
        paths: &[&FieldPath],
        frame: Option<&FieldPath>,
    ) -> Result<Decoded, MessageProblem> {
        let message = content(payload)?;
        let steps = paths.iter().copied().chain(frame).map(|path| &path.0[..]);
        let wanted: Vec<(usize, &[Step])> = steps.enumerate().collect();
        let walk = |unit| {
            let mut walk = Walk {
                definition: self,
                order: message.order,
                content: &message.bytes,
                at: 0,
                steps: 0,
                unit,
                numbers: vec![None; paths.len()],
                frame: String::new(),
            };
            walk.record(self.message, &wanted)?;
            if walk.content.len() - walk.at > LONGEST_PADDING {
                let [bytes, expected] = [walk.content.len(), walk.at].map(|end| ENCODING + end);
                return Err(MessageProblem::MoreBytes { bytes, expected });
            }
            Ok(walk)
        };
        let mut fields = self.records.iter().flatten();
        let walk = if fields.any(|field| field.kind == Kind::WideText) {
            let fitting = UNITS.into_iter().map(walk).find(Result::is_ok);
            fitting.unwrap_or(Err(MessageProblem::WideText))?
        } else {
            walk(1)?
        };
        let numbers = walk.numbers.into_iter();
        let numbers = numbers.map(|number| number.ok_or(MessageProblem::NoElement));
        Ok(Decoded { numbers: numbers.collect::<Result<_, _>>()?, frame: walk.frame })
    }
}

/// Candidates for the bytes per unit of the length of a `wstring`. Implementations of DDS differ in the size of a
/// character, and in whether the length counts characters or bytes, and no field of the message tells which applies. Only
/// with the right candidate is the message as long as its type.
const UNITS: [usize; 3] = [4, 2, 1];

struct Walk<'a> {
    definition: &'a Definition,
    order: Order,
    content: &'a [u8],
    at: usize,
    steps: usize,
    /// One of [`UNITS`].
    unit: usize,
    numbers: Vec<Option<PlacedNumber>>,
    frame: String,
}

impl Walk<'_> {
    /// Walks through a record. `wanted` has the slots of the frame and of the wanted numbers in this record, each
    /// with the rest of its path.
    fn record(&mut self, record: usize, wanted: &[(usize, &[Step])]) -> Result<(), MessageProblem> {
        let fields = &self.definition.records[record];
        self.steps += fields.len();
        if self.steps > MOST_STEPS {
            return Err(MessageProblem::TooManyFields { most: MOST_STEPS });
        }
        if fields.is_empty() {
            // An empty record takes a byte, because a struct of IDL needs at least one member.
            return self.skip(1, 1);
        }
        for (index, field) in fields.iter().enumerate() {
            let wanted_here: Vec<_> = wanted
                .iter()
                .filter_map(|(slot, steps)| {
                    let (step, rest) = steps.split_first()?;
                    (step.field == index).then_some((*slot, step.element, rest))
                })
                .collect();
            let elements = match field.count {
                Count::One => 1,
                Count::Fixed(elements) => elements,
                Count::Sequence => self.number(Number::U32)? as u32,
            };
            match field.kind {
                Kind::Number(number) if wanted_here.is_empty() => {
                    self.skip(number.size(), elements as usize)?;
                }
                Kind::Number(number) => {
                    for element in 0..elements {
                        let value = self.number(number)?;
                        let place = Place {
                            at: ENCODING + self.at - number.size(),
                            number,
                            order: self.order,
                        };
                        for (slot, _, _) in wanted_here.iter().filter(|(_, at, _)| *at == element) {
                            self.numbers[*slot] = Some(PlacedNumber { place, value });
                        }
                    }
                }
                Kind::Text => {
                    for element in 0..elements {
                        let length = self.number(Number::U32)? as usize;
                        self.skip(1, length)?;
                        if wanted_here.iter().any(|(_, at, _)| *at == element) {
                            let text = &self.content[self.at - length..self.at];
                            let text = text.strip_suffix(&[0]).unwrap_or(text);
                            self.frame = String::from_utf8_lossy(text).into_owned();
                        }
                    }
                }
                Kind::WideText => {
                    for _ in 0..elements {
                        let length = self.number(Number::U32)? as usize;
                        self.skip(1, length.checked_mul(self.unit).ok_or(MessageProblem::Cut)?)?;
                    }
                }
                Kind::Record(record) => {
                    for element in 0..elements {
                        let within: Vec<_> = wanted_here
                            .iter()
                            .filter(|(_, at, _)| *at == element)
                            .map(|(slot, _, rest)| (*slot, *rest))
                            .collect();
                        let before = self.at;
                        self.record(record, &within)?;
                        if self.at == before {
                            break;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    /// Advances over `count` values of `size` bytes.
    fn skip(&mut self, size: usize, count: usize) -> Result<(), MessageProblem> {
        if count > 0 {
            self.at = self.at.next_multiple_of(size);
        }
        let end = size.checked_mul(count).and_then(|bytes| self.at.checked_add(bytes));
        self.at = end.filter(|end| *end <= self.content.len()).ok_or(MessageProblem::Cut)?;
        Ok(())
    }

    fn number(&mut self, number: Number) -> Result<f64, MessageProblem> {
        let size = number.size();
        self.skip(size, 1)?;
        let stored = &self.content[self.at - size..self.at];
        let mut bytes = [0; 8];
        bytes[..size].copy_from_slice(stored);
        if self.order == Order::Big {
            bytes[..size].reverse();
        }
        let bits = u64::from_le_bytes(bytes);
        Ok(match number {
            Number::Bool | Number::U8 | Number::U16 | Number::U32 | Number::U64 => bits as f64,
            Number::I8 => f64::from(bits as i8),
            Number::I16 => f64::from(bits as i16),
            Number::I32 => f64::from(bits as i32),
            Number::I64 => bits.cast_signed() as f64,
            Number::F32 => f64::from(f32::from_bits(bits as u32)),
            Number::F64 => f64::from_bits(bits),
        })
    }
}

#[cfg(test)]
mod tests;
