//! Reset of a foot and return to its previous state.

use std::time::Duration;

use wire::NodeId;
use wire::node::{Command, State};

use super::client::{Client, RequestError, TRIES};

/// Timeout from a reset to the first response.
const START: Duration = Duration::from_secs(5);

/// Timeout for detecting a start; over CAN, the foot reports it at once.
const HEARD: Duration = Duration::from_secs(2);

impl Client {
    /// Resets the foot, waits for its first response, and restores its previous state, because a commanded reset
    /// leaves it in the pre-operational state. `node` is its new id, if that changes.
    ///
    /// # Errors
    /// The foot does not restart, or does not respond within five seconds.
    pub fn restart(&mut self, node: Option<NodeId>) -> Result<(), RequestError> {
        let before = self.state()?;
        self.reset(node)?;
        self.bring_to(before)
    }

    /// Like [`Self::restart`], but the foot streams afterwards in any case, as after power-on.
    ///
    /// # Errors
    /// Those of [`Self::restart`].
    pub fn start_again(&mut self) -> Result<(), RequestError> {
        self.reset(None)?;
        self.bring_to(State::Operational)
    }

    /// Resets the foot and waits for its first response; it is in the pre-operational state then. Commands have
    /// no response, and frames may be lost, so the command is repeated if the foot has not restarted.
    pub(super) fn reset(&mut self, node: Option<NodeId>) -> Result<(), RequestError> {
        // If the stored id differs, the foot restarts with that one and is found by its serial number.
        let serial = match node {
            Some(node) => {
                self.hear(node);
                None
            }
            None => self.serial_number().ok(),
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
        Err(self.no_answer(format!("it was commanded to reset {TRIES} times, and has not")))
    }

    /// Waits for a start of the foot: as the given node, or as any node with its serial number.
    fn hears_start(
        &mut self,
        node: Option<NodeId>,
        serial: Option<u32>,
    ) -> Result<bool, RequestError> {
        let before = self.starts;
        let clock = self.clock();
        let end = clock.now() + HEARD;
        while clock.now() < end {
            self.wait(LOOK)?;
            if self.starts != before {
                return Ok(true);
            }
            let booted = self.take_booted();
            if node.is_some_and(|node| booted.contains(&node)) {
                return Ok(true);
            }
            for other in booted {
                if let Some(serial) = serial
                    && self.is_now(other, serial)?
                {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// Returns whether the node has this serial number; if so, the client follows it.
    pub(super) fn is_now(&mut self, node: NodeId, serial: u32) -> Result<bool, RequestError> {
        let Some(own) = self.node() else {
            return Ok(false);
        };
        self.follow(node);
        let is_foot = match self.serial_number() {
            Ok(other) => other == serial,
            Err(RequestError::NoAnswer { .. } | RequestError::Refused { .. }) => false,
            Err(error) => return Err(error),
        };
        if !is_foot {
            self.follow(own);
        }
        Ok(is_foot)
    }

    /// Returns whether the foot responds under its current id.
    fn is_there(&mut self) -> Result<bool, RequestError> {
        match self.serial_number() {
            Ok(_) => Ok(true),
            Err(RequestError::NoAnswer { .. }) => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Waits for the first response of the foot after a start.
    pub(super) fn first_answer(&mut self) -> Result<(), RequestError> {
        let clock = self.clock();
        let end = clock.now() + START;
        while !self.is_there()? {
            if clock.now() > end {
                return Err(self.no_answer(format!("it was reset {} s ago", START.as_secs())));
            }
        }
        Ok(())
    }
}

/// Polling interval for a start.
const LOOK: Duration = Duration::from_millis(5);
