//! Write protection of the bootloader's sectors by option bytes, which the program writes.

use virtual_board::emulator::board::Injection;
use virtual_board::emulator::memory::OPTIONS;
use virtual_board::emulator::part::flash::Protection;
use virtual_board::emulator::part::rcc::ResetCause;
use virtual_board::emulator::wiring::Wiring;

use super::master::{Master, new_image, number_of};
use crate::common::{product, products};
use virtual_board::emulator::corner::Corner;
use wire::dictionary::index;

/// Bits of the sectors 0 and 1.
const OWN: u16 = 0b11;

/// Brown-out level of a chip from the factory.
const OFF: u8 = 0;

/// Board whose program has not run for long enough to write the option bytes.
fn new_board(wiring: &'static Wiring, corner: Corner, level: u8, elf: &[u8]) -> Master {
    Master::with(wiring, Some(elf), |options| {
        options.set_corner(corner);
        options.chip.brown_out_level = level;
        options.chip.protection = Protection::None;
    })
}

/// Time in which a board starts that writes its option bytes first, after two seconds of supply, ms.
const FIRST_START_MS: u32 = 3_500;

fn switch_off_and_on(master: &mut Master) {
    let mut machine = master.board.cpu().machine();
    machine.chip.request_reset(ResetCause::PowerOn);
    machine.wake();
}

/// Lifts the write protection, as a probe does.
fn lift_protection(master: &mut Master) {
    let option_bytes = {
        let mut machine = master.board.cpu().machine();
        machine.chip.flash = machine.chip.flash.clone().with_protection(Protection::None);
        machine.chip.flash.option_bytes()
    };
    master.board.cpu().memory().write(OPTIONS.start, &option_bytes);
}

/// Protected sectors, brown-out level, and byte of the readout protection.
fn protection(master: &mut Master) -> (u16, u32, u8) {
    let flash = &master.board.cpu().machine().chip.flash;
    let [_, readout, ..] = flash.option_bytes();
    (flash.protected_sectors(), flash.brown_out_mv(), readout)
}

#[test]
fn bootloader_is_protected_from_the_first_power_up_on() {
    assert_protected(&products()[..1], &[Corner::Typical]);
}

#[test]
#[ignore = "full: each board in every corner of the chip"]
fn every_bootloader_is_protected_from_the_first_power_up_on() {
    assert_protected(&products(), &Corner::ALL);
}

fn assert_protected(boards: &[(&'static Wiring, Vec<u8>)], corners: &[Corner]) {
    for (wiring, elf) in boards {
        for &corner in corners {
            let case = (wiring.name, corner);
            let mut master = new_board(wiring, corner, OFF, elf);
            master.boot_up(FIRST_START_MS);
            assert_eq!(protection(&mut master), (OWN, 2_830, 0xAA), "{case:?}");
            lift_protection(&mut master);
            master.board.inject(Injection::Reset);
            master.boot_up(1_000);
            assert_eq!(protection(&mut master), (0, 2_830, 0xAA), "{case:?}");
            for _ in 0..2 {
                switch_off_and_on(&mut master);
                master.boot_up(FIRST_START_MS);
                assert_eq!(protection(&mut master), (OWN, 2_830, 0xAA), "{case:?}");
            }
            let operations = master.board.cpu().machine().chip.flash.operations;
            assert_eq!(operations, 2, "{case:?}: each time once");
            assert_eq!(master.number(index::PROGRAM_ID), number_of(elf));
        }
    }
}

/// Power for 1 to 50 ms at a time, and once for nearly two seconds. Every write of the flash in these times is cut off.
#[test]
fn connector_that_bounces_does_not_protect_the_readout() {
    let elf = product();
    for level in [OFF, 3] {
        let mut master = new_board(Wiring::reference(), Corner::Typical, level, &elf);
        master.board.inject(Injection::CutInFlash(1));
        let bounces = (0..80).map(|k| 1 + 17 * k % 50);
        for ms in bounces.chain([1_900]) {
            master.run(ms);
            switch_off_and_on(&mut master);
        }
        master.board.cpu().machine().chip.flash.cut_at = None;
        master.boot_up(FIRST_START_MS);
        assert_eq!(protection(&mut master), (OWN, 2_830, 0xAA), "{level}");
    }
}

/// Erased option bytes mean readout protection.
#[test]
#[ignore = "full: a power cut in the protection, and an update"]
fn foot_survives_a_power_cut_in_its_protection() {
    let elf = product();
    let mut master = new_board(Wiring::reference(), Corner::Typical, OFF, &elf);
    master.board.inject(Injection::CutInFlash(1));
    master.boot_up(2 * FIRST_START_MS);
    let causes: Vec<ResetCause> = master.board.resets().iter().map(|(_, why)| *why).collect();
    assert_eq!(causes, [ResetCause::PowerOn]);
    // The program has written them again.
    assert_eq!(protection(&mut master), (OWN, 2_830, 0xFF));
    master.run(500);
    assert_eq!(master.number(index::PROGRAM_ID), number_of(&elf));
    // Another program comes as ever.
    master.stop();
    master.load(&new_image(&elf));
}

/// The boards of the other tests are past their first power-up.
#[test]
fn protected_board_keeps_its_option_bytes() {
    let elf = product();
    let mut master = Master::of(&elf);
    master.run(500);
    assert_eq!(protection(&mut master), (OWN, 2_830, 0xAA));
    assert_eq!(master.board.cpu().machine().chip.flash.operations, 0);
}
