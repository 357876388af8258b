//! Loads of all feet, and the order of the feet's IMUs. A load is any number in the messages of a topic.
//!
//! The loads are read before the samples. If their topic is a pattern, the names of the feet are needed first, so
//! another reading before the loads finds them.

use std::collections::BTreeSet;

use crate::definition::{Definition, FieldPath, within};
use crate::fields::Fields;
use crate::messages::{Channel, Channels, MessageTimes, Visitor, decode_start, micros};
use crate::pairing::pairs;
use crate::selection::{
    FootOrder, ImuKey, MOST_FRAMES, addresses, hidden_imus, is_imu, is_wanted, last_word, names_of,
    topic_types,
};
use crate::visit;
use options::{InputOptions, LoadTopic, Topics};
use samples::ros::{Header, Time};
use stored::OLDEST_LOAD_US;
use stored::container::Container;
use stored::error::{
    DefinitionProblem, InputError, KnownLoad, LoadProblem, MessageProblem, Problem,
};

/// Loads, and the IMUs of their feet.
#[derive(Default)]
pub(super) struct Loads {
    /// In the order of the topics that were given.
    pub(super) series: Vec<LoadSeries>,
    /// IMUs of the feet, in the order of their loads.
    pub(super) feet: Vec<ImuKey>,
    /// Names of the feet in their loads' topics.
    names: Vec<String>,
}

/// Reads the loads.
pub(super) fn loads(
    container: &mut Container,
    input_options: &InputOptions,
) -> Result<Loads, InputError> {
    match &input_options.bag.loads[..] {
        [] => Ok(Loads::default()),
        [pattern] if pattern.is_pattern() => {
            let names = read(container, input_options, &[])?.names;
            let wanted: Vec<_> = names.iter().map(|name| pattern.of_foot(name)).collect();
            read(container, input_options, &wanted)
        }
        wanted => paired(read(container, input_options, wanted)?, container, input_options),
    }
}

/// Puts several loads in the order of their feet, by the names in the topics of feet and loads. Loads without the names
/// of feet are in the order of the topics that were named.
fn paired(
    mut loads: Loads,
    container: &Container,
    input_options: &InputOptions,
) -> Result<Loads, InputError> {
    if loads.series.len() < 2 || loads.series.len() != loads.feet.len() {
        return Ok(loads);
    }
    let names: Vec<String> = loads.series.iter().map(|load| load.topic.to_string()).collect();
    match pairs(&names, &loads.names) {
        Some(pairs) => {
            let mut series: Vec<Option<LoadSeries>> = loads.series.into_iter().map(Some).collect();
            loads.series = pairs.into_iter().filter_map(|load| series[load].take()).collect();
            Ok(loads)
        }
        None if matches!(input_options.bag.topics, Topics::Named(_)) => Ok(loads),
        None => {
            let problem = Problem::LoadPairs { loads: names, feet: loads.names };
            Err(InputError::of_file(&container.file, problem))
        }
    }
}

/// Names of feet in the recording. The name of an only foot is the last part of its topic that does not name a sensor.
fn names(feet: &[ImuKey], all: &BTreeSet<ImuKey>, hidden: BTreeSet<String>) -> Vec<String> {
    let is_shared = |topic: &str| all.iter().filter(|imu| imu.topic == topic).count() > 1;
    let address = |ImuKey { topic, frame }: &ImuKey| {
        if is_shared(topic) {
            format!("{topic}/{}", frame.trim_matches('/'))
        } else {
            topic.clone()
        }
    };
    let selected: Vec<String> = feet.iter().map(address).collect();
    let all = all.iter().map(address).chain(hidden).collect();
    let names = names_of(&selected, &all).into_iter().zip(&selected);
    let or_word = |(name, address): (Option<String>, &String)| {
        name.or_else(|| last_word(address)).unwrap_or_default()
    };
    names.map(or_word).collect()
}

