//! Settings in the flash of the running board: stores that erase, cuts, garbage, unusable values. Cuts and garbage are rows of
//! the fault matrix; byte for byte it is tested on a simulated flash.

use std::sync::OnceLock;

use crate::common::rig::{RESET_NODE, Rig};
use crate::common::{MILLISECOND, product};
use virtual_board::emulator::board::Injection;
use wire::Fault;
use wire::dictionary::{SIGNATURE_RESTORE, index};

/// Addresses of the settings pages.
const PAGES: u32 = 0x0800_8000;
const PAGES_LENGTH: usize = 0x8000;

/// An abort, and its code "only in pre-operational state".
const ABORT: u8 = 0x80;
const DEVICE_STATE: [u8; 4] = 0x0800_0022_u32.to_le_bytes();

const WRITTEN: u8 = 0x60;

/// Sets the scale of the load input, which has no other effect.
fn set_scale(rig: &mut Rig, scale: f32) {
    let answer = rig.write(index::LOAD_INPUT, 2, scale.to_bits());
    assert_eq!(answer[0], WRITTEN);
}

fn scale(rig: &mut Rig) -> f32 {
    f32::from_bits(rig.read(index::LOAD_INPUT, 2))
}

fn pages(rig: &mut Rig) -> Vec<u8> {
    rig.board.memory(PAGES, PAGES_LENGTH).expect("flash")
}

/// A board with these settings pages, just powered up.
fn with_pages(elf: &[u8], bytes: &[u8]) -> Rig {
    let mut rig = Rig::new(elf);
    rig.board.cpu().memory().write(PAGES, bytes);
    rig
}

/// A board whose settings can be changed.
fn ready(elf: &[u8]) -> Rig {
    let mut rig = Rig::new(elf);
    rig.run(300);
    rig.pre_operational();
    rig
}

#[test]
fn stores_are_limited_to_one_a_second() {
    let elf = product();
    let mut rig = ready(&elf);
    let stores = |rig: &mut Rig, ms: u64| {
        let end = rig.board.now() + ms * MILLISECOND;
        let mut done = 0;
        while rig.board.now() < end {
            let before = pages(rig);
            let answer = rig.stored();
            if answer[0] == WRITTEN {
                done += 1;
                rig.run(10);
            } else {
                let code = wire::AbortCode::TooSoon.code().to_le_bytes();
                assert_eq!((answer[0], &answer[4..]), (ABORT, &code[..]));
                assert!(pages(rig) == before, "a refused store changed something");
                rig.run(10);
            }
        }
        done
    };
    assert_eq!(stores(&mut rig, 600), firmware::STORES_AT_ONCE);
    assert!((2..=3).contains(&stores(&mut rig, 3_000)));
    // A reset that a master commands brings none.
    for _ in 0..2 {
        rig.nmt(RESET_NODE);
        rig.run(205);
        assert_eq!(stores(&mut rig, 300), 0);
    }
    assert_eq!(stores(&mut rig, 1_000), 1);
    rig.inject(Injection::Reset);
    rig.run(300);
    rig.pre_operational();
    assert_eq!(stores(&mut rig, 300), firmware::STORES_AT_ONCE);
}

/// Settings pages of which the active one has no room and the other one is full, with the scale stored in them.
fn full_pages(elf: &[u8]) -> (Vec<u8>, f32) {
    // All tests boot the same program, so the pages are filled once.
    static FILLED: OnceLock<(Vec<u8>, f32)> = OnceLock::new();
    FILLED.get_or_init(|| fill_pages(elf)).clone()
}

fn fill_pages(elf: &[u8]) -> (Vec<u8>, f32) {
    let mut rig = ready(elf);
    for number in 1..100_u8 {
        // At once it takes four stores.
        if number.is_multiple_of(4) {
            rig.inject(Injection::Reset);
            rig.run(300);
        }
        rig.pre_operational();
        let scale = f32::from(number);
        set_scale(&mut rig, scale);
        rig.operational();
        let answer = rig.stored();
        if answer[0] == ABORT {
            assert_eq!(answer[4..], DEVICE_STATE, "store {number}");
            assert!(number > 20, "{number} stores");
            return (pages(&mut rig), scale - 1.0);
        }
    }
    panic!("no store had to erase");
}

