//! Messages of streaming feet, for `footfall record`, `footfall ros2` and `footfall view`.

use std::collections::{BTreeSet, VecDeque};
use std::path::Path;
use std::time::Duration;

use crate::ros::topics::NODE;
use crate::ros::{Bridge, Published};
use feet::decode::KnownFeet;
use feet::feed::FeedEvent;
use feet::link::{LineClock, Remark};
use feet::session::{SEVERAL_BOARDS, SameFoot};
use feet::{Feed, LineSource, LinkError, LiveFoot, Session, Update, usb};
use recordings::hint::Hint;

use crate::Source;
use crate::error::{Error, in_words};
use crate::interruption::is_interrupted;
use crate::messages::warn;

/// Time without arrivals after which [`Sink::idle`] is called.
const QUIET: Duration = Duration::from_millis(200);

/// Time without arrivals after which feet are checked for silence.
const SILENCE_CHECK: Duration = Duration::from_millis(20);

/// Maximum duration of a stream, s: about thirty years.
const LONGEST_S: f64 = 1.0e9;

/// Destination of messages.
pub trait Sink {
    /// Publishes a message.
    ///
    /// # Errors
    /// The message cannot be written.
    fn publish(&mut self, published: Published) -> Result<(), Error>;

    /// Called when nothing has arrived for a while.
    ///
    /// # Errors
    /// Pending messages cannot be written.
    fn idle(&mut self) -> Result<(), Error> {
        Ok(())
    }
}

/// A stream of messages from the feet.
pub struct Stream {
    feed: Feed,
    /// Events of lines that were open before the others.
    early: VecDeque<FeedEvent>,
    session: Session,
    bridge: Bridge,
    /// Feet whose id is used by several boards, as last reported.
    shared: BTreeSet<usize>,
    /// Reported feet that have no place in messages of all feet.
    without_place: BTreeSet<String>,
    /// Whether feet without contacts in messages of all feet were reported.
    warned_of_absent: bool,
    /// Whether any id was shared; sequence numbers then do not show losses.
    was_shared: bool,
}

impl Stream {
    /// Opens sources with the given feet, whose messages `bridge` creates. Returns once each source is open, or is being
    /// waited for.
    ///
    /// # Errors
    /// A source cannot be opened.
    pub fn open(sources: Vec<Source>, feet: KnownFeet, bridge: Bridge) -> Result<Self, LinkError> {
        let feed = feed_of(sources);
        let mut early = VecDeque::new();
        let mut unknown = feed.lines();
        while unknown > 0 && !is_interrupted() {
            match feed.next(QUIET) {
                Some(FeedEvent::Ended(error)) if early.is_empty() => return Err(error),
                Some(FeedEvent::WaitsFor(error)) => {
                    warn_of_waiting(&error);
                    unknown -= 1;
                }
                Some(FeedEvent::Opened) => unknown -= 1,
                Some(end @ FeedEvent::Ended(_)) => {
                    early.push_back(end);
                    break;
                }
                Some(other) => early.push_back(other),
                None => {}
            }
        }
        Ok(Self {
            feed,
            early,
            session: Session::new(feet),
            bridge,
            shared: BTreeSet::new(),
            without_place: BTreeSet::new(),
            warned_of_absent: false,
            was_shared: false,
        })
    }

    /// Clock of the line.
    #[must_use]
    pub const fn clock(&self) -> &LineClock {
        self.feed.clock()
    }

    /// Publishes all messages until the deadline or until the source ends. Returns the error of the source.
    ///
    /// # Errors
    /// Errors of the sink.
    pub fn run(
        &mut self,
        deadline: Option<Duration>,
        sink: &mut impl Sink,
    ) -> Result<Option<LinkError>, Error> {
        let mut ended = None;
        while ended.is_none() && !is_over(self.clock(), deadline) {
            match self.early.pop_front() {
                Some(fed) => self.session.take(fed),
                None => self.session.listen(&self.feed, SILENCE_CHECK),
            }
            ended = self.publish_updates(sink)?;
        }
        self.session.finish();
        self.publish_updates(sink)?;
        Ok(ended)
    }

    /// Reports all feet as silent at the end of the stream.
    ///
    /// # Errors
    /// Errors of the sink.
    pub fn end(&mut self, sink: &mut impl Sink) -> Result<(), Error> {
        let mut last = self.bridge.end(&self.session).into_iter();
        last.try_for_each(|published| sink.publish(published))
    }

