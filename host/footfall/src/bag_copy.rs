//! A copy of a bag with the contacts of its feet beside the messages of others, for `footfall replay --output`.

use std::io::{self, Write};
use std::iter::Peekable;
use std::path::Path;

use analysis::replay::span::Span;
use estimator_core::{ContactEstimate, Params, Timestamp};
use mcap::write::NoSeek;
use recordings::input::bag::{Channel, Receiver, Written, copy};
use recordings::input::{About, Stored};
use recordings::replay::Replay;
use ros::mcap_file::{Declared, Times};
use ros::{Estimates, McapFile};

use crate::error::Error;
use crate::files::write_file;
use crate::foot_names::unlike;
use crate::mcap_recording::io_error;

/// A foot of the bag.
pub struct Foot {
    /// Name of the foot, in the topics of its contacts.
    pub name: String,
    /// Its samples.
    pub stored: Stored,
    /// Parameters of its estimate.
    pub params: Params,
    /// Part of the recording whose contacts are written.
    pub span: Span,
}

/// Copies the messages of the bag `input`, with the contacts of its feet, to the MCAP file `path`. A contact is
/// written when its sample was, to a millisecond; its stamp is that of the sample. Returns a sentence about each part that ends early.
///
/// # Errors
/// The bag has a topic of a contact, or cannot be read or written.
pub fn write(input: &Path, feet: &mut [Foot], path: &Path) -> Result<Vec<String>, Error> {
    let mut outcome = Ok(Vec::new());
    let written = write_file(path, |to| {
        let mut bag = McapFile::new(NoSeek::new(to)).map_err(io_error)?;
        let mut streams = Vec::new();
        let mut names: Vec<String> = Vec::new();
        for foot in feet {
            let name = unlike(&foot.name, &names);
            streams.push(Stream::of(foot, &name)?);
            names.push(name);
        }
        let topics = streams.iter().flat_map(|stream| stream.messages.topics());
        let topics: Vec<String> = topics.map(ToString::to_string).collect();
        let mut merging = Merging {
            bag: &mut bag,
            streams: &mut streams,
            topics,
            taken: None,
        };
        let copied = copy(input, &mut merging);
        if let Some(topic) = merging.taken {
            let file = input.display().to_string();
            outcome = Err(Error::TopicTaken { file, topic });
            return Err(io::ErrorKind::InvalidInput.into());
        }
        let notices = match copied {
            Ok(copied) => copied?,
            Err(error) => {
                outcome = Err(error.into());
                return Err(io::ErrorKind::InvalidData.into());
            }
        };
        merging.contacts_until(i64::MAX)?;
        outcome = Ok(notices);
        bag.finish().map_err(io_error)
    });
    match (outcome, written) {
        (Err(error), _) => Err(error),
        (Ok(notices), Ok(())) => Ok(notices),
        (Ok(_), Err(error)) => Err(error.into()),
    }
}

/// Estimates of a foot, sample by sample.
struct Stream<'a> {
    about: About,
    messages: Estimates,
    estimates: Peekable<Box<dyn Iterator<Item = io::Result<ContactEstimate>> + 'a>>,
}

impl<'a> Stream<'a> {
    fn of(foot: &'a mut Foot, name: &str) -> io::Result<Self> {
        let about = foot.stored.about.clone();
        let replay = Replay::new(about.sample_rate, about.gravity, &foot.params);
        let mut replay = replay.map_err(io::Error::other)?;
        let samples = foot.stored.samples()?;
        let span = foot.span;
        let estimates = samples.map(move |sample| Ok(replay.update(&sample?)));
        let estimates = estimates.filter(move |estimate: &io::Result<ContactEstimate>| {
            estimate
                .as_ref()
                .map_or(true, |estimate| span.contains(estimate.timestamp))
        });
        let estimates: Box<dyn Iterator<Item = _>> = Box::new(estimates);
        Ok(Self {
            messages: Estimates::new(name),
            about,
            estimates: estimates.peekable(),
        })
    }

    /// Times of the next contact, µs: of its sample, and of writing.
    fn next_us(&mut self) -> Option<(i64, i64)> {
        let estimate = self.estimates.peek()?.as_ref().ok()?;
        let since = i64::try_from(estimate.timestamp.as_micros()).unwrap_or(i64::MAX);
        let time_us = self.about.start_us.saturating_add(since);
        Some((time_us, self.about.written_us(time_us)))
    }
}

