//! Writes the copy of bags: merges the contacts and events of their feet into the other messages. It may repeat the
//! states of a Unitree robot with forces of the feet from the estimates, for programs that compare the forces with a
//! threshold.

use std::collections::VecDeque;
use std::io::{self, Write};
use std::iter::Peekable;
use std::path::PathBuf;

use bags::{Channel, CopyError, MessageTimes, Replacement, ReplacementError, copy_merged};
use estimator_core::{ContactEstimate, Load, Timestamp};
use mcap::write::NoSeek;
use replay::events::ContactEvent;
use samples::estimate::Estimator;
use stored::About;

use super::{CopiedFoot, CopyArguments};
use crate::commands::options::FootTwice;
use crate::error::{Error, Worded};
use crate::ros::compat::{Body, FEET, LOW_STATE_TOPIC, RIGHT_FIRST, STANDS};
use crate::ros::mcap_file::earliest;
use crate::ros::topics::unused_name;
use crate::ros::{AllFeet, EstimateMessages, McapFile, Published, RosMessage};

/// Copy of the messages of bags, in order of their times of writing, with the contacts and events of their feet.
///
/// A contact has the time of writing of its sample, within a millisecond, and an event its own time; stamps are those
/// of the samples.
pub(in super::super) struct BagCopy<'a> {
    /// The bags.
    inputs: &'a [PathBuf],
    /// Names of the files in messages.
    files: Vec<String>,
    arguments: &'a CopyArguments,
    /// The feet in messages of all feet.
    body: Body,
    /// Whether recorded contacts are left out, because the estimate is made again. Otherwise they are copied like other
    /// messages.
    leaves_out_recorded: bool,
}

impl<'a> BagCopy<'a> {
    pub(in super::super) fn new(
        inputs: &'a [PathBuf],
        arguments: &'a CopyArguments,
        body: Body,
        leaves_out_recorded: bool,
    ) -> Self {
        let files = inputs.iter().map(|input| input.display().to_string()).collect();
        Self { inputs, files, arguments, body, leaves_out_recorded }
    }

    /// Checks, before anything is written, that these feet can be in one copy.
    ///
    /// # Errors
    /// Two bags have the same foot. If messages of all feet are requested, it is also an error if the contacts of a foot
    /// were recorded, if a foot has no place, or if a place has no foot.
    pub(in super::super) fn check(&self, feet: &[CopiedFoot]) -> Result<(), Error> {
        check_names(feet)?;
        let Some(option) = self.arguments.option() else {
            return Ok(());
        };
        if feet.iter().any(|foot| foot.stored.has_estimates()) {
            return Err(MergeError::CopiedContacts { file: self.files.join(", "), option }.into());
        }
        Ok(self.arguments.check_places(self.body, feet)?)
    }

    /// Writes the copy, an MCAP file, with the contacts and events of these feet.
    ///
    /// # Errors
    /// A bag has a topic of the copy, none has the robot's states, a bag cannot be read, or the copy cannot be written.
    /// The first three are [`wrapped`].
    pub(in super::super) fn write(
        &self,
        feet: &mut [CopiedFoot],
        to: &mut dyn Write,
    ) -> io::Result<()> {
        let mut bag = McapFile::new(NoSeek::new(to))?;
        let mut streams = Vec::new();
        let mut names: Vec<String> = Vec::new();
        let mut places = Vec::new();
        for foot in feet.iter_mut().filter(|foot| !foot.stored.has_estimates()) {
            places.push(foot.place);
            // Names of feet may differ only in characters that topics cannot hold.
            let name = unused_name(&foot.name, &names);
            streams.push(EstimateStream::of(foot, &name)?);
            names.push(name);
        }
        let arguments = self.arguments;
        let topics = streams.iter().flat_map(EstimateStream::topics);
        let topics = topics.chain(arguments.topics(self.body)).collect();
        let all_feet = AllFeet::unless_empty(&arguments.compat, arguments.wrench_force);
        let all_feet = all_feet.map_err(|error| wrapped(error.into()))?;
        let mut merger = Merger {
            file: "",
            bag: &mut bag,
            streams: &mut streams,
            topics,
            leaves_out_topics: self.leaves_out_recorded,
            places,
            all_feet,
            low_state: LowStateForces::of(arguments),
        };
        let copied = copy_merged(self.inputs, &mut |index, channel, times, payload| {
            merger.file = &self.files[index];
            merger.message(channel, times, payload)
        });
        copied.map_err(|error| match error {
            CopyError::Input(error) => wrapped(error.into()),
            CopyError::Receiver(error) => error,
        })?;
        merger.messages_until(i64::MAX)?;
        if let Some(states) = merger.low_state.filter(|states| !states.is_found) {
            let cause = NoForcesCause::NoMessage;
            return Err(no_forces(&self.files.join(", "), &states.topic, cause));
        }
        bag.finish()
    }
}

