//! One boot of the flashed program for each of its promises: the bits of the host in a walk, a fault, an update. `.ci/test`
//! runs it; all that the board does is tested in `virtual-board`. This package compiles little beside the emulator.

#[allow(dead_code, reason = "a part of it is used here")]
#[path = "../../virtual-board/tests/common/mod.rs"]
mod common;
#[allow(dead_code, unused_imports, reason = "a part of it is used here")]
#[path = "../../virtual-board/tests/update/master.rs"]
mod master;

use bootloader::image::{Header, Refusal};
use common::product;
use gait::GaitName;
use master::{CLEAR, Master, OLD, START, new_image, sdo};
use serde_json::json;
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::time::PER_SECOND;
use virtual_board::product::motion;
use virtual_board::product::report::{self, RunOptions};
use virtual_board::product::scenario::{Case, Scenario};
use wire::dictionary::index;

/// Time in which the sensor starts and tests itself, ms.
const STARTING_MS: u64 = 100;

#[test]
fn foot_in_a_walk_sends_the_bits_of_the_host() {
    let elf = product();
    let walk = motion::gait(GaitName::Walk, 3.0, 1);
    let mut board = Board::with_motion(&elf, BoardOptions::default(), walk).expect("it fits");
    let run = RunOptions { milliseconds: 3_000, ..RunOptions::default() };
    let report = report::run(&mut board, &run).expect("it runs");
    for (name, expected) in [
        ("late_ticks", 0.into()),
        ("resets", json!([])),
        ("emergencies", json!([])),
        ("parity_mismatches", 0.into()),
    ] {
        assert_eq!(report[name], expected, "{name}");
    }
    for line in ["uart", "can"] {
        let compared = report["parity_compared"][line].as_u64().expect("a count");
        assert!(compared + STARTING_MS > run.milliseconds, "{line}: {compared}");
    }
}

#[test]
fn foot_reports_a_broken_data_line_and_recovers() {
    let elf = product();
    let row = Scenario::named("miso-low").expect("a row");
    let outcome = row.run(&elf, Case { variant: row.variants.0, phase: 0 }, Corner::Typical);
    let outcome = outcome.unwrap_or_else(|problem| panic!("{problem}"));
    assert!(outcome.violations.is_empty(), "{:#?}", outcome.violations);
}

#[test]
fn foot_is_updated_over_can() {
    let elf = product();
    let mut master = Master::of(&elf);
    master.run(1_000);
    assert_eq!(master.version(), OLD);
    // Settings survive.
    master.pause();
    let scale = 77.0_f32.to_bits();
    let set = sdo(0x23, index::LOAD_INPUT, 2, scale);
    assert_eq!(master.ask(&set)[0], 0x60);
    master.store();
    assert_eq!(master.number_at(index::PROGRAM_ID, 2), 0);
    let before = master.number(index::PROGRAM_ID);
    master.stop();
    let image = new_image(&elf);
    let begin = master.board.now();
    // Zephyr's script and Lely's master clear without a pause.
    master.load(&image);
    // Lely's master compares it before the start.
    let sent = Header::decode(image.first_chunk().expect("a header")).expect("a header");
    assert_eq!(master.number(index::PROGRAM_ID), sent.identification());
    assert_eq!(master.control(START)[0], 0x60);
    master.updated();
    let seconds = (master.board.now() - begin) / PER_SECOND;
    assert!(seconds < 30, "{seconds} s");
    assert_eq!(master.number(index::PROGRAM_ID), sent.identification());
    assert_eq!(master.number_at(index::PROGRAM_ID, 2), before);
    assert_eq!(master.number_at(index::LOAD_INPUT, 2), scale);
    // An image with a bit that was changed.
    master.stop();
    assert_eq!(master.control(CLEAR)[0], 0x60);
    let mut changed = image;
    changed[5_000] ^= 1;
    master.send(&changed);
    assert_eq!(master.status(), Some(Refusal::WrongHash));
}
