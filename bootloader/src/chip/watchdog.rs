//! The independent watchdog, with a period of 5.6 to 15 s: longer than the erase of a sector, which takes 2 s at most.

use stm32_metapac::IWDG;
use stm32_metapac::iwdg::vals::{Key, Pr};

/// Starts the watchdog.
pub fn start() {
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY64));
    IWDG.rlr().write(|w| w.set_rl(0xFFF));
    // The settings take some cycles of its oscillator; until then the period is 0.35 s at least.
    feed();
}

/// Restarts its period.
pub fn feed() {
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}