impl CopyArguments {
    /// Topics of the messages about a robot.
    fn topics(&self, body: Body) -> impl Iterator<Item = String> {
        let compats = self.compat.iter().flat_map(move |compat| compat.topics(body));
        let low_states = self.lowstate.iter();
        compats.chain(low_states.map(|_| LOW_STATE_TOPIC.to_owned()))
    }

    /// Checks that each foot has its own place in the messages, and each place a foot if a message needs all feet.
    fn check_places(&self, body: Body, feet: &[CopiedFoot]) -> Result<(), MergeError> {
        let is_absent = |place: usize| feet.iter().all(|foot| foot.place != Some(place));
        let places = body.feet().iter().enumerate();
        let absent = places.filter(|(place, _)| is_absent(*place)).map(|(_, names)| names[0]);
        let absent: Vec<&str> = absent.collect();
        if let Some(foot) = first_without_own_place(feet) {
            let free = absent.first().copied();
            return Err(MergeError::NoPlace { name: foot.name.clone(), names: body.names(), free });
        }
        // A message of all feet must give every place a value. A foot that is not in the bag may be standing, so "in the
        // air" would be a guess.
        let needs_all_feet =
            self.lowstate.is_some() || self.compat.iter().any(|compat| !compat.is_of_one());
        if needs_all_feet && !absent.is_empty() {
            return Err(MergeError::AbsentFeet {
                option: self.option().unwrap_or_default(),
                absent: absent.join(", "),
                names: body.names(),
            });
        }
        Ok(())
    }
}

/// Returns the first foot without a place, or whose place an earlier foot has taken.
fn first_without_own_place(feet: &[CopiedFoot]) -> Option<&CopiedFoot> {
    for (index, foot) in feet.iter().enumerate() {
        let is_taken = feet[..index].iter().any(|earlier| earlier.place == foot.place);
        if foot.place.is_none() || is_taken {
            return Some(foot);
        }
    }
    None
}

/// Checks that no two bags have a foot of the same name.
fn check_names(feet: &[CopiedFoot]) -> Result<(), FootTwice> {
    for (index, foot) in feet.iter().enumerate() {
        let has_same_name =
            |earlier: &&CopiedFoot| earlier.name == foot.name && earlier.file != foot.file;
        if let Some(earlier) = feet[..index].iter().find(has_same_name) {
            let files = [earlier, foot].map(|foot| foot.file.clone());
            return Err(FootTwice { name: foot.name.clone(), files });
        }
    }
    Ok(())
}

