//! Resets by the watchdog: the reason of this start, and the number of consecutive resets by an unfed watchdog.
//!
//! The loader also starts a copied program through the watchdog, as a timeout. A register of the watchdog distinguishes
//! the two: a running program leaves its mark there. The ROM writes the other registers. 0 and 1 are arguments of the
//! loader, with the mask of its light; 4 to 7 hold the start address (pico-bootrom-rp2040, `bootrom_main.c`).

use embassy_rp::pac;
use embassy_rp::watchdog::{ResetReason, Watchdog};

/// Register of the watchdog with the mark. It keeps its value over the watchdog's resets; all other resets clear it.
const REGISTER: usize = 2;

/// Mark of a program that ran. The low byte is the number of consecutive resets.
const MARK: u32 = u32::from_be_bytes(*b"fal\0");
const COUNT: u32 = 0xFF;

/// Reason of this start, if the program ran before.
pub struct Restart {
    pub reason: Option<ResetReason>,
    /// Consecutive resets by an unfed watchdog.
    pub timeouts: u32,
}

impl Restart {
    /// Returns the reason of this start, and counts it.
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

/// Resets the count of consecutive resets.
pub fn end_row() {
    pac::WATCHDOG.scratch2().write(|mark| *mark = MARK);
}

/// Removes the mark, because another or a new program starts next.
pub fn forget() {
    pac::WATCHDOG.scratch2().write(|mark| *mark = 0);
}
