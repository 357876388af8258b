//! Reading of a bag's samples, after its loads: selects the IMUs that are feet, and passes the messages of each to its
//! feed.

use std::collections::{BTreeSet, HashMap, HashSet};

use crate::contact_feed::{ContactFeeds, is_contact};
use crate::feed::{Feed, Known, Sidecar, SidecarData, is_sidecar};
use crate::fields::{Fields, TRUNK_PARTS, is_low_state};
use crate::loads::Loads;
use crate::messages::{Channel, Channels, MessageTimes, Visitor, decode, decode_start};
use crate::selection::{
    FootOrder, ImuKey, MOST_FRAMES, addresses, hidden_imus, is_imu, is_wanted, topic_types,
};
use options::{ContactUse, InputOptions, Mapping, Topics};
use samples::ros::{Header, Imu};
use stored::error::{ImuTopic, InputError, MessageProblem, Place, Problem};

/// Visitor that reads the samples.
pub(super) struct Reader<'a> {
    file: &'a str,
    input_options: &'a InputOptions,
    loads: &'a Loads,
    /// Topics with samples of an IMU, and their frames.
    feeds: Vec<Feed>,
    /// IMUs that are named in messages of another type, by their addresses.
    parts: Vec<(String, Fields)>,
    /// All other topics.
    others: Channels,
    /// Indices of the feeds of each topic, while the messages are read.
    by_topic: HashMap<String, Vec<usize>>,
    /// Topics of feeds with messages.
    filled: HashSet<String>,
    sidecar: Sidecar,
    /// Contacts of the feet, if they are read.
    contacts: ContactFeeds,
    /// Error in the topic that may be the only one.
    failed: Option<InputError>,
    /// Error about a topic that was named.
    refused: Option<InputError>,
}

/// Content of a bag after its messages have been read.
pub(super) struct Read {
    /// Feeds of the feet, in order.
    pub(super) chosen: Result<Vec<Feed>, InputError>,
    /// Contacts of the feet, if they are read.
    pub(super) contacts: ContactFeeds,
    /// Topics with contacts of feet, even if they are not read.
    pub(super) contact_topics: Vec<String>,
    /// Addresses of all IMUs with messages, and topics of the IMUs that the selection excludes.
    pub(super) all: BTreeSet<String>,
    /// Topics of IMUs without a message.
    pub(super) empty: Vec<String>,
    /// Whether IMUs are read from messages of another type.
    pub(super) has_parts: bool,
    /// Whether the bag has the state of a Unitree.
    pub(super) has_low_state: bool,
}

impl Visitor for Reader<'_> {
    fn channel(&mut self, channel: &Channel) -> bool {
        if !is_imu(channel) || self.input_options.bag.excludes(&channel.topic) {
            self.others.add(channel);
            let has_contacts = self.reads_contacts() && ContactFeeds::is_part(channel);
            // Contacts on a named topic are the estimates of a foot, so no IMU is expected in them.
            let has_fields = !(has_contacts && is_contact(channel)) && self.declare_fields(channel);
            return is_sidecar(channel) || has_fields || has_contacts;
        }
        if !self.by_topic.contains_key(&channel.topic) {
            self.add_feed(Feed::new(channel.topic.clone(), self.input_options));
        }
        true
    }

    fn message(
        &mut self,
        channel: &Channel,
        MessageTimes { log_ns, .. }: MessageTimes,
        payload: &[u8],
    ) -> Result<(), InputError> {
        if let Some(error) = self.refused.take() {
            return Err(error);
        }
        let imus: Vec<_> = (self.parts.iter())
            .filter(|(_, fields)| fields.topic == channel.topic)
            .map(|(address, fields)| (address.clone(), fields.imu(payload)))
            .collect();
        if !imus.is_empty() {
            return imus.into_iter().try_for_each(|(address, imu)| {
                self.sample(&address, SidecarData { log_ns, known: Known::default() }, imu)
            });
        }
        let Some(first) = self.first_feed(&channel.topic) else {
            self.sidecar.process(channel, log_ns, payload);
            // Messages of contacts arrive only if contacts are read (see `channel`).
            let processed = self.contacts.process(channel, log_ns, payload);
            return processed.map_err(|source| InputError::spool(self.file, source));
        };
        let is_needed = match &self.input_options.bag.topics {
            Topics::Named(named) => named.contains(&channel.topic),
            Topics::All => true,
            // If there are several topics, only the counts are needed, unless a frame may select one.
            Topics::TheOnly => {
                let others = self.filled.len() - usize::from(self.filled.contains(&channel.topic));
                !self.input_options.bag.frames.is_empty() || others == 0
            }
        };
        if !is_needed || self.failed.is_some() {
            let at = self.index_of_counted(&channel.topic, payload).unwrap_or(first);
            self.count(at, log_ns);
            return Ok(());
        }
        let known = self.sidecar.of(&channel.topic, log_ns);
        let data = SidecarData { log_ns, known };
        let taken = self.sample(&channel.topic, data, decode(payload));
        match (taken, &self.input_options.bag.topics) {
            (Err(error), Topics::TheOnly) => {
                self.failed = Some(error);
                Ok(())
            }
            (taken, _) => taken,
        }
    }
}

