//! Messages of a foot of a bag, in the order in which they are written.

use std::collections::VecDeque;
use std::io;
use std::iter::Peekable;

use crate::ros::{EstimateMessages, Published};
use estimator_core::{ContactEstimate, Load, Timestamp};
use recordings::events::ContactEvent;
use recordings::input::About;
use recordings::replay::Replay;

use super::CopiedFoot;

/// Estimates of a foot, each with the load of its sample.
type Estimated<'a> = Box<dyn Iterator<Item = io::Result<(ContactEstimate, Option<Load>)>> + 'a>;

/// Contacts and events of a foot.
pub(super) struct Stream<'a> {
    about: About,
    messages: EstimateMessages,
    estimates: Peekable<Estimated<'a>>,
    /// Events in order of time.
    events: VecDeque<ContactEvent>,
}

/// Time of the next messages, µs since 1970.
#[derive(Clone, Copy, Debug)]
pub(super) struct Due {
    /// Time of the sample, or of the event.
    time_us: i64,
    /// Time of writing.
    pub(super) written_us: i64,
    is_event: bool,
}

impl<'a> Stream<'a> {
    /// Starts the estimate of a foot whose topics have this name.
    pub(super) fn of(foot: &'a mut CopiedFoot, name: &str) -> io::Result<Self> {
        let about = foot.stored.about.clone();
        let replay = Replay::new(about.sample_rate, about.gravity, &foot.params);
        let mut replay = replay.map_err(io::Error::other)?;
        let samples = foot.stored.samples()?;
        let span = foot.span;
        let estimates = samples.map(move |sample| {
            let sample = sample?;
            Ok((replay.update(&sample), sample.load))
        });
        let is_in = move |estimated: &io::Result<(ContactEstimate, _)>| match estimated {
            Ok((estimate, _)) => span.contains(estimate.timestamp),
            Err(_) => true,
        };
        let estimates: Estimated<'_> = Box::new(estimates.filter(is_in));
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
    pub(super) fn topics(&self) -> impl Iterator<Item = String> {
        self.messages.topics().map(ToString::to_string).into_iter()
    }

    /// Times of the next messages; an event follows the contact of its time.
    ///
    /// # Errors
    /// The samples cannot be read.
    pub(super) fn due(&mut self) -> io::Result<Option<Due>> {
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

    /// Returns the messages that are due, and the load of their sample.
    pub(super) fn take(&mut self, due: Due) -> (Vec<Published>, Option<Load>) {
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
