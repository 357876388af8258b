//! Bags of ROS 2: `sensor_msgs/msg/Imu` by topic and frame, one foot per topic, or per frame of a topic; and six axes
//! of messages of any type that are named.
//!
//! | step | file |
//! |---|---|
//! | reading the messages of all topics: MCAP, the `SQLite` of a rosbag2 | `visit`; `storage`, `mcap`, `rosbag2` |
//! | decoding a message | `cdr`, `messages`; of any type `definition` |
//! | selecting the IMUs that are feet | `reader`; their axes in messages of any type `fields` |
//! | converting the messages of an IMU into the rows of a foot | `feed` |
//! | load of a foot, from another topic | `forces`, `force` |
//! | validities and labels, from topics beside that of the samples | `sidecar` |
//! | contacts of feet, from topics beside that of the samples | `contacts` |
//! | names of feet | `feet` |
//! | all messages as they are stored | `copy` |
//! | other numbers in the place of those of a message | `replacement` |
//!
//! A bag is read once, and twice if it has loads, which may be stored after the samples that they belong to. Its
//! memory is that of the longest record and of the loads.

mod cdr;
mod contacts;
mod copy;
mod definition;
mod feed;
mod feet;
mod fields;
mod force;
mod forces;
mod mcap;
mod messages;
mod reader;
mod replacement;
mod rosbag2;
mod sidecar;
mod storage;
mod visit;

use std::collections::BTreeSet;

use super::error::InputError;
use super::format::Format;
use super::loaded::{Hints, is_among};
use super::open::Container;
use super::refusal::{ContainerError, ImuTopic, STREAM_ADVICE};
use super::store::stored::Stored;
use super::topics::{BagOptions, Topics};
use crate::ros::Imu;
use contacts::ContactFeeds;
use feed::Feed;
use forces::loads;
use reader::Reader;
use visit::visit;

pub use copy::copy;
pub use replacement::Replacement;
pub use storage::{Channel, Schema, Written};

/// Most frames of one topic: as many feet as a robot may have, and other IMUs beside them.
const MOST_FRAMES: usize = 64;

/// Reads the recordings of the selected feet.
///
/// # Errors
/// The first error in the bag or in the selection.
pub(super) fn read(mut container: Container, hints: &Hints) -> Result<Vec<Stored>, InputError> {
    let file = container.file.clone();
    let loads = loads(&mut container, hints)?;
    let mut reader = Reader::new(&file, hints, &loads);
    let endings = visit(&mut container.parts, &file, &mut reader)?;
    let contact_topics = reader.contact_topics();
    let mut contacts = std::mem::take(&mut reader.contacts);
    let has_parts = !reader.parts.is_empty();
    let all = reader.all_imus();
    let chosen = match reader.chosen() {
        Err(error) if is_without_samples(&error) && are_chosen(&contacts, &hints.bag) => {
            let name = container.name;
            let mut feet = of_contacts_alone(&file, &name, contacts, &hints.bag)?;
            if let Some(first) = feet.first_mut() {
                first.about.notices.extend(endings);
            }
            return Ok(feet);
        }
        chosen => chosen?,
    };
    if !hints.table.mapping.is_empty() && !has_parts {
        return Err(InputError::TableOptions {
            format: container.parts.first().map_or(Format::Mcap, |part| part.format),
            file,
            options: "--map is for messages of other types than sensor_msgs/msg/Imu",
        });
    }
    let topics: Vec<String> = chosen.iter().map(Feed::address).collect();
    let feet = renamed(&feet::names_of(&topics, &all), &topics, &hints.bag, &file)?;
    if !loads.series.is_empty() && loads.series.len() != chosen.len() {
        return Err(ContainerError::LoadCount {
            file,
            loads: hints.bag.loads.clone(),
            feet: topics,
        }
        .into());
    }
    let mut recordings = Vec::new();
    let mut used = Vec::new();
    for ((k, feed), foot) in chosen.into_iter().enumerate().zip(feet) {
        let address = feed.address();
        // Samples of several feet on one topic have no contacts beside them.
        let of_foot = if feed.is_shared { Ok(None) } else { contacts.of_imu(&feed.topic) };
        let of_foot = of_foot.map_err(|source| InputError::spool(&file, source))?;
        let name = container.name.clone();
        let mut stored = feed.finish(name, foot, loads.series.get(k), hints, &file)?;
        stored.about.address = Some(address);
        if let Some((topic, contacts, notices)) = of_foot
            && stored.use_contacts(contacts)
        {
            let notices = notices.iter();
            let notices = notices.map(|notice| format!("{file}, topic {notice}"));
            stored.about.notices.extend(notices);
            used.push(topic);
        }
        recordings.push(stored);
    }
    let contacts = contact_notices(&file, contact_topics, &used, recordings.len());
    if let Some(first) = recordings.first_mut() {
        let notices = endings.into_iter().chain(contacts);
        first.about.notices.splice(0..0, notices);
    }
    Ok(recordings)
}

