//! Load of a foot, from a topic with a number or any number of a message.

use super::super::error::InputError;
use super::super::loaded::OLDEST_LOAD_US;
use super::super::refusal::ContainerError;
use super::super::topics::LoadTopic;
use super::cdr::decode;
use super::definition::{Definition, Path};
use super::messages::{Float32, Float64, MultiArray, Time, Wrench, WrenchStamped};
use super::storage::{Channel, micros};

/// Types of messages that may be a load, and their fields.
const TYPES: [(&str, Type); 6] = [
    ("std_msgs/msg/Float32", Type::Float32),
    ("std_msgs/msg/Float64", Type::Float64),
    ("geometry_msgs/msg/Wrench", Type::Wrench),
    ("geometry_msgs/msg/WrenchStamped", Type::WrenchStamped),
    ("std_msgs/msg/Float32MultiArray", Type::Floats32),
    ("std_msgs/msg/Float64MultiArray", Type::Floats64),
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Type {
    Float32,
    Float64,
    Wrench,
    WrenchStamped,
    Floats32,
    Floats64,
}

/// Number in a message that holds the load.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Field {
    Data,
    Force(usize),
    Magnitude,
    Element(usize),
}

impl Type {
    const fn fields(self) -> &'static str {
        match self {
            Self::Float32 | Self::Float64 => "data",
            Self::Wrench | Self::WrenchStamped => {
                "force.x, force.y, force.z (which is taken where none is named), and force, its magnitude"
            }
            Self::Floats32 | Self::Floats64 => "data[0], data[1] and so on",
        }
    }

    /// Finds a field by its name.
    fn field(self, name: Option<&str>) -> Option<Field> {
        match (self, name) {
            (Self::Float32 | Self::Float64, None | Some("data")) => Some(Field::Data),
            (Self::Wrench | Self::WrenchStamped, None) => Some(Field::Force(2)),
            (Self::Wrench | Self::WrenchStamped, Some(name)) => {
                match name.strip_prefix("wrench.").unwrap_or(name) {
                    "force.x" => Some(Field::Force(0)),
                    "force.y" => Some(Field::Force(1)),
                    "force.z" => Some(Field::Force(2)),
                    "force" => Some(Field::Magnitude),
                    _ => None,
                }
            }
            (Self::Floats32 | Self::Floats64, Some(name)) => {
                let index = name.strip_prefix("data[")?.strip_suffix(']')?;
                index.parse().ok().map(Field::Element)
            }
            _ => None,
        }
    }
}

/// Place of the load in a message.
enum Place {
    /// In a message that has one by its purpose.
    Known(Type, Field),
    /// At a path in a message of any type.
    Defined {
        definition: Definition,
        value: Path,
        stamp: Option<[Path; 2]>,
    },
}

/// All values of a load: 16 bytes each, 32 with stamps.
pub(super) struct LoadSeries {
    pub(super) topic: LoadTopic,
    place: Option<Place>,
    messages: u64,
    /// Values by log time, µs.
    by_log: Vec<(i64, f32)>,
    /// Values by their own stamp, as long as all of them have one.
    by_stamp: Option<Vec<(i64, f32)>>,
}

/// Load at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Found {
    Value(f32),
    /// The last value marks an unknown load.
    NotANumber,
    /// No value is newer than [`OLDEST_LOAD_US`].
    Nothing,
}

/// Clock by which times are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Clock {
    /// Stamps of the sensors.
    Stamp,
    /// Times at which messages were written.
    Log,
}

impl LoadSeries {
    pub(super) const fn new(topic: LoadTopic) -> Self {
        Self {
            topic,
            place: None,
            messages: 0,
            by_log: Vec::new(),
            by_stamp: Some(Vec::new()),
        }
    }

    /// Returns whether a channel is this load; an error if it is, but lacks the field.
    pub(super) fn declare(&mut self, channel: &Channel, file: &str) -> Result<bool, InputError> {
        if channel.topic != self.topic.topic {
            return Ok(false);
        }
        let found = if channel.encoding == "cdr" {
            Place::of(channel, self.topic.field.as_deref())
        } else {
            Err(format!("is in {}, not in CDR", channel.encoding))
        };
        self.place = Some(found.map_err(|what| ContainerError::LoadField {
            file: file.to_owned(),
            load: self.topic.clone(),
            message: channel.message.clone(),
            what,
        })?);
        Ok(true)
    }

    /// Returns whether the bag has the topic.
    pub(super) const fn is_declared(&self) -> bool {
        self.place.is_some()
    }

    /// Name of the load in titles.
    pub(super) fn title(&self) -> String {
        match self.place {
            Some(Place::Known(Type::Wrench | Type::WrenchStamped, _)) => {
                format!("{} (N)", self.topic)
            }
            _ => self.topic.to_string(),
        }
    }

