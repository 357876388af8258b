//! The bootloader and the foot's program, as they are flashed: starts, updates over CAN, and returns to the previous
//! program.

mod attacks;
mod lss;
mod master;
mod matrix;
mod protection;
mod robot;
mod settings;

use self::master::{
    CLEAR, INSTALLED_MS, Master, NEW, OLD, START, boot, bootloader, changed_image, new_image,
    number_of,
};
use crate::common::{options, product};
use bootloader::image::{Header, Refusal};
use lsm6dsox::sim::Stimulus;
use virtual_board::emulator::board::{Board, Injection};
use virtual_board::emulator::chip::Crystal;
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::wiring::Wiring;
use wire::dictionary::{SIGNATURE_STORE, index};

use crate::common::build_bootloader;

#[test]
fn bootloader_starts_the_program_at_once() {
    let Some(elf) = product() else { return };
    let mut master = Master::new(boot(Wiring::reference(), Corner::Typical, &elf));
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
        let elf = std::fs::read(build_bootloader(wiring)).expect("it was built");
        let mut options = options();
        options.wiring = Some(wiring);
        let board = Board::with_bootloader(None, &elf, options, |_| Stimulus::REST);
        let mut master = Master::new(board.expect("it fits"));
        master.boot_up(1_000);
        assert_eq!(
            master.board.can_bit_rate(),
            Some(1_000_000),
            "{}",
            wiring.name
        );
        master.open_serial_line();
        assert_eq!(master.number(index::PROGRAM_ID), 0, "{}", wiring.name);
    }
}

/// Crystals of other boards, and one that is missing.
const WRONG_CRYSTALS: [Crystal; 8] = [
    Crystal::Missing,
    Crystal::Hertz(4_000_000),
    Crystal::Hertz(6_000_000),
    Crystal::Hertz(10_000_000),
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
#[ignore = "full: eight crystals in every corner of the chip"]
fn bootloader_with_any_wrong_crystal_answers_on_its_serial_line() {
    assert_serial_line(&WRONG_CRYSTALS, &Corner::ALL);
}

/// Boots the bootloaders with wrong crystals, and with those of other boards.
fn assert_serial_line(crystals: &[Crystal], corners: &[Corner]) {
    for wiring in Wiring::all() {
        let elf = std::fs::read(build_bootloader(wiring)).expect("it was built");
        let other_board = Wiring::all().iter().find(|other| other.name != wiring.name);
        let others = other_board.map(|other| Crystal::Hertz(other.crystal));
        for crystal in crystals.iter().copied().chain(others) {
            for &corner in corners {
                let mut options = options();
                options.wiring = Some(wiring);
                options.set_corner(corner);
                options.chip.crystal = crystal;
                let board = Board::with_bootloader(None, &elf, options, |_| Stimulus::REST);
                let mut master = Master::new(board.expect("it fits"));
                master.run(1_000);
                let case = (wiring.name, crystal, corner);
                assert_eq!(master.board.can_bit_rate(), None, "{case:?}");
                master.open_serial_line();
                assert_eq!(master.number(index::PROGRAM_ID), 0, "{case:?}");
            }
        }
    }
}

/// In a chip from the factory no program has set the brown-out level: it goes on at a low supply.
#[test]
#[ignore = "full: an update at a low supply"]
fn bootloader_leaves_the_flash_alone_at_a_low_supply() {
    let Some(elf) = product() else { return };
    let mut options = options();
    options.chip.brown_out_level = 0;
    let board = Board::with_bootloader(None, &bootloader(Wiring::reference()), options, |_| {
        Stimulus::REST
    });
    let mut master = Master::new(board.expect("it fits"));
    master.boot_up(1_000);
    let image = changed_image(&elf, |_| ());
    master.board.inject(Injection::Supply(2_600));
    assert_eq!(master.send(&image)[0], 0x80);
    assert_eq!(master.status(), Some(Refusal::FlashFailed));
    master.board.inject(Injection::Supply(3_300));
    assert_eq!(master.control(CLEAR)[0], 0x60);
    assert_eq!(master.send(&image)[0], 0xA1);
    assert_eq!(master.status(), None);
}

/// Updates a foot over CAN. Returns its master, and the image.
fn updated(elf: &[u8]) -> (Master, Vec<u8>) {
    let mut master = Master::new(boot(Wiring::reference(), Corner::Typical, elf));
    master.run(1_000);
    assert_eq!(master.version(), OLD);
    // Settings survive.
    master.pause();
    let scale = 77.0_f32.to_le_bytes();
    let [a, b, c, d] = scale;
    assert_eq!(master.ask(&[0x23, 0x15, 0x20, 2, a, b, c, d])[0], 0x60);
    let [a, b, c, d] = SIGNATURE_STORE.to_le_bytes();
    assert_eq!(
        master
            .ask_within(&[0x23, 0x10, 0x10, 1, a, b, c, d], 2_000)
            .map(|a| a[0]),
        Some(0x60)
    );
    assert_eq!(master.previous(), 0);
    let before = master.number(index::PROGRAM_ID);
    master.stop();
    // Zephyr's script and Lely's master clear without a pause.
    assert_eq!(master.control(CLEAR)[0], 0x60);
    let image = new_image(elf);
    let begin = master.board.now();
    let answer = master.send(&image);
    assert_eq!(answer[0], 0xA1, "{answer:02x?}");
    assert_eq!(master.status(), None);
    // Lely's master compares it before the start.
    let sent = Header::decode(image.first_chunk().expect("a header")).expect("a header");
    assert_eq!(master.number(index::PROGRAM_ID), sent.identification());
    assert_eq!(master.control(START)[0], 0x60);
    master.boot_up(INSTALLED_MS);
    let seconds = (master.board.now() - begin) / virtual_board::emulator::time::PER_SECOND;
    assert!(seconds < 30, "{seconds} s");
    assert_eq!(master.version(), NEW);
    assert_eq!(master.number(index::PROGRAM_ID), sent.identification());
    assert_eq!(master.previous(), before);
    assert!(master.ask(&[0x40, 0x15, 0x20, 2, 0, 0, 0, 0])[4..] == scale);
    (master, image)
}

/// Sends an image with a bit that was changed.
fn assert_damaged_refused(master: &mut Master, image: &[u8]) {
    master.stop();
    assert_eq!(master.control(CLEAR)[0], 0x60);
    let mut changed = image.to_vec();
    changed[5_000] ^= 1;
    master.send(&changed);
    assert_eq!(master.status(), Some(Refusal::WrongHash));
}

#[test]
fn foot_is_updated_over_can() {
    let Some(elf) = product() else { return };
    let (mut master, image) = updated(&elf);
    assert_damaged_refused(&mut master, &image);
}

#[test]
#[ignore = "full: ten seconds of a trial, and an update over CAN with the same image"]
fn updated_foot_confirms_itself_and_takes_the_image_again() {
    let Some(elf) = product() else { return };
    let (mut master, image) = updated(&elf);
    // It confirms itself after ten seconds, and stays.
    master.operate();
    assert!(master.contacts(10_500) > 9_000);
    for _ in 0..5 {
        master.board.inject(Injection::Reset);
        let ms = master.boot_up(1_000);
        assert!(
            (130..160).contains(&ms),
            "{ms} ms, docs/update.md says 0.14 s"
        );
    }
    assert_eq!(master.version(), NEW);
    assert_eq!(master.status(), None);
    assert_damaged_refused(&mut master, &image);
    // The same file. The slot is clear.
    master.send(&image);
    assert_eq!(master.status(), None);
}
