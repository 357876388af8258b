//! State of all feet of a robot, from the events of its feed.
//!
//! A command that shows, records or publishes streaming feet uses a [`Session`]. It lets the session listen to a feed,
//! or passes the feed's events to it, and then takes the updates. After each update the foot has the
//! state of the message.
//!
//! A foot is silent if nothing was received from it during the [listening time](Listening).

use std::time::Duration;

use estimator_core::Timestamp;
use wire::Foot;

use crate::Feed;
use crate::decode::KnownFeet;
use crate::decode::live::{FootMessage, LiveDecoder, MessageBody};
use crate::feed::FeedEvent;
use crate::link::LineClock;
use crate::live_foot::LiveFoot;

/// Description of several boards with one id.
pub const SEVERAL_BOARDS: &str = "several boards with this id";

/// State of all feet of a robot.
#[derive(Default)]
pub struct Session {
    decoder: LiveDecoder,
    feet: Vec<LiveFoot>,
    listening: Listening,
    /// Time of the first arrival.
    first: Option<Timestamp>,
    /// Clock of the feed.
    clock: LineClock,
    /// Time of the newest arrival, on the clock that stamped it and on the clock of the feed.
    newest: Option<(Timestamp, Duration)>,
    now: Timestamp,
    /// Number of lines and fragments that could not be read.
    unreadable: u64,
    /// Update after the messages that are still to be returned.
    after_messages: Option<Update>,
    /// Indices of two feet on different lines with the same name.
    same_name: Option<[usize; 2]>,
}

/// Change of a session.
#[derive(Debug)]
pub enum Update {
    /// A message was applied to the foot with this index.
    Message(usize, FootMessage),
    /// Nothing has arrived until this time.
    Quiet(Timestamp),
    /// Something other than an arrival; before the end of the feed all messages are returned.
    Line(FeedEvent),
}

/// Two feet on different lines with the same name, whose messages would be mixed.
#[derive(Clone, Copy, Debug)]
pub struct SameFoot<'a> {
    /// The feet.
    pub feet: [&'a LiveFoot; 2],
    /// Whether each is on a serial line.
    pub are_serial: [bool; 2],
    /// Name of a foot that no foot of the session has.
    pub unused: &'static str,
}

impl Session {
    /// Creates the state before the first arrival. `feet` defines the nodes of a CAN bus that are feet, and their
    /// names.
    #[must_use]
    pub fn new(feet: KnownFeet) -> Self {
        Self { decoder: LiveDecoder::new(feet), ..Self::default() }
    }

    /// Waits up to `longest` for the next event of a feed, and processes it; without one, the time advances. All updates
    /// must have been taken.
    pub fn listen(&mut self, feed: &Feed, longest: Duration) {
        self.clock.clone_from(feed.clock());
        match feed.next(longest) {
            Some(event) => self.take(event),
            None => self.idle(self.quiet_for()),
        }
    }

    /// Processes an event of a feed. All updates must have been taken.
    pub fn take(&mut self, event: FeedEvent) {
        match event {
            FeedEvent::Arrived((at, arrival)) => {
                self.first.get_or_insert(at);
                self.now = at;
                self.newest = Some((at, self.clock.now()));
                let unreadable = self.decoder.take(arrival, at);
                self.unreadable += u64::from(unreadable.is_some());
                return;
            }
            FeedEvent::Ended(_) => self.decoder.finish(),
            _ => {}
        }
        self.after_messages = Some(Update::Line(event));
    }

    /// Advances the time to `since` after the newest arrival, if there was one. All updates must have been taken.
    pub fn idle(&mut self, since: Duration) {
        let Some((newest, _)) = self.newest else {
            return;
        };
        let since_us = since.as_micros() as u64;
        let now = Timestamp::from_micros(newest.as_micros().saturating_add(since_us));
        if now > self.now {
            self.now = now;
            self.decoder.idle(now);
            self.after_messages = Some(Update::Quiet(now));
        }
    }

    /// Ends reception: contacts that wait for related messages are released.
    pub fn finish(&mut self) {
        self.decoder.finish();
    }

    /// Returns the next update, if any.
    pub fn next_update(&mut self) -> Option<Update> {
        if let Some(message) = self.decoder.next_message() {
            self.listening.arrive(message.at);
            let index = self.sender_of(&message);
            self.feet[index].apply(&message, self.listening.us());
            return Some(Update::Message(index, message));
        }
        let update = self.after_messages.take();
        if let Some(Update::Quiet(now)) = update {
            self.listening.idle(now);
        }
        update
    }