    /// Processes a message.
    pub(super) fn take(
        &mut self,
        log_ns: i64,
        payload: &[u8],
        file: &str,
    ) -> Result<(), InputError> {
        let Some(place) = &self.place else {
            return Ok(());
        };
        self.messages += 1;
        let (value, stamp_us) = place
            .number(payload)
            .map_err(|what| ContainerError::Message {
                file: file.to_owned(),
                topic: self.topic.topic.clone(),
                number: self.messages,
                what,
            })?;
        self.by_log.push((micros(log_ns), value as f32));
        match (&mut self.by_stamp, stamp_us) {
            (Some(by_stamp), Some(stamp_us)) => by_stamp.push((stamp_us, value as f32)),
            _ => self.by_stamp = None,
        }
        Ok(())
    }

    /// Sorts the values after the last one has been added.
    pub(super) fn sort(&mut self) {
        // Of two values with the same time the later one counts, so the sort must be stable.
        self.by_log.sort_by_key(|(time, _)| *time);
        if let Some(by_stamp) = &mut self.by_stamp {
            by_stamp.sort_by_key(|(time, _)| *time);
        }
    }

    /// Clock by which the load of a stamped sample is found.
    pub(super) const fn clock(&self) -> Clock {
        match self.by_stamp {
            Some(_) => Clock::Stamp,
            None => Clock::Log,
        }
    }

    /// Last value at or before a time.
    pub(super) fn at(&self, time_us: i64, clock: Clock) -> Found {
        let values = match (clock, &self.by_stamp) {
            (Clock::Stamp, Some(by_stamp)) => by_stamp,
            _ => &self.by_log,
        };
        let after = values.partition_point(|(time, _)| *time <= time_us);
        let newest = after.checked_sub(1).and_then(|index| values.get(index));
        match newest {
            Some((time, _)) if time_us.abs_diff(*time) > OLDEST_LOAD_US => Found::Nothing,
            None => Found::Nothing,
            Some((_, value)) if !value.is_finite() => Found::NotANumber,
            Some((_, value)) => Found::Value(*value),
        }
    }
}

impl Place {
    /// Place of the load in the messages of a channel; the error is half a sentence.
    fn of(channel: &Channel, field: Option<&str>) -> Result<Self, String> {
        let known = TYPES.iter().find(|(name, _)| *name == channel.message);
        if let Some((_, kind)) = known {
            let found = kind.field(field).map(|field| Self::Known(*kind, field));
            return found.ok_or_else(|| format!("has {}", kind.fields()));
        }
        let definition =
            Definition::of_channel(channel).map_err(|what| format!("cannot be read: {what}"))?;
        let listed = || format!("has the numbers {}", definition.listed(""));
        let field = field.ok_or_else(listed)?;
        let value = definition
            .number(field)
            .map_err(|what| format!("has no such number: {what}"))?;
        let stamp = definition.stamp("");
        Ok(Self::Defined {
            definition,
            value,
            stamp,
        })
    }

    /// The number of a message and its stamp, µs; the error is half a sentence.
    fn number(&self, payload: &[u8]) -> Result<(f64, Option<i64>), String> {
        let (definition, value, stamp) = match self {
            Self::Known(kind, field) => return number((*kind, *field), payload),
            Self::Defined {
                definition,
                value,
                stamp,
            } => (definition, value, stamp),
        };
        let paths: Vec<&Path> = [value].into_iter().chain(stamp.iter().flatten()).collect();
        match &definition.values(payload, &paths)?[..] {
            [value, stamp @ ..] => Ok((*value, Time::of_numbers(stamp).micros())),
            [] => Err("it lacks the number".to_owned()),
        }
    }
}

/// The number of a message of a known type, and its stamp, µs.
fn number((kind, field): (Type, Field), payload: &[u8]) -> Result<(f64, Option<i64>), String> {
    let element = |data: &[f64], index: usize| {
        let missing = || format!("it has {} numbers and no data[{index}]", data.len());
        data.get(index).copied().ok_or_else(missing)
    };
    let force = |wrench: &Wrench| match field {
        Field::Force(axis) => wrench.force[axis.min(2)],
        _ => wrench
            .force
            .map(|part| part * part)
            .iter()
            .sum::<f64>()
            .sqrt(),
    };
    let index = match field {
        Field::Element(index) => index,
        _ => 0,
    };
    Ok(match kind {
        Type::Float32 => (f64::from(decode::<Float32>(payload)?.data), None),
        Type::Float64 => (decode::<Float64>(payload)?.data, None),
        Type::Wrench => (force(&decode(payload)?), None),
        Type::WrenchStamped => {
            let stamped: WrenchStamped = decode(payload)?;
            (force(&stamped.wrench), stamped.header.stamp.micros())
        }
        Type::Floats32 => {
            let array: MultiArray<f32> = decode(payload)?;
            let data: Vec<f64> = array.data.into_iter().map(f64::from).collect();
            (element(&data, index)?, None)
        }
        Type::Floats64 => (
            element(&decode::<MultiArray<f64>>(payload)?.data, index)?,
            None,
        ),
    })
}
