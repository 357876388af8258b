//! Selection of the IMUs that are feet, and the names of the feet.

use std::collections::BTreeSet;

use crate::messages::Channel;
use crate::pairing::names_a_foot;
use options::{BagOptions, InputOptions, Topics, is_among};
use samples::ros::Imu;
use stored::error::{InputError, Problem, TopicType};

/// Maximum number of frames of one topic: enough for the feet of any robot and other IMUs.
pub(super) const MOST_FRAMES: usize = 64;

/// Topic and frame of an IMU; by the topic first, if they are sorted.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ImuKey {
    /// Topic, or part of its messages.
    pub(super) topic: String,
    pub(super) frame: String,
}

/// Sort key of feet in the order of their selection: by topic, then by frame; by name if none are named.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct FootOrder {
    /// Place of the topic among the named topics.
    topic_place: Option<usize>,
    topic: String,
    /// Place of the frame among the named frames.
    frame_place: Option<usize>,
    frame: String,
}

impl FootOrder {
    pub(super) fn of(bag: &BagOptions, topic: &str, frame: &str) -> Self {
        let topic_place = match &bag.topics {
            Topics::Named(named) => named.iter().position(|name| name == topic),
            Topics::All | Topics::TheOnly => None,
        };
        let frame_place = bag.frames.iter().position(|name| name == frame);
        Self { topic_place, topic: topic.to_owned(), frame_place, frame: frame.to_owned() }
    }
}

/// Returns whether the frame of a message is selected.
pub(super) fn is_wanted(frame: &str, input_options: &InputOptions) -> bool {
    let frames = &input_options.bag.frames;
    frames.is_empty() || frames.iter().any(|wanted| wanted == frame)
}

/// Named IMUs in the messages of a channel, each with the part of the message that it is: `/feet.imu[0]` is the part
/// `imu[0]` of `/feet`, and `/lowstate` the whole message.
pub(super) fn addresses<'a>(
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
pub(super) fn is_imu(channel: &Channel) -> bool {
    channel.message == Imu::TYPE && channel.encoding == "cdr"
}

/// Topics with samples of an IMU that the selection excludes.
pub(super) fn hidden_imus(channels: &[Channel], bag: &BagOptions) -> BTreeSet<String> {
    let is_hidden = |channel: &&Channel| is_imu(channel) && bag.excludes(&channel.topic);
    let hidden = channels.iter().filter(is_hidden);
    hidden.map(|channel| channel.topic.clone()).collect()
}

/// Topics of channels, with the types of their messages.
pub(super) fn topic_types(channels: &[Channel]) -> Vec<TopicType> {
    let topic_type = |channel: &Channel| TopicType {
        topic: channel.topic.clone(),
        message: channel.message.clone(),
        encoding: channel.encoding.clone(),
    };
    channels.iter().map(topic_type).collect()
}

/// Returns the names of feet, after the options have replaced some of them. An option identifies a foot by its name,
/// its topic, or a part of its topic.
pub(super) fn renamed(
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
            let problem =
                Problem::NoFootToRename { name: rename.old.clone(), feet: topics.to_vec() };
            return Err(InputError::of_file(file, problem));
        };
        new[at] = Some(rename.new.clone());
    }
    for (at, name) in new.iter().enumerate() {
        if let Some(name) = name.clone()
            && new != names
            && is_among(&name, new[..at].iter().flatten())
        {
            return Err(InputError::of_file(file, Problem::TwoFeet(name)));
        }
    }
    Ok(new)
}

/// Words in addresses that name a sensor and not a foot.
const SENSORS: [&str; 3] = ["imu", "data", "raw"];

/// Names of the selected IMUs as feet, by the addresses of all IMUs in the bag. Even an IMU that is the only one
/// selected has a name if the bag has others, so that the name of a foot does not depend on the others read.
pub(super) fn names_of(selected: &[String], all: &BTreeSet<String>) -> Vec<Option<String>> {
    match selected {
        [only] if all.len() > 1 => vec![of_several(only, all)],
        [_] => vec![None],
        several => names(several).into_iter().map(Some).collect(),
    }
}

