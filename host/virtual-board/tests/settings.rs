//! Settings in the flash of the running board: stores that erase, cuts, garbage, worn bits.

mod common;

use std::ops::Range;
use std::sync::OnceLock;

use common::{MILLISECOND, boot_product, options, product, run, watch};
use virtual_board::emulator::board::{Board, Injection};
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::part::can::BusFrame;
use virtual_board::emulator::part::rcc::ResetCause;
use wire::dictionary::{SIGNATURE_RESTORE, SIGNATURE_STORE, index};

/// Addresses of the settings pages.
const PAGES: u32 = 0x0800_8000;
const PAGES_LENGTH: usize = 0x8000;

const PRE_OPERATIONAL: u8 = 0x80;
const OPERATIONAL: u8 = 0x01;
const RESET_NODE: u8 = 0x81;
const RESET_COMMUNICATION: u8 = 0x82;

/// An abort, and its code "only in pre-operational state".
const ABORT: u8 = 0x80;
const DEVICE_STATE: [u8; 4] = 0x0800_0022_u32.to_le_bytes();

const WRITTEN: u8 = 0x60;

fn board(elf: &[u8]) -> Board {
    boot_product(elf)
}

fn command(board: &mut Board, command: u8) {
    board.push_can(BusFrame::new(0x000, &[command, 0x11]));
    run(board, 5);
}

/// Sends an SDO request. Returns its answer, if it arrives within two seconds.
fn ask(board: &mut Board, request: &[u8; 8]) -> Option<[u8; 8]> {
    board.take_can();
    board.push_can(BusFrame::new(0x611, request));
    for _ in 0..200 {
        run(board, 10);
        let frames = board.take_can();
        let answer = frames.iter().find(|sent| sent.frame.id == 0x591);
        if let Some(sent) = answer {
            return sent.frame.data.as_slice().try_into().ok();
        }
    }
    None
}

fn write(board: &mut Board, index: u16, subindex: u8, value: [u8; 4]) -> Option<[u8; 8]> {
    let [i0, i1] = index.to_le_bytes();
    let [a, b, c, d] = value;
    ask(board, &[0x23, i0, i1, subindex, a, b, c, d])
}

fn store(board: &mut Board) -> Option<[u8; 8]> {
    write(board, index::STORE, 1, SIGNATURE_STORE.to_le_bytes())
}

/// Sets the scale of the load input, which has no other effect.
fn set_scale(board: &mut Board, scale: f32) {
    let answer = write(board, index::LOAD_INPUT, 2, scale.to_le_bytes());
    assert_eq!(answer.map(|a| a[0]), Some(WRITTEN));
}

fn scale(board: &mut Board) -> f32 {
    let [i0, i1] = index::LOAD_INPUT.to_le_bytes();
    let answer = ask(board, &[0x40, i0, i1, 2, 0, 0, 0, 0]).expect("an answer");
    f32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]])
}

fn pages(board: &mut Board) -> Vec<u8> {
    board.memory(PAGES, PAGES_LENGTH).expect("flash")
}

/// A board with these settings pages, just powered up.
fn with_pages(elf: &[u8], bytes: &[u8]) -> Board {
    in_corner(elf, bytes, Corner::Typical)
}

fn in_corner(elf: &[u8], bytes: &[u8], corner: Corner) -> Board {
    let mut options = options();
    options.set_corner(corner);
    let still = |_| lsm6dsox::sim::Stimulus::REST;
    let mut board = Board::with_motion(elf, options, still).expect("it fits");
    board.cpu().memory().write(PAGES, bytes);
    board
}

/// Time after which one more store is possible, ms.
const STORE_INTERVAL_MS: u64 = 1_030;