fn read(
    container: &mut Container,
    input_options: &InputOptions,
    wanted: &[LoadTopic],
) -> Result<Loads, InputError> {
    let scale = input_options.table.scale.load;
    let mut reader = LoadReader {
        file: &container.file,
        input_options,
        series: wanted.iter().cloned().map(|topic| LoadSeries::new(topic, scale)).collect(),
        feet: BTreeSet::new(),
        channels: Channels::default(),
        parts: Vec::new(),
        failed: None,
    };
    visit(&mut container.parts, &container.file, &mut reader)?;
    if let Some(error) = reader.failed {
        return Err(error);
    }
    for series in &mut reader.series {
        if !series.is_declared() {
            let problem = Problem::NoSuchTopic {
                topic: series.topic.topic.clone(),
                wanted: "numbers",
                imus: Vec::new(),
                topics: topic_types(&reader.channels),
            };
            return Err(InputError::of_file(&container.file, problem));
        }
        series.sort();
    }
    let is_selected = |imu: &&ImuKey| is_wanted(&imu.frame, input_options);
    let mut feet: Vec<ImuKey> = reader.feet.iter().filter(is_selected).cloned().collect();
    if let Topics::Named(named) = &input_options.bag.topics {
        feet.retain(|imu| named.contains(&imu.topic));
    }
    feet.sort_by_cached_key(|imu| FootOrder::of(&input_options.bag, &imu.topic, &imu.frame));
    let hidden = hidden_imus(&reader.channels, &input_options.bag);
    let names = names(&feet, &reader.feet, hidden);
    Ok(Loads { series: reader.series, feet, names })
}

/// Visitor that reads the loads.
struct LoadReader<'a> {
    file: &'a str,
    series: Vec<LoadSeries>,
    input_options: &'a InputOptions,
    /// All IMUs, by name.
    feet: BTreeSet<ImuKey>,
    /// All topics.
    channels: Channels,
    /// IMUs that are named in messages of another type, by their addresses.
    parts: Vec<(String, Fields)>,
    failed: Option<InputError>,
}

impl LoadReader<'_> {
    fn is_foot(&self, channel: &Channel) -> bool {
        is_imu(channel) && !self.input_options.bag.excludes(&channel.topic)
    }

    /// Adds the IMUs that are named in messages of another type. IMUs that cannot be read are reported when the samples
    /// are read.
    fn declare_parts(&mut self, channel: &Channel) -> bool {
        let mut is_needed = false;
        for (address, part) in addresses(&self.input_options.bag, channel) {
            if let Ok(fields) = Fields::of(channel, part, &self.input_options.table.mapping) {
                is_needed = true;
                if !self.parts.iter().any(|(before, _)| before == address) {
                    self.parts.push((address.to_owned(), fields));
                }
            }
        }
        is_needed
    }
}

/// Adds an IMU.
fn add(feet: &mut BTreeSet<ImuKey>, topic: &str, frame: String) {
    let is_of_topic = |imu: &&ImuKey| imu.topic == topic;
    if feet.iter().filter(is_of_topic).count() < MOST_FRAMES {
        feet.insert(ImuKey { topic: topic.to_owned(), frame });
    }
}

impl Visitor for LoadReader<'_> {
    fn channel(&mut self, channel: &Channel) -> bool {
        self.channels.add(channel);
        let mut is_needed = self.is_foot(channel) || self.declare_parts(channel);
        for series in &mut self.series {
            match series.declare(channel, self.file) {
                Ok(is_load) => is_needed |= is_load,
                Err(error) => self.failed = self.failed.take().or(Some(error)),
            }
        }
        is_needed
    }

    fn message(
        &mut self,
        channel: &Channel,
        MessageTimes { log_ns, .. }: MessageTimes,
        payload: &[u8],
    ) -> Result<(), InputError> {
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        // A message that cannot be decoded is reported when the samples are read.
        if self.is_foot(channel)
            && let Ok(Header { frame_id, .. }) = decode_start(payload)
        {
            add(&mut self.feet, &channel.topic, frame_id);
        }
        for (address, fields) in &self.parts {
            if fields.topic == channel.topic
                && let Ok(imu) = fields.imu(payload)
            {
                add(&mut self.feet, address, imu.header.frame_id);
            }
        }
        let wanted = |series: &&mut LoadSeries| series.topic.topic == channel.topic;
        for series in self.series.iter_mut().filter(wanted) {
            series.process(log_ns, payload, self.file)?;
        }
        Ok(())
    }
}

/// Type whose force is within a field.
const WRENCH_STAMPED: &str = "geometry_msgs/msg/WrenchStamped";

/// Place of the load in a message.
pub(super) struct LoadPlace {
    definition: Definition,
    /// A number, or the three axes of a force, whose magnitude is the load.
    values: Vec<FieldPath>,
    /// Seconds and nanoseconds.
    stamp: Option<[FieldPath; 2]>,
    /// Whether the load is a force, N.
    is_force: bool,
}

/// The load of a message.
pub(super) struct DecodedLoad {
    /// In the unit of the message.
    pub(super) value: f64,
    /// `None` without a stamp.
    stamp_us: Option<i64>,
}

/// All values of a load: 16 bytes each, 32 with stamps.
pub(super) struct LoadSeries {
    pub(super) topic: LoadTopic,
    /// Factor of the numbers in messages.
    scale: f64,
    place: Option<LoadPlace>,
    messages: u64,
    /// Values by log time, µs.
    by_log: Vec<(i64, f32)>,
    /// Values by their own stamp, as long as all of them have one.
    by_stamp: Option<Vec<(i64, f32)>>,
}

