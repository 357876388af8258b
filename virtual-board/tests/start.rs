//! A hang while the board starts is ended by the watchdog.

mod common;

use common::{boot_product, product};
use virtual_board::board::Injection;
use virtual_board::part::rcc::ResetCause;
use virtual_board::time::PER_SECOND;

const MICROSECOND: u64 = PER_SECOND / 1_000_000;

#[test]
fn a_hang_at_any_moment_of_the_start_is_ended_by_the_watchdog() {
    let Some(elf) = product() else { return };
    for hang_us in [
        400, 1_000, 2_000, 3_000, 5_000, 8_000, 11_000, 13_000, 40_000,
    ] {
        let mut board = boot_product(&elf);
        board.run_for(hang_us * MICROSECOND).expect("it runs");
        board.inject(Injection::Hang);
        board.run_for(3 * PER_SECOND).expect("it runs");
        let causes: Vec<_> = board.resets().iter().map(|(_, cause)| *cause).collect();
        assert_eq!(causes, [ResetCause::Watchdog], "at {hang_us} µs");
        board.take_can();
        board.run_for(PER_SECOND).expect("it runs");
        let contacts = board.take_can();
        let contacts = contacts.iter().filter(|sent| sent.frame.id == 0x191);
        assert!((998..=1002).contains(&contacts.count()), "at {hang_us} µs");
    }
}
