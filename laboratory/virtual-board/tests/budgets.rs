//! Budgets of the product, measured on the ELF that is flashed.

use crate::common::{is_built_here, product, products};
use crate::digest::{assert_reproduced_on, digest_of};
use results::Measurement;
use serde_json::Value;
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::part::can::BusFrame;
use virtual_board::emulator::time;
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::motion;
use virtual_board::product::report::{self, RunOptions};
use virtual_board::product::traffic::{self, Traffic};
use wire::board::EDGE_TO_MAILBOX_US;

/// Duration of a measurement, ms; the first half second is for settling.
const MEASURED: u64 = 3_500;

/// A measured quantity.
struct Quantity {
    name: &'static str,
    /// Place in the report.
    place: &'static str,
    /// Greatest accepted value.
    budget: Option<u64>,
    unit: &'static str,
}

/// Instructions are exact. Times are estimates, and their budgets have room for an error by a factor of two.
const WITH_ALL_STREAMS: &[Quantity] = &[
    Quantity {
        name: "tick, median",
        place: "/instructions_per_tick/median",
        budget: Some(14_000),
        unit: "instructions",
    },
    Quantity {
        name: "estimator alone, median",
        place: "/estimator_instructions/median",
        budget: Some(4_000),
        unit: "instructions",
    },
    Quantity {
        name: "processor load",
        place: "/cpu_load_percent",
        budget: Some(30),
        unit: "%, estimated",
    },
    LATE_TICKS,
];

/// Quantities under full load ([`Traffic::Full`]).
const UNDER_FULL_LOAD: &[Quantity] = &[
    Quantity {
        name: "tick, longest",
        place: "/instructions_per_tick/max",
        budget: Some(48_000),
        unit: "instructions",
    },
    Quantity {
        name: "data-ready edge to CAN mailbox, median",
        place: "/drdy_to_can_us/median",
        budget: None,
        unit: "µs, estimated",
    },
    Quantity {
        name: "data-ready edge to CAN mailbox, 99.9 %",
        place: "/drdy_to_can_us/p99_9",
        budget: None,
        unit: "µs, estimated",
    },
    LATENCY,
    Quantity {
        name: "data-ready edge to the serial line, longest",
        place: "/drdy_to_uart_us/max",
        budget: Some(1_000),
        unit: "µs, estimated",
    },
    LATE_TICKS,
];

const LATENCY: Quantity = Quantity {
    name: "data-ready edge to CAN mailbox, longest",
    place: "/drdy_to_can_us/max",
    budget: Some(EDGE_TO_MAILBOX_US as u64),
    unit: "µs, estimated",
};

const LATE_TICKS: Quantity =
    Quantity { name: "late ticks", place: "/late_ticks", budget: Some(0), unit: "" };

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
    traffic::turn_all_streams_on(&mut board).expect("it runs");
    let run = RunOptions { milliseconds: MEASURED, ..RunOptions::default() };
    report::run(&mut board, &run).expect("it runs")
}

/// Runs the same walk with the messages and requests of other nodes.
fn under_full_load(elf: &[u8], milliseconds: u64, traffic: Traffic) -> Value {
    let seconds = milliseconds as f64 / 1.0e3;
    let gait = motion::gait(gait::GaitName::Walk, seconds, 1);
    let mut board = Board::with_motion(elf, BoardOptions::default(), gait).expect("it fits");
    report::run(&mut board, &RunOptions { milliseconds, traffic }).expect("it runs")
}

impl Quantity {
    /// Returns the measured value, rounded to whole units. Counts are exact, whereas all other values are estimates
    /// whose fractions mean nothing.
    fn measured(&self, report: &Value) -> u64 {
        let value = report.pointer(self.place).and_then(Value::as_f64);
        value.expect("it is measured").round() as u64
    }

    fn assert_kept(&self, report: &Value) {
        let measured = self.measured(report);
        if let Some(budget) = self.budget {
            assert!(measured <= budget, "{}: {measured} {}, of {budget}", self.name, self.unit);
        }
    }
}

/// Asserts that nothing is lost and no fault reported, the bits are the host's, and every budget is kept.
fn assert_kept(quantities: &[Quantity], report: &Value) {
    for line in ["uart", "can"] {
        assert_eq!(report["drops"][line], 0, "{report:#}");
    }
    assert_eq!(report["parity_mismatches"], 0, "{report:#}");
    assert_eq!(report["emergencies"], serde_json::json!([]), "{report:#}");
    quantities.iter().for_each(|quantity| quantity.assert_kept(report));
}

