//! Bags of ROS 2: `sensor_msgs/msg/Imu` by topic, one foot per topic.
//!
//! | step | file |
//! |---|---|
//! | reading the messages of all topics: MCAP, the `SQLite` of a rosbag2 | `storage`; `mcap`, `rosbag2` |
//! | decoding a message | `cdr`, `messages` |
//! | converting the messages of a topic into the rows of a foot | `feed` |
//! | load of a foot, from another topic | `load` |
//! | validities and labels, from topics beside that of the samples | `beside` |
//! | names of feet | `feet` |
//!
//! A bag is read once, and twice if it has loads, which may be stored after the samples that they belong to. Its
//! memory is that of the longest record and of the loads.

mod beside;
mod cdr;
mod feed;
mod feet;
mod load;
mod mcap;
mod messages;
mod rosbag2;
mod storage;

use std::collections::BTreeSet;

use super::error::InputError;
use super::loaded::Hints;
use super::open::Container;
use super::refusal::{ContainerError, ImuTopic};
use super::stored::Stored;
use super::topics::Topics;
use beside::{Beside, is_beside};
use feed::{Feed, Name};
use load::LoadSeries;
use messages::Imu;
use storage::{Channel, Interest, Visitor, visit};

/// Reads the recordings of the selected feet.
///
/// # Errors
/// The first error in the bag or in the selection.
pub(super) fn read(mut container: Container, hints: &Hints) -> Result<Vec<Stored>, InputError> {
    let file = container.file.clone();
    let Loads {
        series: loads,
        feet,
    } = loads(&mut container, hints)?;
    let mut reader = Reader {
        file: &file,
        hints,
        loads: &loads,
        order: &feet,
        feeds: Vec::new(),
        others: Vec::new(),
        beside: Beside::default(),
        failed: None,
    };
    let endings = visit(&mut container.parts, &file, &mut reader)?;
    let chosen = reader.chosen()?;
    let topics: Vec<String> = chosen.iter().map(|feed| feed.topic.clone()).collect();
    let feet = feet::names(&topics);
    let is_alone = chosen.len() == 1;
    if !loads.is_empty() && loads.len() != chosen.len() {
        return Err(load_count(&file, hints, topics));
    }
    let mut recordings = Vec::new();
    for ((k, feed), foot) in chosen.into_iter().enumerate().zip(feet) {
        let name = Name {
            recording: container.name.clone(),
            foot: (!is_alone).then_some(foot),
        };
        recordings.push(feed.finish(name, loads.get(k), hints, &file)?);
    }
    if let Some(first) = recordings.first_mut() {
        first.about.notices.splice(0..0, endings);
    }
    Ok(recordings)
}

fn load_count(file: &str, hints: &Hints, feet: Vec<String>) -> InputError {
    ContainerError::LoadCount {
        file: file.to_owned(),
        loads: hints.bag.loads.clone(),
        feet,
    }
    .into()
}

/// Loads, and the topics of their feet.
#[derive(Default)]
struct Loads {
    series: Vec<LoadSeries>,
    feet: Vec<String>,
}

/// Reads the loads.
fn loads(container: &mut Container, hints: &Hints) -> Result<Loads, InputError> {
    let wanted = &hints.bag.loads;
    if wanted.is_empty() {
        return Ok(Loads::default());
    }
    let mut reader = LoadReader {
        file: &container.file,
        series: wanted.iter().cloned().map(LoadSeries::new).collect(),
        feet: BTreeSet::new(),
        others: Vec::new(),
        failed: None,
    };
    visit(&mut container.parts, &container.file, &mut reader)?;
    let LoadReader {
        mut series,
        feet,
        others,
        failed,
        ..
    } = reader;
    if let Some(error) = failed {
        return Err(error);
    }
    for series in &mut series {
        if !series.is_declared() {
            return Err(ContainerError::NoSuchTopic {
                file: container.file.clone(),
                topic: series.topic.topic.clone(),
                wanted: "numbers",
                topics: others.iter().map(described).collect(),
            }
            .into());
        }
        series.sort();
    }
    let feet = match &hints.bag.topics {
        Topics::Named(named) => named.clone(),
        Topics::All | Topics::TheOnly => feet.into_iter().collect(),
    };
    Ok(Loads { series, feet })
}

/// Visitor that reads the loads.
struct LoadReader<'a> {
    file: &'a str,
    series: Vec<LoadSeries>,
    /// Topics with messages of an IMU, by name.
    feet: BTreeSet<String>,
    /// All topics.
    others: Vec<Channel>,
    failed: Option<InputError>,
}

impl Visitor for LoadReader<'_> {
    fn channel(&mut self, channel: &Channel) -> Interest {
        if !self.others.contains(channel) {
            self.others.push(channel.clone());
        }
        let mut interest = if is_imu(channel) {
            Interest::Wanted
        } else {
            Interest::Unwanted
        };
        for series in &mut self.series {
            match series.declare(channel, self.file) {
                Ok(true) => interest = Interest::Wanted,
                Ok(false) => {}
                Err(error) => self.failed = self.failed.take().or(Some(error)),
            }
        }
        interest
    }

    fn message(
        &mut self,
        channel: &Channel,
        log_ns: i64,
        payload: &[u8],
    ) -> Result<(), InputError> {
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        if is_imu(channel) && !self.feet.contains(&channel.topic) {
            self.feet.insert(channel.topic.clone());
        }
        let wanted = |series: &&mut LoadSeries| series.topic.topic == channel.topic;
        for series in self.series.iter_mut().filter(wanted) {
            series.take(log_ns, payload, self.file)?;
        }
        Ok(())
    }
}

