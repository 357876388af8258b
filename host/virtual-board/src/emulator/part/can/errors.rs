//! Error counters and the states derived from them: warning, passive, off.

use super::Can;
use super::registers::{ABOM, ERRI};

impl Can {
    pub(super) fn error_raised(&mut self) {
        // ERRIE, and LECIE, BOFIE, EPVIE, EWGIE for the new state.
        if self.transmit_errors > 255 && !self.off {
            self.off = true;
            self.transmit_errors = 0;
            if self.control & ABOM != 0 {
                self.wait_for_idle(128 * 11);
            }
        }
        let state = self.error_state();
        let watched = self.interrupts >> 8;
        if state & watched & 7 != 0 || watched & 8 != 0 {
            self.status |= ERRI;
        }
    }

    pub(super) const fn error_state(&self) -> u32 {
        let (transmit, receive) = (self.transmit_errors, self.receive_errors);
        let warning = transmit >= 96 || receive >= 96 || self.off;
        let passive = transmit > 127 || receive > 127 || self.off;
        warning as u32 | (passive as u32) << 1 | (self.off as u32) << 2
    }
}