    /// Returns the index of the foot that sent a message, adding it on first reception.
    fn sender_of(&mut self, message: &FootMessage) -> usize {
        let key = &message.foot;
        let name = match (self.decoder.name(key), &message.body) {
            (None, MessageBody::Contact(row)) => row.foot.clone(),
            (name, _) => name,
        };
        let is_same = |foot: &LiveFoot| {
            foot.key.line == key.line
                && match (foot.key.node, key.node) {
                    (Some(known), Some(node)) => known == node,
                    // Several feet of a recording share one line.
                    (None, None) => name.is_none() || name == foot.name,
                    // A foot on a serial line is received before its id is known.
                    (known, _) => known.is_none(),
                }
        };
        let index = self.feet.iter().position(is_same);
        let index = index.unwrap_or_else(|| {
            self.feet.push(LiveFoot::new(key.clone(), name.clone()));
            self.feet.len() - 1
        });
        let foot = &mut self.feet[index];
        if foot.key != *key {
            (foot.key, foot.name) = (key.clone(), name);
        }
        self.compare_names(index);
        index
    }

    /// Looks for a foot on another line with the name of this one.
    fn compare_names(&mut self, index: usize) {
        let foot = &self.feet[index];
        let is_same = |other: &LiveFoot| {
            foot.name.is_some() && other.name == foot.name && other.key.line != foot.key.line
        };
        if self.same_name.is_none()
            && let Some(other) = self.feet.iter().position(is_same)
        {
            self.same_name = Some([other.min(index), other.max(index)]);
        }
    }

    /// Returns two feet on different lines with the same name, if there are any.
    #[must_use]
    pub fn same_name(&self) -> Option<SameFoot<'_>> {
        let feet = self.same_name?.map(|index| &self.feet[index]);
        let is_unused =
            |name: &&str| self.feet.iter().all(|foot| foot.name.as_deref() != Some(*name));
        let unused = Foot::ALL.map(Foot::name).into_iter().find(is_unused);
        Some(SameFoot {
            feet,
            are_serial: feet.map(|foot| self.decoder.is_serial(&foot.key.line)),
            unused: unused.unwrap_or("R"),
        })
    }

    /// Returns the feet, in the order of their first messages.
    #[must_use]
    pub fn feet(&self) -> &[LiveFoot] {
        &self.feet
    }

    /// Returns the decoder of all lines.
    #[must_use]
    pub const fn decoder(&self) -> &LiveDecoder {
        &self.decoder
    }

    /// Returns the listening time.
    #[must_use]
    pub const fn listening(&self) -> &Listening {
        &self.listening
    }

    /// Returns the time of the newest arrival, or the present time of the clock if that is later.
    #[must_use]
    pub const fn now(&self) -> Timestamp {
        self.now
    }

    /// Returns the time from the first arrival to [`Self::now`], s.
    #[must_use]
    pub fn elapsed_s(&self) -> f64 {
        let first = self.first.unwrap_or(self.now);
        self.now.as_micros().saturating_sub(first.as_micros()) as f64 / 1.0e6
    }

    /// Returns the time since the newest arrival on the clock of the feed; 0 before the first.
    #[must_use]
    pub fn quiet_for(&self) -> Duration {
        let elapsed = self.newest.map(|(_, arrived)| self.clock.now().saturating_sub(arrived));
        elapsed.unwrap_or_default()
    }

    /// Returns the number of unreadable lines of logs and adapters.
    #[must_use]
    pub const fn unreadable(&self) -> u64 {
        self.unreadable
    }
}

/// Maximum time counted between two arrivals, µs; a longer gap means that the program has stalled.
const LONGEST_GAP_US: u64 = 10_000;

/// Maximum time counted for an idle poll, µs; a longer gap means that the program has stalled.
const LONGEST_IDLE_US: u64 = 50_000;

/// Accumulated listening time, against which silent feet are detected. A stall of this machine delays all feet, one after
/// the other, and does not count.
#[derive(Clone, Copy, Debug, Default)]
pub struct Listening {
    us: u64,
    now: Option<Timestamp>,
}

impl Listening {
    /// Adds the time until data received at `at`.
    pub fn arrive(&mut self, at: Timestamp) {
        self.advance(at, LONGEST_GAP_US);
    }

    /// Adds the time until `now` without reception.
    pub fn idle(&mut self, now: Timestamp) {
        self.advance(now, LONGEST_IDLE_US);
    }

    fn advance(&mut self, time: Timestamp, longest_us: u64) {
        let before_us = self.now.unwrap_or(time).as_micros();
        let since_us = time.as_micros().saturating_sub(before_us);
        self.us += since_us.min(longest_us);
        self.now = self.now.max(Some(time));
    }

    /// Listening time, µs.
    #[must_use]
    pub const fn us(&self) -> u64 {
        self.us
    }

