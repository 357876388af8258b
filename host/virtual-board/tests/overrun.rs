//! Frames that arrive faster than the foot reads them are lost, and the loss is reported.

mod common;

use common::{boot_product, product};
use virtual_board::emulator::part::can::BusFrame;
use virtual_board::emulator::time::PER_SECOND;
use wire::{Emergency, Fault};

const MILLISECOND: u64 = PER_SECOND / 1000;

/// Sends `syncs` SYNCs without a pause, `after_tick` after a tick. Returns the number lost, and whether the loss
/// was reported.
fn flood(elf: &[u8], syncs: usize, after_tick: u64) -> (u64, bool) {
    let mut board = boot_product(elf);
    board
        .run_for(500 * MILLISECOND + after_tick)
        .expect("it runs");
    board.take_can();
    for _ in 0..syncs {
        board.push_can(BusFrame::new(0x080, &[]));
    }
    board.run_for(100 * MILLISECOND).expect("it runs");
    let reported = board
        .take_can()
        .iter()
        .filter(|sent| sent.frame.id == 0x091)
        .filter_map(|sent| <[u8; 8]>::try_from(sent.frame.data.as_slice()).ok())
        .any(|data| Emergency::decode(&data).fault == Some(Fault::CanOverrun));
    (board.cpu().machine().chip.can.overruns, reported)
}

#[test]
fn every_frame_loss_and_nothing_else_is_reported() {
    let Some(elf) = product() else { return };
    let mut losses = 0;
    for syncs in [16, 22, 26, 30] {
        for after_tick in [0, MILLISECOND / 5, 3 * MILLISECOND / 5] {
            let (lost, reported) = flood(&elf, syncs, after_tick);
            assert_eq!(reported, lost > 0, "{lost} lost of {syncs}");
            losses += usize::from(lost > 0);
        }
    }
    assert!(
        losses > 2,
        "{losses} floods lost frames: too few for a test"
    );
}
