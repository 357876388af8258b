//! The journal of updates near its end, and power cuts in its records.

use bootloader::flash::{JOURNAL, JOURNAL_SIZE};
use virtual_board::emulator::board::Injection;
use virtual_board::emulator::part::rcc::ResetCause;
use virtual_board::emulator::wiring::Wiring;
use wire::dictionary::index;

use super::master::{
    CONFIRM, INSTALLED_MS, Master, NEW, OLD, image_beginning_with, new_image, sdo,
};
use super::matrix::BRANCH_TO_ITSELF;
use crate::common::product;

/// Records of an update: install, kept, started, confirmed.
const UPDATE: [u32; 4] = [1, 6, 2, 3];

/// Number of records in use. With it an erase is due, and the last update is complete.
const RECORDS: u32 = JOURNAL_SIZE / 8 - 8;

/// Fills the journal with updates.
fn fill(master: &mut Master) {
    for k in 0..RECORDS {
        let word = UPDATE[(k % 4) as usize];
        let record = [word.to_le_bytes(), (!word).to_le_bytes()].concat();
        master.board.cpu().memory().write(JOURNAL + 8 * k, &record);
    }
}

/// The confirmed program is the only one to which the board can return.
#[test]
#[ignore = "full: power cuts in the renewal of the journal"]
fn confirmed_program_survives_a_cut_in_the_journals_erase() {
    let elf = product();
    let hangs = image_beginning_with(&elf, &BRANCH_TO_ITSELF);
    // The mark and each word in use are written before the erase. One cut is early in these writes, the other at
    // their end.
    for operation in [3, 2 + 2 * u64::from(RECORDS)] {
        let mut master = Master::with(Wiring::reference(), None, |_| ());
        master.boot_up(1_000);
        master.install(&new_image(&elf));
        master.updated();
        assert_eq!(master.control(CONFIRM)[0], 0x60);
        fill(&mut master);
        master.board.inject(Injection::CutInFlash(operation));
        master.board.inject(Injection::Reset);
        master.boot_up(INSTALLED_MS);
        let causes = master.board.resets();
        let cuts = causes.iter().filter(|(_, cause)| *cause == ResetCause::PowerOn);
        assert_eq!(cuts.count(), 1, "operation {operation}");
        // Another program comes before it confirms itself again.
        master.stop();
        master.install(&hangs);
        master.boot_up(90_000);
        assert_eq!(master.version(), NEW, "operation {operation}");
    }
}

/// A confirmation programs five words. It writes the previous record again (two words), the first word of the next
/// record, which could be the remains of an interrupted one, and its own two.
#[test]
#[ignore = "full: power cuts in each word of a confirmation"]
fn update_goes_on_after_a_cut_in_each_word_of_its_confirmation() {
    let elf = product();
    let hangs = image_beginning_with(&elf, &BRANCH_TO_ITSELF);
    let confirm = sdo(0x2F, index::PROGRAM_CONTROL, 1, CONFIRM.into());
    for operation in 1..=6 {
        let mut master = Master::of(&elf);
        master.run(500);
        master.stop();
        master.install(&new_image(&elf));
        master.updated();
        let before = master.board.resets().len();
        master.board.inject(Injection::CutInFlash(operation));
        let answer = master.ask_within(&confirm, 100);
        // The sixth operation does not come.
        assert_eq!(answer.is_some(), operation == 6, "operation {operation}");
        if operation == 6 {
            continue;
        }
        master.boot_up(1_000);
        let causes = master.board.resets().split_off(before);
        assert_eq!(causes.len(), 1, "operation {operation}: {causes:?}");
        assert_eq!(master.version(), NEW, "operation {operation}");
        // The next program does not work, and one that has worked is back.
        master.stop();
        master.install(&hangs);
        master.boot_up(90_000);
        let version = master.version();
        assert!([OLD, NEW].contains(&version.as_str()), "operation {operation}: {version}");
    }
}
