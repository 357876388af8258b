//! Streaming feet, for the commands that listen to them.
//!
//! | item | used by |
//! |---|---|
//! | [`Stream`]: the messages of the feet, published to a [`Sink`] | `record`, `ros2`, `view` |
//! | [`UnheardLines`], [`SameName`] and events of lines: reports about lines and boards | these and `monitor` |
//! | duration and end of a stream | these and `monitor` |

use std::collections::{BTreeSet, VecDeque};
use std::path::Path;
use std::time::Duration;

use crate::ros::topics::NODE;
use crate::ros::{Bridge, Published};
use feet::decode::{KnownFeet, Report};
use feet::feed::FeedEvent;
use feet::link::{LineClock, Remark};
use feet::session::{SEVERAL_BOARDS, SameFoot};
use feet::{Feed, LineSource, LinkError, LiveFoot, Session, Update, usb};
use options::hint::Hint;
use wire::NodeId;

use crate::Source;
use crate::error::{Error, Worded};
use crate::interruption::is_interrupted;
use crate::messages::{detail, warn};
use crate::words::in_words;

/// Time without arrivals after which [`Sink::idle`] is called.
const QUIET: Duration = Duration::from_millis(200);

/// Time without arrivals after which feet are checked for silence.
const SILENCE_CHECK: Duration = Duration::from_millis(20);

/// Maximum duration of a stream, s: about thirty years.
const LONGEST_S: f64 = 1.0e9;

/// Time after which a line without a foot is reported.
const UNHEARD: Duration = Duration::from_secs(2);

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
    sources: Vec<Source>,
    feed: Feed,
    /// Events that arrived before every line was open.
    early: VecDeque<FeedEvent>,
    session: Session,
    bridge: Bridge,
    /// Feet whose id is used by several boards, as last reported.
    shared: BTreeSet<usize>,
    /// Lines on which no foot was received so far.
    unheard: UnheardLines,
    /// Reported feet that have no place in messages of all feet.
    without_place: BTreeSet<String>,
    /// Whether feet without contacts in messages of all feet were reported.
    warned_of_absent: bool,
    /// Whether any id was shared; sequence numbers then do not show losses.
    was_shared: bool,
}