/// Receiver that puts contacts between the messages of others.
struct Merging<'a, 'b, W: Write + io::Seek> {
    bag: &'a mut McapFile<W>,
    streams: &'a mut [Stream<'b>],
    /// Topics of the contacts.
    topics: Vec<String>,
    /// Topic of a contact that the bag has already.
    taken: Option<String>,
}

impl<W: Write + io::Seek> Merging<'_, '_, W> {
    /// Writes the contacts up to a time of writing, µs.
    fn contacts_until(&mut self, until_us: i64) -> io::Result<()> {
        loop {
            let mut first: Option<(i64, i64, usize)> = None;
            for (index, stream) in self.streams.iter_mut().enumerate() {
                if let Some(Err(error)) = stream.estimates.next_if(Result::is_err) {
                    return Err(error);
                }
                if let Some((time_us, written_us)) = stream.next_us()
                    && written_us <= until_us
                    && first.is_none_or(|(_, before, _)| written_us < before)
                {
                    first = Some((time_us, written_us, index));
                }
            }
            let Some((time_us, written_us, index)) = first else {
                return Ok(());
            };
            let stream = &mut self.streams[index];
            let Some(Ok(estimate)) = stream.estimates.next() else {
                return Ok(());
            };
            let [stamp, at] = [time_us, written_us]
                .map(|us| Timestamp::from_micros(u64::try_from(us).unwrap_or_default()));
            for published in stream.messages.messages(&estimate, stamp, at) {
                self.bag.write(&published).map_err(io_error)?;
            }
        }
    }
}

impl<W: Write + io::Seek> Receiver for Merging<'_, '_, W> {
    fn message(&mut self, channel: &Channel, written: Written, payload: &[u8]) -> io::Result<()> {
        if self.topics.contains(&channel.topic) {
            self.taken = Some(channel.topic.clone());
            return Err(io::ErrorKind::InvalidInput.into());
        }
        let schema = channel.schema.as_deref();
        let declared = Declared {
            topic: &channel.topic,
            message: &channel.message,
            schema: schema.map(|schema| (schema.encoding.as_str(), &schema.text[..])),
            encoding: &channel.encoding,
            metadata: &channel.metadata,
        };
        // A contact follows its sample, whose log time is rounded to µs.
        self.contacts_until((written.log_ns.saturating_sub(1000)).div_euclid(1000))?;
        let [log_ns, publish_ns] = [written.log_ns, written.publish_ns]
            .map(|nanos| u64::try_from(nanos).unwrap_or_default());
        let times = Times {
            log_ns,
            publish_ns,
            sequence: written.sequence,
        };
        self.bag.copy(&declared, times, payload).map_err(io_error)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;
    use std::fmt::Write as _;

    use recordings::input::{Hints, Opened};

    use super::*;

    #[test]
    fn feet_with_similar_names_have_topics_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let mut bag = McapFile::new(std::fs::File::create(path("walk.mcap")).unwrap()).unwrap();
        let other = Declared {
            topic: "/other",
            message: "my_msgs/msg/Other",
            schema: None,
            encoding: "json",
            metadata: &BTreeMap::new(),
        };
        let times = Times {
            log_ns: 7,
            publish_ns: 7,
            sequence: None,
        };
        bag.copy(&other, times, b"{}").unwrap();
        bag.finish().unwrap();
        let mut table = "t,ax,ay,az,wx,wy,wz\n".to_owned();
        for k in 0..50 {
            writeln!(table, "{},0,0,9.81,0,0,0", 0.01 * f64::from(k)).unwrap();
        }
        std::fs::write(path("walk.csv"), table).unwrap();
        let foot = |name: &str| {
            let opened = Opened::new(&path("walk.csv"), None).unwrap();
            let mut stored = opened.store_all(&Hints::default()).unwrap();
            Foot {
                name: name.to_owned(),
                stored: stored.remove(0),
                params: Params::default(),
                span: Span::default(),
            }
        };
        let mut feet = ["front left", "front_left"].map(foot);
        write(&path("walk.mcap"), &mut feet, &path("contacts.mcap")).unwrap();
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
