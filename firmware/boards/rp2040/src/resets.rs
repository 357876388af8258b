//! Resets by the watchdog: why the program started, and how often in a row it did so without being fed.
//!
//! The loader starts a copied program by the watchdog, too, as a timeout. It is distinguished by a register of the watchdog in
//! which a program that runs leaves its mark. The ROM writes the others: 0 and 1 are arguments of the loader, with the
//! mask of its light, 4 to 7 say where to start (pico-bootrom-rp2040, `bootrom_main.c`).

use embassy_rp::pac;
use embassy_rp::watchdog::{ResetReason, Watchdog};

/// Register of the watchdog with the mark, kept over its resets and cleared by all others.
const REGISTER: usize = 2;

/// Mark of a program that ran, above the number of resets in a row.
const MARK: u32 = u32::from_be_bytes(*b"fal\0");
const COUNT: u32 = 0xFF;

/// Reason of this start, if the program ran before.
pub struct Restart {
    pub reason: Option<ResetReason>,
    /// Resets in a row of a watchdog that was not fed.
    pub timeouts: u32,
}

impl Restart {
    /// Reads the reason of this start, and counts it.
    pub fn take(watchdog: &mut Watchdog) -> Self {
        let left = watchdog.get_scratch(REGISTER);
        let reason = watchdog.reset_reason().filter(|_| left & !COUNT == MARK);
        let timeouts = match reason {
            Some(ResetReason::TimedOut) => COUNT.min((left & COUNT) + 1),
            _ => 0,
        };
        watchdog.set_scratch(REGISTER, MARK | timeouts);
        Self { reason, timeouts }
    }
}

/// Ends the row of resets.
pub fn end_row() {
    pac::WATCHDOG.scratch2().write(|mark| *mark = MARK);
}

/// Removes the mark: another program, or a new one, starts next.
pub fn forget() {
    pac::WATCHDOG.scratch2().write(|mark| *mark = 0);
}
