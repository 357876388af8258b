//! Forwarding of server log entries that concern the user: errors, failed handshakes, and slow clients, which the server
//! reports in no other way.

use std::fmt::{self, Debug, Write};

use tracing::field::{Field, Visit};
use tracing::span::{Attributes, Id, Record};
use tracing::subscriber::set_global_default;
use tracing::{Event, Level, Metadata, Subscriber};

use crate::messages::warn;

/// Prefix of a log entry about dropped messages; at most two a minute for all clients.
const FULL: &str = "outbox for client ";

/// Begin and end of a log entry about a client without the protocol: an old viewer, or another program.
const HANDSHAKE: [&str; 2] = ["Dropping client ", ": handshake failed"];

/// Starts forwarding the server's log entries.
pub fn notice() {
    // An embedding program may already have a subscriber.
    let _ = set_global_default(Notes);
}

/// Subscriber for log entries.
struct Notes;

impl Subscriber for Notes {
    fn enabled(&self, about: &Metadata<'_>) -> bool {
        about.is_event() && about.target().starts_with("foxglove") && *about.level() <= Level::INFO
    }

    fn new_span(&self, _: &Attributes<'_>) -> Id {
        // No span is enabled.
        Id::from_u64(1)
    }

    fn record(&self, _: &Id, _: &Record<'_>) {}

    fn record_follows_from(&self, _: &Id, _: &Id) {}

    fn event(&self, event: &Event<'_>) {
        let mut text = Text::default();
        event.record(&mut text);
        if let Some(said) = what_to_say(*event.metadata().level(), &text.0) {
            warn(said);
        }
    }

    fn enter(&self, _: &Id) {}

    fn exit(&self, _: &Id) {}
}

/// Returns the warning for a log entry, if any.
fn what_to_say(level: Level, note: &str) -> Option<String> {
    if let Some(rest) = note.strip_prefix(FULL) {
        let client = rest.split_whitespace().next().unwrap_or_default();
        return Some(format!(
            "the viewer at {client} takes less than is sent: its oldest messages are dropped"
        ));
    }
    let client = note
        .strip_prefix(HANDSHAKE[0])
        .and_then(|rest| rest.strip_suffix(HANDSHAKE[1]));
    if let Some(client) = client {
        return Some(format!(
            "the viewer at {client} did not offer the subprotocol foxglove.sdk.v1 in its handshake: update it"
        ));
    }
    (level == Level::ERROR).then(|| note.to_owned())
}

/// Text of a log entry.
#[derive(Default)]
struct Text(String);

impl Visit for Text {
    fn record_debug(&mut self, field: &Field, value: &dyn Debug) {
        if field.name() == "message" {
            // Writing to memory does not fail.
            let _: fmt::Result = write!(self.0, "{value:?}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_and_old_viewers_and_errors_are_reported() {
        assert_eq!(
            what_to_say(Level::INFO, "outbox for client 127.0.0.1:9 full").as_deref(),
            Some(
                "the viewer at 127.0.0.1:9 takes less than is sent: its oldest messages are dropped"
            )
        );
        assert_eq!(
            what_to_say(Level::ERROR, "Dropping client [::1]:9: handshake failed").as_deref(),
            Some(
                "the viewer at [::1]:9 did not offer the subprotocol foxglove.sdk.v1 in its handshake: update it"
            )
        );
        assert_eq!(what_to_say(Level::INFO, "Started server"), None);
        assert_eq!(what_to_say(Level::ERROR, "x").as_deref(), Some("x"));
    }
}
