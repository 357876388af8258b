//! Attacks on a foot that is being updated, on the ELFs that are flashed: others on its lines, and power cuts.

use bootloader::image::BROKEN_OFF;
use host_tests::changed::Chance;
use virtual_board::emulator::board::Injection;
use virtual_board::emulator::part::can::BusFrame;
use wire::dictionary::index;

use super::master::{CLEAR, CONFIRM, Master, NEW, START, new_image, segment};
use crate::common::product;

/// Foot in its bootloader, with an empty slot, and an image for it.
fn stopped() -> (Master, Vec<u8>) {
    let elf = product();
    let mut master = Master::of(&elf);
    master.run(500);
    master.stop();
    assert_eq!(master.control(CLEAR)[0], 0x60);
    (master, new_image(&elf))
}

/// Installs an image, with something else in the middle of each block.
fn install_beside(beside: impl Fn(&mut Master, usize)) -> Master {
    let (mut master, image) = stopped();
    let answer = master.send_with(&image, |master, number, k, request| {
        if k == 60 {
            beside(master, number);
        }
        master.push(request);
        true
    });
    assert_eq!(answer[0], 0xA1);
    assert_eq!(master.status(), None);
    assert_eq!(master.control(START)[0], 0x60);
    master.updated();
    master
}

#[test]
#[ignore = "full: an update with LSS beside it"]
fn lss_during_a_transfer_disturbs_neither() {
    let services: [[u8; 8]; 8] = [
        [0x51, 0, 0, 0, 0, 0x80, 0, 0],
        [0x04, 1, 0, 0, 0, 0, 0, 0],
        [0x5E, 0, 0, 0, 0, 0, 0, 0],
        // Requests that set another id for this foot, which has one already, set another bit rate, and store both.
        [0x11, 0x22, 0, 0, 0, 0, 0, 0],
        [0x13, 0, 3, 0, 0, 0, 0, 0],
        [0x17, 0, 0, 0, 0, 0, 0, 0],
        [0x04, 0, 0, 0, 0, 0, 0, 0],
        [0xFF; 8],
    ];
    let master = install_beside(|master, number| {
        let request = services[number % services.len()];
        master.board.push_can(BusFrame::new(0x7E5, &request));
    });
    assert_eq!(master.board.can_bit_rate(), Some(1_000_000));
}

#[test]
#[ignore = "full: an update with noise beside it"]
fn noise_on_the_serial_line_does_not_disturb_a_transfer() {
    install_beside(|master, number| {
        let mut chance = Chance::new(number as u64);
        let noise: Vec<u8> = (0..400).map(|_| chance.bits() as u8).collect();
        master.board.push_uart(&noise);
        // Unknown lines, and frames for other nodes.
        let lines = ["\rC\rO\r", "t6128400810000000000\r", "t61184\r", "T1FFFFFFF8\r"];
        master.board.push_uart(lines[number % 4].as_bytes());
    });
}

/// A second master on the serial line begins its own transfer: the first ends with an abort, and the next attempt succeeds.
#[test]
#[ignore = "full: an update with two masters"]
fn master_on_the_other_line_ends_a_transfer_in_words() {
    let (mut master, image) = stopped();
    master.begin_with_a_block(&image);
    master.open_serial_line();
    // A read waits for the transfer of the other line; an abort ends it.
    master.push(&[0x80, 0x50, 0x1F, 1, 0, 0, 4, 5]);
    assert_eq!(master.number(index::FLASH_STATUS), BROKEN_OFF);
    master.turn_to_bus();
    let next = segment(1, &image[..7], false);
    assert_eq!(master.ask(&next)[0], 0x80);
    assert_eq!(master.number(index::FLASH_STATUS), BROKEN_OFF);
    master.install(&image);
    master.updated();
}

/// A cut in the record by which a program confirms itself leaves it on trial, or confirmed.
#[test]
#[ignore = "full: power cuts in the confirmation"]
fn power_cut_in_the_confirmation_keeps_the_new_program() {
    for at in [1, 2] {
        let (mut master, image) = stopped();
        master.install(&image);
        master.updated();
        master.board.inject(Injection::CutInFlash(at));
        master.push(&[0x2F, 0x51, 0x1F, 1, CONFIRM, 0, 0, 0]);
        master.boot_up(2_000);
        assert_eq!(master.version(), NEW, "{at}");
        assert_eq!(master.control(CONFIRM)[0], 0x60, "{at}");
        for _ in 0..4 {
            master.board.inject(Injection::Reset);
            master.boot_up(1_000);
        }
        assert_eq!(master.version(), NEW, "{at}");
    }
}
