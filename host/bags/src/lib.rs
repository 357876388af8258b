//! Bags of ROS 2 and ROS 1: `sensor_msgs/msg/Imu` by topic and frame, one foot per topic, or per frame of a topic. Also
//! six named axes of messages of any type.
//!
//! | step | file |
//! |---|---|
//! | a message, its topic and type, as stored and decoded from CDR | `messages` |
//! | numbers in messages of any type, by the definition of the type; the six axes of an IMU among them | `definition`; `fields` |
//! | messages of ROS 1, converted to messages of ROS 2 | `definition/ros1` |
//! | the messages of all topics, from their storage | `mcap`, `rosbag1` (both by `records`) and `rosbag2` |
//! | which topics are feet, and the names of the feet | `selection` |
//! | loads of the feet, from other topics: the first reading | `loads`, paired with feet by `pairing` |
//! | samples of the feet: the second reading | `reader`, a `feed` for each IMU |
//! | contacts of feet, from topics beside the topic of the samples | `contact_feed` |
//! | copies of all messages | `copy` |
//! | messages that arrive one by one | [`live`] |
//!
//! A bag is read once. If loads are selected it is read twice, because a load may be stored after its sample. It is
//! read three times if `{foot}` in the topic of the loads stands for the names of the feet. The memory required is
//! that of the longest record and of the loads.

mod contact_feed;
mod copy;
mod definition;
mod feed;
mod fields;
pub mod live;
mod loads;
mod mcap;
mod messages;
mod pairing;
mod reader;
mod records;
mod rosbag1;
mod rosbag2;
mod selection;

use contact_feed::ContactFeeds;
use feed::Feed;
use loads::{LoadSeries, loads};
use messages::Visitor;
use pairing::names_another_leg;
use reader::Reader;
use selection::{is_trunk, names_of, renamed, trunks};

use options::Format;
use options::hint::{Hint, Notice};
use options::{BagOptions, InputOptions, Topics};
use stored::Stored;
use stored::container::{Container, ContainerFile};
use stored::error::{ImuTopic, InputError, OptionsFor, Problem, STREAM_ADVICE};

pub use copy::{CopyError, Replacement, ReplacementError, copy_merged};
pub use messages::{Channel, MessageTimes, Schema};

/// Reads the recordings of the selected feet.
///
/// # Errors
/// The first error in the bag or in the selection.
pub fn read(
    mut container: Container,
    input_options: &InputOptions,
) -> Result<Vec<Stored>, InputError> {
    let file = container.file.clone();
    let loads = loads(&mut container, input_options)?;
    let mut reader = Reader::new(&file, input_options, &loads);
    let endings = visit(&mut container.parts, &file, &mut reader)?;
    let mut read = reader.finish();
    read.contacts.finish().map_err(|source| InputError::spool(&file, source))?;
    let chosen = match read.chosen {
        Err(error)
            if is_without_samples(&error) && are_chosen(&read.contacts, &input_options.bag) =>
        {
            let name = container.name;
            let mut feet = of_contacts_alone(&file, &name, read.contacts, &input_options.bag)?;
            let Some(first) = feet.first_mut() else {
                return Err(error);
            };
            first.about.notices.extend(endings);
            return Ok(feet);
        }
        chosen => chosen?,
    };
    if input_options.table.mapping.columns().next().is_some() && !read.has_parts {
        // The folder of a rosbag2 may have files of MCAP: the error names their format.
        let format = container.parts.first().map_or(container.format, |part| part.format);
        let given = OptionsFor::OtherMessages;
        return Err(InputError::of_file(file, Problem::Options { format, given }));
    }
    if let ([only], Topics::TheOnly) = (&chosen[..], &input_options.bag.topics)
        && read.all.len() == 1
        && is_trunk(&only.topic, only.frame.as_deref().unwrap_or_default(), read.has_low_state)
    {
        let problem = Problem::OnlyTrunk { topic: only.topic.clone() };
        return Err(InputError::of_file(file, problem));
    }
    let topics: Vec<String> = chosen.iter().map(Feed::address).collect();
    let feet = renamed(&names_of(&topics, &read.all), &topics, &input_options.bag, &file)?;
    if !loads.series.is_empty() && loads.series.len() != chosen.len() {
        return Err(load_count(&file, &input_options.bag, topics));
    }
    let mut recordings = Vec::new();
    let mut used = Vec::new();
    for ((k, feed), foot) in chosen.into_iter().enumerate().zip(feet) {
        let load = loads.series.get(k);
        let (stored, contacts) =
            store(feed, foot, load, &mut read.contacts, &container, input_options)?;
        recordings.push(stored);
        used.extend(contacts);
    }
    let mut notices = endings;
    notices.extend(load_notice(&file, &topics, &loads.series));
    notices.extend(contact_notices(&file, read.contact_topics, &used, recordings.len()));
    if input_options.bag.topics == Topics::All {
        notices.extend(selection_notices(&file, &topics, &read.empty));
    }
    if let Some(first) = recordings.first_mut() {
        first.about.notices.splice(0..0, notices);
    }
    Ok(recordings)
}

fn load_count(file: &str, bag: &BagOptions, feet: Vec<String>) -> InputError {
    InputError::of_file(file, Problem::LoadCount { loads: bag.loads.len(), feet })
}

