//! Load of a foot, from a topic with a number or any number of a message.

use super::super::error::InputError;
use super::super::loaded::OLDEST_LOAD_US;
use super::super::refusal::ContainerError;
use super::super::topics::LoadTopic;
use super::cdr::decode;
use super::definition::{Definition, Path};
use super::messages::{MultiArray, Time, Wrench, WrenchStamped};
use super::storage::{Channel, micros};

/// Place of the load in a message.
enum Place {
    Float32,
    Float64,
    Wrench(Force),
    WrenchStamped(Force),
    /// Index of a number in a `Float32MultiArray`.
    Floats32(usize),
    /// Index of a number in a `Float64MultiArray`.
    Floats64(usize),
    /// At a path in a message of any type.
    Defined {
        definition: Definition,
        value: Path,
        stamp: Option<[Path; 2]>,
    },
}

/// Component of a force that is taken as the load.
enum Force {
    /// Along an axis.
    Axis(usize),
    Magnitude,
}

impl Force {
    /// Finds a number by its name; that along z where none is named.
    fn of_name(name: Option<&str>) -> Option<Self> {
        let name = name.map(|name| name.strip_prefix("wrench.").unwrap_or(name));
        Some(match name.unwrap_or("force.z") {
            "force.x" => Self::Axis(0),
            "force.y" => Self::Axis(1),
            "force.z" => Self::Axis(2),
            "force" => Self::Magnitude,
            _ => return None,
        })
    }

    fn number(&self, Wrench { force, .. }: &Wrench) -> f64 {
        match self {
            Self::Axis(axis) => force[*axis],
            Self::Magnitude => force.map(|part| part * part).iter().sum::<f64>().sqrt(),
        }
    }
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
            Some(Place::Wrench(_) | Place::WrenchStamped(_)) => format!("{} (N)", self.topic),
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

    /// Last value at or before a sample, by its stamp where the load has stamps, too, else by the time at which it was
    /// written: not finite if it marks an unknown load; `None` if there is none, or if it is older than
    /// [`OLDEST_LOAD_US`].
    pub(super) fn at(&self, stamp_us: Option<i64>, log_us: i64) -> Option<f32> {
        let (values, time_us) = match (&self.by_stamp, stamp_us) {
            (Some(by_stamp), Some(stamp_us)) => (by_stamp, stamp_us),
            _ => (&self.by_log, log_us),
        };
        let after = values.partition_point(|(time, _)| *time <= time_us);
        let (time, value) = values[..after].last()?;
        (time_us.abs_diff(*time) <= OLDEST_LOAD_US).then_some(*value)
    }
}

impl Place {
    /// Place of the load in the messages of a channel; the error is half a sentence.
    fn of(channel: &Channel, field: Option<&str>) -> Result<Self, String> {
        const FORCES: &str = "force.x, force.y, force.z (which is taken where none is named), and force, its magnitude";
        const ELEMENTS: &str = "data[0], data[1] and so on";
        let is_data = matches!(field, None | Some("data"));
        let force = Force::of_name(field);
        let index = |field: &str| field.strip_prefix("data[")?.strip_suffix(']')?.parse().ok();
        let element = field.and_then(index);
        let known = match channel.message.as_str() {
            "std_msgs/msg/Float32" => Some((is_data.then_some(Self::Float32), "data")),
            "std_msgs/msg/Float64" => Some((is_data.then_some(Self::Float64), "data")),
            "geometry_msgs/msg/Wrench" => Some((force.map(Self::Wrench), FORCES)),
            "geometry_msgs/msg/WrenchStamped" => Some((force.map(Self::WrenchStamped), FORCES)),
            "std_msgs/msg/Float32MultiArray" => Some((element.map(Self::Floats32), ELEMENTS)),
            "std_msgs/msg/Float64MultiArray" => Some((element.map(Self::Floats64), ELEMENTS)),
            _ => None,
        };
        if let Some((place, fields)) = known {
            return place.ok_or_else(|| format!("has {fields}"));
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
        let number = match self {
            Self::Float32 => f64::from(decode::<f32>(payload)?),
            Self::Float64 => decode(payload)?,
            Self::Wrench(force) => force.number(&decode(payload)?),
            Self::WrenchStamped(force) => {
                let WrenchStamped { header, wrench } = decode(payload)?;
                return Ok((force.number(&wrench), header.stamp.micros()));
            }
            Self::Floats32(index) => {
                f64::from(element(&decode::<MultiArray<f32>>(payload)?.data, *index)?)
            }
            Self::Floats64(index) => element(&decode::<MultiArray<f64>>(payload)?.data, *index)?,
            Self::Defined {
                definition,
                value,
                stamp,
            } => {
                let paths: Vec<&Path> = [value].into_iter().chain(stamp.iter().flatten()).collect();
                return match &definition.values(payload, &paths)?[..] {
                    [value, stamp @ ..] => Ok((*value, Time::of_numbers(stamp).micros())),
                    [] => Err("it lacks the number".to_owned()),
                };
            }
        };
        Ok((number, None))
    }
}

fn element<T: Copy>(data: &[T], index: usize) -> Result<T, String> {
    let missing = || format!("it has {} numbers and no data[{index}]", data.len());
    data.get(index).copied().ok_or_else(missing)
}