    /// Publishes the messages of all pending updates; returns the error that has ended the source, if any.
    fn publish_updates(&mut self, sink: &mut impl Sink) -> Result<Option<LinkError>, Error> {
        while let Some(update) = self.session.next_update() {
            for published in self.bridge.messages(&self.session, &update) {
                sink.publish(published)?;
            }
            if let Some(same) = self.session.same_name() {
                return Err(SameName::of(same).into());
            }
            self.warn_of_feet_without_place();
            self.warn_of_absent_feet();
            match update {
                Update::Message(foot, _) => self.warn_of_shared_id(foot),
                Update::Quiet(_) if self.session.quiet_for() >= QUIET => sink.idle()?,
                Update::Line(FeedEvent::WaitsFor(error)) => warn_of_waiting(&error),
                Update::Line(FeedEvent::Remark(remark)) => warn(remark_text(&remark)),
                Update::Line(FeedEvent::NotSent(error)) => warn(error),
                Update::Line(FeedEvent::Ended(error)) => return Ok(Some(error)),
                Update::Line(FeedEvent::OpenedAgain(line)) => warn(format!("{line} is open again")),
                Update::Quiet(_) | Update::Line(FeedEvent::Opened | FeedEvent::Arrived(_)) => {}
            }
        }
        Ok(None)
    }

    /// Warns once about each foot without a place in messages of all feet.
    fn warn_of_feet_without_place(&mut self) {
        for name in self.bridge.without_place() {
            if self.without_place.insert(name.to_owned()) {
                let names = self.bridge.body().names();
                warn(format!(
                    "no message of --compat includes {name}, only the feet {names}: rename it with --names"
                ));
            }
        }
    }

    /// Warns once about feet that have a place in messages of all feet and have sent nothing.
    fn warn_of_absent_feet(&mut self) {
        if self.warned_of_absent {
            return;
        }
        let absent = self.bridge.absent(&self.session);
        if !absent.is_empty() {
            self.warned_of_absent = true;
            warn(format!(
                "no contact of {}: --compat sends messages of all feet once each has sent a contact; bool and wrench send those of the others",
                absent.join(", ")
            ));
        }
    }

    /// Warns about an id used by several boards, each time this begins.
    fn warn_of_shared_id(&mut self, index: usize) {
        let foot = &self.session.feet()[index];
        if !foot.is_of_several_boards() {
            self.shared.remove(&index);
        } else if self.shared.insert(index) {
            self.was_shared = true;
            warn(format!(
                "{}: {SEVERAL_BOARDS}, no contact of it is valid; connect one at a time, \
                 and give it an id of its own with footfall foot SOURCE id",
                foot.name_or(NODE)
            ));
        }
    }

    /// Warns about lost and unreadable data.
    pub fn report(&self) {
        let decoder = self.session.decoder();
        let reports = decoder.reports();
        let missing: u64 = reports.iter().map(|(_, report)| report.missing).sum();
        let problems = reports.iter().flat_map(|(_, report)| &report.problems);
        let problems = problems.map(|(name, count)| format!("{name} {count}"));
        let problems: Vec<_> = problems.collect();
        if self.session.feet().is_empty() {
            let unknown = decoder.unknown_foot();
            let hint = unknown.map(|id| format!(", but node {id} may be one: --node {id}"));
            warn(format!("no foot was heard{}", hint.unwrap_or_default()));
        }
        if missing > 0 && !self.was_shared {
            warn(format!("{missing} frames are missing, by their numbers"));
        }
        let unreadable = self.session.unreadable();
        if !problems.is_empty() || unreadable > 0 {
            let problems = problems.join(", ");
            warn(format!("{unreadable} lines unreadable; {problems}"));
        }
        warn_of_lost(&self.feed);
    }
}

/// Opens sources as one feed.
#[must_use]
pub fn feed_of(sources: Vec<Source>) -> Feed {
    let boxed = |source| Box::new(source) as Box<dyn LineSource>;
    Feed::open_all(sources.into_iter().map(boxed).collect())
}

/// Two boards have the name of one foot, so that their messages would be mixed.
#[derive(Debug, thiserror::Error)]
#[error("two boards are {name}, {} and {}; {advice}", boards[0], boards[1])]
pub struct SameName {
    name: String,
    boards: [String; 2],
    /// Commands that give one of them another name.
    advice: String,
}

