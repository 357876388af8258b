//! Sleep between frames and ticks. Interrupts are masked throughout, so a pending interrupt only ends the sleep.

use cortex_m::peripheral::{NVIC, SCB};
use stm32_metapac::Interrupt;

/// Masks interrupts, and lets frames and ticks end a sleep.
pub fn prepare() {
    cortex_m::interrupt::disable();
    // SAFETY: interrupts are masked, so that no handler is called.
    unsafe { NVIC::unmask(Interrupt::CAN1_RX0) };
}

/// Clears earlier frames and ticks. Later ones end the next sleep.
pub fn forget() {
    SCB::clear_pendst();
    NVIC::unpend(Interrupt::CAN1_RX0);
}

/// Sleeps until a frame or a tick comes.
pub fn until_frame_or_tick() {
    cortex_m::asm::wfi();
}
