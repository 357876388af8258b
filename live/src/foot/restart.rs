//! A reset, until the foot is back in the state that it was in before.

use std::time::{Duration, Instant};

use wire::dictionary::index;
use wire::node::{Command, State};
use wire::{Address, DataType, NodeId, Value};

use super::client::{Client, RequestError, TRIES};

/// How long a foot may take from its reset to its first answer.
const START: Duration = Duration::from_secs(5);

/// How long it takes at most until it is heard that a foot has started: over CAN it says so at once.
const HEARD: Duration = Duration::from_secs(2);

impl Client {
    /// Resets the foot, waits for its first answer, and brings it back to the state before: a commanded
    /// reset leaves it in pre-operational state. `node` is its id from then on, where that changes.
    ///
    /// # Errors
    /// It does not start again, or does not come back within five seconds.
    pub fn restart(&mut self, node: Option<NodeId>) -> Result<(), RequestError> {
        let before = self.state()?;
        self.reset(node)?;
        self.bring_to(before)
    }

    /// The same, but as if it were switched on: it streams afterwards, whatever its state was before.
    ///
    /// # Errors
    /// Those of [`Self::restart`].
    pub fn start_again(&mut self) -> Result<(), RequestError> {
        self.reset(None)?;
        self.bring_to(State::Operational)
    }

    /// Resets the foot and waits for its first answer; it is in pre-operational state then. Commands are not
    /// answered, and frames are lost: a foot that goes on as it was is commanded again.
    pub(super) fn reset(&mut self, node: Option<NodeId>) -> Result<(), RequestError> {
        // A foot whose stored id is another starts with that one.
        let serial = match node {
            Some(node) => {
                self.hear(node);
                None
            }
            None => self.read(SERIAL_NUMBER, DataType::Unsigned32).ok(),
        };
        for _ in 0..TRIES {
            self.take_booted();
            self.command(Command::ResetNode)?;
            let has_started = self.hears_start(node, serial)?;
            if has_started || !self.is_there()? {
                if let Some(node) = node {
                    self.follow(node);
                }
                return self.first_answer();
            }
        }
        Err(RequestError::NoAnswer {
            foot: self.foot(),
            what: format!("it was commanded to reset {TRIES} times, and has not"),
        })
    }

    /// Whether the foot is heard to start, as the node that it is from then on: the one that is given, or
    /// any that has its serial number.
    fn hears_start(
        &mut self,
        node: Option<NodeId>,
        serial: Option<Value>,
    ) -> Result<bool, RequestError> {
        let before = self.starts();
        let end = Instant::now() + HEARD;
        while Instant::now() < end {
            self.wait(LOOK)?;
            if self.starts() != before {
                return Ok(true);
            }
            let booted = self.take_booted();
            if node.is_some_and(|node| booted.contains(&node)) {
                return Ok(true);
            }
            for other in booted {
                if serial.is_some() && self.is_now(other, serial)? {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// Whether the node of this id has this serial number; then it is the foot.
    fn is_now(&mut self, node: NodeId, serial: Option<Value>) -> Result<bool, RequestError> {
        let Some(own) = self.node() else {
            return Ok(false);
        };
        self.follow(node);
        let is_foot = match self.read(SERIAL_NUMBER, DataType::Unsigned32) {
            Ok(other) => Some(other) == serial,
            Err(RequestError::NoAnswer { .. } | RequestError::Refused { .. }) => false,
            Err(error) => return Err(error),
        };
        if !is_foot {
            self.follow(own);
        }
        Ok(is_foot)
    }

    /// Whether the foot answers as the node that it was.
    fn is_there(&mut self) -> Result<bool, RequestError> {
        match self.read(SERIAL_NUMBER, DataType::Unsigned32) {
            Ok(_) => Ok(true),
            Err(RequestError::NoAnswer { .. }) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Waits for the foot's first answer after a start.
    pub(super) fn first_answer(&mut self) -> Result<(), RequestError> {
        let end = Instant::now() + START;
        while !self.is_there()? {
            if Instant::now() > end {
                return Err(RequestError::NoAnswer {
                    foot: self.foot(),
                    what: format!("it was reset {} s ago", START.as_secs()),
                });
            }
        }
        Ok(())
    }
}

/// How long to listen before it is looked whether the foot has started.
const LOOK: Duration = Duration::from_millis(5);

const SERIAL_NUMBER: Address = Address::new(index::IDENTITY, 4);