/// Visitor that reads the samples.
struct Reader<'a> {
    file: &'a str,
    hints: &'a Hints,
    loads: &'a [LoadSeries],
    /// Topics of the feet in the order of their loads.
    order: &'a [String],
    /// Topics with samples of an IMU.
    feeds: Vec<Feed>,
    /// All other topics.
    others: Vec<Channel>,
    beside: Beside,
    /// Error in the topic that may be the only one.
    failed: Option<InputError>,
}

impl Visitor for Reader<'_> {
    fn channel(&mut self, channel: &Channel) -> Interest {
        if !is_imu(channel) {
            if !self.others.contains(channel) {
                self.others.push(channel.clone());
            }
            return if is_beside(channel) {
                Interest::Wanted
            } else {
                Interest::Unwanted
            };
        }
        if !self.feeds.iter().any(|feed| feed.topic == channel.topic) {
            self.feeds
                .push(Feed::new(channel.topic.clone(), self.hints));
        }
        Interest::Wanted
    }

    fn message(
        &mut self,
        channel: &Channel,
        log_ns: i64,
        payload: &[u8],
    ) -> Result<(), InputError> {
        let Some(at) = self
            .feeds
            .iter()
            .position(|feed| feed.topic == channel.topic)
        else {
            self.beside.take(channel, log_ns, payload);
            return Ok(());
        };
        let known = self.beside.of(&channel.topic, log_ns);
        self.feeds[at].count(log_ns);
        let filled = |feed: &&Feed| feed.messages > 0;
        let is_wanted = match &self.hints.bag.topics {
            Topics::Named(named) => named.contains(&channel.topic),
            Topics::All => true,
            // If there are several topics, only the counts are needed.
            Topics::TheOnly => self.feeds.iter().filter(filled).count() == 1,
        };
        if !is_wanted || self.failed.is_some() {
            return Ok(());
        }
        let foot = self.order.iter().position(|name| *name == channel.topic);
        let load = foot.and_then(|foot| self.loads.get(foot));
        let taken = self.feeds[at].take((log_ns, known), payload, load, self.hints, self.file);
        match (taken, &self.hints.bag.topics) {
            (Err(error), Topics::TheOnly) => {
                self.failed = self.failed.take().or(Some(error));
                Ok(())
            }
            (taken, _) => taken,
        }
    }
}

impl Reader<'_> {
    /// Topics that are feet, in order.
    fn chosen(self) -> Result<Vec<Feed>, InputError> {
        let file = self.file.to_owned();
        let abouts: Vec<ImuTopic> = self.feeds.iter().map(Feed::about).collect();
        let mut feeds = self.feeds;
        match &self.hints.bag.topics {
            Topics::Named(named) => {
                let order = |feed: &Feed| named.iter().position(|name| *name == feed.topic);
                for topic in named {
                    let topic = topic.clone();
                    match feeds.iter().find(|feed| feed.topic == topic) {
                        Some(feed) if feed.messages > 0 => {}
                        Some(_) => {
                            let topics = abouts;
                            return Err(ContainerError::NoMessage {
                                file,
                                topic,
                                topics,
                            }
                            .into());
                        }
                        None => {
                            let all = abouts.iter().map(ToString::to_string);
                            return Err(ContainerError::NoSuchTopic {
                                file,
                                topic,
                                wanted: Imu::TYPE,
                                topics: all.chain(self.others.iter().map(described)).collect(),
                            }
                            .into());
                        }
                    }
                }
                feeds.retain(|feed| order(feed).is_some());
                feeds.sort_by_key(order);
                return Ok(feeds);
            }
            Topics::All => feeds.sort_by(|a, b| a.topic.cmp(&b.topic)),
            Topics::TheOnly => {}
        }
        if feeds.is_empty() {
            let topics = self.others.iter().map(described).collect();
            return Err(ContainerError::NoImu { file, topics }.into());
        }
        feeds.retain(|feed| feed.messages > 0);
        match (feeds.len(), &self.hints.bag.topics) {
            (0, _) => {
                let topic = Imu::TYPE.to_owned();
                let topics = abouts;
                Err(ContainerError::NoMessage {
                    file,
                    topic,
                    topics,
                }
                .into())
            }
            (2.., Topics::TheOnly) => {
                let topics = abouts;
                Err(ContainerError::SeveralTopics { file, topics }.into())
            }
            _ => match self.failed {
                Some(error) => Err(error),
                None => Ok(feeds),
            },
        }
    }
}

/// Returns whether a topic has samples of an IMU.
fn is_imu(channel: &Channel) -> bool {
    channel.message == Imu::TYPE && channel.encoding == "cdr"
}

/// A topic with the type of its messages.
fn described(channel: &Channel) -> String {
    let Channel {
        topic,
        message,
        encoding,
    } = channel;
    match (message.as_str(), encoding.as_str()) {
        ("", encoding) => format!("{topic} ({encoding})"),
        (message, "cdr") => format!("{topic} ({message})"),
        (message, encoding) => format!("{topic} ({message} in {encoding})"),
    }
}

#[cfg(test)]
mod tests;