/// Reason the contacts of feet cannot be merged into bags.
#[derive(Debug, thiserror::Error)]
enum MergeError {
    /// A bag has a topic that contacts are written to.
    #[error(
        "{file} already has the topic {topic}, from an earlier estimate or from another program; --estimate-again replaces its messages"
    )]
    TopicTaken {
        /// Bag as given.
        file: String,
        /// Topic of the contacts of a foot, or of messages of all feet.
        topic: String,
    },
    /// An option asks for messages of all feet, but the contacts of the bag are copied unchanged.
    #[error("{file} has contacts, which are copied unchanged: {option} needs --estimate-again")]
    CopiedContacts {
        /// Bags as given.
        file: String,
        /// Option of the messages.
        option: &'static str,
    },
    /// A foot has no place in messages of all feet.
    #[error(
        "the foot {name} has no place of its own in the messages of all feet, which are those of {names}: {}leave its topic out with --not-topic",
        free.map(|free| format!("name it, as in --rename {name}={free}, or ")).unwrap_or_default()
    )]
    NoPlace {
        /// Name of the foot.
        name: String,
        /// Names of all feet.
        names: String,
        /// The first of these names that no foot has, if any.
        free: Option<&'static str>,
    },
    /// Messages of all feet are to be written, and feet are missing.
    #[error(
        "missing feet: {absent}; {option} writes messages of {names}, and a missing foot may be standing; --compat bool and wrench have a topic for each foot"
    )]
    AbsentFeet {
        /// Option that requests the messages.
        option: &'static str,
        /// Names of the missing feet.
        absent: String,
        /// Names of all feet.
        names: String,
    },
    /// Messages whose forces are to be replaced have none.
    #[error("{file}, topic {topic}: no forces of four feet to replace: {cause}")]
    NoForces {
        /// Bag as given.
        file: String,
        /// Topic of the robot's states.
        topic: String,
        /// Reason.
        cause: NoForcesCause,
    },
}

impl Worded for MergeError {}

/// Reason messages have no forces that could be replaced.
#[derive(Debug, thiserror::Error)]
enum NoForcesCause {
    /// The topic has no message.
    #[error("the bag has no message on it")]
    NoMessage,
    /// The numbers are not found in a message.
    #[error(transparent)]
    Replacement(#[from] ReplacementError),
}

/// Wraps an error to return it from a writer. [`write_file`](crate::files::write_file) says how it is unwrapped.
fn wrapped(error: Error) -> io::Error {
    io::Error::other(error)
}

fn no_forces(file: &str, topic: &str, cause: NoForcesCause) -> io::Error {
    let [file, topic] = [file, topic].map(str::to_owned);
    wrapped(MergeError::NoForces { file, topic, cause }.into())
}

/// Merges messages of the feet into the copied messages, in order of their times of writing.
struct Merger<'a, 'b, W: Write + io::Seek> {
    /// Name of the bag in messages.
    file: &'a str,
    bag: &'a mut McapFile<W>,
    streams: &'a mut [EstimateStream<'b>],
    /// Topics that the copy adds.
    topics: Vec<String>,
    /// Whether messages of the bag on these topics are left out. Otherwise they are an error.
    leaves_out_topics: bool,
    /// Place of each foot in messages of all feet, if it has one.
    places: Vec<Option<usize>>,
    all_feet: Option<AllFeet>,
    low_state: Option<LowStateForces>,
}

