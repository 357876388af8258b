//! Loads of all feet, and the IMUs of their feet in order: the first reading of a bag that has loads.

use std::collections::BTreeSet;

use super::super::error::InputError;
use super::super::loaded::Hints;
use super::super::open::Container;
use super::super::refusal::ContainerError;
use super::super::topics::{LoadTopic, Topics};
use super::cdr::decode_start;
use super::fields::Fields;
use super::force::LoadSeries;
use super::storage::{Channel, Visitor, Written};
use super::visit::visit;
use super::{
    ImuKey, MOST_FRAMES, addresses, described, feet, hidden_imus, is_imu, is_wanted, order,
};
use crate::ros::Header;

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
pub(super) fn loads(container: &mut Container, hints: &Hints) -> Result<Loads, InputError> {
    match &hints.bag.loads[..] {
        [] => Ok(Loads::default()),
        [pattern] if pattern.is_pattern() => {
            let names = read(container, hints, &[])?.names;
            let wanted: Vec<_> = names.iter().map(|name| pattern.of_foot(name)).collect();
            read(container, hints, &wanted)
        }
        wanted => read(container, hints, wanted),
    }
}

/// Names of feet as recordings have them; that of an only foot is the last part of its topic that does not name a sensor.
fn names(feet: &[ImuKey], all: &BTreeSet<ImuKey>, hidden: BTreeSet<String>) -> Vec<String> {
    let is_shared = |topic: &str| all.iter().filter(|(other, _)| other == topic).count() > 1;
    let address = |(topic, frame): &ImuKey| match is_shared(topic) {
        true => format!("{topic}/{}", frame.trim_matches('/')),
        false => topic.clone(),
    };
    let selected: Vec<String> = feet.iter().map(address).collect();
    let all = all.iter().map(address).chain(hidden).collect();
    let names = feet::names_of(&selected, &all).into_iter().zip(&selected);
    let or_word = |(name, address): (Option<String>, &String)| {
        name.or_else(|| feet::last_word(address)).unwrap_or_default()
    };
    names.map(or_word).collect()
}

fn read(
    container: &mut Container,
    hints: &Hints,
    wanted: &[LoadTopic],
) -> Result<Loads, InputError> {
    let mut reader = LoadReader {
        file: &container.file,
        hints,
        series: wanted.iter().cloned().map(LoadSeries::new).collect(),
        feet: BTreeSet::new(),
        others: Vec::new(),
        parts: Vec::new(),
        failed: None,
    };
    visit(&mut container.parts, &container.file, &mut reader)?;
    if let Some(error) = reader.failed {
        return Err(error);
    }
    for series in &mut reader.series {
        if !series.is_declared() {
            return Err(ContainerError::NoSuchTopic {
                file: container.file.clone(),
                topic: series.topic.topic.clone(),
                wanted: "numbers",
                topics: reader.others.iter().map(described).collect(),
            }
            .into());
        }
        series.sort();
    }
    let is_selected = |(_, frame): &&ImuKey| is_wanted(frame, hints);
    let mut feet: Vec<ImuKey> = reader.feet.iter().filter(is_selected).cloned().collect();
    if let Topics::Named(named) = &hints.bag.topics {
        feet.retain(|(topic, _)| named.contains(topic));
    }
    feet.sort_by_cached_key(|(topic, frame)| order(&hints.bag, topic, frame));
    let hidden = hidden_imus(&reader.others, &hints.bag);
    let names = names(&feet, &reader.feet, hidden);
    Ok(Loads { series: reader.series, feet, names })
}

/// Visitor that reads the loads.
struct LoadReader<'a> {
    file: &'a str,
    series: Vec<LoadSeries>,
    hints: &'a Hints,
    /// All IMUs, by name.
    feet: BTreeSet<ImuKey>,
    /// All topics.
    others: Vec<Channel>,
    /// IMUs that are named in messages of another type, by their addresses.
    parts: Vec<(String, Fields)>,
    failed: Option<InputError>,
}

impl LoadReader<'_> {
    fn is_foot(&self, channel: &Channel) -> bool {
        is_imu(channel) && !self.hints.bag.excludes(&channel.topic)
    }

    /// Adds the IMUs that are named in messages of another type. Those that cannot be read are reported when the samples
    /// are read.
    fn declare_parts(&mut self, channel: &Channel) -> bool {
        let mut is_needed = false;
        for (address, part) in addresses(&self.hints.bag, channel) {
            if let Ok(fields) = Fields::of(channel, part, &self.hints.table.mapping) {
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
    let of_topic = |(other, _): &&ImuKey| other == topic;
    if feet.iter().filter(of_topic).count() < MOST_FRAMES {
        feet.insert((topic.to_owned(), frame));
    }
}

impl Visitor for LoadReader<'_> {
    fn channel(&mut self, channel: &Channel) -> bool {
        if !self.others.contains(channel) {
            self.others.push(channel.clone());
        }
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
        Written { log_ns, .. }: Written,
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
            series.take(log_ns, payload, self.file)?;
        }
        Ok(())
    }
}