#[test]
fn stores_are_limited_to_one_a_second() {
    let Some(elf) = product() else { return };
    let mut board = board(&elf);
    run(&mut board, 300);
    command(&mut board, PRE_OPERATIONAL);
    let stores = |board: &mut Board, ms: u64| {
        let end = board.now() + ms * MILLISECOND;
        let mut done = 0;
        while board.now() < end {
            let before = pages(board);
            let answer = store(board).expect("an answer");
            if answer[0] == WRITTEN {
                done += 1;
            } else {
                let code = wire::AbortCode::TooSoon.code().to_le_bytes();
                assert_eq!((answer[0], &answer[4..]), (ABORT, &code[..]));
                assert!(pages(board) == before, "a refused store changed something");
            }
        }
        done
    };
    assert_eq!(stores(&mut board, 600), firmware::STORES_AT_ONCE);
    assert!((4..=5).contains(&stores(&mut board, 5_000)));
    // A reset that a master commands brings none.
    for _ in 0..2 {
        command(&mut board, RESET_NODE);
        run(&mut board, 200);
        assert_eq!(stores(&mut board, 300), 0);
    }
    assert_eq!(stores(&mut board, 1_000), 1);
    board.inject(Injection::Reset);
    run(&mut board, 300);
    command(&mut board, PRE_OPERATIONAL);
    assert_eq!(stores(&mut board, 300), firmware::STORES_AT_ONCE);
}

/// Settings pages of which the active one has no room and the other one is full, with the scale stored in them.
fn full_pages(elf: &[u8]) -> (Vec<u8>, f32) {
    // The same for all tests, which boot the same program.
    static FILLED: OnceLock<(Vec<u8>, f32)> = OnceLock::new();
    FILLED.get_or_init(|| fill_pages(elf)).clone()
}

fn fill_pages(elf: &[u8]) -> (Vec<u8>, f32) {
    let mut board = board(elf);
    run(&mut board, 300);
    for number in 1..100_u8 {
        // At once it takes four stores.
        if number.is_multiple_of(4) {
            board.inject(Injection::Reset);
            run(&mut board, 300);
        }
        command(&mut board, PRE_OPERATIONAL);
        let scale = f32::from(number);
        set_scale(&mut board, scale);
        command(&mut board, OPERATIONAL);
        let answer = store(&mut board).expect("an answer");
        if answer[0] == ABORT {
            assert_eq!(answer[4..], DEVICE_STATE, "store {number}");
            assert!(number > 20, "{number} stores");
            return (pages(&mut board), scale - 1.0);
        }
    }
    panic!("no store had to erase");
}

#[test]
fn an_erasing_store_is_refused_while_data_are_sent() {
    assert_refused("a store");
}

#[test]
#[ignore = "full: restores until one has to erase, a minute of virtual time"]
fn an_erasing_restore_waits_for_a_moment_without_data() {
    assert_refused("a restore");
}

fn assert_refused(erasing: &str) {
    let Some(elf) = product() else { return };
    let (full, last) = full_pages(&elf);
    let mut board = with_pages(&elf, &full);
    run(&mut board, 1_000);
    assert!((scale(&mut board) - last).abs() < 1.0e-6);
    let before = pages(&mut board);
    assert_eq!(store(&mut board).map(|a| a[0]), Some(ABORT));
    assert!(
        pages(&mut board) == before,
        "the refused store changed something"
    );
    command(&mut board, PRE_OPERATIONAL);
    let answer = match erasing {
        "a store" => {
            set_scale(&mut board, 77.0);
            store(&mut board)
        }
        _ => {
            let signature = SIGNATURE_RESTORE.to_le_bytes();
            // Small records that fit where a record of settings does not, repeated until the store must erase.
            (0..60).for_each(|_| {
                write(&mut board, index::RESTORE, 1, signature);
                run(&mut board, STORE_INTERVAL_MS);
            });
            write(&mut board, index::RESTORE, 1, signature)
        }
    };
    assert_eq!(answer.map(|a| a[0]), Some(WRITTEN), "{erasing}");
    command(&mut board, OPERATIONAL);
    run(&mut board, 1_100);
    let (codes, contacts) = watch(&mut board, 1_000);
    assert_eq!(board.resets(), [], "{erasing}");
    assert_eq!(codes, Vec::<u16>::new(), "{erasing}");
    assert!((998..=1002).contains(&contacts), "{contacts}");
    board.inject(Injection::Reset);
    run(&mut board, 500);
    let expected = if erasing == "a store" { 77.0 } else { 1.0 };
    assert!((scale(&mut board) - expected).abs() < 1.0e-6, "{erasing}");
}

#[test]
fn ticks_lost_to_an_erase_are_counted_and_ticks_resume() {
    assert_ticks_resume(&[Corner::Typical]);
}

#[test]
#[ignore = "full: every corner of the chip"]
fn ticks_lost_to_an_erase_are_counted_in_every_corner() {
    assert_ticks_resume(&Corner::ALL);
}

