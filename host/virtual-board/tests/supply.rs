//! The supply: the brown-out level in the option bytes, and flash that is not written below 2.7 V.

mod common;

use common::{options, product, run, watch};
use lsm6dsox::sim::Stimulus;
use virtual_board::emulator::board::{Board, Injection};
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::part::can::BusFrame;
use wire::Emergency;
use wire::dictionary::{SIGNATURE_BROWN_OUT, SIGNATURE_STORE, index};

/// Readout protection of level 0.
const OPEN: u8 = 0xAA;
const WRITTEN: u8 = 0x60;
const HARDWARE: [u8; 4] = 0x0606_0000_u32.to_le_bytes();
const DEVICE_STATE: [u8; 4] = 0x0800_0022_u32.to_le_bytes();

/// Sends an SDO request. Returns its answer, and the emergency messages before it.
fn ask(board: &mut Board, request: &[u8; 8]) -> ([u8; 8], Vec<Emergency>) {
    board.take_can();
    board.push_can(BusFrame::new(0x611, request));
    // The option bytes take as long as an erase by bytes: 0.8 s at most.
    run(board, 1_000);
    let frames = board.take_can();
    let data = |id: u32| {
        let of = frames.iter().filter(move |sent| sent.frame.id == id);
        of.filter_map(|sent| <[u8; 8]>::try_from(sent.frame.data.as_slice()).ok())
    };
    let answer = data(0x591).next().expect("an answer");
    (
        answer,
        data(0x091).map(|data| Emergency::decode(&data)).collect(),
    )
}

fn write(index: u16, subindex: u8, value: u32) -> [u8; 8] {
    let ([i0, i1], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
    [0x23, i0, i1, subindex, a, b, c, d]
}

fn level(board: &mut Board) -> u8 {
    let [i0, i1] = index::SUPPLY.to_le_bytes();
    ask(board, &[0x40, i0, i1, 1, 0, 0, 0, 0]).0[4]
}

fn pre_operational(board: &mut Board) {
    board.push_can(BusFrame::new(0x000, &[0x80, 0x11]));
    run(board, 5);
}

/// A board with this brown-out level in its option bytes.
fn board(elf: &[u8], level: u8) -> Board {
    let mut options = options();
    options.chip.brown_out_level = level;
    Board::with_motion(elf, options, |_| Stimulus::REST).expect("it fits the flash")
}

/// As delivered, the level is off.
#[test]
fn the_first_start_sets_the_brown_out_level() {
    let Some(elf) = product() else { return };
    for (mv, expected) in [(3_300, 3), (2_600, 0)] {
        let mut board = board(&elf, 0);
        board.inject(Injection::Supply(mv));
        run(&mut board, 1_200);
        let (codes, contacts) = watch(&mut board, 500);
        assert_eq!((codes, board.resets().len()), (vec![], 0), "{mv} mV");
        assert!(contacts >= 499, "{mv} mV: {contacts} contacts");
        board.inject(Injection::Reset);
        run(&mut board, 300);
        assert_eq!(level(&mut board), expected, "{mv} mV");
    }
}

/// No data sheet limits the time that option bytes take: cut short, they close the chip to probes.
#[test]
#[ignore = "full: option bytes that take 4 s"]
fn slow_option_bytes_end_before_the_watchdog() {
    let Some(elf) = product() else { return };
    let mut options = options();
    options.chip.brown_out_level = 0;
    options.chip.corner = Corner::Fast;
    let mut board =
        Board::with_motion(&elf, options, |_| Stimulus::REST).expect("it fits the flash");
    board.cpu().machine().chip.flash.option_bytes_ms = Some(4_000);
    run(&mut board, 4_500);
    let (codes, contacts) = watch(&mut board, 500);
    assert_eq!((codes, board.resets().len()), (vec![], 0));
    assert!(contacts >= 499, "{contacts} contacts");
    let [_, readout, ..] = board.cpu().machine().chip.flash.option_bytes();
    assert_eq!(readout, OPEN);
    // The period is the usual one again.
    board.inject(Injection::Hang);
    run(&mut board, 900);
    assert_eq!(board.resets().len(), 1);
}

#[test]
fn the_brown_out_level_is_raised_on_request() {
    let Some(elf) = product() else { return };
    let mut board = board(&elf, 1);
    run(&mut board, 300);
    assert_eq!(level(&mut board), 1);
    let set = write(index::SUPPLY, 2, SIGNATURE_BROWN_OUT);
    assert_eq!(ask(&mut board, &set).0[4..], DEVICE_STATE);
    pre_operational(&mut board);
    for time in 0..2 {
        let (answer, emergencies) = ask(&mut board, &set);
        assert_eq!(answer[0], WRITTEN, "time {time}");
        // It lasts as long as an erase.
        let late = |e: &Emergency| e.code == 0 || e.fault == Some(wire::Fault::LateTick);
        assert!(emergencies.iter().all(late), "{emergencies:?}");
    }
    board.inject(Injection::BrownOut);
    run(&mut board, 300);
    assert_eq!(level(&mut board), 3);
    // From now on a dip resets the board.
    let resets = board.resets().len();
    board.inject(Injection::Supply(2_600));
    run(&mut board, 300);
    assert_eq!(board.resets().len(), resets + 1);
}

#[test]
fn a_store_below_2_7_v_is_refused_and_reported() {
    let Some(elf) = product() else { return };
    let mut board = board(&elf, 1);
    run(&mut board, 300);
    pre_operational(&mut board);
    let blank = board.settings();
    board.inject(Injection::Supply(2_600));
    for request in [
        write(index::STORE, 1, SIGNATURE_STORE),
        write(index::SUPPLY, 2, SIGNATURE_BROWN_OUT),
    ] {
        let (answer, emergencies) = ask(&mut board, &request);
        assert_eq!((answer[0], &answer[4..]), (0x80, &HARDWARE[..]));
        let reported: Vec<_> = emergencies.iter().map(|e| (e.fault, e.detail)).collect();
        if request[1..3] == index::STORE.to_le_bytes() {
            assert_eq!(reported, [(Some(wire::Fault::ConfigStore), 1)]);
        }
    }
    assert!(board.settings() == blank);
    assert_eq!(level(&mut board), 1);
    board.inject(Injection::Supply(3_300));
    let (answer, _) = ask(&mut board, &write(index::STORE, 1, SIGNATURE_STORE));
    assert_eq!(answer[0], WRITTEN);
    assert!(board.settings() != blank);
}