/// Name of an IMU among several: its distinct part, if that is one word and not the name of a sensor; else
/// [`last_word`].
fn of_several(only: &str, all: &BTreeSet<String>) -> Option<String> {
    let all: Vec<String> = all.iter().cloned().collect();
    let mut named = all.iter().zip(names(&all));
    let distinct = named.find(|(address, _)| *address == only);
    let distinct = distinct.map(|(_, name)| name);
    let is_word = |name: &String| !name.contains('/') && !SENSORS.contains(&name.as_str());
    distinct.filter(is_word).or_else(|| last_word(only))
}

/// Words for a robot's trunk in topics, and for sensors on it that have an IMU of their own.
const TRUNK_WORDS: [&str; 12] = [
    "trunk", "base", "body", "torso", "pelvis", "chest", "waist", "head", "camera", "lidar",
    "livox", "ouster",
];

/// Addresses that may be the trunk of a robot, among several. Such an address has a word for a trunk. If other
/// addresses name a part of the robot, it may also be an address that names nothing but a sensor.
pub(super) fn trunks(addresses: &[String]) -> impl Iterator<Item = &String> {
    let only_sensors = |address: &String| words(address).all(|word| is_one_of(&SENSORS, &word));
    let has_names = !addresses.iter().all(only_sensors);
    addresses.iter().filter(move |address| {
        let names_trunk = words(address).any(|word| is_one_of(&TRUNK_WORDS, &word));
        addresses.len() > 1 && (names_trunk || has_names && only_sensors(address))
    })
}

/// Frame of the trunk's IMU on robots of Unitree and others.
const TRUNK_FRAME: &str = "imu_link";

/// Returns whether the only IMU is probably on the trunk: its topic or its frame names the trunk, or `has_low_state` tells
/// that a Unitree, whose feet have no IMU, also sends its state.
#[must_use]
pub fn is_trunk(topic: &str, frame: &str, has_low_state: bool) -> bool {
    let names_trunk = words(topic).chain(words(frame)).any(|word| is_one_of(&TRUNK_WORDS, &word));
    let is_named = names_a_foot(topic) || names_a_foot(frame);
    !is_named && (names_trunk || has_low_state || frame == TRUNK_FRAME)
}

/// Words of an address, in lower case.
fn words(address: &str) -> impl Iterator<Item = String> {
    let words = address.split(['/', '.', '_']).filter(|word| !word.is_empty());
    words.map(str::to_lowercase)
}

fn is_one_of(words: &[&str], word: &str) -> bool {
    words.contains(&word)
}

/// Last part of an address that does not name a sensor.
pub(super) fn last_word(address: &str) -> Option<String> {
    let mut parts = address.split('/').filter(|part| !part.is_empty());
    let is_sensor = |part: &&str| SENSORS.iter().any(|word| part.contains(word));
    parts.rfind(|part| !is_sensor(part)).map(str::to_owned)
}

/// The distinct parts of several topics: `fl` and `fr` for `/imu/fl` and `/imu/fr`, `fl_foot` and `fr_foot` for
/// `/fl_foot/imu` and `/fr_foot/imu`.
fn names(topics: &[String]) -> Vec<String> {
    let whole: Vec<&str> = topics.iter().map(|topic| topic.trim_matches('/')).collect();
    let parts: Vec<Vec<&str>> = whole.iter().map(|topic| topic.split('/').collect()).collect();
    // Each topic keeps a part.
    let start = common(parts.iter().map(|parts| parts.iter().rev().skip(1).rev()));
    let end = common(parts.iter().map(|parts| parts.iter().skip(1).rev()));
    let short = parts.iter().map(|parts| {
        let own = parts.get(start..parts.len() - end);
        own.unwrap_or_default().join("/")
    });
    let short: Vec<String> = short.collect();
    if short.iter().any(String::is_empty) {
        return whole.into_iter().map(str::to_owned).collect();
    }
    short
}

