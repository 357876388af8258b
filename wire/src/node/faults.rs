//! Active faults, and the emergency messages that report when each is raised and when it is cleared.

use canopen_rs::NmtState;

use super::Node;
use crate::fault::{Emergency, Fault, Faults};
use crate::foot::cob_id;
use crate::frame::CanFrame;

impl Node {
    /// Raises a fault; returns the emergency message to send. `None` if the fault was active
    /// already; if it cannot be sent in this state, [`Node::tick`] sends it later.
    pub fn raise(&mut self, fault: Fault, detail: u32) -> Option<CanFrame> {
        if self.device.faults.contains(fault) {
            return None;
        }
        self.note(fault, detail);
        self.report(fault)
    }

    /// Raises a fault that cannot be reported while it lasts: [`Node::tick`] sends the
    /// emergency message after [`Node::release`].
    pub fn raise_held_back(&mut self, fault: Fault, detail: u32) {
        if !self.reported.contains(fault) {
            self.held_back = self.held_back.with(fault);
        }
        if !self.device.faults.contains(fault) {
            self.note(fault, detail);
        }
    }

    /// Allows a fault that was held back to be reported.
    pub fn release(&mut self, fault: Fault) {
        self.held_back = self.held_back.without(fault);
    }

    fn note(&mut self, fault: Fault, detail: u32) {
        self.device.faults = self.device.faults.with(fault);
        let history = &mut self.device.history;
        if history.is_full() {
            history.pop_back();
        }
        // There is room now.
        let _ = history.push_front(u32::from(fault.code()) | u32::from(fault.number()) << 16);
        if let Some(kept) = self.details.get_mut(usize::from(fault.number())) {
            *kept = detail;
        }
    }

    /// Clears a fault; returns the emergency message to send if the fault was reported.
    pub fn clear(&mut self, fault: Fault) -> Option<CanFrame> {
        self.device.faults = self.device.faults.without(fault);
        self.held_back = self.held_back.without(fault);
        let reported = self.reported.contains(fault);
        self.reported = self.reported.without(fault);
        let id = self.id_for_emergencies().filter(|_| reported)?;
        let emergency = Emergency::cleared(fault, self.device.faults);
        Some(CanFrame::of(id, emergency.encode()))
    }

    pub(super) fn report(&mut self, fault: Fault) -> Option<CanFrame> {
        let id = self.id_for_emergencies()?;
        self.reported = self.reported.with(fault);
        let detail = self.details.get(usize::from(fault.number())).copied();
        let emergency = Emergency::raised(fault, detail.unwrap_or(0), self.device.faults);
        Some(CanFrame::of(id, emergency.encode()))
    }

    /// Identifier of emergency messages, in states in which they are sent.
    fn id_for_emergencies(&self) -> Option<u16> {
        match self.device.state {
            NmtState::PreOperational | NmtState::Operational => {
                Some(self.device.id?.cob_id(cob_id::EMERGENCY))
            }
            NmtState::Initialising | NmtState::Stopped => None,
        }
    }

    /// Active faults that are neither reported nor held back.
    #[inline]
    pub(super) const fn unreported(&self) -> Faults {
        let reportable = self.device.faults.without_all(self.held_back);
        reportable.without_all(self.reported)
    }
}