/// Returns whether the error is that a bag has no samples of an IMU, or none on a topic that is named.
const fn is_without_samples(error: &InputError) -> bool {
    matches!(
        error,
        InputError::Container(
            ContainerError::NoImu { .. }
                | ContainerError::NoMessage { .. }
                | ContainerError::NoSuchTopic { .. }
        )
    )
}

/// Returns whether there are contacts, and those of feet are all that is named.
fn are_chosen(contacts: &ContactFeeds, bag: &BagOptions) -> bool {
    let all: Vec<String> = contacts.topics().map(|(topic, _)| topic).collect();
    match &bag.topics {
        Topics::Named(named) => named.iter().all(|topic| all.contains(topic)),
        Topics::TheOnly | Topics::All => !all.is_empty(),
    }
}

/// Reads the feet of a bag that has their contacts and none of their samples.
fn of_contacts_alone(
    file: &str,
    name: &str,
    mut contacts: ContactFeeds,
    bag: &BagOptions,
) -> Result<Vec<Stored>, InputError> {
    let all: Vec<(String, usize)> = contacts.topics().collect();
    let named: Vec<String> = match &bag.topics {
        Topics::Named(named) => named.clone(),
        _ => all.iter().map(|(topic, _)| topic.clone()).collect(),
    };
    let named: Vec<String> = named.into_iter().filter(|topic| !bag.excludes(topic)).collect();
    if named.len() > 1 && bag.topics == Topics::TheOnly {
        let topics = all.into_iter().map(|(name, messages)| ImuTopic {
            name,
            frame: None,
            messages: messages as u64,
            rate: None,
        });
        return Err(ContainerError::SeveralTopics {
            file: file.to_owned(),
            topics: topics.collect(),
        }
        .into());
    }
    let known = all.iter().map(|(topic, _)| topic.clone()).collect();
    let feet = renamed(&feet::names_of(&named, &known), &named, bag, file)?;
    let mut recordings = Vec::new();
    for (topic, foot) in named.into_iter().zip(feet) {
        let of_topic = contacts.of_topic(&topic);
        let of_topic = of_topic.map_err(|source| InputError::spool(file, source))?;
        let stored = of_topic.and_then(|(_, contacts, notices)| {
            let mut stored = Stored::of_contacts(name.to_owned(), foot, contacts)?;
            let notices = notices.iter().map(|notice| format!("{file}, topic {notice}"));
            stored.about.notices.extend(notices);
            stored.about.notices.push(format!(
                "{file} has contacts on {topic} without samples; they are used as they were recorded{STREAM_ADVICE}"
            ));
            stored.about.address = Some(topic);
            Some(stored)
        });
        recordings.extend(stored);
    }
    Ok(recordings)
}