impl LoadSeries {
    pub(super) const fn new(topic: LoadTopic, scale: f64) -> Self {
        let by_stamp = Some(Vec::new());
        Self { topic, scale, place: None, messages: 0, by_log: Vec::new(), by_stamp }
    }

    /// Returns whether a channel is this load; an error if it is, but lacks the field.
    pub(super) fn declare(&mut self, channel: &Channel, file: &str) -> Result<bool, InputError> {
        if channel.topic != self.topic.topic {
            return Ok(false);
        }
        let found = if channel.encoding == "cdr" {
            LoadPlace::of(channel, self.topic.field.as_deref())
        } else {
            Err(LoadProblem::Encoding(channel.encoding.clone()))
        };
        let no_field = |problem| {
            let (load, message) = (self.topic.clone(), channel.message.clone());
            InputError::of_file(file, Problem::LoadField { load, message, problem })
        };
        self.place = Some(found.map_err(no_field)?);
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
    pub(super) fn process(
        &mut self,
        log_ns: i64,
        payload: &[u8],
        file: &str,
    ) -> Result<(), InputError> {
        let Some(place) = &self.place else {
            return Ok(());
        };
        self.messages += 1;
        let decoded = place.decode(payload).map_err(|problem| {
            InputError::of_message(file, &self.topic.topic, self.messages, problem)
        })?;
        let load = (self.scale * decoded.value) as f32;
        self.by_log.push((micros(log_ns), load));
        match (&mut self.by_stamp, decoded.stamp_us) {
            (Some(by_stamp), Some(stamp_us)) => by_stamp.push((stamp_us, load)),
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

    /// Last value at or before a sample. Values are compared by stamps if the load has stamps, else by their times of
    /// writing. Not finite if the value marks an unknown load; `None` without a value, or if it is older than
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

impl LoadPlace {
    /// Place of the load in the messages of a channel.
    pub(super) fn of(channel: &Channel, field: Option<&str>) -> Result<Self, LoadProblem> {
        let message = channel.message.as_str();
        let known = match message {
            "std_msgs/msg/Float32" | "std_msgs/msg/Float64" => Some(KnownLoad::Number),
            "geometry_msgs/msg/Wrench" | WRENCH_STAMPED => Some(KnownLoad::Wrench),
            "std_msgs/msg/Float32MultiArray" | "std_msgs/msg/Float64MultiArray" => {
                Some(KnownLoad::Numbers)
            }
            _ => None,
        };
        let definition = match known {
            Some(_) => Definition::of(message, None),
            None => Definition::of_channel(channel),
        };
        let definition = definition.map_err(LoadProblem::Definition)?;
        let listed = || match known {
            Some(known) => LoadProblem::Known(known),
            None => LoadProblem::Numbers(definition.names("")),
        };
        let default = known.and_then(KnownLoad::default_field);
        let field = field.or(default).ok_or_else(listed)?;
        let is_wrench = known == Some(KnownLoad::Wrench);
        let bare = field.strip_prefix("wrench.").unwrap_or(field);
        let part = if message == WRENCH_STAMPED { "wrench" } else { "" };
        let names = if is_wrench && bare == "force" {
            ["x", "y", "z"].map(|axis| format!("force.{axis}")).to_vec()
        } else if is_wrench {
            vec![bare.to_owned()]
        } else {
            vec![field.to_owned()]
        };
        let paths = names.iter().map(|name| definition.number(&within(part, name)));
        let paths: Result<_, DefinitionProblem> = paths.collect();
        let values = paths.map_err(|problem| match known {
            Some(_) => listed(),
            None => LoadProblem::NoNumber(problem),
        })?;
        let stamp = definition.stamp("");
        // The other numbers of a wrench are torques.
        let is_force = is_wrench && bare.starts_with("force");
        Ok(Self { definition, values, stamp, is_force })
    }

    /// Load of a message.
    pub(super) fn decode(&self, payload: &[u8]) -> Result<DecodedLoad, MessageProblem> {
        let paths = self.values.iter().chain(self.stamp.iter().flatten());
        let numbers = self.definition.values(payload, &paths.collect::<Vec<_>>())?;
        let (values, stamp) = numbers.split_at(self.values.len());
        let value = match values {
            [value] => *value,
            axes => axes.iter().map(|part| part * part).sum::<f64>().sqrt(),
        };
        Ok(DecodedLoad { value, stamp_us: Time::of_numbers(stamp).micros() })
    }
}
