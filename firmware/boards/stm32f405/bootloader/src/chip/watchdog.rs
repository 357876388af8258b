//! The independent watchdog, with a period of 5.6 to 15 s. That is longer than the erase of a sector, 2 s at most.

use stm32_metapac::IWDG;
use stm32_metapac::iwdg::vals::{Key, Pr};

/// Starts the watchdog.
pub fn start() {
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY64));
    IWDG.rlr().write(|w| w.set_rl(0xFFF));
    // The settings take some cycles of the watchdog's oscillator. Until then the period is at least 0.35 s.
    feed();
}

/// Restarts the watchdog's period.
pub fn feed() {
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}
