//! The supply: the brown-out level in the option bytes, and flash that is not written below 2.7 V.

use crate::common::product;
use crate::common::rig::Rig;
use virtual_board::emulator::board::Injection;
use virtual_board::emulator::corner::Corner;
use wire::Fault;
use wire::dictionary::{SIGNATURE_BROWN_OUT, SIGNATURE_STORE, index};

/// Readout protection of level 0.
const OPEN: u8 = 0xAA;
const WRITTEN: u8 = 0x60;
const HARDWARE: [u8; 4] = 0x0606_0000_u32.to_le_bytes();
const DEVICE_STATE: [u8; 4] = 0x0800_0022_u32.to_le_bytes();

fn level(rig: &mut Rig) -> u8 {
    rig.read(index::SUPPLY, 1) as u8
}

/// A board with this brown-out level in its option bytes.
fn board(elf: &[u8], level: u8) -> Rig {
    Rig::with(elf, |options| options.chip.brown_out_level = level)
}

/// As delivered, the level is off.
#[test]
fn the_first_start_sets_the_brown_out_level() {
    let elf = product();
    for (mv, expected) in [(3_300, 3), (2_600, 0)] {
        let mut rig = board(&elf, 0);
        rig.inject(Injection::Supply(mv));
        rig.run(3_200);
        let (codes, contacts) = rig.watch(500);
        assert_eq!((codes, rig.resets().len()), (vec![], 0), "{mv} mV");
        assert!(contacts >= 499, "{mv} mV: {contacts} contacts");
        rig.inject(Injection::Reset);
        rig.run(300);
        assert_eq!(level(&mut rig), expected, "{mv} mV");
    }
}

/// 160 MHz need more wait states below 2.7 V than the HAL sets.
#[test]
fn start_waits_for_the_supply_and_goes_on_slower_without() {
    let elf = product();
    for (risen_mv, hertz) in [(3_300, 160_000_000), (2_600, 72_000_000)] {
        let mut rig = board(&elf, 0);
        rig.inject(Injection::Supply(2_600));
        rig.run(30);
        assert_eq!(rig.board.processor_hertz(), 16_000_000);
        rig.inject(Injection::Supply(risen_mv));
        rig.run(3_400);
        assert_eq!(rig.board.processor_hertz(), hertz);
        let (codes, contacts) = rig.watch(500);
        assert_eq!((codes, rig.resets().len()), (vec![], 0), "{risen_mv} mV");
        assert!(contacts >= 499, "{risen_mv} mV: {contacts} contacts");
        assert_eq!(rig.board.can_bit_rate(), Some(1_000_000), "{risen_mv} mV");
    }
}

/// No data sheet limits the time that option bytes take: cut short, they close the chip to probes.
#[test]
#[ignore = "full: option bytes that take 4 s"]
fn slow_option_bytes_end_before_the_watchdog() {
    let elf = product();
    let mut rig = Rig::with(&elf, |options| {
        (options.chip.brown_out_level, options.chip.corner) = (0, Corner::Fast);
    });
    rig.board.cpu().machine().chip.flash.option_bytes_ms = Some(4_000);
    rig.run(6_500);
    let (codes, contacts) = rig.watch(500);
    assert_eq!((codes, rig.resets().len()), (vec![], 0));
    assert!(contacts >= 499, "{contacts} contacts");
    let [_, readout, ..] = rig.board.cpu().machine().chip.flash.option_bytes();
    assert_eq!(readout, OPEN);
    // The period is the usual one again.
    rig.inject(Injection::Hang);
    rig.run(900);
    assert_eq!(rig.resets().len(), 1);
}

#[test]
fn the_brown_out_level_is_raised_on_request() {
    let elf = product();
    let mut rig = board(&elf, 1);
    rig.run(300);
    assert_eq!(level(&mut rig), 1);
    let set = |rig: &mut Rig| rig.write(index::SUPPLY, 2, SIGNATURE_BROWN_OUT);
    assert_eq!(set(&mut rig)[4..], DEVICE_STATE);
    rig.pre_operational();
    for time in 0..2 {
        assert_eq!(set(&mut rig)[0], WRITTEN, "time {time}");
        // Programming the option bytes takes as long as an erase, so ticks may be late.
        let late = |code: &u16| *code == Fault::LateTick.code();
        rig.run(100);
        assert!(rig.emergencies().iter().all(late), "time {time}");
    }
    rig.inject(Injection::BrownOut);
    rig.run(300);
    assert_eq!(level(&mut rig), 3);
    // From now on a dip resets the board.
    let resets = rig.resets().len();
    rig.inject(Injection::Supply(2_600));
    rig.run(300);
    assert_eq!(rig.resets().len(), resets + 1);
}

/// The register of the option bytes holds what was written to it, even if the flash has not taken that.
#[test]
fn refused_option_bytes_are_an_error_each_time() {
    let elf = product();
    let mut rig = board(&elf, 1);
    rig.run(300);
    rig.pre_operational();
    let set = |rig: &mut Rig| rig.write(index::SUPPLY, 2, SIGNATURE_BROWN_OUT);
    rig.board.cpu().machine().chip.flash.refuses_option_bytes = true;
    for time in 0..2 {
        let answer = set(&mut rig);
        assert_eq!((answer[0], &answer[4..]), (0x80, &HARDWARE[..]), "time {time}");
        rig.run(100);
        assert_eq!(level(&mut rig), 1, "time {time}");
    }
    rig.board.cpu().machine().chip.flash.refuses_option_bytes = false;
    assert_eq!(set(&mut rig)[0], WRITTEN);
    rig.inject(Injection::BrownOut);
    rig.run(300);
    assert_eq!(level(&mut rig), 3);
}

#[test]
fn a_store_below_2_7_v_is_refused_and_reported() {
    let elf = product();
    let mut rig = board(&elf, 1);
    rig.run(300);
    rig.pre_operational();
    let blank = rig.board.settings();
    rig.inject(Injection::Supply(2_600));
    let answer = rig.write(index::STORE, 1, SIGNATURE_STORE);
    assert_eq!((answer[0], &answer[4..]), (0x80, &HARDWARE[..]));
    rig.run(100);
    let reported = rig.emergency_messages();
    let reported: Vec<_> = reported.iter().map(|e| (e.fault, e.detail)).collect();
    assert_eq!(reported, [(Some(Fault::ConfigStore), 1)]);
    let answer = rig.write(index::SUPPLY, 2, SIGNATURE_BROWN_OUT);
    assert_eq!((answer[0], &answer[4..]), (0x80, &HARDWARE[..]));
    assert!(rig.board.settings() == blank);
    assert_eq!(level(&mut rig), 1);
    rig.inject(Injection::Supply(3_300));
    assert_eq!(rig.stored()[0], WRITTEN);
    assert!(rig.board.settings() != blank);
}