impl Stream {
    /// Opens sources with the given feet, whose messages `bridge` creates. Returns once each source is open, or is
    /// being waited for.
    ///
    /// # Errors
    /// A source cannot be opened.
    pub fn open(sources: Vec<Source>, feet: KnownFeet, bridge: Bridge) -> Result<Self, LinkError> {
        let mut unheard = UnheardLines::of(&sources);
        let feed = feed_of(sources.clone());
        let mut early = VecDeque::new();
        let mut unknown = feed.lines();
        while unknown > 0 && !is_interrupted() {
            match feed.next(QUIET) {
                Some(FeedEvent::Ended(error)) if early.is_empty() => return Err(error),
                Some(event @ FeedEvent::WaitsFor(_)) => {
                    unheard.remove_waiting(&event);
                    line_event_text(&event).into_iter().for_each(warn);
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
            sources,
            feed,
            early,
            session: Session::new(feet),
            bridge,
            shared: BTreeSet::new(),
            unheard,
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
            let now = self.clock().now();
            self.unheard.take_overdue(now, &self.session).into_iter().for_each(warn);
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
                return Err(SameName::of(same, &self.sources).into());
            }
            self.warn_of_feet_without_place();
            self.warn_of_absent_feet();
            match update {
                Update::Message(foot, _) => self.warn_of_shared_id(foot),
                Update::Quiet(_) if self.session.quiet_for() >= QUIET => sink.idle()?,
                Update::Line(FeedEvent::Ended(error)) => return Ok(Some(error)),
                Update::Line(FeedEvent::Remark(remark)) if is_detail(&remark) => {
                    detail(in_words(&remark));
                }
                Update::Line(event) => {
                    self.unheard.remove_waiting(&event);
                    line_event_text(&event).into_iter().for_each(warn);
                }
                Update::Quiet(_) => {}
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
        if self.session.feet().is_empty() {
            let unknown = decoder.unknown_feet().next();
            let hint = unknown.map(|(_, id)| format!(", but node {id} may be one: --node {id}"));
            warn(format!("no foot was heard{}", hint.unwrap_or_default()));
        }
        if missing > 0 && !self.was_shared {
            warn(format!("{missing} frames are missing, by their numbers"));
        }
        problems_text(&reports, self.session.unreadable()).into_iter().for_each(warn);
        warn_of_lost(&self.feed);
    }
}

/// Opens sources as one feed.
#[must_use]
pub fn feed_of(sources: Vec<Source>) -> Feed {
    let boxed = |source| Box::new(source) as Box<dyn LineSource>;
    Feed::open_all(sources.into_iter().map(boxed).collect())
}

/// Devices on which no foot was received so far. Each is reported once.
#[derive(Debug, Default)]
pub struct UnheardLines {
    /// Sources of the lines.
    sources: Vec<Source>,
    /// Time of the first check on the clock of the feed.
    began: Option<Duration>,
}

impl UnheardLines {
    /// Returns the lines of these sources that are devices. A file or a demo ends instead.
    #[must_use]
    pub fn of(sources: &[Source]) -> Self {
        let devices = sources.iter().filter(|source| source.device().is_some());
        Self { sources: devices.cloned().collect(), began: None }
    }

    /// Removes the line of this event if the event says that the line is missing or has broken, because that is reported
    /// separately.
    pub fn remove_waiting(&mut self, event: &FeedEvent) {
        if let FeedEvent::WaitsFor(error) = event {
            self.sources.retain(|source| source.device() != error.device_name());
        }
    }

    /// Takes the lines without a foot two seconds after the first call, and returns a sentence about each. `now` is the
    /// time on the clock of the feed.
    pub fn take_overdue(&mut self, now: Duration, session: &Session) -> Vec<String> {
        let began = *self.began.get_or_insert(now);
        if self.sources.is_empty() || now.saturating_sub(began) < UNHEARD {
            return Vec::new();
        }
        let unheard = std::mem::take(&mut self.sources).into_iter().filter_map(|source| {
            let line = source.device()?;
            let is_heard = session.feet().iter().any(|foot| *foot.key.line == *line);
            (!is_heard).then(|| unheard_text(&source, line, session))
        });
        unheard.collect()
    }
}

/// Counts of the problems of each line, and of unreadable lines of logs and adapters; `None` without problems.
fn problems_text(reports: &[(Option<&str>, &Report)], unreadable: u64) -> Option<String> {
    let mut parts = Vec::new();
    if unreadable > 0 {
        parts.push(format!("{unreadable} lines unreadable"));
    }
    for (line, report) in reports {
        let problems = report.problems.iter().map(|(name, count)| format!("{name} {count}"));
        let problems: Vec<_> = problems.collect();
        if !problems.is_empty() {
            parts.push(format!("{}: {}", line.unwrap_or("CAN"), problems.join(", ")));
        }
    }
    (!parts.is_empty()).then(|| parts.join("; "))
}

/// Sentence about a line without a foot.
fn unheard_text(source: &Source, line: &str, session: &Session) -> String {
    let decoder = session.decoder();
    let seconds = UNHEARD.as_secs();
    let mut unknown = decoder.unknown_feet();
    let unknown = unknown.find_map(|(of, node)| (of == line).then_some(node));
    match (source, unknown) {
        (Source::Line(feet::Source::Uart { baud, .. }), _) if decoder.is_serial(line) => format!(
            "uart:{line}: bytes arrive at {baud} Bd, but no message of a foot: it is another device, or has another rate, \
             uart:{line}@BAUD"
        ),
        (Source::Line(feet::Source::Uart { .. }), _) => {
            format!("uart:{line}: nothing has arrived for {seconds} s")
        }
        (_, Some(node)) => format!(
            "{source}: no foot was heard for {seconds} s, but node {node} may be one: --node {node}"
        ),
        (_, None) => format!("{source}: no foot was heard for {seconds} s"),
    }
}

/// Two boards have the name of one foot, so that their messages or their results would be mixed.
#[derive(Debug, thiserror::Error)]
#[error("two boards are {name}, {} and {}; {advice}", boards[0], boards[1])]
pub struct SameName {
    name: String,
    boards: [String; 2],
    /// Commands that give one of them another name.
    advice: String,
}

impl Worded for SameName {}

/// No foot has sent anything that could be recorded.
#[derive(Debug, thiserror::Error)]
#[error("nothing was recorded, and no file is written")]
pub struct NothingHeard;

impl Worded for NothingHeard {}

impl SameName {
    /// Describes two feet of a session of these sources with the same name, and names a position that no foot of it has.
    #[must_use]
    pub fn of(SameFoot { feet, are_serial, unused }: SameFoot<'_>, sources: &[Source]) -> Self {
        let [first, second] = feet;
        let boards =
            [Board::of(first, are_serial[0], sources), Board::of(second, are_serial[1], sources)];
        let mut advice = rename_advice(&boards, unused, "play");
        // Rename the second of the two feet, because the first had the name before.
        if let Some(line) = boards.iter().rev().find_map(|board| board.line.as_ref()) {
            advice += &format!("; for this command alone: --names {line}={unused}");
        }
        let name = first.name.as_deref().unwrap_or_default().to_owned();
        Self { name, boards: boards.map(|board| board.text), advice }
    }

    /// Describes two boards that answer requests with the same name. `unused` is a name that no board has.
    #[must_use]
    pub fn of_asked(name: &str, boards: [(&Source, Option<NodeId>); 2], unused: &str) -> Self {
        let boards = boards.map(|(source, node)| Board::asked(source, node));
        let advice = rename_advice(&boards, unused, "calibrate");
        Self { name: name.to_owned(), boards: boards.map(|board| board.text), advice }
    }
}

/// Advice to give one of two boards an unused name; boards that take no requests are to be read in turn.
fn rename_advice(boards: &[Board; 2], unused: &str, verb: &str) -> String {
    let commands = boards.iter().filter_map(|board| {
        let source = board.source.as_ref()?;
        Some(format!("footfall foot {source} id {unused}"))
    });
    let commands: Vec<_> = commands.collect();
    if commands.is_empty() {
        format!("{verb} them one at a time")
    } else {
        format!("make one of them {unused}: {}", commands.join(", or "))
    }
}

/// Board as messages name it.
struct Board {
    text: String,
    /// Source of the board, to which a request is sent, if it is a device.
    source: Option<String>,
    /// Line of the board in `--names`.
    line: Option<String>,
}

impl Board {
    fn of(foot: &LiveFoot, is_serial: bool, sources: &[Source]) -> Self {
        let line = &*foot.key.line;
        let serial = usb::serial_number(line);
        let node = foot.key.node.filter(|_| !is_serial);
        let text = match (&serial, node) {
            (Some(serial), _) => format!("usb:{serial}"),
            (None, Some(node)) => format!("node {node} on {line}"),
            (None, None) if is_serial && !Path::new(line).is_file() => format!("uart:{line}"),
            (None, None) => line.to_owned(),
        };
        // Find the line among the sources, because a line named in a log may be another device on this machine.
        let mut sources = sources.iter();
        let source = sources.find(|source| source.device() == Some(line));
        Self {
            text,
            source: source.map(|source| request_text(source, node)),
            line: is_serial.then(|| serial.unwrap_or_else(|| line.to_owned())),
        }
    }

    /// Returns the board of a source that was asked.
    fn asked(source: &Source, node: Option<NodeId>) -> Self {
        let text = request_text(source, node.map(NodeId::get));
        Self { source: source.device().map(|_| text.clone()), text, line: None }
    }
}

/// Source as in a command that sends a request: a board on USB by its serial number, and the node of a bus.
fn request_text(source: &Source, node: Option<u8>) -> String {
    let serial = source.device().and_then(usb::serial_number);
    let source = serial.map_or_else(|| source.to_string(), |serial| format!("usb:{serial}"));
    match node {
        Some(node) => format!("{source} --node {node}"),
        None => source,
    }
}

/// Parses the duration of a stream, s.
///
/// # Errors
/// A sentence that states the accepted values.
pub fn parse_duration(text: &str) -> Result<f64, String> {
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
pub fn due_after(clock: &LineClock, period: Duration, end: Option<Duration>) -> Duration {
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

/// Returns the sentence that reports an event of a line; `None` if the event needs no report, or is the end of the
/// source.
#[must_use]
pub fn line_event_text(event: &FeedEvent) -> Option<String> {
    match event {
        FeedEvent::WaitsFor(error) => Some(format!("{error}; waiting for it")),
        FeedEvent::OpenedAgain(line) => Some(format!("{line} is open again")),
        FeedEvent::Remark(remark) => Some(remark_text(remark)),
        FeedEvent::Opened | FeedEvent::Arrived(_) | FeedEvent::Ended(_) => None,
    }
}

/// Returns whether a remark is about a usual fact, and so needs no warning.
#[must_use]
pub const fn is_detail(remark: &Remark) -> bool {
    matches!(remark, Remark::Detail(_) | Remark::Rate(..))
}

/// Returns a remark about a recording that is played, in words. Commands that play accept the options that a finding
/// advises, except `--gravity`.
fn remark_text(remark: &Remark) -> String {
    let is_of_convert = matches!(
        remark,
        Remark::Implausible(_, finding) if matches!(finding.hint(), Some(Hint::Gravity(_)))
    );
    in_words(remark) + if is_of_convert { ", in footfall convert" } else { "" }
}

/// Warns about arrivals lost on this machine, if any.
pub fn warn_of_lost(feed: &Feed) {
    lost_text(feed.lost()).into_iter().for_each(warn);
}

/// Sentence about lost arrivals, if any.
fn lost_text(lost: u64) -> Option<String> {
    (lost > 0).then(|| format!("{lost} arrivals were lost: this machine did not keep up"))
}

#[cfg(test)]
mod tests {
    use estimator_core::{ContactEstimate, Timestamp};
    use feet::Arrival;
    use wire::uart::{ContactMessage, Message, encode};
    use wire::{CanFrame, Faults};

    use super::*;

    fn source(text: &str) -> Source {
        let argument = text.parse::<crate::SourceArgument>().expect("a source");
        argument.find_one().expect("one line")
    }

    fn lines(sources: &[&str]) -> UnheardLines {
        let sources = sources.iter().map(|text| source(text));
        UnheardLines::of(&sources.collect::<Vec<_>>())
    }

    fn arrive(session: &mut Session, arrival: Arrival) {
        session.take(FeedEvent::Arrived((Timestamp::from_micros(1), arrival)));
        session.idle(Duration::from_secs(1));
        while session.next_update().is_some() {}
    }

    fn bytes(port: &str, bytes: &[u8]) -> Arrival {
        Arrival::Bytes { port: port.into(), bytes: bytes.to_vec() }
    }

    #[test]
    fn line_without_a_foot_is_reported_once() {
        let mut session = Session::new(KnownFeet::default());
        let mut unheard = lines(&[
            "uart:/a",
            "uart:/b@9600",
            "uart:/c",
            "can:can0",
            "can:can1",
            "demo",
            "file:walk.csv",
        ]);
        let contact = ContactMessage::new(&ContactEstimate::default(), Faults::NONE);
        let contact = encode(0, &Message::Contact(contact));
        arrive(&mut session, bytes("/a", contact.as_bytes()));
        arrive(&mut session, bytes("/b", b"hello\0"));
        let interface = "can0".into();
        let frame = CanFrame::new(0x1A2, &[0; 8]).expect("a frame");
        arrive(&mut session, Arrival::Frame { interface, frame });
        let at = Duration::from_secs;
        assert!(unheard.take_overdue(at(5), &session).is_empty());
        assert!(unheard.take_overdue(at(6), &session).is_empty());
        let reported = unheard.take_overdue(at(7), &session);
        let [rate, silent, bus, other] = &reported[..] else { panic!("{reported:?}") };
        assert!(rate.starts_with("uart:/b: bytes arrive at 9600 Bd, but no message of a foot"));
        assert_eq!(silent, "uart:/c: nothing has arrived for 2 s");
        let hint = ", but node 34 may be one: --node 34";
        assert_eq!(*bus, format!("can:can0: no foot was heard for 2 s{hint}"));
        assert_eq!(other, "can:can1: no foot was heard for 2 s");
        assert!(unheard.take_overdue(at(9), &session).is_empty());
    }

    /// Returns the error of two boards FL, whose contacts arrive as frames of node 17 on these two lines.
    fn same_name(sources: &[&str], lines: [&str; 2]) -> String {
        let mut session = Session::new(KnownFeet::default());
        for line in lines {
            let frame = CanFrame::new(0x191, &[0; 8]).expect("a frame");
            arrive(&mut session, Arrival::Frame { interface: line.into(), frame });
        }
        let sources: Vec<Source> = sources.iter().map(|text| source(text)).collect();
        SameName::of(session.same_name().expect("two boards"), &sources).to_string()
    }

    #[test]
    fn boards_of_one_name_are_renamed_on_their_own_devices() {
        let adapters = ["slcan:/dev/ttyACM8", "slcan:/dev/ttyACM9"];
        assert_eq!(
            same_name(&adapters, ["/dev/ttyACM8", "/dev/ttyACM9"]),
            "two boards are FL, node 17 on /dev/ttyACM8 and node 17 on /dev/ttyACM9; make one of them FR: \
             footfall foot slcan:/dev/ttyACM8@1000 --node 17 id FR, or footfall foot slcan:/dev/ttyACM9@1000 --node 17 id FR"
        );
        // The names of interfaces in a log may be from another machine.
        assert_eq!(
            same_name(&["file:can.log"], ["can0", "can1"]),
            "two boards are FL, node 17 on can0 and node 17 on can1; play them one at a time"
        );
    }

    #[test]
    fn boards_that_answer_with_one_name_are_named() {
        let [port, bus] = ["uart:/dev/ttyACM8", "can:can0"].map(source);
        let boards = [(&port, None), (&bus, NodeId::new(17))];
        assert_eq!(
            SameName::of_asked("FL", boards, "FR").to_string(),
            "two boards are FL, uart:/dev/ttyACM8@1000000 and can:can0 --node 17; make one of them FR: \
             footfall foot uart:/dev/ttyACM8@1000000 id FR, or footfall foot can:can0 --node 17 id FR"
        );
    }

    #[test]
    fn breaks_and_losses_of_lines_are_reported() {
        let again = FeedEvent::OpenedAgain("uart:/a@9600".to_owned());
        assert_eq!(line_event_text(&again).as_deref(), Some("uart:/a@9600 is open again"));
        assert_eq!(line_event_text(&FeedEvent::Opened), None);
        assert_eq!(lost_text(0), None);
        let lost = lost_text(3).expect("a sentence");
        assert_eq!(lost, "3 arrivals were lost: this machine did not keep up");
    }

    #[test]
    fn problems_are_reported_with_their_lines() {
        let report = |problems: &[(&str, u64)]| Report {
            problems: problems.iter().map(|(name, count)| ((*name).to_owned(), *count)).collect(),
            ..Report::default()
        };
        let (first, second) = (report(&[("crc", 2), ("length", 1)]), report(&[("crc", 3)]));
        let none = report(&[]);
        let all = [(None, &none), (Some("/a"), &first), (Some("/b"), &second)];
        assert_eq!(problems_text(&all, 0).as_deref(), Some("/a: crc 2, length 1; /b: crc 3"));
        let bus = [(None, &second)];
        assert_eq!(problems_text(&bus, 4).as_deref(), Some("4 lines unreadable; CAN: crc 3"));
        assert_eq!(problems_text(&[(None, &none)], 4).as_deref(), Some("4 lines unreadable"));
        assert_eq!(problems_text(&[(None, &none)], 0), None);
    }

    #[test]
    fn missing_device_is_not_reported_as_unheard() {
        let session = Session::new(KnownFeet::default());
        let mut unheard = lines(&["uart:/a", "uart:/b"]);
        let error = "uart:/b/none".parse::<feet::Source>().expect("a source").open().err();
        unheard.remove_waiting(&FeedEvent::WaitsFor(error.expect("no such port")));
        let device = || "/b".to_owned();
        let broken = LinkError::Adapter { device: device(), what: "no answer" };
        unheard.remove_waiting(&FeedEvent::WaitsFor(broken));
        unheard.take_overdue(Duration::ZERO, &session);
        let reported = unheard.take_overdue(UNHEARD, &session);
        assert_eq!(reported, ["uart:/a: nothing has arrived for 2 s"]);
    }
}
