//! All messages of a bag as they are stored, for a copy of it.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io;
use std::path::Path;

use super::super::error::InputError;
use super::super::open::Source;
use super::super::refusal::ContainerError;
use super::cdr::decompressed_message;
use super::mcap::LONGEST_RECORD;
use super::storage::{Channel, Visitor, Written};
use super::visit::visit;

/// Receiver of the messages of a bag, decompressed; its error ends the copy.
type Receiver<'a> = &'a mut dyn FnMut(&Channel, Written, &[u8]) -> io::Result<()>;

/// Passes all messages of a bag in stored order to a receiver; returns a sentence about each part that ends early.
///
/// # Errors
/// Outer: the bag cannot be read. Inner: the first error of the receiver.
pub fn copy(path: &Path, receiver: Receiver<'_>) -> Result<io::Result<Vec<String>>, InputError> {
    let Source::Container(mut container) = Source::open(path, None, |file, _| Box::new(file))?
    else {
        return Ok(Err(io::ErrorKind::InvalidInput.into()));
    };
    let mut copier =
        Copier { receiver, file: container.file.clone(), messages: HashMap::new(), failed: None };
    let visited = visit(&mut container.parts, &container.file, &mut copier);
    match (copier.failed, visited) {
        (Some(error), _) => Ok(Err(error)),
        (None, visited) => visited.map(Ok),
    }
}

struct Copier<'a> {
    receiver: Receiver<'a>,
    file: String,
    /// Number of messages of each topic so far.
    messages: HashMap<String, u64>,
    failed: Option<io::Error>,
}

impl Visitor for Copier<'_> {
    fn channel(&mut self, _: &Channel) -> bool {
        true
    }

    fn message(
        &mut self,
        channel: &Channel,
        written: Written,
        payload: &[u8],
    ) -> Result<(), InputError> {
        let number = self.messages.entry(channel.topic.clone()).or_default();
        *number += 1;
        // rosbag2 compresses messages one by one; in others these bytes may be anything.
        let message = match channel.encoding.as_str() {
            "cdr" => decompressed_message(payload, LONGEST_RECORD as u64),
            _ => Ok(Cow::Borrowed(payload)),
        };
        let message = message.map_err(|what| ContainerError::Message {
            file: self.file.clone(),
            topic: channel.topic.clone(),
            number: *number,
            what,
        })?;
        let received = (self.receiver)(channel, written, &message);
        received.map_err(|error| {
            // The visit ends; the error itself is returned apart.
            self.failed = Some(error);
            InputError::empty(&self.file)
        })
    }
}