impl SameName {
    /// Describes two feet of a session with the same name, and names a position that no foot of it has.
    #[must_use]
    pub fn of(SameFoot { feet, are_serial, unused }: SameFoot<'_>) -> Self {
        let [first, second] = feet;
        let boards = [Board::of(first, are_serial[0]), Board::of(second, are_serial[1])];
        let commands = boards.iter().filter_map(|board| {
            let source = board.source.as_ref()?;
            Some(format!("footfall foot {source} id {unused}"))
        });
        let commands: Vec<_> = commands.collect();
        let mut advice = if commands.is_empty() {
            "play them one at a time".to_owned()
        } else {
            format!("make one of them {unused}: {}", commands.join(", or "))
        };
        // The second of both, as the first has the name already.
        if let Some(line) = boards.iter().rev().find_map(|board| board.line.as_ref()) {
            advice += &format!("; for this command alone: --names {line}={unused}");
        }
        let name = first.name.as_deref().unwrap_or_default().to_owned();
        Self { name, boards: boards.map(|board| board.text), advice }
    }
}

/// Board as messages name it.
struct Board {
    text: String,
    /// Its source, to which a request is sent, if it is not played.
    source: Option<String>,
    /// Its line in `--names`.
    line: Option<String>,
}

impl Board {
    fn of(foot: &LiveFoot, is_serial: bool) -> Self {
        let line = &*foot.key.line;
        match (usb::serial_number(line), is_serial, foot.key.node) {
            (Some(serial), ..) => {
                let source = format!("usb:{serial}");
                Self { text: source.clone(), source: Some(source), line: Some(serial) }
            }
            (None, true, _) => {
                let is_played = Path::new(line).is_file();
                let text = if is_played { line.to_owned() } else { format!("uart:{line}") };
                let source = (!is_played).then(|| text.clone());
                Self { text, source, line: Some(line.to_owned()) }
            }
            (None, false, Some(node)) => Self {
                text: format!("node {node} on {line}"),
                source: Some(format!("can:{line} --node {node}")),
                line: None,
            },
            (None, false, None) => Self { text: line.to_owned(), source: None, line: None },
        }
    }
}

/// Parses the duration of a stream, s.
///
/// # Errors
/// A sentence that states the accepted values.
pub fn parse_seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok();
    let seconds = seconds.filter(|seconds| (0.0..=LONGEST_S).contains(seconds));
    seconds.ok_or_else(|| format!("write seconds from 0 to {LONGEST_S}"))
}

/// Returns the deadline of a stream on the clock of its line; an interruption always ends it.
#[must_use]
pub fn deadline(clock: &LineClock, seconds: Option<f64>) -> Option<Duration> {
    let time = Duration::try_from_secs_f64(seconds?).ok()?;
    clock.now().checked_add(time)
}

/// Returns whether the deadline has passed or an interruption was requested.
#[must_use]
pub fn is_over(clock: &LineClock, deadline: Option<Duration>) -> bool {
    is_interrupted() || deadline.is_some_and(|deadline| clock.now() >= deadline)
}

/// Returns the time after `period`, or the end if it comes first.
#[must_use]
pub fn next(clock: &LineClock, period: Duration, end: Option<Duration>) -> Duration {
    let due = clock.now() + period;
    end.map_or(due, |end| due.min(end))
}

/// Returns the error that has ended a source, unless its playback has ended.
///
/// # Errors
/// That error.
pub fn unless_ended(ended: Option<LinkError>) -> Result<(), Error> {
    match ended {
        None | Some(LinkError::Ended(_)) => Ok(()),
        Some(error) => Err(error.into()),
    }
}

/// Returns a remark about a recording that is played, in words. Commands that play accept the options that a finding
/// advises, except `--gravity`.
pub fn remark_text(remark: &Remark) -> String {
    let is_of_convert = matches!(
        remark,
        Remark::Implausible(_, finding) if matches!(finding.hint(), Some(Hint::Gravity(_)))
    );
    in_words(remark) + if is_of_convert { ", in footfall convert" } else { "" }
}

fn warn_of_waiting(error: &LinkError) {
    warn(format!("{error}; waiting for it"));
}

/// Warns about arrivals lost on this machine, if any.
pub fn warn_of_lost(feed: &Feed) {
    let lost = feed.lost();
    if lost > 0 {
        warn(format!("{lost} arrivals were lost: this machine did not keep up"));
    }
}
