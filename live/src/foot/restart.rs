//! A reset, until the foot is back in the state that it was in before.

use std::time::{Duration, Instant};

use decode::live::Said;
use wire::dictionary::index;
use wire::node::Command;
use wire::{Address, DataType, NodeId};

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

    /// Resets the foot and waits for its first answer; it is in pre-operational state then. Commands are not
    /// answered, and frames are lost: a foot that goes on as it was is commanded again.
    pub(super) fn reset(&mut self, node: Option<NodeId>) -> Result<(), RequestError> {
        for _ in 0..TRIES {
            self.command(Command::ResetNode)?;
            let has_started = self.hears_start(node)?;
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

    /// Whether the foot is heard to start, as the node that it is from then on.
    fn hears_start(&mut self, node: Option<NodeId>) -> Result<bool, RequestError> {
        let before = self.starts();
        let node = node.map(NodeId::get);
        let end = Instant::now() + HEARD;
        while Instant::now() < end {
            let other = self.listen(LOOK, |heard| {
                let is_new = node.is_some() && heard.foot.node == node;
                (is_new && heard.said == Said::BootUp).then_some(())
            })?;
            if other.is_some() || self.starts() != before {
                return Ok(true);
            }
        }
        Ok(false)
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
