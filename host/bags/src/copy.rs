//! Copies of all messages of one bag or of several bags. Numbers in some messages can be replaced.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io;
use std::mem::replace;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::thread::{self, ScopedJoinHandle};

use thiserror::Error;

use crate::definition::{Definition, FieldPath};
use crate::messages::{Channel, MessageTimes, Visitor, decompressed_message};
use crate::records::LONGEST_RECORD;
use crate::visit;
use stored::container::Readable;
use stored::error::{DefinitionProblem, InputError, MessageProblem};

/// Error of a copy.
#[derive(Debug, Error)]
pub enum CopyError {
    /// A bag cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The receiver of the messages failed.
    #[error(transparent)]
    Receiver(io::Error),
}

/// Receiver of the messages of a bag, decompressed; its error ends the copy.
type Receiver<'a> = &'a mut dyn FnMut(&Channel, MessageTimes, &[u8]) -> io::Result<()>;

/// Passes all messages of a bag in stored order to a receiver.
///
/// # Errors
/// The bag cannot be read, or the first error of the receiver.
pub(crate) fn copy(path: &Path, receiver: Receiver<'_>) -> Result<(), CopyError> {
    let Readable::Container(mut container) =
        Readable::open(path, None, |file, _| Box::new(file), |_| None)?
    else {
        let not_a_bag = io::ErrorKind::InvalidInput.into();
        return Err(InputError::unreadable(&path.display().to_string(), not_a_bag).into());
    };
    let mut copier =
        Copier { receiver, file: container.file.clone(), messages: HashMap::new(), failed: None };
    let visited = visit(&mut container.parts, &container.file, &mut copier);
    if let Some(error) = copier.failed {
        return Err(CopyError::Receiver(error));
    }
    // Parts that end early were reported when the samples were read.
    visited?;
    Ok(())
}

/// Messages of a bag that may wait until the messages of the others have reached their time.
const WAITING: usize = 64;

/// Receiver of the messages of several bags, with the index of the bag; its error ends the copy.
type ReceiverOfAll<'a> = &'a mut dyn FnMut(usize, &Channel, MessageTimes, &[u8]) -> io::Result<()>;

/// Passes all messages of bags to a receiver in order of the time of writing, as far as each bag is in this order
/// itself. Memory does not grow with the length of a bag.
///
/// Parts that end early are not reported, because they were already reported when the samples were read.
///
/// # Errors
/// A bag cannot be read, or the first error of the receiver.
pub fn copy_merged(paths: &[PathBuf], receiver: ReceiverOfAll<'_>) -> Result<(), CopyError> {
    if let [path] = paths {
        return copy(path, &mut |channel, times, payload| receiver(0, channel, times, payload));
    }
    // A thread reads each bag, and waits while the others are behind.
    thread::scope(|scope| {
        let mut bags: Vec<_> = paths
            .iter()
            .map(|path| {
                let (sender, messages) = mpsc::sync_channel(WAITING);
                let reader = scope.spawn(move || {
                    copy(path, &mut |channel, times, payload| {
                        let (channel, payload) = (channel.clone(), payload.to_vec());
                        let message = Message { channel, times, payload };
                        sender.send(message).map_err(|_| io::ErrorKind::BrokenPipe.into())
                    })
                });
                Reading { next: None, messages, reader: Some(reader) }
            })
            .collect();
        for bag in &mut bags {
            bag.next = bag.messages.recv().ok();
        }
        loop {
            for bag in bags.iter_mut().filter(|bag| bag.next.is_none()) {
                if let Some(reader) = bag.reader.take() {
                    reader.join().unwrap_or_else(|panic| resume_unwind(panic))?;
                }
            }
            let heads = bags.iter().enumerate().filter_map(|(index, bag)| {
                bag.next.as_ref().map(|message| (message.times.log_ns, index))
            });
            let Some((_, index)) = heads.min() else {
                return Ok(());
            };
            let bag = &mut bags[index];
            let following = bag.messages.recv().ok();
            if let Some(Message { channel, times, payload }) = replace(&mut bag.next, following)
                && let Err(error) = receiver(index, &channel, times, &payload)
            {
                return Err(CopyError::Receiver(error));
            }
        }
    })
}

/// A bag that is being read.
struct Reading<'scope> {
    messages: mpsc::Receiver<Message>,
    /// The next message; `None` after the last.
    next: Option<Message>,
    /// Reader of the bag; `None` once it has ended.
    reader: Option<ScopedJoinHandle<'scope, Result<(), CopyError>>>,
}

/// A message on the way to the receiver.
struct Message {
    channel: Channel,
    times: MessageTimes,
    payload: Vec<u8>,
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
        times: MessageTimes,
        payload: &[u8],
    ) -> Result<(), InputError> {
        let number = self.messages.entry(channel.topic.clone()).or_default();
        *number += 1;
        // rosbag2 compresses messages one by one. Only in CDR do the first bytes of a message tell whether it is
        // compressed.
        let message = match channel.encoding.as_str() {
            "cdr" => decompressed_message(payload, LONGEST_RECORD as u64),
            _ => Ok(Cow::Borrowed(payload)),
        };
        let message = message.map_err(|problem| {
            InputError::of_message(&self.file, &channel.topic, *number, problem)
        })?;
        let received = (self.receiver)(channel, times, &message);
        received.map_err(|error| {
            self.failed = Some(error);
            // Only an error ends a visit. It is not returned, because `copy` returns the error of the receiver.
            InputError::empty(&self.file)
        })
    }
}

/// Reason why numbers cannot be replaced.
#[derive(Debug, Error)]
pub enum ReplacementError {
    /// There is no definition, or no such number in it.
    #[error(transparent)]
    Definition(#[from] DefinitionProblem),
    /// The message is not of its definition.
    #[error(transparent)]
    Message(#[from] MessageProblem),
}

/// Numbers to replace in the messages of a channel.
#[derive(Clone, Debug)]
pub struct Replacement {
    definition: Definition,
    paths: Vec<FieldPath>,
}

impl Replacement {
    /// Finds numbers by their names, such as `foot_force[0]`, in the definition of a channel.
    ///
    /// # Errors
    /// There is no definition, or no such number in it.
    pub fn of(channel: &Channel, names: &[&str]) -> Result<Self, ReplacementError> {
        let definition = Definition::of_channel(channel)?;
        let paths = names.iter().map(|name| definition.number(name));
        let paths = paths.collect::<Result<_, DefinitionProblem>>()?;
        Ok(Self { definition, paths })
    }

    /// Returns a message, which is not compressed, with other values: one for each name, in its unit, rounded and
    /// limited to the type of the number.
    ///
    /// # Errors
    /// The message is not of its definition.
    pub fn replaced(&self, message: &[u8], values: &[f64]) -> Result<Vec<u8>, ReplacementError> {
        let paths: Vec<&FieldPath> = self.paths.iter().collect();
        let places = self.definition.places(message, &paths)?;
        let mut message = message.to_vec();
        for (place, value) in places.into_iter().zip(values) {
            place.write(*value, &mut message).ok_or(MessageProblem::NoRoom)?;
        }
        Ok(message)
    }
}