impl<'a> Reader<'a> {
    pub(super) fn new(file: &'a str, input_options: &'a InputOptions, loads: &'a Loads) -> Self {
        Self {
            file,
            input_options,
            loads,
            feeds: Vec::new(),
            parts: Vec::new(),
            others: Channels::default(),
            by_topic: HashMap::new(),
            filled: HashSet::new(),
            sidecar: Sidecar::default(),
            contacts: ContactFeeds::default(),
            failed: None,
            refused: None,
        }
    }

    const fn reads_contacts(&self) -> bool {
        matches!(self.input_options.contacts, ContactUse::Recorded)
    }

    /// Adds the IMUs that are named in messages of another type; returns whether there is one.
    fn declare_fields(&mut self, channel: &Channel) -> bool {
        let mut is_named = false;
        for (address, part) in addresses(&self.input_options.bag, channel) {
            is_named = true;
            if self.parts.iter().any(|(before, _)| before == address) {
                continue;
            }
            match Fields::of(channel, part, &self.input_options.table.mapping) {
                Ok(fields) => {
                    let mut feed = Feed::new(address.to_owned(), self.input_options);
                    feed.found_axes.clone_from(&fields.found);
                    self.add_feed(feed);
                    self.parts.push((address.to_owned(), fields));
                }
                Err(problem) => {
                    let message = channel.message.clone();
                    self.refused.get_or_insert(InputError {
                        file: self.file.to_owned(),
                        place: Place::Topic(address.to_owned()),
                        problem: Problem::ImuFields { message, problem },
                    });
                }
            }
        }
        is_named
    }

    /// Passes a message that is needed to the feed of its topic, or of the part of its messages, and its frame.
    fn sample(
        &mut self,
        topic: &str,
        data: SidecarData,
        imu: Result<Imu, MessageProblem>,
    ) -> Result<(), InputError> {
        let decoded = imu.and_then(|imu| Ok((self.feed_index(topic, &imu.header.frame_id)?, imu)));
        let (at, imu) = decoded.map_err(|problem| {
            if let Some(first) = self.first_feed(topic) {
                self.count(first, data.log_ns);
            }
            let number = self.of_topic(topic).map(|at| self.feeds[at].messages).sum();
            InputError::of_message(self.file, topic, number, problem)
        })?;
        self.count(at, data.log_ns);
        if !is_wanted(&imu.header.frame_id, self.input_options) {
            return Ok(());
        }
        let is_same = |foot: &ImuKey| foot.topic == topic && foot.frame == imu.header.frame_id;
        let foot = self.loads.feet.iter().position(is_same);
        let load = foot.and_then(|foot| self.loads.series.get(foot));
        if self.reads_contacts() {
            self.contacts.process_imu(topic, data.log_ns, &imu);
        }
        self.feeds[at].process(data, &imu, load, self.input_options, self.file)
    }

    /// Index of the feed in which a message that is not needed is counted; `None` if its frame makes no difference.
    /// Only the error about several IMUs lists these counts, by frame.
    fn index_of_counted(&mut self, topic: &str, payload: &[u8]) -> Option<usize> {
        if self.input_options.bag.topics != Topics::TheOnly {
            return None;
        }
        let Header { frame_id, .. } = decode_start(payload).ok()?;
        if self.failed.is_some() {
            // Do not add a foot for a new frame, because the frame may be as damaged as the message that failed.
            let is_same = |at: &usize| self.feeds[*at].frame.as_ref() == Some(&frame_id);
            return self.of_topic(topic).find(is_same);
        }
        self.feed_index(topic, &frame_id).ok()
    }

