//! The start: nothing is dropped, and a crystal of another board is measured.

use crate::common::products;
use crate::common::rig::Rig;
use virtual_board::emulator::board::Injection;
use virtual_board::emulator::chip::Crystal;
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::part::can::BusFault;
use virtual_board::emulator::wiring::Wiring;
use wire::Counter;
use wire::uart::Message;

/// The sending tasks wait for the first tick, at any moment of its millisecond. They also wait if the foot cannot join the bus.
#[test]
fn no_message_is_dropped_at_the_start() {
    for (board, elf) in products() {
        for corner in [Corner::Fast, Corner::Typical, Corner::Slow] {
            for fault in [BusFault::None, BusFault::Shorted] {
                let case = format!("{}, {corner:?}, {fault:?}", board.name);
                let mut rig = Rig::with(&elf, |options| options.set_corner(corner));
                rig.inject(Injection::Bus(fault));
                rig.run(300);
                let counters = rig.health().expect("a health message").counters;
                assert_eq!(counters.get(Counter::UartDropped), 0, "{case}");
                if fault == BusFault::None {
                    assert_eq!(counters.get(Counter::CanDropped), 0, "{case}");
                }
            }
        }
    }
}

/// The manual does not state that the crystal's divided clock reaches the timer that measures it.
#[test]
fn crystal_that_cannot_be_measured_is_used_and_reported() {
    for (board, elf) in products() {
        let mut rig = Rig::with(&elf, |options| options.chip.crystal = Crystal::NotMeasurable);
        rig.run(400);
        assert!(rig.contacts() > 200, "{}: {} contacts", board.name, rig.contacts());
        assert_eq!((rig.emergencies(), rig.resets()), (vec![], vec![]), "{}", board.name);
        let lines = rig.messages.iter().filter(|(_, message)| match message {
            Message::Log(line) => line.text() == "crystal not measured",
            _ => false,
        });
        assert_eq!(lines.count(), 1, "{}", board.name);
    }
}

/// The chip takes crystals of 4 to 26 MHz, but only one frequency gives the clocks that a program is built for.
#[test]
fn a_wrong_or_missing_crystal_is_measured_reported_and_not_used() {
    for (board, elf) in products() {
        for khz in [0, 8_000, 12_000, 25_000] {
            assert_crystal(board, &elf, Corner::Typical, khz);
        }
    }
}

#[test]
#[ignore = "full: eleven crystals in every corner of the chip"]
fn any_wrong_crystal_is_measured_reported_and_not_used() {
    for (board, elf) in products() {
        for corner in [Corner::Fast, Corner::Typical, Corner::Slow] {
            for khz in [
                0, 4_000, 6_000, 7_000, 8_000, 9_000, 10_000, 12_000, 14_000, 16_000, 25_000,
                26_000,
            ] {
                assert_crystal(board, &elf, corner, khz);
            }
        }
    }
}

/// Asserts that a board with a crystal of `khz` measures it. If it is the board's crystal, the board joins the bus;
/// otherwise it reports the frequency. 0 means no crystal.
fn assert_crystal(board: &Wiring, elf: &[u8], corner: Corner, khz: u32) {
    let case = format!("{}, {khz} kHz, {corner:?}", board.name);
    let mut rig = Rig::with(elf, |options| {
        options.set_corner(corner);
        options.chip.crystal = match khz {
            0 => Crystal::Missing,
            _ => Crystal::Hertz(khz * 1000),
        };
    });
    rig.run(400);
    assert_eq!(rig.resets(), [], "{case}");
    let frames = rig.messages.iter();
    let serial = frames.clone().filter(|(_, message)| matches!(message, Message::Contact(_)));
    assert!(serial.count() > 200, "{case}");
    let found = frames.filter_map(|(_, message)| match message {
        Message::Log(line) => {
            line.text().strip_prefix("crystal of ")?.strip_suffix(" MHz")?.parse().ok()
        }
        _ => None,
    });
    let found: Vec<f64> = found.collect();
    if khz == 0 {
        assert_eq!((rig.contacts(), found.len()), (0, 0), "{case}");
    } else if khz * 1000 == board.crystal {
        assert!(rig.contacts() > 200 && found.is_empty(), "{case}: {found:?}");
    } else {
        assert_eq!((rig.contacts(), found.len()), (0, 1), "{case}");
        // The internal oscillator's 4 %, and a rounded digit.
        let error_khz = (found[0] * 1.0e3 - f64::from(khz)).abs();
        assert!(error_khz < f64::from(khz) * 0.042 + 60.0, "{case}: {found:?}");
    }
}
