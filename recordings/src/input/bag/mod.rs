//! Bags of ROS 2: `sensor_msgs/msg/Imu` by topic and frame, one foot per topic, or per frame of a topic.
//!
//! | step | file |
//! |---|---|
//! | reading the messages of all topics: MCAP, the `SQLite` of a rosbag2 | `storage`; `mcap`, `rosbag2` |
//! | decoding a message | `cdr`, `messages` |
//! | converting the messages of an IMU into the rows of a foot | `feed` |
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
use super::topics::{BagOptions, Topics};
use beside::{Beside, is_beside};
use cdr::decode;
use feed::{Feed, Name, Sharing};
use load::LoadSeries;
use messages::Imu;
use storage::{Channel, Interest, Visitor, visit};

/// Most frames of one topic: as many feet as a robot may have, and other IMUs beside them.
const MOST_FRAMES: usize = 64;

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
    let topics: Vec<String> = chosen.iter().map(Feed::address).collect();
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

/// Topic and frame of an IMU.
type ImuKey = (String, String);

/// Loads, and the IMUs of their feet.
#[derive(Default)]
struct Loads {
    series: Vec<LoadSeries>,
    feet: Vec<ImuKey>,
}

/// Reads the loads.
fn loads(container: &mut Container, hints: &Hints) -> Result<Loads, InputError> {
    let wanted = &hints.bag.loads;
    if wanted.is_empty() {
        return Ok(Loads::default());
    }
    let mut reader = LoadReader {
        file: &container.file,
        hints,
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
    let mut feet: Vec<ImuKey> = feet.into_iter().collect();
    if let Topics::Named(named) = &hints.bag.topics {
        feet.retain(|(topic, _)| named.contains(topic));
    }
    feet.sort_by(|a, b| order(&hints.bag, &a.0, &a.1).cmp(&order(&hints.bag, &b.0, &b.1)));
    Ok(Loads { series, feet })
}

/// Visitor that reads the loads.
struct LoadReader<'a> {
    file: &'a str,
    series: Vec<LoadSeries>,
    hints: &'a Hints,
    /// IMUs that are selected by their frames, by name.
    feet: BTreeSet<ImuKey>,
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
        // A message that cannot be decoded is reported when the samples are read.
        if is_imu(channel)
            && let Ok(imu) = decode::<Imu>(payload)
            && is_wanted(&imu, self.hints)
            && self.feet.len() < MOST_FRAMES
        {
            self.feet
                .insert((channel.topic.clone(), imu.header.frame_id.0));
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
    /// IMUs of the feet in the order of their loads.
    order: &'a [ImuKey],
    /// Topics with samples of an IMU, and their frames.
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
        let is_same = |feed: &Feed| feed.topic == channel.topic;
        let Some(first) = self.feeds.iter().position(is_same) else {
            self.beside.take(channel, log_ns, payload);
            return Ok(());
        };
        let is_needed = match &self.hints.bag.topics {
            Topics::Named(named) => named.contains(&channel.topic),
            Topics::All => true,
            // If there are several topics, only the counts are needed, unless a frame may select one.
            Topics::TheOnly => {
                let is_other = |feed: &Feed| feed.messages > 0 && !is_same(feed);
                !self.hints.bag.frames.is_empty() || !self.feeds.iter().any(is_other)
            }
        };
        if !is_needed || self.failed.is_some() {
            self.feeds[first].count(log_ns);
            return Ok(());
        }
        let taken = self.sample(channel, (log_ns, first), payload);
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
    /// Passes a message that is needed to the feed of its topic, the first of which is `first`, and its frame.
    fn sample(
        &mut self,
        channel: &Channel,
        (log_ns, first): (i64, usize),
        payload: &[u8],
    ) -> Result<(), InputError> {
        let known = self.beside.of(&channel.topic, log_ns);
        let decoded = decode::<Imu>(payload).and_then(|imu| {
            let at = self.place(&channel.topic, &imu.header.frame_id.0)?;
            Ok((at, imu))
        });
        let (at, imu) = match decoded {
            Ok((at, imu)) => (at, imu),
            Err(what) => {
                self.feeds[first].count(log_ns);
                let of_topic = self.feeds.iter().filter(|feed| feed.topic == channel.topic);
                return Err(ContainerError::Message {
                    file: self.file.to_owned(),
                    topic: channel.topic.clone(),
                    number: of_topic.map(|feed| feed.messages).sum(),
                    what,
                }
                .into());
            }
        };
        self.feeds[at].count(log_ns);
        if !is_wanted(&imu, self.hints) {
            return Ok(());
        }
        let is_foot =
            |(topic, frame): &ImuKey| *topic == channel.topic && *frame == imu.header.frame_id.0;
        let foot = self.order.iter().position(is_foot);
        let load = foot.and_then(|foot| self.loads.get(foot));
        self.feeds[at].take((log_ns, known), &imu, load, self.hints, self.file)
    }

    /// Place of the feed of a topic and frame, which is added if it is the first of its frame; the error is half a
    /// sentence.
    fn place(&mut self, topic: &str, frame: &str) -> Result<usize, String> {
        let is_same = |feed: &Feed| feed.topic == topic;
        let is_it = |feed: &Feed| is_same(feed) && feed.frame.as_deref() == Some(frame);
        if let Some(at) = self.feeds.iter().position(is_it) {
            return Ok(at);
        }
        let is_new = |feed: &Feed| is_same(feed) && feed.frame.is_none();
        if let Some(at) = self.feeds.iter().position(is_new) {
            self.feeds[at].frame = Some(frame.to_owned());
            return Ok(at);
        }
        if self.feeds.iter().filter(|feed| is_same(feed)).count() >= MOST_FRAMES {
            return Err(format!(
                "its frame {frame:?} is beyond the {MOST_FRAMES} that a topic may have"
            ));
        }
        let mut feed = Feed::new(topic.to_owned(), self.hints);
        feed.frame = Some(frame.to_owned());
        self.feeds.push(feed);
        for feed in self.feeds.iter_mut().filter(|feed| is_same(feed)) {
            feed.sharing = Sharing::Shared;
        }
        Ok(self.feeds.len() - 1)
    }

    /// Leaves the feeds with the selected frames.
    fn select_frames(&mut self) -> Result<(), InputError> {
        let frames = &self.hints.bag.frames;
        let has = |feed: &Feed, frame: &String| feed.frame.as_ref() == Some(frame);
        let is_there = |frame: &String| self.feeds.iter().any(|feed| has(feed, frame));
        if let Some(frame) = frames.iter().find(|frame| !is_there(frame)) {
            let filled = self.feeds.iter().filter(|feed| feed.frame.is_some());
            return Err(ContainerError::NoSuchFrame {
                file: self.file.to_owned(),
                frame: frame.clone(),
                frames: filled
                    .map(|feed| {
                        let frame = feed.frame.clone();
                        ImuTopic {
                            frame,
                            ..feed.about()
                        }
                    })
                    .collect(),
            }
            .into());
        }
        if !frames.is_empty() {
            self.feeds
                .retain(|feed| frames.iter().any(|frame| has(feed, frame)));
        }
        Ok(())
    }

    /// Topics that are feet, in order.
    fn chosen(mut self) -> Result<Vec<Feed>, InputError> {
        let file = self.file.to_owned();
        if let Some(error) = self.failed.take_if(|_| !self.hints.bag.frames.is_empty()) {
            return Err(error);
        }
        self.select_frames()?;
        let abouts: Vec<ImuTopic> = self.feeds.iter().map(Feed::about).collect();
        let mut feeds = self.feeds;
        match &self.hints.bag.topics {
            Topics::Named(named) => {
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
                feeds.retain(|feed| named.contains(&feed.topic));
                sort(&mut feeds, &self.hints.bag);
                return Ok(feeds);
            }
            Topics::All | Topics::TheOnly => sort(&mut feeds, &self.hints.bag),
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
            // Each of the frames that were selected may be a foot.
            (several @ 2.., Topics::TheOnly) if several > self.hints.bag.frames.len() => {
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

/// Sorts feeds by [`order`].
fn sort(feeds: &mut [Feed], bag: &BagOptions) {
    feeds.sort_by(|a, b| {
        let of = |feed: &Feed| feed.frame.clone().unwrap_or_default();
        let (a_frame, b_frame) = (of(a), of(b));
        order(bag, &a.topic, &a_frame).cmp(&order(bag, &b.topic, &b_frame))
    });
}

/// Key that sorts feet as they are selected: by topic, then by frame; by name where none are named.
fn order<'a>(
    bag: &BagOptions,
    topic: &'a str,
    frame: &'a str,
) -> (Option<usize>, &'a str, Option<usize>, &'a str) {
    let topic_place = match &bag.topics {
        Topics::Named(named) => named.iter().position(|name| name == topic),
        Topics::All | Topics::TheOnly => None,
    };
    let frame_place = bag.frames.iter().position(|name| name == frame);
    (topic_place, topic, frame_place, frame)
}

/// Returns whether the frame of a message is selected.
fn is_wanted(imu: &Imu, hints: &Hints) -> bool {
    let frames = &hints.bag.frames;
    frames.is_empty() || frames.contains(&imu.header.frame_id.0)
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
