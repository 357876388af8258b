//! The self-check on a Cortex-M33.

#![no_std]
#![no_main]

#[path = "../../../self_check.rs"]
mod self_check;

use critical_section::RawRestoreState;
// The vector table.
use rp_pac as _;

struct Alone;

critical_section::set_impl!(Alone);

// SAFETY: one core runs this program, and no interrupt is enabled.
unsafe impl critical_section::Impl for Alone {
    unsafe fn acquire() -> RawRestoreState {
        RawRestoreState::default()
    }

    unsafe fn release(_: RawRestoreState) {}
}