/// Stores the samples of a foot. If it has contacts, they are the estimates, and their topic is returned as well.
fn store(
    feed: Feed,
    foot: Option<String>,
    load: Option<&LoadSeries>,
    contacts: &mut ContactFeeds,
    container: &Container,
    input_options: &InputOptions,
) -> Result<(Stored, Option<String>), InputError> {
    let Container { file, name, .. } = container;
    let foot_contacts = if feed.is_shared {
        // Samples of several feet on one topic have no contacts beside them.
        None
    } else {
        contacts.of_imu(&feed.topic)
    };
    let mut stored = feed.finish(name.clone(), foot, load, input_options, file)?;
    let mut used = None;
    if let Some(foot_contacts) = foot_contacts {
        stored.about.notices.extend(foot_contacts.notices(file));
        if stored.use_contacts(foot_contacts.contacts) {
            used = Some(foot_contacts.topic);
        }
    }
    Ok((stored, used))
}

/// Passes all messages to a visitor in stored order, and reports each part that ends early.
fn visit(
    parts: &mut [ContainerFile],
    file: &str,
    visitor: &mut dyn Visitor,
) -> Result<Vec<Notice>, InputError> {
    let mut notices = Vec::new();
    let is_alone = parts.len() == 1;
    for part in parts {
        let name = if is_alone { file.to_owned() } else { part.path.display().to_string() };
        let early = match part.format {
            Format::Mcap => mcap::visit(part, &name, visitor)?,
            Format::Rosbag1 => rosbag1::visit(part, &name, visitor)?,
            _ => rosbag2::visit(part, &name, visitor)?,
        };
        notices.extend(early.map(|why| {
            let text = format!("{name} ends early ({why}); what is there is read");
            Notice::with_hint(text, Hint::WholeCopy)
        }));
    }
    Ok(notices)
}

/// Returns whether the error is that a bag, or a named topic of it, has no samples of an IMU.
const fn is_without_samples(error: &InputError) -> bool {
    matches!(
        error.problem,
        Problem::NoImu { .. } | Problem::NoMessage { .. } | Problem::NoSuchTopic { .. }
    )
}

/// Returns whether contacts of a foot are selected: at least one topic with them, and every named one.
fn are_chosen(contacts: &ContactFeeds, bag: &BagOptions) -> bool {
    let all = contacts.topics().map(|(topic, _)| topic);
    let all: Vec<String> = all.filter(|topic| !bag.excludes(topic)).collect();
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
    let mut named: Vec<String> = match &bag.topics {
        Topics::Named(named) => named.clone(),
        _ => all.iter().map(|(topic, _)| topic.clone()).collect(),
    };
    named.retain(|topic| !bag.excludes(topic));
    if named.len() > 1 && bag.topics == Topics::TheOnly {
        let topics = all.into_iter().map(|(name, messages)| ImuTopic {
            name,
            frame: None,
            messages: messages as u64,
            rate: None,
        });
        return Err(InputError::of_file(file, Problem::SeveralTopics(topics.collect())));
    }
    let known = all.iter().map(|(topic, _)| topic.clone()).collect();
    let feet = renamed(&names_of(&named, &known), &named, bag, file)?;
    let mut recordings = Vec::new();
    for (topic, foot) in named.into_iter().zip(feet) {
        let stored = contacts.of_topic(&topic).and_then(|foot_contacts| {
            let notices = foot_contacts.notices(file);
            let mut stored = Stored::of_contacts(name.to_owned(), foot, foot_contacts.contacts)?;
            stored.about.notices.extend(notices);
            let alone = format!(
                "{file} has contacts on {topic} without samples; they are used as they were recorded{STREAM_ADVICE}"
            );
            stored.about.notices.push(alone.into());
            stored.about.address = Some(topic);
            Some(stored)
        });
        recordings.extend(stored);
    }
    Ok(recordings)
}

/// Returns sentences for a selection of all topics: on a topic that may be the robot's trunk, and on topics without a
/// message.
fn selection_notices(file: &str, topics: &[String], empty: &[String]) -> Vec<Notice> {
    let trunks = trunks(topics).map(|topic| {
        let text = format!("{file} is read with {topic} as a foot; if it is the robot's trunk");
        Notice::with_hint(text, Hint::LeaveOut(topic.clone()))
    });
    let empty = empty.iter().map(|topic| Notice::from(format!("{file}, topic {topic} is empty")));
    trunks.chain(empty).collect()
}

/// Returns a sentence that lists the load of each foot, if there are several feet, or if the load of the only foot has
/// the name of another leg.
fn load_notice(file: &str, feet: &[String], loads: &[LoadSeries]) -> Option<Notice> {
    let mut has_other = false;
    let pairs = feet.iter().zip(loads).map(|(foot, load)| {
        let is_other = names_another_leg(&load.topic.to_string(), foot);
        has_other |= is_other;
        let remark = if is_other { ", which has the name of another leg" } else { "" };
        format!("{} of {foot}{remark}", load.topic)
    });
    let pairs: Vec<String> = pairs.collect();
    let is_said = pairs.len() > 1 || has_other;
    is_said.then(|| Notice::from(format!("{file}: loads are {}", pairs.join(", "))))
}

/// Returns sentences on the contacts in a bag of `feet` feet: on the topics `used`, and on the other topics if a foot
/// has none.
fn contact_notices(
    file: &str,
    mut topics: Vec<String>,
    used: &[String],
    feet: usize,
) -> impl Iterator<Item = Notice> {
    let taken = (!used.is_empty()).then(|| {
        let topics = used.join(", ");
        let text = format!("{file} has contacts on {topics}, which are used as they were recorded");
        Notice::with_hint(text, Hint::EstimateFromSamples)
    });
    topics.retain(|topic| !used.contains(topic));
    let ignored = (!topics.is_empty() && used.len() < feet).then(|| {
        Notice::from(format!(
            "{file} has contacts on {}, which are not read: the estimate is computed again from the samples",
            topics.join(", ")
        ))
    });
    taken.into_iter().chain(ignored)
}

#[cfg(test)]
mod tests;
