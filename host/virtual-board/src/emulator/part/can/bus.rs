//! The bus: arbitration, the end of a frame, and faults of the lines.

use super::registers::{ABOM, INAK, INRQ, LOOPBACK, NART, SILENT, SLAK, SLEEP};
use super::{BusFault, BusFrame, Can, Sender, TimedFrame};
use crate::emulator::time::NEVER;

impl Can {
    /// Time of the next event on the bus.
    #[must_use]
    pub fn next_event(&self) -> u64 {
        let mut next = self.joined_at;
        if let Some((_, end)) = self.busy {
            return end;
        }
        if self.starts_now() {
            next = next.min(self.now);
        }
        if self.is_normal()
            && self.hears_others()
            && let Some(first) = self.incoming.front()
        {
            next = next.min(first.time);
        }
        next
    }

    fn starts_now(&self) -> bool {
        let own = self.takes_part() && self.mailboxes.iter().any(|mailbox| mailbox.pending);
        own || (self.fault == BusFault::Saturated && self.is_normal() && self.hears_others())
    }

    fn hears_others(&self) -> bool {
        self.timing & LOOPBACK == 0 && matches!(self.fault, BusFault::None | BusFault::Saturated)
    }

    /// Returns whether the controller sees a shorted bus. In loop-back mode it disregards its pin (RM0090, 32.5.3).
    pub(super) fn is_shorted(&self) -> bool {
        self.fault == BusFault::Shorted && self.timing & LOOPBACK == 0
    }

    /// Advances to `now`.
    pub fn advance(&mut self, now: u64) {
        loop {
            if self.joined_at <= now && self.busy.is_none() {
                self.join(self.joined_at);
            }
            match self.busy {
                Some((sender, end)) if end <= now => {
                    self.busy = None;
                    self.now = end;
                    self.finish(sender, end);
                    if !self.is_shorted() {
                        self.acknowledge();
                    }
                }
                Some(_) => break,
                None => {
                    let peer = match self.incoming.front() {
                        Some(first) if self.hears_others() => first.time,
                        _ => NEVER,
                    };
                    let start = if self.starts_now() { self.now } else { peer.max(self.now) };
                    if start <= now && self.is_normal() {
                        self.arbitrate(start);
                    }
                    if self.busy.is_none() {
                        self.now = now;
                        break;
                    }
                }
            }
        }
    }

    /// Selects the winner: the lowest identifier among the next mailbox and the other nodes.
    fn arbitrate(&mut self, start: u64) {
        let own = self.next_mailbox().filter(|_| self.takes_part());
        let connected = self.hears_others();
        let peer = self
            .incoming
            .front()
            .filter(|first| connected && first.time <= start)
            .map(|first| first.frame.clone());
        let flood = (self.fault == BusFault::Saturated && connected).then(flooding);
        let rivals = [
            own.map(|index| (self.mailboxes[index].frame(), Sender::Mailbox(index))),
            peer.map(|frame| (frame, Sender::Peer)),
            flood.map(|frame| (frame, Sender::Flood)),
        ];
        let Some((frame, sender)) = rivals.into_iter().flatten().min_by_key(|(frame, _)| frame.id)
        else {
            return;
        };
        if let Some(index) = own
            && sender != Sender::Mailbox(index)
        {
            // ALST.
            self.transmit |= 4 << (8 * index);
            if self.control & NART != 0 {
                self.complete(index, false);
            }
        }
        // An error flag ends a frame early: no bit after the first few is sent.
        let bits = if self.is_shorted() { 1 + 6 + 8 + 3 } else { frame.bits() };
        let length = bits * self.bit();
        self.busy = Some((sender, start + length));
    }

    fn finish(&mut self, sender: Sender, time: u64) {
        match sender {
            Sender::Mailbox(index) => {
                let alone = self.timing & (LOOPBACK | SILENT) == 0;
                let error = match self.fault {
                    BusFault::Shorted if alone => Some(5),
                    BusFault::NoAcknowledge | BusFault::AbortIgnored if alone => Some(3),
                    _ => None,
                };
                if let Some(code) = error {
                    self.last_error = code;
                    // A passive node does not count further errors without an acknowledge.
                    if !(code == 3 && self.transmit_errors >= 128) {
                        self.transmit_errors += 8;
                    }
                    self.transmit |= 8 << (8 * index);
                    if self.control & NART != 0 || self.is_aborted(index) {
                        self.complete(index, false);
                        self.transmit |= 8 << (8 * index);
                    }
                    self.error_raised();
                } else {
                    let frame = self.mailboxes[index].frame();
                    self.transmit_errors = self.transmit_errors.saturating_sub(1);
                    self.last_error = 0;
                    self.complete(index, true);
                    if self.timing & LOOPBACK != 0 {
                        self.receive(&frame);
                    }
                    if self.timing & SILENT == 0 {
                        self.sent.push(TimedFrame { time, frame });
                    }
                }
            }
            Sender::Peer => {
                if let Some(TimedFrame { frame, .. }) = self.incoming.pop_front()
                    && self.takes_part()
                {
                    self.receive_errors = self.receive_errors.saturating_sub(1);
                    self.last_error = 0;
                    self.receive(&frame);
                }
            }
            Sender::Flood if self.takes_part() => self.receive(&flooding()),
            Sender::Flood => {}
        }
    }

    /// Waits for this many recessive bits until the controller takes part again.
    pub(super) fn wait_for_idle(&mut self, bits: u64) {
        self.joined_at = if self.is_shorted() { NEVER } else { self.now + bits * self.bit() };
    }

    fn join(&mut self, time: u64) {
        self.joined_at = NEVER;
        self.now = self.now.max(time);
        if self.off {
            self.off = false;
            self.transmit_errors = 0;
            self.receive_errors = 0;
        }
        if self.control & (INRQ | SLEEP) == 0 {
            self.status &= !(INAK | SLAK);
        }
    }

    /// Sets or clears a fault of the bus.
    pub fn set_fault(&mut self, fault: BusFault) {
        let was = core::mem::replace(&mut self.fault, fault);
        if fault != BusFault::Shorted && self.busy.is_none() && self.is_normal() {
            self.acknowledge();
        }
        if was == BusFault::Shorted && self.joined_at == NEVER {
            if self.off && self.control & ABOM != 0 {
                self.wait_for_idle(128 * 11);
            } else if !self.is_normal() && self.control & (INRQ | SLEEP) == 0 {
                self.wait_for_idle(11);
            }
        }
    }
}

fn flooding() -> BusFrame {
    BusFrame::new(0, &[0x55; 8])
}
