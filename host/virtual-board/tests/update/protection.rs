//! Write protection of the bootloader's own sectors by option bytes.

use lsm6dsox::sim::Stimulus;
use virtual_board::emulator::board::{Board, Injection};
use virtual_board::emulator::part::flash::Protection;
use virtual_board::emulator::part::rcc::ResetCause;
use virtual_board::emulator::wiring::Wiring;

use crate::common::{options, product, products};
use crate::master::{
    CLEAR, Master, START, boot, bootloader, image_beginning_with, new_image, number_of,
};
use crate::matrix::WRITES_BOOTLOADER;
use virtual_board::emulator::corner::Corner;
use wire::dictionary::index;

/// Bits of the sectors 0 and 1.
const OWN: u16 = 0b11;

/// Reference board whose chip comes from the factory.
fn factory_board(elf: &[u8]) -> Master {
    factory_board_of(Wiring::reference(), Corner::Typical, elf)
}

fn factory_board_of(wiring: &'static Wiring, corner: Corner, elf: &[u8]) -> Master {
    let mut options = options();
    options.wiring = Some(wiring);
    options.set_corner(corner);
    options.chip.brown_out_level = 0;
    options.chip.protection = Protection::None;
    let bootloader = bootloader(wiring);
    let at_rest = |_| Stimulus::REST;
    Master::new(Board::with_bootloader(Some(&bootloader), elf, options, at_rest).expect("it fits"))
}

/// Switches the board off and on, and waits until its program has run for a second.
fn switch_off_and_on(master: &mut Master) {
    let mut machine = master.board.cpu().machine();
    machine.chip.request_reset(ResetCause::PowerOn);
    machine.wake();
    drop(machine);
    master.boot_up(1_500);
    master.run(1_000);
}

/// Protected sectors, brown-out level, and byte of the readout protection.
fn protection(master: &mut Master) -> (u16, u32, u8) {
    let flash = &master.board.cpu().machine().chip.flash;
    let [_, readout, ..] = flash.option_bytes();
    (flash.protected_sectors(), flash.brown_out_mv(), readout)
}

#[test]
fn bootloader_is_protected_from_the_second_power_up_on() {
    assert_protected(&products()[..1], &[Corner::Typical]);
}

#[test]
#[ignore = "full: each board in every corner of the chip"]
fn every_bootloader_is_protected_from_the_second_power_up_on() {
    assert_protected(&products(), &Corner::ALL);
}

fn assert_protected(boards: &[(&'static Wiring, Vec<u8>)], corners: &[Corner]) {
    for (wiring, elf) in boards {
        for &corner in corners {
            let case = (wiring.name, corner);
            let mut master = factory_board_of(wiring, corner, elf);
            master.boot_up(1_500);
            master.run(1_000);
            // The program has set the brown-out level.
            assert_eq!(protection(&mut master), (0, 2_830, 0xAA), "{case:?}");
            master.board.inject(Injection::Reset);
            master.boot_up(1_000);
            assert_eq!(protection(&mut master), (0, 2_830, 0xAA), "{case:?}");
            switch_off_and_on(&mut master);
            assert_eq!(protection(&mut master), (OWN, 2_830, 0xAA), "{case:?}");
            let operations = master.board.cpu().machine().chip.flash.operations;
            switch_off_and_on(&mut master);
            let after = master.board.cpu().machine().chip.flash.operations;
            assert_eq!(operations, after, "{case:?}: done once");
            assert_eq!(master.number(index::PROGRAM_ID), number_of(elf));
        }
    }
}

/// Option bytes that were erased are those of readout protection.
#[test]
#[ignore = "full: a power cut in the protection, and an update"]
fn foot_survives_a_power_cut_in_its_protection() {
    let Some(elf) = product() else { return };
    let mut master = factory_board(&elf);
    master.boot_up(1_500);
    master.run(1_000);
    master.board.inject(Injection::CutInFlash(1));
    switch_off_and_on(&mut master);
    let causes: Vec<ResetCause> = master.board.resets().iter().map(|(_, why)| *why).collect();
    assert_eq!(causes, [ResetCause::PowerOn; 2]);
    // The program has set the brown-out level again.
    assert_eq!(protection(&mut master), (0, 2_830, 0xFF));
    switch_off_and_on(&mut master);
    assert_eq!(protection(&mut master), (OWN, 2_830, 0xFF));
    assert_eq!(master.number(index::PROGRAM_ID), number_of(&elf));
    // Another program comes as ever.
    master.stop();
    assert_eq!(master.control(CLEAR)[0], 0x60);
    assert_eq!(master.send(&new_image(&elf))[0], 0xA1);
}

/// The row `writes-bootloader` of the table of disturbances, without the protection.
#[test]
#[ignore = "full: an update that erases the bootloader"]
fn unprotected_bootloader_is_lost_to_a_program() {
    let Some(elf) = product() else { return };
    let mut master = factory_board(&elf);
    master.boot_up(1_500);
    master.run(1_000);
    master.stop();
    assert_eq!(master.control(CLEAR)[0], 0x60);
    let image = image_beginning_with(&elf, &WRITES_BOOTLOADER);
    assert_eq!(master.send(&image)[0], 0xA1);
    assert_eq!(master.control(START)[0], 0x60);
    master.run(8_000);
    let found = master.board.memory(0x0800_0000, 8).expect("flash");
    assert_eq!(found, [0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF]);
}

/// The boards of the other tests are past their second power-up.
#[test]
fn protected_board_keeps_its_option_bytes() {
    let Some(elf) = product() else { return };
    let mut master = Master::new(boot(Wiring::reference(), Corner::Typical, &elf));
    master.run(500);
    assert_eq!(protection(&mut master), (OWN, 2_830, 0xAA));
    assert_eq!(master.board.cpu().machine().chip.flash.operations, 0);
}
