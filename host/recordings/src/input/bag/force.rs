//! Load of a foot, from a topic with a number or any number of a message.

use super::super::error::InputError;
use super::super::loaded::OLDEST_LOAD_US;
use super::super::refusal::ContainerError;
use super::super::topics::LoadTopic;
use super::definition::{Definition, Path, within};
use super::storage::{Channel, micros};
use crate::ros::Time;

/// Type whose force is within a field.
const WRENCH_STAMPED: &str = "geometry_msgs/msg/WrenchStamped";

/// Place of the load in a message.
struct Place {
    definition: Definition,
    /// A number, or the three axes of a force, whose magnitude is the load.
    values: Vec<Path>,
    /// Seconds and nanoseconds.
    stamp: Option<[Path; 2]>,
    /// Whether the load is a force, N.
    is_force: bool,
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
        Self { topic, place: None, messages: 0, by_log: Vec::new(), by_stamp: Some(Vec::new()) }
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
        match &self.place {
            Some(place) if place.is_force => format!("{} (N)", self.topic),
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
        let (value, stamp_us) = place.number(payload).map_err(|what| ContainerError::Message {
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
        let message = channel.message.as_str();
        let known = match message {
            "std_msgs/msg/Float32" | "std_msgs/msg/Float64" => Some((Some("data"), "data")),
            "geometry_msgs/msg/Wrench" | WRENCH_STAMPED => Some((Some("force.z"), FORCES)),
            "std_msgs/msg/Float32MultiArray" | "std_msgs/msg/Float64MultiArray" => {
                Some((None, ELEMENTS))
            }
            _ => None,
        };
        let definition = match known {
            Some(_) => Definition::of(message, None),
            None => Definition::of_channel(channel),
        };
        let definition = definition.map_err(|what| format!("cannot be read: {what}"))?;
        let listed = || match known {
            Some((_, fields)) => format!("has {fields}"),
            None => format!("has the numbers {}", definition.listed("")),
        };
        let default = known.and_then(|(default, _)| default);
        let field = field.or(default).ok_or_else(listed)?;
        let is_force = default == Some("force.z");
        let bare = field.strip_prefix("wrench.").unwrap_or(field);
        let part = if message == WRENCH_STAMPED { "wrench" } else { "" };
        let names = match is_force {
            true if bare == "force" => ["x", "y", "z"].map(|axis| format!("force.{axis}")).to_vec(),
            true => vec![bare.to_owned()],
            false => vec![field.to_owned()],
        };
        let paths = names.iter().map(|name| definition.number(&within(part, name)));
        let paths: Result<_, String> = paths.collect();
        let values = paths.map_err(|what| match known {
            Some(_) => listed(),
            None => format!("has no such number: {what}"),
        })?;
        let stamp = definition.stamp("");
        Ok(Self { definition, values, stamp, is_force })
    }

    /// The number of a message and its stamp, µs; the error is half a sentence.
    fn number(&self, payload: &[u8]) -> Result<(f64, Option<i64>), String> {
        let paths = self.values.iter().chain(self.stamp.iter().flatten());
        let found = self.definition.values(payload, &paths.collect::<Vec<_>>())?;
        let (values, stamp) = found.split_at(self.values.len());
        let number = match values {
            [value] => *value,
            axes => axes.iter().map(|part| part * part).sum::<f64>().sqrt(),
        };
        Ok((number, Time::of_numbers(stamp).micros()))
    }
}
