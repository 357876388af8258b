//! Paths to the numbers of a message: `imu_state.accelerometer[0]`.

use super::{Count, Definition, Kind, MOST_STEPS};
use crate::input::refusal::first_of;

/// Largest number of names that are listed.
const MOST_NAMES: usize = 10_000;

/// Way to a part of a message: a field of each record, and the element where it is an array.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(in super::super) struct Path(pub(super) Vec<Step>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Step {
    pub(super) field: usize,
    /// 0 for a single value.
    pub(super) element: u32,
}

/// Names of numbers and their paths, and the number of fields that were looked at.
#[derive(Default)]
struct Listing {
    numbers: Vec<(String, Path)>,
    steps: usize,
}

/// Part of a message at the end of a path.
enum Part {
    Number,
    /// Index of a record.
    Record(usize),
    Text,
    Other,
}

impl Definition {
    /// Path to a number; the error is half a sentence that names the fields.
    pub(in super::super) fn number(&self, name: &str) -> Result<Path, String> {
        match self.part(name)? {
            (path, Part::Number) => Ok(path),
            (_, Part::Record(_)) => Err(format!("{name} has the numbers {}", self.listed(name))),
            (_, Part::Text | Part::Other) => Err(format!("{name} is not one number")),
        }
    }

    /// Names of the numbers in a part of the message, which is all of it for an empty name, and their paths.
    /// Elements of sequences are not listed, because each message has its own number of them.
    pub(in super::super) fn numbers(&self, part: &str) -> Result<Vec<(String, Path)>, String> {
        let (path, record) = match self.part(part)? {
            (path, Part::Record(record)) => (path, record),
            _ => return Err(format!("{part} has no fields")),
        };
        let mut listing = Listing::default();
        self.list(record, "", &path, &mut listing);
        Ok(listing.numbers)
    }

    /// Paths to the seconds and nanoseconds of the header in a part of the message, if it has one.
    pub(in super::super) fn stamp(&self, part: &str) -> Option<[Path; 2]> {
        let number = |name| self.number(&within(part, name)).ok();
        Some([number("header.stamp.sec")?, number("header.stamp.nanosec")?])
    }

    /// Path to the frame of the header in a part of the message, if it has one.
    pub(in super::super) fn frame(&self, part: &str) -> Option<Path> {
        match self.part(&within(part, "header.frame_id")) {
            Ok((path, Part::Text)) => Some(path),
            _ => None,
        }
    }

    /// Paths to the first covariances of the rates and the accelerations in a part of the message, if it has them.
    pub(in super::super) fn covariances(&self, part: &str) -> Option<[Path; 2]> {
        let number = |name| self.number(&within(part, name)).ok();
        Some([
            number("angular_velocity_covariance[0]")?,
            number("linear_acceleration_covariance[0]")?,
        ])
    }

    /// Names of the first numbers in a part of the message, for people.
    pub(in super::super) fn listed(&self, part: &str) -> String {
        let numbers = self.numbers(part).unwrap_or_default();
        first_of(numbers.iter().map(|(name, _)| name), 12)
    }

    /// Appends the numbers of a record to a list.
    fn list(&self, record: usize, prefix: &str, path: &Path, to: &mut Listing) {
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
    fn part(&self, name: &str) -> Result<(Path, Part), String> {
        let mut path = Path::default();
        let mut part = Part::Record(self.message);
        for word in name.split('.').filter(|_| !name.is_empty()) {
            let Part::Record(record) = part else {
                return Err(format!("there is no {name}: what is before .{word} has no fields"));
            };
            let (bare, element) = match word.split_once('[') {
                None => (word, None),
                Some((bare, index)) => {
                    let index = index.strip_suffix(']').and_then(|index| index.parse().ok());
                    let index =
                        index.ok_or_else(|| format!("{word:?} is not of the form field[INDEX]"))?;
                    (bare, Some(index))
                }
            };
            let fields = &self.records[record];
            let Some(index) = fields.iter().position(|field| field.name == bare) else {
                let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
                return Err(format!("there is no {bare}, but {}", names.join(", ")));
            };
            path.0.push(Step { field: index, element: element.unwrap_or(0) });
            let field = &fields[index];
            part = match (field.kind, field.count, element) {
                (_, Count::One, Some(_)) => return Err(format!("{bare} is not an array")),
                (_, Count::Fixed(length), Some(element)) if element >= length => {
                    let last = length.saturating_sub(1);
                    return Err(format!("{bare} has the elements [0] to [{last}]"));
                }
                (_, Count::Fixed(_) | Count::Sequence, None) => Part::Other,
                (Kind::Text, ..) => Part::Text,
                (Kind::WideText, ..) => Part::Other,
                (Kind::Number(_), ..) => Part::Number,
                (Kind::Record(record), ..) => Part::Record(record),
            };
        }
        Ok((path, part))
    }
}

/// Name of a field in a part of a message, which is all of it for an empty name.
pub(in super::super) fn within(part: &str, field: &str) -> String {
    if part.is_empty() { field.to_owned() } else { format!("{part}.{field}") }
}