#[test]
fn an_erasing_store_is_refused_while_data_are_sent() {
    let elf = product();
    let (full, last) = full_pages(&elf);
    let mut rig = with_pages(&elf, &full);
    rig.run(1_000);
    assert_eq!(scale(&mut rig), last);
    assert_eq!(rig.stored()[0], ABORT);
    assert!(pages(&mut rig) == full, "the refused store changed something");
    rig.pre_operational();
    set_scale(&mut rig, 77.0);
    assert_eq!(rig.stored()[0], WRITTEN);
    rig.operational();
    rig.run(1_100);
    let (codes, contacts) = rig.watch(1_000);
    assert_eq!((rig.resets(), codes), (vec![], vec![]));
    assert!((998..=1002).contains(&contacts), "{contacts}");
    rig.inject(Injection::Reset);
    rig.run(500);
    assert_eq!(scale(&mut rig), 77.0);
}

#[test]
fn ticks_lost_to_an_erase_are_counted_and_ticks_resume() {
    let elf = product();
    let mut rig = with_pages(&elf, &full_pages(&elf).0);
    rig.run(1_000);
    rig.pre_operational();
    rig.store();
    let (codes, _) = rig.watch(1_000);
    assert_eq!(codes, [Fault::LateTick.code()]);
    rig.operational();
    let (_, contacts) = rig.watch(1_000);
    assert!((995..=1_005).contains(&contacts), "{contacts}");
    assert_eq!(rig.resets(), []);
}

/// Pages of a board that has stored a scale of 2.
fn stored_pages(elf: &[u8]) -> Vec<u8> {
    let mut rig = ready(elf);
    set_scale(&mut rig, 2.0);
    assert_eq!(rig.stored()[0], WRITTEN);
    pages(&mut rig)
}

/// CRC-32 of a record, as the pages keep it.
fn checksum(data: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in data {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            let low = crc & 1;
            crc = (crc >> 1) ^ (low * 0xEDB8_8320);
        }
    }
    !crc
}

/// Pages with one record, changed by `change`, under a valid checksum.
fn rewritten(pages: &[u8], change: impl Fn(&mut [u8])) -> Vec<u8> {
    const ITEM: usize = 4;
    const DATA: usize = ITEM + 8;
    let mut pages = pages.to_vec();
    let length = usize::from(u16::from_le_bytes([pages[ITEM + 4], pages[ITEM + 5]]));
    let data = &mut pages[DATA..DATA + length];
    change(data);
    let check = checksum(data).to_le_bytes();
    pages[ITEM..ITEM + 4].copy_from_slice(&check);
    pages
}

/// Replaces the value of a setting in a record.
fn replace(record: &mut [u8], index: u16, subindex: u8, value: u32) {
    let [i0, i1] = index.to_le_bytes();
    let mut entries = record[1..].chunks_exact_mut(7);
    let entry = entries.find(|entry| entry[..3] == [i0, i1, subindex]);
    entry.expect("a setting")[3..].copy_from_slice(&value.to_le_bytes());
}

#[test]
fn unusable_settings_are_replaced_by_defaults_and_kept() {
    assert_replaced(1);
}

#[test]
#[ignore = "full: every kind of unusable settings"]
fn all_unusable_settings_are_replaced_by_defaults_and_kept() {
    assert_replaced(usize::MAX);
}