    /// Index of the feed of a topic and frame. A frame without a feed gets one.
    fn feed_index(&mut self, topic: &str, frame: &str) -> Result<usize, MessageProblem> {
        let may_have_frame =
            |at: &usize| self.feeds[*at].frame.as_deref().is_none_or(|known| known == frame);
        let wanted = self.of_topic(topic).find(may_have_frame);
        if let Some(at) = wanted {
            let known = &mut self.feeds[at].frame;
            known.get_or_insert_with(|| frame.to_owned());
            return Ok(at);
        }
        if self.of_topic(topic).count() >= MOST_FRAMES {
            let frame = frame.to_owned();
            return Err(MessageProblem::TooManyFrames { frame, most: MOST_FRAMES });
        }
        let mut feed = Feed::new(topic.to_owned(), self.input_options);
        feed.frame = Some(frame.to_owned());
        let first = self.first_feed(topic);
        feed.found_axes = first.and_then(|first| self.feeds[first].found_axes.clone());
        self.add_feed(feed);
        for at in self.of_topic(topic).collect::<Vec<_>>() {
            self.feeds[at].is_shared = true;
        }
        Ok(self.feeds.len() - 1)
    }

    /// Adds a feed to the feeds of its topic.
    fn add_feed(&mut self, feed: Feed) {
        self.by_topic.entry(feed.topic.clone()).or_default().push(self.feeds.len());
        self.feeds.push(feed);
    }

    /// Indices of the feeds of a topic.
    fn of_topic(&self, topic: &str) -> impl Iterator<Item = usize> {
        self.by_topic.get(topic).into_iter().flatten().copied()
    }

    fn first_feed(&self, topic: &str) -> Option<usize> {
        self.of_topic(topic).next()
    }

    /// Counts a message of a feed.
    fn count(&mut self, at: usize, log_ns: i64) {
        let feed = &mut self.feeds[at];
        feed.count(log_ns);
        if feed.messages == 1 && !self.filled.contains(&feed.topic) {
            self.filled.insert(feed.topic.clone());
        }
    }

    /// Ends the reading after the last message.
    pub(super) fn finish(mut self) -> Read {
        let contact_topics = self.contact_topics();
        // Lists all IMUs, before the selection leaves only the feet.
        let (all, empty) = (self.all_imus(), self.empty_imus());
        let selected = self.select_feet();
        Read {
            chosen: selected.map(|()| self.feeds),
            contacts: self.contacts,
            contact_topics,
            all,
            empty,
            has_parts: !self.parts.is_empty(),
            has_low_state: self.others.iter().any(|channel| is_low_state(&channel.message)),
        }
    }

    /// Topics with contacts of feet.
    fn contact_topics(&self) -> Vec<String> {
        (self.others.iter())
            .filter(|channel| is_contact(channel))
            .map(|channel| channel.topic.clone())
            .collect()
    }

    /// Addresses of all IMUs with messages, and topics of the IMUs that the selection excludes.
    fn all_imus(&self) -> BTreeSet<String> {
        let filled = self.feeds.iter().filter(|feed| feed.messages > 0);
        let hidden = hidden_imus(&self.others, &self.input_options.bag);
        filled.map(Feed::address).chain(hidden).collect()
    }

    /// Topics of IMUs without a message.
    fn empty_imus(&self) -> Vec<String> {
        (self.feeds.iter())
            .filter(|feed| feed.messages == 0)
            .map(|feed| feed.topic.clone())
            .collect()
    }

    /// Leaves the feeds of the feet, in their order.
    ///
    /// # Errors
    /// The first of these:
    /// 1. The messages of a topic that was named have no axes of an IMU.
    /// 2. A message could not be read, and frames are selected. Later messages were not decoded, so that their frames
    ///    would seem to be missing.
    /// 3. A selected frame is missing.
    /// 4. A topic is missing or empty, or it is not clear which one is the foot.
    /// 5. A message could not be read, and no frame is selected. If there are several IMUs, it may be of one that is not
    ///    the foot. Therefore the topic is to be chosen first.
    fn select_feet(&mut self) -> Result<(), InputError> {
        let bag = &self.input_options.bag;
        if let Some(error) = self.refused.take() {
            return Err(error);
        }
        if let Some(error) = self.failed.take_if(|_| !bag.frames.is_empty()) {
            return Err(error);
        }
        self.select_frames()?;
        // Errors list the IMUs in the order of the bag.
        let imus: Vec<ImuTopic> = self.feeds.iter().map(Feed::about).collect();
        self.feeds.sort_by_cached_key(|feed| {
            FootOrder::of(bag, &feed.topic, feed.frame.as_deref().unwrap_or_default())
        });
        match &bag.topics {
            Topics::Named(named) => self.select_named(named, imus),
            Topics::All | Topics::TheOnly => self.select_unnamed(imus),
        }
    }

