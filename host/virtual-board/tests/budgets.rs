//! Budgets of the product, measured on the ELF that is flashed.

use crate::common::digest::{README, assert_block_of};
use crate::common::{is_built_here, product, products};
use host_tests::committed::assert_block;
use serde_json::Value;
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::part::can::BusFrame;
use virtual_board::emulator::time;
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::report::{self, RunOptions};
use virtual_board::product::traffic::Traffic;
use virtual_board::product::{motion, streams};

/// Duration of a measurement, ms; the first half second is for settling.
const MEASURED: u64 = 3_500;

/// Budgets: name, place in the report, limit, unit.
type Budgets = [(&'static str, &'static str, f64, &'static str)];

const BUDGETS: &Budgets = &[
    ("tick, median", "/instructions_per_tick/median", 16_000.0, "instructions"),
    ("estimator alone, median", "/estimator_instructions/median", 2_500.0, "instructions"),
    ("data-ready edge to CAN mailbox, median", "/drdy_to_can_us/median", 120.0, "µs, estimated"),
    ("data-ready edge to CAN mailbox, longest", "/drdy_to_can_us/max", 120.0, "µs, estimated"),
    ("processor load", "/cpu_load_percent", 20.0, "%, estimated"),
    ("late ticks", "/late_ticks", 0.0, ""),
];

/// Limits of the worst ticks under full load ([`Traffic::Full`]).
const WORST: &Budgets = &[
    ("tick, longest", "/instructions_per_tick/max", 24_000.0, "instructions"),
    ("data-ready edge to CAN mailbox, longest", "/drdy_to_can_us/max", 120.0, "µs, estimated"),
    ("late ticks", "/late_ticks", 0.0, ""),
];

/// Duration of a measurement under full load, ms: long enough for rare actions of the board.
const MEASURED_UNDER_FULL_LOAD: u64 = 20_000;

/// Duration of a measurement under full load in the default run, ms.
const BRIEFLY: u64 = 2_500;

/// Runs a walk with all messages enabled: on CAN all seven process data objects, the contact each tick,
/// acceleration, rate, attitude and axes each 20 ms, health each 100 ms, bias each second, and the heartbeat; over
/// the serial line at 1 Mbaud contact and raw sample each tick and health each 10 ms, which takes 89 % of it.
fn with_all_streams(elf: &[u8]) -> Value {
    let gait = motion::gait(gait::GaitName::Walk, 4.0, 1);
    let mut board = Board::with_motion(elf, BoardOptions::default(), gait).expect("it fits");
    streams::turn_all_on(&mut board).expect("it runs");
    let run = RunOptions { milliseconds: MEASURED, ..RunOptions::default() };
    report::run(&mut board, &run).expect("it runs")
}

/// The same walk with the messages and requests of other nodes.
fn under_full_load(elf: &[u8], milliseconds: u64) -> Value {
    let seconds = milliseconds as f64 / 1.0e3;
    let gait = motion::gait(gait::GaitName::Walk, seconds, 1);
    let mut board = Board::with_motion(elf, BoardOptions::default(), gait).expect("it fits");
    let run = RunOptions { milliseconds, traffic: Traffic::Full };
    report::run(&mut board, &run).expect("it runs")
}

fn measured(report: &Value, place: &str) -> f64 {
    let value = report.pointer(place).and_then(Value::as_f64);
    value.expect("it is measured")
}

/// Limit of a budget on a board: the Feather's sensor is read at 2.5 MHz, which takes 27 µs longer.
fn limit(board: &Wiring, place: &str, most: f64) -> f64 {
    match board.name {
        "feather" if place.starts_with("/drdy_to_can") => most + 28.0,
        _ => most,
    }
}

fn table(board: &Wiring, when: &str, budgets: &Budgets, report: &Value) -> String {
    let mut table = format!("| {when} | measured | budget | |\n|---|---|---|---|\n");
    for (name, place, most, unit) in budgets {
        let most = limit(board, place, *most);
        // Counts are exact, all other values are estimates: no more than whole units.
        let measured = measured(report, place);
        table += &format!("| {name} | {measured:.0} | {most} | {unit} |\n");
    }
    table
}

/// Asserts that nothing is lost, the bits are the host's, and every budget is kept.
fn assert_kept(board: &Wiring, budgets: &Budgets, report: &Value) {
    for line in ["uart", "can"] {
        assert_eq!(report["drops"][line], 0, "{report:#}");
    }
    assert_eq!(report["parity_mismatches"], 0, "{report:#}");
    assert_eq!(report["emergencies"], serde_json::json!([]), "{report:#}");
    for (name, place, most, unit) in budgets {
        let most = limit(board, place, *most);
        let measured = measured(report, place);
        assert!(measured <= most, "{name}: {measured} {unit}, {most} are allowed");
    }
}

#[test]
fn budgets_hold_with_all_streams_and_the_readme_shows_them() {
    for (board, elf) in products() {
        let report = with_all_streams(&elf);
        let head = format!("{}, with all streams on", board.name);
        let table = table(board, &head, BUDGETS, &report);
        println!("{table}");
        // Asserts that all streams are on and are transmitted.
        let frames = report["uart_frames"].as_u64().expect("a count");
        assert!(frames > 2 * MEASURED + MEASURED / 10, "{report:#}");
        assert_kept(board, BUDGETS, &report);
        if is_built_here() {
            let block = format!("budgets-{}", board.name);
            assert_block(README, &block, &table);
        }
    }
}

#[test]
fn full_load_causes_no_long_tick_and_no_late_estimate() {
    for (board, elf) in products() {
        assert_kept(board, WORST, &under_full_load(&elf, BRIEFLY));
    }
}

#[test]
#[ignore = "full: 20 s of full load on each board"]
fn full_load_causes_no_long_tick_in_its_rare_moments() {
    for (board, elf) in products() {
        let report = under_full_load(&elf, MEASURED_UNDER_FULL_LOAD);
        let head = format!("{}, under full load", board.name);
        let table = table(board, &head, WORST, &report);
        println!("{table}");
        assert_kept(board, WORST, &report);
        let block = format!("full-load-{}", board.name);
        assert_block_of(&[board.program], &block, &table);
    }
}

#[test]
fn request_floods_delay_an_estimate_by_three_frames_at_most() {
    const MILLISECOND: u64 = time::PER_SECOND / 1000;
    const ESTIMATE: u32 = 0x191;
    let Some(elf) = product() else { return };
    let mut board = Board::from_elf(&elf).expect("it fits");
    board.run_for(1_000 * MILLISECOND).expect("it runs");
    board.take_can();
    // A SYNC and an identity request, repeated without a pause.
    for _ in 0..3_000 {
        board.push_can(BusFrame::new(0x080, &[]));
        board.push_can(BusFrame::new(0x611, &[0x40, 0x18, 0x10, 1, 0, 0, 0, 0]));
    }
    board.run_for(300 * MILLISECOND).expect("it runs");
    let sent = board.take_can();
    let answers = sent.iter().filter(|sent| sent.frame.id == 0x591).count();
    assert!(answers > 500, "{answers} answers are too few for a flood");
    let times: Vec<u64> =
        sent.iter().filter(|sent| sent.frame.id == ESTIMATE).map(|sent| sent.time).collect();
    assert!(times.len() >= 299, "{} estimates in 300 ms", times.len());
    // The frame on the bus, a SYNC, and its own: at most 135 bits each.
    let longest = times.windows(2).map(|pair| pair[1] - pair[0]).max();
    let longest = time::to_us(longest.expect("estimates"));
    println!("{answers} answers; at most {longest:.0} µs from an estimate to the next");
    assert!(longest < 1_000.0 + 3.0 * 135.0, "{longest} µs");
    assert_eq!(board.resets(), []);
}
