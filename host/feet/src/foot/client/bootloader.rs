//! A foot on a serial line, whose bootloader speaks otherwise than its program. On a bus both are one node.

use std::time::Duration;

use crate::decode::live::Listener;
use wire::NodeId;

use super::{Client, RequestError};
use crate::foot::scan::{self, SCAN};
use crate::link::{Link, LinkError};

/// Returns the id under which a bootloader answers on a serial line; `None` where there is none.
pub(super) fn node(
    link: &mut dyn Link,
    listener: &mut Listener,
) -> Result<Option<NodeId>, RequestError> {
    let Some(line) = link.as_serial_line() else {
        return Ok(None);
    };
    match line.speak_text() {
        Ok(()) => {}
        Err(LinkError::Adapter { .. }) => return Ok(None),
        Err(error) => return Err(error.into()),
    }
    let feet = scan::feet(link, listener, SCAN)?;
    let node = feet.iter().find_map(|foot| foot.node);
    if let (None, Some(line)) = (node, link.as_serial_line()) {
        line.speak_messages();
    }
    Ok(node.and_then(NodeId::new))
}

impl Client {
    /// Turns to the bootloader that is starting, which answers within `longest`.
    ///
    /// # Errors
    /// It does not, or the line does not work.
    pub(in crate::foot) fn turn_to_bootloader(
        &mut self,
        longest: Duration,
    ) -> Result<(), RequestError> {
        if self.link.as_serial_line().is_none() {
            return Ok(());
        }
        let clock = self.clock();
        let end = clock.now() + longest;
        loop {
            if let Some(node) = node(self.link.as_mut(), &mut self.listener)? {
                self.node = Some(node);
                return Ok(());
            }
            if clock.now() > end {
                return Err(self.no_answer("as its bootloader"));
            }
        }
    }

    /// Turns to the program that is starting.
    pub(in crate::foot) fn turn_to_program(&mut self) {
        if let Some(line) = self.link.as_serial_line() {
            line.speak_messages();
            self.node = None;
            self.clock_us = None;
        }
    }
}
