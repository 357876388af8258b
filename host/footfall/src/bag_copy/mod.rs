//! A copy of a bag with the contacts and events of its feet beside the messages of others, for `footfall replay --output`.
//!
//! | part | file |
//! |---|---|
//! | contacts and events of a foot | `stream` |
//! | states of a Unitree robot with other forces | `low_state` |

mod low_state;
mod stream;

use std::io::{self, Write};
use std::path::Path;

use crate::ros::compat::{FEET, LOW_STATE_TOPIC};
use crate::ros::{AllFeet, Compat, McapFile, RosMessage};
use mcap::write::NoSeek;
use recordings::input::bag::{Channel, Written, copy};

use crate::convert::earliest;
use crate::error::Error;
use crate::files::write_file;
use crate::foot_names::unlike;
use crate::mcap_recording::io_error;
use crate::messages::warn;
use crate::replay_output::CopiedFoot;
use low_state::LowState;
use stream::Stream;

pub use low_state::LowStates;

/// Messages of all feet in the copy.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OfAllFeet {
    /// Programs whose messages are written.
    pub compats: Vec<Compat>,
    /// States of the robot that are written again with the forces of the estimates.
    pub low_states: Option<LowStates>,
}

impl OfAllFeet {
    /// Topics of the messages.
    fn topics(&self) -> impl Iterator<Item = String> {
        let compats = self.compats.iter().flat_map(|compat| compat.topics());
        let low_states = self.low_states.iter();
        compats.chain(low_states.map(|_| LOW_STATE_TOPIC.to_owned()))
    }

    /// Option that wants the messages, if any are wanted.
    fn option(&self) -> Option<&'static str> {
        match (&self.low_states, &self.compats[..]) {
            (Some(_), _) => Some("--lowstate"),
            (None, [_, ..]) => Some("--compat"),
            (None, []) => None,
        }
    }

    /// Checks that each foot has a place of its own in the messages, and warns about places without a foot.
    fn check_places(feet: &[CopiedFoot]) -> Result<(), Error> {
        let has_none = |(index, foot): &(usize, &CopiedFoot)| {
            let mut before = feet[..*index].iter();
            foot.place.is_none() || before.any(|other| other.place == foot.place)
        };
        if let Some((_, foot)) = feet.iter().enumerate().find(has_none) {
            let name = foot.name.clone();
            return Err(Error::NoPlace { name });
        }
        let is_absent = |at: &usize| feet.iter().all(|foot| foot.place != Some(*at));
        let absent = (0..FEET.len()).filter(is_absent).map(|at| FEET[at][0]);
        let absent: Vec<&str> = absent.collect();
        if !absent.is_empty() {
            warn(format!(
                "the bag has no foot {}: in messages of all feet each counts as in swing",
                absent.join(", ")
            ));
        }
        Ok(())
    }
}

/// Copies the messages of the bag `input`, with the contacts and events of its feet, to the MCAP file `path`. A contact is
/// written when its sample was, to a millisecond, and an event at its time; stamps are those of the samples. Recorded
/// contacts are copied like other messages, and left out where the estimate is made `again`. Returns a sentence about each
/// part that ends early.
///
/// # Errors
/// The bag has a topic of the copy, lacks the robot's states, or cannot be read or written.
pub fn write(
    input: &Path,
    feet: &mut [CopiedFoot],
    of_all_feet: &OfAllFeet,
    again: bool,
    path: &Path,
) -> Result<Vec<String>, Error> {
    let mut notices = Vec::new();
    let file = input.display().to_string();
    if let Some(option) = of_all_feet.option() {
        if feet.iter().any(|foot| foot.stored.has_estimates()) {
            return Err(Error::CopiedContacts { file, option });
        }
        OfAllFeet::check_places(feet)?;
    }
    write_file(path, |to| {
        let mut bag = McapFile::new(NoSeek::new(to)).map_err(io_error)?;
        let mut streams = Vec::new();
        let mut names: Vec<String> = Vec::new();
        let mut places = Vec::new();
        for foot in feet.iter_mut().filter(|foot| !foot.stored.has_estimates()) {
            places.push(foot.place);
            let name = unlike(&foot.name, &names);
            streams.push(Stream::of(foot, &name)?);
            names.push(name);
        }
        let topics = streams.iter().flat_map(Stream::topics);
        let topics = topics.chain(of_all_feet.topics()).collect();
        let compats = &of_all_feet.compats;
        let mut merging = Merging {
            file: &file,
            bag: &mut bag,
            streams: &mut streams,
            topics,
            places,
            again,
            all_feet: (!compats.is_empty()).then(|| AllFeet::new(compats)),
            low_state: of_all_feet.low_states.as_ref().map(LowState::new),
        };
        let copied = copy(input, &mut |channel, written, payload| {
            merging.message(channel, written, payload)
        });
        notices = copied.map_err(|error| carried(error.into()))??;
        merging.messages_until(i64::MAX)?;
        if let Some(states) = &of_all_feet.low_states
            && merging.low_state.is_some_and(|state| !state.is_found)
        {
            let what = "the bag has no message on it".to_owned();
            return Err(no_forces(&file, &states.topic, what));
        }
        bag.finish().map_err(io_error)
    })?;
    Ok(notices)
}