    /// Newest time passed in.
    #[must_use]
    pub fn now(&self) -> Timestamp {
        self.now.unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Arrival;
    use crate::decode::ContactRow;
    use wire::CanFrame;

    fn at(ms: u64) -> Timestamp {
        Timestamp::from_micros(9_000_000 + 1000 * ms)
    }

    /// Returns all updates, with the index of the foot or `None`.
    fn updates(session: &mut Session) -> Vec<Option<usize>> {
        let updates = std::iter::from_fn(|| session.next_update());
        let index = |update| match update {
            Update::Message(foot, _) => Some(foot),
            Update::Quiet(_) | Update::Line(_) => None,
        };
        updates.map(index).collect()
    }

    fn estimate(session: &mut Session, ms: u64, foot: &str) {
        let row =
            ContactRow { timestamp: at(ms), foot: Some(foot.into()), ..ContactRow::default() };
        session.take(FeedEvent::Arrived((at(ms), Arrival::Estimate(Box::new(row)))));
    }

    fn frame(session: &mut Session, ms: u64, id: u16, data: &[u8]) {
        let frame = CanFrame::new(id, data).expect("a frame");
        let interface = "can0".into();
        session.take(FeedEvent::Arrived((at(ms), Arrival::Frame { interface, frame })));
    }

    #[test]
    fn feet_of_a_recording_share_a_line_without_an_id() {
        let mut session = Session::new(KnownFeet::default());
        for (foot, index) in [("FL", 0), ("FR", 1), ("FL", 0), ("RL", 2), ("FR", 1)] {
            estimate(&mut session, 0, foot);
            assert_eq!(updates(&mut session), [Some(index)], "{foot}");
        }
        let names = session.feet().iter().map(|foot| foot.name_or("node "));
        assert!(names.eq(["FL", "FR", "RL"]));
    }

    #[test]
    fn same_name_on_two_lines_is_found_once_both_are_heard() {
        let mut session = Session::new(KnownFeet::default());
        let mut row = |line: &str, foot: &str| {
            let row = ContactRow {
                timestamp: at(0),
                interface: Some(line.into()),
                foot: Some(foot.into()),
                ..ContactRow::default()
            };
            session.take(FeedEvent::Arrived((at(0), Arrival::Estimate(Box::new(row)))));
            updates(&mut session);
            let same = session.same_name();
            same.map(|same| (same.feet.map(|foot| foot.key.line.to_string()), same.unused))
        };
        assert_eq!(row("a", "FL"), None);
        assert_eq!(row("b", "FR"), None);
        let both = ["a", "c"].map(str::to_owned);
        assert_eq!(row("c", "FL"), Some((both, "RL")));
    }

    #[test]
    fn stall_of_this_machine_silences_feet_in_the_display_alone() {
        let mut session = Session::new(KnownFeet::default());
        for foot in ["FL", "FR"] {
            estimate(&mut session, 0, foot);
            updates(&mut session);
        }
        let silent = |session: &Session| {
            let foot = &session.feet()[1];
            let listened_us = session.listening().us();
            [foot.is_silent(session.now()), foot.has_fallen_silent(listened_us)]
        };
        estimate(&mut session, 900, "FL");
        updates(&mut session);
        assert_eq!(silent(&session), [true, false]);
        for ms in 901..1500 {
            estimate(&mut session, ms, "FL");
            updates(&mut session);
        }
        assert_eq!(silent(&session), [true, true]);
        estimate(&mut session, 1500, "FR");
        updates(&mut session);
        assert_eq!(silent(&session), [false, false]);
    }

    #[test]
    fn quiet_update_follows_contacts_that_waited() {
        let mut session = Session::new(KnownFeet::default());
        session.idle(Duration::from_millis(30));
        assert_eq!(updates(&mut session), [], "nothing has arrived");
        frame(&mut session, 0, 0x191, &[0; 8]);
        assert_eq!(updates(&mut session), []);
        session.idle(Duration::from_millis(30));
        assert_eq!(updates(&mut session), [Some(0), None]);
        assert_eq!(session.now(), at(30));
        session.idle(Duration::from_millis(20));
        assert_eq!(updates(&mut session), [], "time does not go back");
    }

    #[test]
    fn drops_are_counted_across_turns_and_restarts() {
        let mut session = Session::new(KnownFeet::default());
        let mut dropped = |id, data: &[u8]| {
            frame(&mut session, 0, id, data);
            updates(&mut session);
            let foot = &session.feet()[0];
            (foot.dropped, foot.health.map(|health| health.dropped))
        };
        let health = |count| [0, 0, count, 0, 0, 0, 0, 0];
        assert_eq!(dropped(0x511, &health(250)), (250, Some(250)));
        assert_eq!(dropped(0x511, &health(4)), (260, Some(4)));
        assert_eq!(dropped(0x711, &[0]), (260, Some(4)));
        assert_eq!(dropped(0x511, &health(3)), (3, Some(3)));
    }
}