/// Returns the names of feet with those that the options give them; a foot is meant by its name, by its topic, or by a part
/// of that.
fn renamed(
    names: &[Option<String>],
    topics: &[String],
    bag: &BagOptions,
    file: &str,
) -> Result<Vec<Option<String>>, InputError> {
    let mut new = names.to_vec();
    for rename in &bag.renames {
        let is_meant = |at: &usize| {
            let topic = topics[*at].trim_start_matches('/');
            let mut parts = topic.split('/');
            names[*at].as_ref() == Some(&rename.old)
                || topic == rename.old.trim_start_matches('/')
                || parts.any(|part| part == rename.old)
        };
        let mut meant = (0..names.len()).filter(is_meant);
        let (Some(at), None) = (meant.next(), meant.next()) else {
            return Err(ContainerError::NoFootToRename {
                file: file.to_owned(),
                name: rename.old.clone(),
                feet: topics.to_vec(),
            }
            .into());
        };
        new[at] = Some(rename.new.clone());
    }
    for (at, name) in new.iter().enumerate() {
        if let Some(name) = name.clone()
            && new != names
            && is_among(&name, new[..at].iter().flatten())
        {
            return Err(ContainerError::TwoFeet { file: file.to_owned(), name }.into());
        }
    }
    Ok(new)
}

/// Sentences on the contacts in a bag of `feet` feet: those on the topics `used`, and all others where a foot has none.
fn contact_notices(
    file: &str,
    topics: Vec<String>,
    used: &[String],
    feet: usize,
) -> impl Iterator<Item = String> {
    let taken = (!used.is_empty()).then(|| {
        format!(
            "{file} has contacts on {}, which are used as they were recorded: --estimate-again computes the estimate from the samples",
            used.join(", ")
        )
    });
    let mut others = topics;
    others.retain(|topic| !used.contains(topic));
    let ignored = (!others.is_empty() && used.len() < feet).then(|| {
        format!(
            "{file} has contacts on {}, which are not read: the estimate is computed again from the samples",
            others.join(", ")
        )
    });
    taken.into_iter().chain(ignored)
}

/// Topic, or part of its messages, and frame of an IMU.
type ImuKey = (String, String);

/// Key that sorts feet as they are selected: by topic, then by frame; by name where none are named.
fn order(
    bag: &BagOptions,
    topic: &str,
    frame: &str,
) -> (Option<usize>, String, Option<usize>, String) {
    let topic_place = match &bag.topics {
        Topics::Named(named) => named.iter().position(|name| name == topic),
        Topics::All | Topics::TheOnly => None,
    };
    let frame_place = bag.frames.iter().position(|name| name == frame);
    (topic_place, topic.to_owned(), frame_place, frame.to_owned())
}

/// Returns whether the frame of a message is selected.
fn is_wanted(frame: &str, hints: &Hints) -> bool {
    let frames = &hints.bag.frames;
    frames.is_empty() || frames.iter().any(|wanted| wanted == frame)
}

/// Named IMUs in the messages of a channel, each with the part of the message that it is: `/feet.imu[0]` is the part
/// `imu[0]` of `/feet`, and `/lowstate` the whole message.
fn addresses<'a>(
    bag: &'a BagOptions,
    channel: &'a Channel,
) -> impl Iterator<Item = (&'a str, &'a str)> {
    let named = match &bag.topics {
        Topics::Named(named) if channel.encoding == "cdr" => &named[..],
        _ => &[],
    };
    named.iter().filter_map(|address| {
        let part = match address.strip_prefix(&channel.topic)? {
            "" => "",
            part => part.strip_prefix('.')?,
        };
        Some((address.as_str(), part))
    })
}

/// Returns whether a topic has samples of an IMU.
fn is_imu(channel: &Channel) -> bool {
    channel.message == Imu::TYPE && channel.encoding == "cdr"
}

/// Topics with samples of an IMU that the selection excludes.
fn hidden_imus(channels: &[Channel], bag: &BagOptions) -> BTreeSet<String> {
    let is_hidden = |channel: &&Channel| is_imu(channel) && bag.excludes(&channel.topic);
    let hidden = channels.iter().filter(is_hidden);
    hidden.map(|channel| channel.topic.clone()).collect()
}

/// A topic with the type of its messages.
fn described(channel: &Channel) -> String {
    let topic = &channel.topic;
    match (channel.message.as_str(), channel.encoding.as_str()) {
        ("", encoding) => format!("{topic} ({encoding})"),
        (message, "cdr") => format!("{topic} ({message})"),
        (message, encoding) => format!("{topic} ({message} in {encoding})"),
    }
}

#[cfg(test)]
mod tests;
