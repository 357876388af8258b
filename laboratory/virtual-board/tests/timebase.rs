//! The timer that clocks the sampling continues, however long the core is stalled.

use crate::common::rig::Rig;
use crate::common::{MILLISECOND, product};
use virtual_board::emulator::time::PER_SECOND;

const MICROSECOND: u64 = PER_SECOND / 1_000_000;

#[test]
fn ticks_continue_after_a_stall_and_lost_ones_are_reported() {
    assert_ticks_continue(&[400]);
}

#[test]
#[ignore = "full: stalls at six phases of a tick"]
fn ticks_continue_after_a_stall_at_any_phase() {
    assert_ticks_continue(&[0, 3, 150, 400, 777, 990]);
}

/// Stalls the core at times after a tick, for durations up to half a second.
fn assert_ticks_continue(phases_us: &[u64]) {
    let elf = product();
    let late = wire::Fault::LateTick.code();
    let mut rig = Rig::new(&elf);
    rig.watch(500);
    for held_us in [
        150, 190, 200, 210, 500, 690, 700, 710, 790, 800, 990, 999, 1_000, 1_001, 1_010, 1_200,
        1_999, 5_300, 250_000, 500_000,
    ] {
        for &phase_us in phases_us {
            let lost = held_us > 2_000;
            if lost {
                // The fault ends a second after the last late tick.
                rig.watch(1_100);
            }
            let next = rig.board.now().next_multiple_of(MILLISECOND) + phase_us * MICROSECOND;
            rig.board.run_until(next).expect("it runs");
            // The core stands still from its next access to a peripheral on.
            rig.board.cpu().machine().chip.flash.stall += held_us * MICROSECOND;
            let (codes, _) = rig.watch(held_us / 1_000 + 10);
            let what = format!("{held_us} µs, {phase_us} µs after a tick: {codes:x?}");
            assert!(!lost || codes.contains(&late), "{what}");
            assert!(codes.iter().all(|code| *code == late), "{what}");
            let (codes, contacts) = rig.watch(20);
            assert!(codes.is_empty(), "{what}, then {codes:x?}");
            assert!((19..=21).contains(&contacts), "{what}: {contacts}");
            assert_eq!(rig.resets(), [], "{what}");
        }
    }
}