/// Adds a row for each quantity, with its value on each board.
fn add_rows(
    result: &mut Measurement,
    quantities: &[Quantity],
    reports: &[(&'static Wiring, Value)],
) {
    for quantity in quantities {
        let of_boards = reports.iter().map(|(board, report)| {
            let measured = quantity.measured(report);
            (board.name, measured.into())
        });
        let name = ("quantity", quantity.name.into());
        let others = [("budget", quantity.budget.into()), ("unit", quantity.unit.into())];
        result.row([name].into_iter().chain(of_boards).chain(others));
    }
}

#[test]
fn budgets_hold_with_all_streams() {
    let boards = products();
    let reports: Vec<(&Wiring, Value)> =
        boards.iter().map(|(board, elf)| (*board, with_all_streams(elf))).collect();
    for (_, report) in &reports {
        // All streams are on and are transmitted.
        let frames = report["uart_frames"].as_u64().expect("a count");
        assert!(frames > 2 * MEASURED + MEASURED / 10, "{report:#}");
        assert_kept(WITH_ALL_STREAMS, report);
    }
    if is_built_here() {
        let mut result = Measurement::new(
            "budgets",
            "Cost of a tick in a walk with all streams on, and its budgets.",
        )
        .measured_by("cargo test -p virtual-board budgets::budgets_hold_with_all_streams");
        for (board, _) in &reports {
            result = result.on_elf(board.program, digest_of(board.program));
        }
        add_rows(&mut result, WITH_ALL_STREAMS, &reports);
        result.assert_current();
    }
}

#[test]
fn full_load_causes_no_long_tick_and_no_late_estimate() {
    for (_, elf) in products() {
        assert_kept(UNDER_FULL_LOAD, &under_full_load(&elf, BRIEFLY, Traffic::Full));
    }
}

#[test]
fn a_tick_that_reports_a_fault_keeps_the_latency() {
    for (_, elf) in products() {
        let report = under_full_load(&elf, BRIEFLY, Traffic::FullWithFaults);
        let emergencies = report["emergencies"].as_array().map_or(0, Vec::len);
        assert!(emergencies > 1, "{report:#}");
        LATENCY.assert_kept(&report);
        LATE_TICKS.assert_kept(&report);
    }
}

#[test]
#[ignore = "full: 20 s of full load on each board"]
fn full_load_causes_no_long_tick_in_its_rare_moments() {
    let boards = products();
    let reports = boards.iter().map(|(board, elf)| {
        (*board, under_full_load(elf, MEASURED_UNDER_FULL_LOAD, Traffic::Full))
    });
    let reports: Vec<(&Wiring, Value)> = reports.collect();
    for (board, report) in &reports {
        println!("{}: {:#}", board.name, report["longest_ticks"]);
        assert_kept(UNDER_FULL_LOAD, report);
    }
    let mut result = Measurement::new(
        "full-load",
        "Longest ticks and latencies in 20 s of full load: the streams of four feet on the bus, a SYNC every 10 ms, and \
         requests over both lines, which are served first.",
    )
    .measured_by("cargo test -p virtual-board budgets::full_load -- --ignored");
    add_rows(&mut result, UNDER_FULL_LOAD, &reports);
    let programs: Vec<&str> = boards.iter().map(|(board, _)| board.program).collect();
    assert_reproduced_on(&programs, result);
}

#[test]
fn request_floods_delay_an_estimate_by_three_frames_at_most() {
    const MILLISECOND: u64 = time::PER_SECOND / 1000;
    const ESTIMATE: u32 = 0x191;
    let elf = product();
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
    // An estimate may wait for the frame on the bus and for a SYNC, and then takes its own time: at most 135 bits each.
    let longest = times.windows(2).map(|pair| pair[1] - pair[0]).max();
    let longest = time::to_us(longest.expect("estimates"));
    println!("{answers} answers; at most {longest:.0} µs from an estimate to the next");
    assert!(longest < 1_000.0 + 3.0 * 135.0, "{longest} µs");
    assert_eq!(board.resets(), []);
}
