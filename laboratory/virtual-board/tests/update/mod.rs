//! The bootloader and the foot's program, as flashed: starts, updates over CAN, and returns to the previous program.

mod attacks;
mod journal;
mod lss;
mod master;
mod matrix;
mod protection;
mod robot;
mod settings;

use self::master::{Master, changed_image, number_of};
use crate::common::product;
use bootloader::image::Refusal;
use virtual_board::emulator::board::Injection;
use virtual_board::emulator::chip::Crystal;
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::wiring::Wiring;
use wire::dictionary::index;

#[test]
fn bootloader_starts_the_program_at_once() {
    let elf = product();
    let mut master = Master::of(&elf);
    let boot_up = master.boot_up(500);
    let mut alone = Master::new(crate::common::boot_product(&elf));
    let without = alone.boot_up(500);
    assert!(boot_up <= without + 60, "{boot_up} ms, {without} without");
    assert_eq!(master.number(index::PROGRAM_ID), number_of(&elf));
    assert_eq!(master.status(), None);
}

#[test]
fn bootloader_of_each_board_joins_its_bus_and_serial_line() {
    for wiring in Wiring::all() {
        let mut master = Master::with(wiring, None, |_| ());
        master.boot_up(1_000);
        let rate = master.board.can_bit_rate();
        assert_eq!(rate, Some(1_000_000), "{}", wiring.name);
        master.open_serial_line();
        assert_eq!(master.number(index::PROGRAM_ID), 0, "{}", wiring.name);
    }
}

#[test]
fn bootloader_uses_a_crystal_that_cannot_be_measured() {
    for wiring in Wiring::all() {
        let mut master = Master::with(wiring, None, |options| {
            options.chip.crystal = Crystal::NotMeasurable;
        });
        master.boot_up(1_000);
        let rate = master.board.can_bit_rate();
        assert_eq!(rate, Some(1_000_000), "{}", wiring.name);
    }
}

/// The supply has not been checked yet, so wait states and prefetch must suit any supply.
#[test]
fn bootloader_starts_at_the_lowest_supply() {
    let mut master = Master::with(Wiring::reference(), None, |options| {
        options.chip.brown_out_level = 0;
    });
    master.board.inject(Injection::Supply(1_800));
    master.boot_up(1_000);
}

/// Crystals of other boards, and one that is missing.
const WRONG_CRYSTALS: [Crystal; 10] = [
    Crystal::Missing,
    Crystal::Hertz(4_000_000),
    Crystal::Hertz(6_000_000),
    Crystal::Hertz(8_000_000),
    Crystal::Hertz(10_000_000),
    Crystal::Hertz(12_000_000),
    Crystal::Hertz(16_000_000),
    Crystal::Hertz(20_000_000),
    Crystal::Hertz(25_000_000),
    Crystal::Hertz(26_000_000),
];

#[test]
fn bootloader_with_a_wrong_crystal_answers_on_its_serial_line() {
    assert_serial_line(&WRONG_CRYSTALS[..1], &[Corner::Typical]);
}

#[test]
#[ignore = "full: nine crystals in every corner of the chip"]
fn bootloader_with_any_wrong_crystal_answers_on_its_serial_line() {
    assert_serial_line(&WRONG_CRYSTALS, &Corner::ALL);
}

/// Boots the bootloaders with wrong crystals.
fn assert_serial_line(crystals: &[Crystal], corners: &[Corner]) {
    for wiring in Wiring::all() {
        let own = Crystal::Hertz(wiring.crystal);
        for &crystal in crystals.iter().filter(|crystal| **crystal != own) {
            for &corner in corners {
                let mut master = Master::with(wiring, None, |options| {
                    options.set_corner(corner);
                    options.chip.crystal = crystal;
                });
                master.run(1_000);
                let case = (wiring.name, crystal, corner);
                assert_eq!(master.board.can_bit_rate(), None, "{case:?}");
                master.open_serial_line();
                assert_eq!(master.number(index::PROGRAM_ID), 0, "{case:?}");
            }
        }
    }
}

/// A chip from the factory has no brown-out level set, so it keeps running at a low supply.
#[test]
#[ignore = "full: an update at a low supply"]
fn bootloader_leaves_the_flash_alone_at_a_low_supply() {
    let elf = product();
    let mut master = Master::with(Wiring::reference(), None, |options| {
        options.chip.brown_out_level = 0;
    });
    master.boot_up(1_000);
    let image = changed_image(&elf, |_| ());
    master.board.inject(Injection::Supply(2_600));
    assert_eq!(master.send(&image)[0], 0x80);
    assert_eq!(master.status(), Some(Refusal::FlashFailed));
    master.board.inject(Injection::Supply(3_300));
    master.load(&image);
}
