//! The independent watchdog resets the chip unless it is fed. It runs from the first instructions after reset.
//!
//! Its oscillator runs at 17 to 47 kHz, nominally at 32 (DS8626, table 34 \[M\]). The nominal period of 1 s is
//! therefore 0.68 to 1.88 s. That is longer than a start, and longer than the erase of a page with the feeding before
//! and after it. A hang ends after 1.88 s at the latest.

use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::{DBGMCU, IWDG};

/// Frequency of the oscillator, Hz: nominal, and maximum.
const LSI_HZ: u32 = 32_000;
const FASTEST_LSI_HZ: u32 = 47_000;

const DIVIDER: u32 = 16;

/// Period at the nominal frequency, ms.
const PERIOD_MILLIS: u32 = 1_000;

const RELOAD: u32 = LSI_HZ / DIVIDER * PERIOD_MILLIS / 1_000 - 1;

/// Interval of feeding, ms. The period has more than ten of them.
pub const FEEDING_MILLIS: u32 = 60;

/// Reserve of the shortest period in which all workers must report, ms: one feeding calls them, and the next checks
/// them.
const REPORT_MILLIS: u32 = 2 * FEEDING_MILLIS;

/// Longest time without feeding after which the workers can still report, ms.
pub const LONGEST_STALL_MILLIS: u32 =
    PERIOD_MILLIS * (LSI_HZ / 1_000) / (FASTEST_LSI_HZ / 1_000) - REPORT_MILLIS;

const _: () = assert!(RELOAD <= 0xFFF);

/// Maximum polls of `IWDG_SR` until the settings are applied. That takes five cycles of the oscillator, at most 300 µs,
/// or 48,000 cycles of the processor at its full clock. Each poll takes at least 5 cycles.
const POLLS: u32 = 10_000;

// The watchdog starts before memory is initialised and the stack painted, which takes some milliseconds. Its period is
// 0.35 to 0.96 s after a reset, and 5.6 to 15 s behind the bootloader, which has set it.
core::arch::global_asm!(
    ".section .text.__pre_init, \"ax\"",
    ".global __pre_init",
    ".type __pre_init, %function",
    ".thumb_func",
    "__pre_init:",
    "ldr r0, =0x40003000", // IWDG_KR
    "movw r1, #0xCCCC",
    "str r1, [r0]",
    "bx lr",
);

/// Sets the watchdog's period. The watchdog is already running and cannot be stopped.
pub fn start() {
    // A debugger that halts the program also stops the watchdog and the timers, because a halted program is not stuck.
    DBGMCU.apb1fzr().modify(|w| {
        w.set_iwdg(true);
        w.set_tim2(true);
        w.set_tim4(true);
        w.set_tim5(true);
    });
    set_period(Pr::DIVIDE_BY16, RELOAD as u16);
}

/// Extends the period to 5.6 to 15 s until [`start`] is called. Option bytes that a reset leaves erased close the chip
/// to probes, and no data sheet limits the time of their erase.
pub fn extend() {
    set_period(Pr::DIVIDE_BY64, 0xFFF);
}

fn set_period(divider: Pr, reload: u16) {
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(divider));
    IWDG.rlr().write(|w| w.set_rl(reload));
    for _ in 0..POLLS {
        if IWDG.sr().read().0 == 0 {
            break;
        }
    }
    feed();
}

/// Restarts the watchdog's period.
pub fn feed() {
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}