/// Number of the first parts that all topics have in common.
fn common<'a, P: Iterator<Item = &'a &'a str>>(mut topics: impl Iterator<Item = P>) -> usize {
    let first: Vec<&&str> = topics.next().into_iter().flatten().collect();
    let equal = |parts: P| parts.zip(&first).take_while(|(a, b)| a == *b).count();
    topics.map(equal).min().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(topics: &[&str]) -> Vec<String> {
        names(&topics.iter().map(|topic| (*topic).to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn only_imu_of_the_trunk_is_told_from_that_of_a_foot() {
        for (topic, frame, has_low_state, trunk) in [
            ("/trunk/imu", "", false, true),
            ("/imu", "imu_link", false, true),
            ("/imu/data", "base_link", false, true),
            ("/camera/imu", "camera_imu_optical_frame", false, true),
            ("/imu", "waist_link", false, true),
            ("/imu", "imu", true, true),
            ("/imu", "imu", false, false),
            ("/fl_foot/imu", "imu_link", true, false),
            ("/imu", "left_sole", true, false),
        ] {
            assert_eq!(is_trunk(topic, frame, has_low_state), trunk, "{topic}, {frame}");
        }
    }

    #[test]
    fn trunk_is_known_by_a_word_of_its_topic() {
        let trunks_of = |topics: &[&str]| {
            let topics: Vec<String> = topics.iter().map(|topic| (*topic).to_owned()).collect();
            trunks(&topics).cloned().collect::<Vec<_>>()
        };
        for topic in ["/trunk/imu", "/imu/base_link", "/Body_imu", "/imu/data", "/imu_raw"] {
            assert_eq!(trunks_of(&["/imu/fl", topic, "/fr/imu"]), [topic]);
            assert!(trunks_of(&[topic]).is_empty(), "{topic}");
        }
        assert!(trunks_of(&["/imu/fl", "/database/imu"]).is_empty());
        // Two sensors of the only foot.
        assert!(trunks_of(&["/imu", "/imu/raw"]).is_empty());
    }

    #[test]
    fn foot_is_named_by_the_distinct_part_of_its_topic() {
        for (topics, feet) in [
            (["/imu/fl", "/imu/fr"], ["fl", "fr"]),
            (["/fl_foot/imu", "/fr_foot/imu"], ["fl_foot", "fr_foot"]),
            (["/leg_1/imu/data", "/leg_2/imu/data"], ["leg_1", "leg_2"]),
            (["/imu_left", "/imu_right"], ["imu_left", "imu_right"]),
            (["/robot/1/imu", "/robot/12/imu"], ["1", "12"]),
            (["/a/left/imu", "/b/right/imu"], ["a/left", "b/right"]),
            (["/imu", "/imu/raw"], ["imu", "imu/raw"]),
            (["/x/fl/imu", "/x/fl/imu2"], ["imu", "imu2"]),
        ] {
            assert_eq!(named(&topics), feet, "{topics:?}");
        }
    }

    #[test]
    fn foot_selected_alone_keeps_the_name_that_it_has_among_all() {
        for (one, others, name) in [
            ("/imu/fl", &["/imu/fr"][..], Some("fl")),
            ("/fl_foot/imu", &["/fr_foot/imu"], Some("fl_foot")),
            ("/leg/fl/imu/front", &["/leg/fr/imu/front"], Some("fl")),
            ("/foot_imus/rl_foot", &["/foot_imus/fl_foot"], Some("rl_foot")),
            ("/imu_left", &["/imu_right"], Some("imu_left")),
            // The trunk has nothing in common with the topics of feet.
            ("/imu/fl", &["/imu/fr", "/trunk/imu"], Some("fl")),
            ("/fl/imu", &["/fl/imu2"], Some("fl")),
            ("/imu", &["/trunk_imu"], None),
            ("/imu/fl", &[], None),
        ] {
            let all = others.iter().copied().chain([one]);
            let all = all.map(str::to_owned).collect();
            let names = names_of(&[one.to_owned()], &all);
            assert_eq!(names, [name.map(str::to_owned)], "{one}, {others:?}");
        }
    }
}