impl<W: Write + io::Seek> Merger<'_, '_, W> {
    /// Writes the messages of the feet up to a time of writing, µs.
    fn messages_until(&mut self, until_us: i64) -> io::Result<()> {
        while let Some((due, index)) = earliest(self.streams, |stream| {
            let due = stream.due()?.filter(|due| due.written_us <= until_us);
            Ok(due.map(|due| (due.written_us, due)))
        })? {
            let (messages, load) = self.streams[index].pop_messages(due);
            for published in messages {
                self.bag.write(&published)?;
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
                        self.bag.write(&published)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// Writes a message of the bag, after the messages of the feet that precede it.
    fn message(
        &mut self,
        channel: &Channel,
        times: MessageTimes,
        payload: &[u8],
    ) -> io::Result<()> {
        if self.topics.contains(&channel.topic) {
            if self.leaves_out_topics {
                return Ok(());
            }
            let (file, topic) = (self.file.to_owned(), channel.topic.clone());
            return Err(wrapped(MergeError::TopicTaken { file, topic }.into()));
        }
        // A contact with the same time of writing follows its sample. The times of contacts are rounded to µs.
        self.messages_until((times.log_ns.saturating_sub(1000)).div_euclid(1000))?;
        self.bag.copy(channel, times, payload)?;
        let Some(low_state) = &mut self.low_state else {
            return Ok(());
        };
        let replaced = low_state.replaced(channel, payload);
        match replaced.map_err(|error| no_forces(self.file, &channel.topic, error.into()))? {
            None => Ok(()),
            Some(message) => {
                let channel = Channel { topic: LOW_STATE_TOPIC.to_owned(), ..channel.clone() };
                self.bag.copy(&channel, times, &message)
            }
        }
    }
}

/// Estimates of a foot, each with the load of its sample.
type Estimated<'a> = Box<dyn Iterator<Item = io::Result<(ContactEstimate, Option<Load>)>> + 'a>;

/// Contacts and events of a foot.
struct EstimateStream<'a> {
    about: About,
    messages: EstimateMessages,
    estimates: Peekable<Estimated<'a>>,
    /// Events in order of time.
    events: VecDeque<ContactEvent>,
}

/// Time of the next messages, µs since 1970.
#[derive(Clone, Copy, Debug)]
struct Due {
    /// Time of the sample, or of the event.
    time_us: i64,
    /// Time of writing.
    written_us: i64,
    is_event: bool,
}

impl<'a> EstimateStream<'a> {
    /// Starts the estimate of a foot whose topics have this name.
    fn of(foot: &'a mut CopiedFoot, name: &str) -> io::Result<Self> {
        let about = foot.stored.about.clone();
        let estimator = Estimator::new(about.sample_rate, about.gravity, &foot.params);
        let mut estimator = estimator.map_err(io::Error::other)?;
        let samples = foot.stored.samples()?;
        let span = foot.span;
        let estimates = samples.map(move |sample| {
            let sample = sample?;
            Ok((estimator.update(&sample), sample.load))
        });
        let is_in_span = move |estimated: &io::Result<(ContactEstimate, _)>| match estimated {
            Ok((estimate, _)) => span.contains(estimate.timestamp),
            Err(_) => true,
        };
        let estimates: Estimated<'_> = Box::new(estimates.filter(is_in_span));
        let mut events = foot.events.clone();
        events.sort_by_key(|event| event.time);
        Ok(Self {
            messages: EstimateMessages::new(name),
            about,
            estimates: estimates.peekable(),
            events: events.into(),
        })
    }

    /// Topics of the messages.
    fn topics(&self) -> impl Iterator<Item = String> {
        self.messages.topics().map(ToString::to_string).into_iter()
    }

    /// Times of the next messages; an event follows the contact of its time.
    ///
    /// # Errors
    /// The samples cannot be read.
    fn due(&mut self) -> io::Result<Option<Due>> {
        if let Some(Err(error)) = self.estimates.next_if(Result::is_err) {
            return Err(error);
        }
        let estimate = self.estimates.peek().and_then(|next| next.as_ref().ok());
        let contact = estimate.map(|(estimate, _)| (estimate.timestamp, false));
        let event = self.events.front().map(|event| (event.time, true));
        let next = contact.into_iter().chain(event).min();
        Ok(next.map(|(time, is_event)| {
            let since = i64::try_from(time.as_micros()).unwrap_or(i64::MAX);
            let time_us = self.about.start_us.saturating_add(since);
            Due { time_us, written_us: self.about.written_us(time_us), is_event }
        }))
    }

    /// Removes and returns the messages that are due, with the load of their sample.
    fn pop_messages(&mut self, due: Due) -> (Vec<Published>, Option<Load>) {
        let [stamp, at] = [due.time_us, due.written_us]
            .map(|us| Timestamp::from_micros(u64::try_from(us).unwrap_or_default()));
        if due.is_event {
            let event = self.events.pop_front();
            let message = event.map(|event| self.messages.event(&event, stamp, at));
            return (message.into_iter().collect(), None);
        }
        match self.estimates.next() {
            Some(Ok((estimate, load))) => {
                (self.messages.messages(&estimate, stamp, at).into(), load)
            }
            Some(Err(_)) | None => (Vec::new(), None),
        }
    }
}

/// Names of the forces, in Unitree's order.
const FORCES: [&str; 4] = ["foot_force[0]", "foot_force[1]", "foot_force[2]", "foot_force[3]"];

/// Newest forces, and the fields that they replace.
struct LowStateForces {
    /// Topic of the robot's states.
    topic: String,
    /// Factor of the loads; `None` for decisions, [`STANDS`] or 0.
    scale: Option<f64>,
    /// Forces in the order of [`FEET`].
    forces: [f64; FEET.len()],
    /// Fields of the messages of the newest channel.
    replacement: Option<(Channel, Replacement)>,
    /// Whether a message was replaced.
    is_found: bool,
}

impl LowStateForces {
    /// Returns the forces before the first message, if they are wanted.
    fn of(arguments: &CopyArguments) -> Option<Self> {
        let topic = arguments.lowstate.clone()?;
        Some(Self {
            topic,
            scale: arguments.lowstate_scale,
            forces: [0.0; FEET.len()],
            replacement: None,
            is_found: false,
        })
    }

    /// Sets the force of a foot in the order of [`FEET`]; an unknown load is 0.
    fn set(&mut self, place: usize, stands: bool, load: Option<Load>) {
        self.forces[place] = match self.scale {
            Some(scale) => load.map_or(0.0, |load| scale * f64::from(load.0)),
            None if stands => f64::from(STANDS),
            None => 0.0,
        };
    }

    /// Returns a message with the newest forces; `None` for a message of another topic.
    ///
    /// # Errors
    /// The message has no forces of four feet.
    fn replaced(
        &mut self,
        channel: &Channel,
        message: &[u8],
    ) -> Result<Option<Vec<u8>>, ReplacementError> {
        if channel.topic != self.topic {
            return Ok(None);
        }
        self.is_found = true;
        let replacement = match &mut self.replacement {
            Some((newest_channel, replacement)) if newest_channel == channel => replacement,
            outdated => {
                let new = Replacement::of(channel, &FORCES)?;
                &mut outdated.insert((channel.clone(), new)).1
            }
        };
        let forces = RIGHT_FIRST.map(|foot| self.forces[foot]);
        replacement.replaced(message, &forces).map(Some)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fmt::Write as _;

    use estimator_core::any::AnyParams;
    use options::InputOptions;
    use recordings::Opened;
    use replay::Span;

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
        let times = MessageTimes { log_ns: 7, publish_ns: 7, sequence: None };
        bag.copy(&other, times, b"{}").unwrap();
        bag.finish().unwrap();
        let mut table = "t,ax,ay,az,wx,wy,wz\n".to_owned();
        for k in 0..50 {
            writeln!(table, "{},0,0,9.81,0,0,0", 0.01 * f64::from(k)).unwrap();
        }
        std::fs::write(path("walk.csv"), table).unwrap();
        let foot = |name: &str| {
            let opened = Opened::new(&path("walk.csv"), None).unwrap();
            let mut stored = opened.store_all(&InputOptions::default()).unwrap();
            CopiedFoot {
                file: "walk.mcap".to_owned(),
                name: name.to_owned(),
                place: None,
                stored: stored.remove(0),
                params: AnyParams::DEFAULT,
                span: Span::default(),
                events: Vec::new(),
            }
        };
        let mut feet = ["front left", "front_left"].map(foot);
        let arguments = CopyArguments::default();
        let inputs = [path("walk.mcap")];
        let copy = BagCopy::new(&inputs, &arguments, Body::FourLegged, false);
        copy.check(&feet).unwrap();
        let mut bytes = Vec::new();
        copy.write(&mut feet, &mut bytes).unwrap();
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