    /// Leaves the feeds with the selected frames.
    fn select_frames(&mut self) -> Result<(), InputError> {
        let frames = &self.input_options.bag.frames;
        let has_frame = |feed: &Feed, frame: &String| feed.frame.as_ref() == Some(frame);
        let is_present = |frame: &String| self.feeds.iter().any(|feed| has_frame(feed, frame));
        if let Some(frame) = frames.iter().find(|frame| !is_present(frame)) {
            let filled = self.feeds.iter().filter(|feed| feed.frame.is_some());
            let with_frame = |feed: &Feed| ImuTopic { frame: feed.frame.clone(), ..feed.about() };
            let problem = Problem::NoSuchFrame {
                frame: frame.clone(),
                frames: filled.map(with_frame).collect(),
            };
            return Err(InputError::of_file(self.file, problem));
        }
        if !frames.is_empty() {
            self.feeds.retain(|feed| frames.iter().any(|frame| has_frame(feed, frame)));
        }
        Ok(())
    }

    /// Leaves the feeds of the topics that were named. Errors list `imus`, the IMUs of all feeds.
    fn select_named(&mut self, named: &[String], imus: Vec<ImuTopic>) -> Result<(), InputError> {
        for topic in named {
            match self.feeds.iter().find(|feed| feed.topic == *topic) {
                Some(feed) if feed.messages > 0 => {}
                Some(_) => return Err(no_message(self.file, Some(topic.clone()), imus)),
                None => {
                    let problem = Problem::NoSuchTopic {
                        topic: topic.clone(),
                        wanted: Imu::TYPE,
                        imus,
                        topics: topic_types(&self.others),
                    };
                    return Err(InputError::of_file(self.file, problem));
                }
            }
        }
        self.feeds.retain(|feed| named.contains(&feed.topic));
        Ok(())
    }

    /// Keeps only the feeds that have messages. One feed must be left, unless all feeds or several frames are selected.
    /// Errors list `imus`, the IMUs of all feeds.
    fn select_unnamed(&mut self, imus: Vec<ImuTopic>) -> Result<(), InputError> {
        if self.feeds.is_empty() {
            let problem = Problem::NoImu {
                topics: topic_types(&self.others),
                with_axes: self.address_with_axes(),
                has_contacts: self.others.iter().any(is_contact),
            };
            return Err(InputError::of_file(self.file, problem));
        }
        self.feeds.retain(|feed| feed.messages > 0);
        let bag = &self.input_options.bag;
        match (self.feeds.len(), &bag.topics) {
            (0, _) => Err(no_message(self.file, None, imus)),
            // Each of the frames that were selected may be a foot.
            (several @ 2.., Topics::TheOnly) if several > bag.frames.len() => {
                Err(InputError::of_file(self.file, Problem::SeveralTopics(imus)))
            }
            _ => self.failed.take().map_or(Ok(()), Err),
        }
    }

    /// Returns the address of the first IMU in messages of another type. An IMU in a part of a known name is on the robot's
    /// trunk.
    fn address_with_axes(&self) -> Option<String> {
        let has_axes =
            |channel: &Channel, part| Fields::of(channel, part, &Mapping::default()).is_ok();
        self.others.iter().find_map(|channel| {
            let topic = &channel.topic;
            if has_axes(channel, "") {
                return Some(topic.clone());
            }
            let trunk = TRUNK_PARTS.into_iter().find(|part| has_axes(channel, part));
            trunk.map(|part| format!("{topic}.{part}"))
        })
    }
}

fn no_message(file: &str, topic: Option<String>, topics: Vec<ImuTopic>) -> InputError {
    InputError::of_file(file, Problem::NoMessage { topic, topics })
}