fn assert_ticks_resume(corners: &[Corner]) {
    let Some(elf) = product() else { return };
    let (full, _) = full_pages(&elf);
    for &corner in corners {
        let mut board = in_corner(&elf, &full, corner);
        run(&mut board, 1_000);
        command(&mut board, PRE_OPERATIONAL);
        board.push_can(BusFrame::new(
            0x611,
            &[0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'],
        ));
        let (codes, _) = watch(&mut board, 1_000);
        let late = wire::Fault::LateTick.code();
        assert_eq!(codes, [late], "{corner:?}: {codes:x?}");
        command(&mut board, OPERATIONAL);
        let (_, contacts) = watch(&mut board, 2_000);
        assert!(
            (1_995..=2_005).contains(&contacts),
            "{corner:?}: {contacts}"
        );
        assert_eq!(board.resets(), [], "{corner:?}");
    }
}

#[test]
fn a_cut_erasing_store_leaves_the_old_or_new_settings() {
    // The erase, the marks, the header, data, and the last.
    assert_cut_stores(|whole| [1, 2, 5, whole / 2, whole].to_vec());
}

#[test]
#[ignore = "full: power cuts at every operation of a store"]
fn a_store_cut_at_any_operation_leaves_the_old_or_new_settings() {
    assert_cut_stores(|whole| (1..=whole).collect());
}

/// Cuts the supply in operations of an erasing store, of which there are as many as `operations` gets.
fn assert_cut_stores(operations: impl Fn(u64) -> Vec<u64>) {
    let Some(elf) = product() else { return };
    let (full, last) = full_pages(&elf);
    let whole = {
        let mut board = with_pages(&elf, &full);
        run(&mut board, 300);
        command(&mut board, PRE_OPERATIONAL);
        let before = board.cpu().machine().chip.flash.operations;
        assert!(store(&mut board).is_some());
        board.cpu().machine().chip.flash.operations - before
    };
    println!("{whole} operations of flash");
    let mut kept = [0; 2];
    for operation in operations(whole) {
        let mut board = with_pages(&elf, &full);
        run(&mut board, 300);
        command(&mut board, PRE_OPERATIONAL);
        set_scale(&mut board, 55.0);
        board.inject(Injection::CutInFlash(operation));
        board.push_can(BusFrame::new(
            0x611,
            &[0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'],
        ));
        run(&mut board, 1_000);
        let causes: Vec<_> = board.resets().iter().map(|(_, cause)| *cause).collect();
        assert_eq!(causes, [ResetCause::PowerOn], "operation {operation}");
        let is_new = scale(&mut board) > 54.0;
        assert!(
            is_new || (scale(&mut board) - last).abs() < 1.0e-6,
            "operation {operation}: {}",
            scale(&mut board)
        );
        kept[usize::from(is_new)] += 1;
    }
    println!("old, new: {kept:?}");
    assert!(kept[0] > 0);
}

#[test]
fn arbitrary_pages_are_reported_until_settings_are_stored() {
    assert_pages_reported(0..2);
}

#[test]
#[ignore = "full: a dozen arbitrary pages"]
fn any_arbitrary_pages_are_reported_until_settings_are_stored() {
    assert_pages_reported(0..12);
}

fn assert_pages_reported(seeds: Range<u32>) {
    let Some(elf) = product() else { return };
    for seed in seeds {
        let mut state = seed.wrapping_mul(0x9E37_79B9) | 1;
        let garbage: Vec<u8> = (0..PAGES_LENGTH)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 24) as u8
            })
            .collect();
        let bytes = match seed {
            0 => vec![0; PAGES_LENGTH],
            _ => garbage,
        };
        let mut board = with_pages(&elf, &bytes);
        let corrupted = wire::Fault::ConfigCorrupted.code();
        for start in 0..2 {
            let (codes, contacts) = watch(&mut board, 500);
            assert!(codes.contains(&corrupted), "seed {seed}, start {start}");
            assert!(contacts > 300, "seed {seed}: {contacts} contacts");
            assert!(pages(&mut board) == bytes, "a start writes no flash");
            board.inject(Injection::Reset);
        }
        run(&mut board, 300);
        command(&mut board, PRE_OPERATIONAL);
        set_scale(&mut board, 9.0);
        assert_eq!(
            store(&mut board).map(|a| a[0]),
            Some(WRITTEN),
            "seed {seed}"
        );
        board.inject(Injection::Reset);
        let (codes, _) = watch(&mut board, 500);
        assert!(!codes.contains(&corrupted), "seed {seed}: {codes:x?}");
        assert!((scale(&mut board) - 9.0).abs() < 1.0e-6, "seed {seed}");
    }
}