/// Tries the first of the kinds of unusable settings.
fn assert_replaced(kinds: usize) {
    let elf = product();
    let stored = stored_pages(&elf);
    assert!(rewritten(&stored, |_| {}) == stored, "another format");
    let values = [
        (index::HALF_WIDTH, 1, 1.0e4_f32.to_bits()),
        (index::DECISION, 1, f32::NAN.to_bits()),
        // For a frame in each millisecond.
        (index::CAN_BIT_RATE, 0, 125),
        (index::CAN_BIT_RATE, 0, 333),
        (index::UART_RATE, 0, 3),
    ];
    let value = |(index, subindex, value)| {
        let change = move |record: &mut [u8]| replace(record, index, subindex, value);
        (format!("{index:#x} {value:#x}"), 2.0, rewritten(&stored, change))
    };
    let address = rewritten(&stored, |record| record[1..3].fill(0xFF));
    let version = rewritten(&stored, |record| record[0] = 99);
    let cases = values
        .into_iter()
        .map(value)
        .chain([("address".into(), 2.0, address), ("version".into(), 1.0, version)]);
    for (case, expected, bytes) in cases.take(kinds) {
        let mut rig = with_pages(&elf, &bytes);
        for _ in 0..2 {
            let (codes, contacts) = rig.watch(500);
            assert_eq!(codes, [Fault::ConfigCorrupted.code()], "{case}");
            assert!(contacts > 300, "{case}: {contacts} contacts");
            assert_eq!(scale(&mut rig), expected, "{case}");
            assert!(pages(&mut rig) == bytes, "{case}: a start writes no flash");
            rig.inject(Injection::Reset);
        }
        rig.run(300);
        rig.pre_operational();
        assert_eq!(rig.stored()[0], WRITTEN, "{case}");
        rig.inject(Injection::Reset);
        let (codes, _) = rig.watch(500);
        assert_eq!((codes, rig.resets().len()), (vec![], 3), "{case}");
    }
}

#[test]
fn three_watchdog_resets_in_a_row_start_with_defaults() {
    let elf = product();
    let stored = stored_pages(&elf);
    let mut rig = with_pages(&elf, &stored);
    let corrupted = Fault::ConfigCorrupted.code();
    for resets in 0..3 {
        rig.run(30);
        rig.inject(Injection::Hang);
        while rig.resets().len() < resets + 1 {
            rig.run(10);
        }
        if resets < 2 {
            assert!(!rig.watch(1).0.contains(&corrupted), "{resets}");
        }
    }
    let (codes, contacts) = rig.watch(500);
    assert!(codes.contains(&corrupted), "{codes:x?}");
    assert!(contacts > 300, "{contacts} contacts");
    assert_eq!(scale(&mut rig), 1.0);
    assert!(pages(&mut rig) == stored, "the settings have changed");
    // The board has worked since the last reset by the watchdog, so the next one is the first of a new row.
    rig.inject(Injection::Hang);
    rig.run(1_500);
    assert_eq!(rig.resets().len(), 4);
    assert_eq!(scale(&mut rig), 2.0);
}

#[test]
fn largest_costs_are_measured_by_the_board() {
    let elf = product();
    let mut rig = Rig::new(&elf);
    for start in ["power-up", "reset"] {
        // The stack is searched piece by piece: all 96 pieces of 512 bytes in 5.8 s.
        rig.run(6_000);
        let costs = [1, 2, 3].map(|subindex| rig.read(index::COSTS, subindex) as u16);
        println!("{start}: {costs:?}");
        let [mailbox, end, stack] = costs;
        assert!((50..=150).contains(&mailbox), "{start}: {costs:?}");
        assert!((mailbox..400).contains(&end), "{start}: {costs:?}");
        assert!((8_000..=30_000).contains(&stack), "{start}: {costs:?}");
        // The sensor measures meanwhile: a tick with an edge waits for the program.
        rig.inject(Injection::Reset);
    }
}

/// The old settings, or the defaults.
#[test]
fn a_cut_restore_leaves_the_old_settings_or_the_defaults() {
    let elf = product();
    let mut kept = [0; 2];
    for operation in 1..=12 {
        let mut rig = ready(&elf);
        set_scale(&mut rig, 5.0);
        rig.write(index::LOAD_INPUT, 3, 7.0_f32.to_bits());
        rig.stored();
        rig.run(60);
        rig.inject(Injection::CutInFlash(operation));
        rig.sdo_write(index::RESTORE, 1, SIGNATURE_RESTORE);
        rig.run(60);
        rig.inject(Injection::Reset);
        rig.run(50);
        let values = [2, 3].map(|subindex| f32::from_bits(rig.read(index::LOAD_INPUT, subindex)));
        let allowed = [[5.0, 7.0], [1.0, 0.0]];
        let index = allowed.iter().position(|all| values == *all);
        kept[index.unwrap_or_else(|| panic!("{values:?} after {operation}"))] += 1;
    }
    assert!(kept.iter().all(|count| *count > 0), "{kept:?}");
}