/// Carries an error out of a writer.
fn carried(error: Error) -> io::Error {
    io::Error::other(error)
}

fn no_forces(file: &str, topic: &str, what: String) -> io::Error {
    let [file, topic] = [file, topic].map(str::to_owned);
    carried(Error::NoForces { file, topic, what })
}

/// Receiver that puts messages of the feet between those of others.
struct Merging<'a, 'b, W: Write + io::Seek> {
    /// Name of the bag in messages.
    file: &'a str,
    bag: &'a mut McapFile<W>,
    streams: &'a mut [Stream<'b>],
    /// Topics of the feet.
    topics: Vec<String>,
    /// Whether messages on these topics are left out.
    again: bool,
    /// Place of each foot in messages of all feet, if it has one.
    places: Vec<Option<usize>>,
    all_feet: Option<AllFeet>,
    low_state: Option<LowState>,
}

impl<W: Write + io::Seek> Merging<'_, '_, W> {
    /// Writes the messages of the feet up to a time of writing, µs.
    fn messages_until(&mut self, until_us: i64) -> io::Result<()> {
        while let Some((due, index)) = earliest(self.streams, |stream| {
            let due = stream.due()?.filter(|due| due.written_us <= until_us);
            Ok(due.map(|due| (due.written_us, due)))
        })? {
            let (messages, load) = self.streams[index].take(due);
            for published in messages {
                self.bag.write(&published).map_err(io_error)?;
                let RosMessage::Contact(contact) = published.message else {
                    continue;
                };
                let Some(place) = self.places[index] else {
                    continue;
                };
                let stands = contact.valid && contact.decision;
                if let Some(low_state) = &mut self.low_state {
                    low_state.set(place, stands, load);
                }
                if let Some(all_feet) = &mut self.all_feet {
                    let at = published.at;
                    for published in all_feet.take_at(place, &contact, at, at.as_micros()) {
                        self.bag.write(&published).map_err(io_error)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Writes a message of the bag, after those of the feet that precede it.
    fn message(&mut self, channel: &Channel, written: Written, payload: &[u8]) -> io::Result<()> {
        if self.topics.contains(&channel.topic) {
            if self.again {
                return Ok(());
            }
            let (file, topic) = (self.file.to_owned(), channel.topic.clone());
            return Err(carried(Error::TopicTaken { file, topic }));
        }
        // A contact follows its sample, whose log time is rounded to µs.
        self.messages_until((written.log_ns.saturating_sub(1000)).div_euclid(1000))?;
        self.bag.copy(channel, written, payload).map_err(io_error)?;
        let Some(low_state) = &mut self.low_state else {
            return Ok(());
        };
        let replaced = low_state.replaced(channel, payload);
        match replaced.map_err(|what| no_forces(self.file, &channel.topic, what))? {
            None => Ok(()),
            Some(message) => {
                let channel = Channel { topic: LOW_STATE_TOPIC.to_owned(), ..channel.clone() };
                self.bag.copy(&channel, written, &message).map_err(io_error)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fmt::Write as _;

    use estimator_core::Params;
    use recordings::analysis::replay::span::Span;
    use recordings::input::{Hints, Opened};

    use super::*;

    #[test]
    fn feet_with_similar_names_have_topics_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let mut bag = McapFile::new(std::fs::File::create(path("walk.mcap")).unwrap()).unwrap();
        let other = Channel {
            topic: "/other".to_owned(),
            message: "my_msgs/msg/Other".to_owned(),
            schema: None,
            encoding: "json".to_owned(),
            metadata: BTreeMap::new(),
        };
        let written = Written { log_ns: 7, publish_ns: 7, sequence: None };
        bag.copy(&other, written, b"{}").unwrap();
        bag.finish().unwrap();
        let mut table = "t,ax,ay,az,wx,wy,wz\n".to_owned();
        for k in 0..50 {
            writeln!(table, "{},0,0,9.81,0,0,0", 0.01 * f64::from(k)).unwrap();
        }
        std::fs::write(path("walk.csv"), table).unwrap();
        let foot = |name: &str| {
            let opened = Opened::new(&path("walk.csv"), None).unwrap();
            let mut stored = opened.store_all(&Hints::default()).unwrap();
            CopiedFoot {
                name: name.to_owned(),
                place: None,
                stored: stored.remove(0),
                params: Params::default(),
                span: Span::default(),
                events: Vec::new(),
            }
        };
        let mut feet = ["front left", "front_left"].map(foot);
        let of_all_feet = OfAllFeet::default();
        write(&path("walk.mcap"), &mut feet, &of_all_feet, false, &path("contacts.mcap")).unwrap();
        let bytes = std::fs::read(path("contacts.mcap")).unwrap();
        let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
        let counts = summary.stats.unwrap().channel_message_counts;
        for part in ["front_left", "front_left_2"] {
            let topic = format!("/footfall/{part}/contact");
            let mut channels = summary.channels.values();
            let channel = channels.find(|channel| channel.topic == topic);
            assert_eq!(counts[&channel.expect(part).id], 50, "{part}");
        }
    }
}
