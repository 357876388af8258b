//! Forbidden or redundant settings of the chip that do not stop the board.

use crate::common::rig::Rig;
use crate::common::{MILLISECOND, boot_product, product};
use virtual_board::emulator::board::Board;
use virtual_board::emulator::part::can::BusFrame;

/// Offset of `RCC_PLLCFGR`, and its PLLQ.
const PLLCFGR: u32 = 0x04;
const PLLQ: u32 = 0xF << 24;

/// Offset of `CAN_MCR`, and its TTCM.
const CAN_MCR: u32 = 0x00;
const TTCM: u32 = 1 << 7;

/// The host's request that the target waits while the buffer of the log is full (SEGGER RTT).
const BLOCK_IF_FULL: u32 = 2;

/// Offsets from the start of the RTT control block, in its first channel: the buffer's size, the target's
/// position, the host's position, and the channel's flags.
const SIZE: u32 = 32;
const WRITTEN: u32 = 36;
const READ: u32 = 40;
const FLAGS: u32 = 44;

/// Address in the unused part of the stack: its use is logged as a deep stack.
const DEEP_IN_THE_STACK: u32 = 0x2000_5000;

#[test]
fn no_register_holds_a_value_that_the_manual_forbids() {
    let elf = product();
    let mut board = boot_product(&elf);
    board.run_for(300 * MILLISECOND).expect("it runs");
    let now = board.now();
    let mut machine = board.cpu().machine();
    let pll = machine.chip.rcc.read(PLLCFGR, now).expect("a register");
    let divider = (pll & PLLQ) >> 24;
    assert!((2..=15).contains(&divider), "PLLQ = {divider}");
    let control = machine.chip.can.read(CAN_MCR, now).expect("a register");
    assert_eq!(control & TTCM, 0, "CAN_MCR = {control:#x}");
}

#[test]
fn a_removed_probe_does_not_stop_the_foot() {
    let elf = product();
    let mut board = boot_product(&elf);
    board.run_for(300 * MILLISECOND).expect("it runs");
    let block = board.image.symbol("_SEGGER_RTT").expect("the log");
    let name = board.memory(block, 10);
    assert_eq!(name.as_deref(), Some(b"SEGGER RTT".as_slice()));
    let word = |board: &mut Board, offset: u32| {
        let bytes = board.memory(block + offset, 4).expect("RAM");
        u32::from_le_bytes(bytes.try_into().expect("a word"))
    };
    let write = |board: &mut Board, address: u32, value: u32| {
        assert!(board.cpu().memory().write(address, &value.to_le_bytes()));
    };
    // The host has requested blocking, has read all but four bytes, and is gone.
    let (size, written) = (word(&mut board, SIZE), word(&mut board, WRITTEN));
    write(&mut board, block + READ, (written + 4) % size);
    write(&mut board, block + FLAGS, BLOCK_IF_FULL);
    write(&mut board, DEEP_IN_THE_STACK, 0);
    board.take_can();
    board.run_for(4_000 * MILLISECOND).expect("it runs");
    assert_eq!(board.resets(), []);
    assert!(board.take_can().len() > 4_000);
    let logged = word(&mut board, WRITTEN);
    assert_ne!(logged, written, "nothing was logged, so nothing was compared");
}

#[test]
fn a_length_code_above_eight_means_eight_bytes() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(300);
    for length in 9..=15 {
        // A vendor request in an SDO frame that exceeds the maximum length.
        let mut data = vec![0x40, 0x18, 0x10, 1];
        data.resize(length, 0);
        rig.board.push_can(BusFrame { id: 0x611, data, ..BusFrame::default() });
        rig.run(5);
    }
    assert_eq!(rig.resets(), []);
    assert_eq!(rig.answers().len(), 7);
}

/// Frames with the base identifiers of requests to the foot, which other nodes may send. A filter that took one would
/// fill its FIFO, and the foot would answer it.
#[test]
fn frames_of_29_bits_and_remote_frames_reach_no_foot() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    rig.run(300);
    let data = vec![0x40, 0x18, 0x10, 1, 0, 0, 0, 0];
    let remote = BusFrame { is_remote: true, ..BusFrame::new(0x611, &data) };
    let extended = BusFrame { id: 0x611 << 18, is_extended: true, ..BusFrame::new(0, &data) };
    // NMT: stop, to all nodes.
    let command = BusFrame { id: 0, is_extended: true, ..BusFrame::new(0, &[2, 0]) };
    let both = BusFrame { is_remote: true, ..extended.clone() };
    let short = BusFrame { id: 0x611, is_extended: true, ..BusFrame::new(0, &data) };
    for _ in 0..50 {
        for frame in [&remote, &extended, &command, &both, &short] {
            rig.board.push_can(frame.clone());
        }
        rig.run(2);
    }
    assert_eq!(rig.answers().len(), 0);
    assert_eq!(rig.resets(), []);
    let before = rig.contacts();
    rig.board.push_can(BusFrame::new(0x611, &data));
    rig.run(20);
    assert_eq!(rig.answers().len(), 1);
    assert!(rig.contacts() - before >= 19, "{} contacts", rig.contacts() - before);
}
