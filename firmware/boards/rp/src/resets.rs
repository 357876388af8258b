//! Resets by the watchdog: the reason of this start, and the number of consecutive resets by an unfed watchdog.
//!
//! The loader also starts a copied program through the watchdog, as a timeout. A register of the watchdog distinguishes
//! the two, because a running program leaves its mark there. It is one that the ROM does not write, see the board's
//! [`MARK_REGISTER`]. The register keeps its value over the watchdog's resets; all other resets clear it.

use embassy_rp::pac;
use embassy_rp::watchdog::{ResetReason, Watchdog};

use crate::board::MARK_REGISTER;

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
        let left = watchdog.get_scratch(MARK_REGISTER);
        let reason = watchdog.reset_reason().filter(|_| left & !COUNT == MARK);
        let timeouts = match reason {
            Some(ResetReason::TimedOut) => COUNT.min((left & COUNT) + 1),
            _ => 0,
        };
        watchdog.set_scratch(MARK_REGISTER, MARK | timeouts);
        Self { reason, timeouts }
    }
}

/// Resets the count of consecutive resets.
pub fn end_row() {
    write(MARK);
}

/// Removes the mark, because another or a new program starts next.
pub fn forget() {
    write(0);
}

fn write(mark: u32) {
    match MARK_REGISTER {
        1 => pac::WATCHDOG.scratch1().write(|register| *register = mark),
        _ => pac::WATCHDOG.scratch2().write(|register| *register = mark),
    }
}