/// Pages of a board that has stored a scale of 2.
fn stored_pages(elf: &[u8]) -> Vec<u8> {
    let mut board = board(elf);
    run(&mut board, 300);
    command(&mut board, PRE_OPERATIONAL);
    set_scale(&mut board, 2.0);
    assert_eq!(store(&mut board).map(|a| a[0]), Some(WRITTEN));
    pages(&mut board)
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
    let Some(elf) = product() else { return };
    let stored = stored_pages(&elf);
    assert!(rewritten(&stored, |_| {}) == stored, "another format");
    let not_a_number = f32::NAN.to_bits();
    type Change<'a> = &'a dyn Fn(&mut [u8]);
    let cases: [(&str, bool, Change<'_>); 7] = [
        ("half-width", true, &|record| {
            replace(record, index::HALF_WIDTH, 1, 1.0e4_f32.to_bits());
        }),
        ("not a number", true, &|record| {
            replace(record, index::DECISION, 1, not_a_number);
        }),
        // For a frame in each millisecond.
        ("bit rate that does not fit", true, &|record| {
            replace(record, index::CAN_BIT_RATE, 0, 125);
        }),
        ("bit rate", true, &|record| {
            replace(record, index::CAN_BIT_RATE, 0, 333);
        }),
        ("serial rate", true, &|record| {
            replace(record, index::UART_RATE, 0, 3);
        }),
        ("address", true, &|record| record[1..3].fill(0xFF)),
        ("version", false, &|record| record[0] = 99),
    ];
    for (case, others_apply, change) in cases.into_iter().take(kinds) {
        let bytes = rewritten(&stored, change);
        let mut board = with_pages(&elf, &bytes);
        for _ in 0..2 {
            let (codes, contacts) = watch(&mut board, 500);
            assert_eq!(codes, [wire::Fault::ConfigCorrupted.code()], "{case}");
            assert!(contacts > 300, "{case}: {contacts} contacts");
            let expected = if others_apply { 2.0 } else { 1.0 };
            assert!((scale(&mut board) - expected).abs() < 1.0e-6, "{case}");
            assert!(
                pages(&mut board) == bytes,
                "{case}: a start writes no flash"
            );
            board.inject(Injection::Reset);
        }
        run(&mut board, 300);
        command(&mut board, PRE_OPERATIONAL);
        assert_eq!(store(&mut board).map(|a| a[0]), Some(WRITTEN), "{case}");
        board.inject(Injection::Reset);
        let (codes, _) = watch(&mut board, 500);
        assert_eq!(codes, Vec::<u16>::new(), "{case}");
        assert_eq!(board.resets().len(), 3, "{case}");
    }
}

/// A valid length over and over, whose data would be checked at each word.
#[test]
fn pages_full_of_valid_lengths_delay_no_start() {
    let Some(elf) = product() else { return };
    for (length, check) in [(512_u16, 0xFAA2_u16), (8192, 0xFEA6), (12_000, 0xE85E)] {
        let [l0, l1] = length.to_le_bytes();
        let [k0, k1] = check.to_le_bytes();
        let mut bytes = [0, 1, 2, 3, l0, l1, k0, k1].repeat(PAGES_LENGTH / 8);
        // Each page is marked as in use.
        for page in bytes.chunks_mut(PAGES_LENGTH / 2) {
            page.copy_within(..PAGES_LENGTH / 2 - 4, 4);
            page[..4].fill(0);
        }
        let mut board = with_pages(&elf, &bytes);
        let (codes, contacts) = watch(&mut board, 600);
        assert!(
            codes.contains(&wire::Fault::ConfigCorrupted.code()),
            "{length}: {codes:x?}"
        );
        assert!(contacts > 300, "{length}: {contacts} contacts");
        assert_eq!(board.resets(), [], "{length}");
    }
}

#[test]
fn three_watchdog_resets_in_a_row_start_with_defaults() {
    let Some(elf) = product() else { return };
    let mut board = board(&elf);
    run(&mut board, 300);
    command(&mut board, PRE_OPERATIONAL);
    set_scale(&mut board, 2.0);
    assert_eq!(store(&mut board).map(|a| a[0]), Some(WRITTEN));
    let stored = pages(&mut board);
    board.inject(Injection::Reset);
    let corrupted = wire::Fault::ConfigCorrupted.code();
    for resets in 1..=3 {
        run(&mut board, 30);
        board.inject(Injection::Hang);
        while board.resets().len() < resets + 1 {
            run(&mut board, 10);
        }
        if resets < 3 {
            let (codes, _) = watch(&mut board, 1);
            assert!(!codes.contains(&corrupted), "{resets}");
        }
    }
    let (codes, contacts) = watch(&mut board, 500);
    assert!(codes.contains(&corrupted), "{codes:x?}");
    assert!(contacts > 300, "{contacts} contacts");
    assert!((scale(&mut board) - 1.0).abs() < 1.0e-6);
    assert!(
        pages(&mut board) == stored,
        "the stored settings have changed"
    );
    // It worked since: the next reset by the watchdog is the first of its row.
    board.inject(Injection::Hang);
    run(&mut board, 1_500);
    assert_eq!(board.resets().len(), 5);
    assert!((scale(&mut board) - 2.0).abs() < 1.0e-6);
}

#[test]
fn largest_costs_are_measured_by_the_board() {
    let Some(elf) = product() else { return };
    let mut board = board(&elf);
    for start in ["power-up", "reset"] {
        // The stack is searched piece by piece.
        run(&mut board, 4_000);
        let costs: Vec<u16> = (1..=3)
            .map(|subindex| {
                let [i0, i1] = index::COSTS.to_le_bytes();
                let answer = ask(&mut board, &[0x40, i0, i1, subindex, 0, 0, 0, 0]);
                let answer = answer.expect("an answer");
                u16::from_le_bytes([answer[4], answer[5]])
            })
            .collect();
        println!("{start}: {costs:?}");
        let [mailbox, end, stack] = costs[..] else {
            unreachable!()
        };
        assert!((50..=150).contains(&mailbox), "{start}: {costs:?}");
        assert!((mailbox..400).contains(&end), "{start}: {costs:?}");
        assert!((8_000..=30_000).contains(&stack), "{start}: {costs:?}");
        // The sensor measures meanwhile: a tick with an edge waits for the program.
        board.inject(Injection::Reset);
    }
}

#[test]
fn one_cleared_bit_under_the_record_loses_no_settings() {
    assert_kept_over_cleared_bits(400);
}

#[test]
#[ignore = "full: 20 bits under the record"]
fn any_cleared_bit_under_the_record_loses_no_settings() {
    assert_kept_over_cleared_bits(41);
}

/// Clears one bit in every `stride`th byte under the record, each on a board of its own.
fn assert_kept_over_cleared_bits(stride: usize) {
    let Some(elf) = product() else { return };
    let stored = stored_pages(&elf);
    let used = stored.iter().rposition(|byte| *byte != 0xFF);
    let used = used.expect("something was stored") + 1;
    for (at, bit) in (used..used + 800).step_by(stride).zip((0..8).cycle()) {
        let mut worn = stored.clone();
        worn[at] &= !(1 << bit);
        let mut board = with_pages(&elf, &worn);
        run(&mut board, 300);
        command(&mut board, PRE_OPERATIONAL);
        set_scale(&mut board, 3.0);
        assert_eq!(store(&mut board).map(|a| a[0]), Some(WRITTEN));
        board.inject(Injection::BrownOut);
        run(&mut board, 500);
        assert!((scale(&mut board) - 3.0).abs() < 1.0e-6, "byte {at}");
    }
}

#[test]
fn damaged_settings_are_reported_after_communication_resets() {
    let Some(elf) = product() else { return };
    let mut board = board(&elf);
    run(&mut board, 300);
    assert_eq!(store(&mut board).map(|a| a[0]), Some(WRITTEN));
    board.inject(Injection::SettingsDamaged);
    board.push_can(BusFrame::new(0x000, &[RESET_COMMUNICATION, 0x11]));
    let (codes, _) = watch(&mut board, 200);
    assert_eq!(codes, [wire::Fault::ConfigCorrupted.code()]);
    assert_eq!(board.resets(), []);
}
