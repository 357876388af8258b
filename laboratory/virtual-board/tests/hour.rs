//! An hour of virtual time with everything enabled.

use std::time::Instant;

use crate::common::product;
use crate::digest::assert_reproduced_on;
use gait::GaitName;
use results::{Measurement, rounded};
use serde_json::{Value, json};
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::motion;
use virtual_board::product::report::{self, RunOptions};
use virtual_board::product::traffic::Traffic;
use wire::board::EDGE_TO_MAILBOX_US;

const SECONDS: u64 = 3600;

/// Ticks without a sample while the sensor starts.
const STARTING: u64 = 100;

#[test]
#[ignore = "full: an hour of virtual time, half an hour"]
fn an_hour_has_no_late_tick_no_drop_and_the_hosts_bits() {
    let elf = product();
    let gait = motion::gait(GaitName::Walk, SECONDS as f64, 1);
    let mut board =
        Board::with_motion(&elf, BoardOptions::default(), gait).expect("it fits the flash");
    let run = RunOptions { milliseconds: SECONDS * 1000, traffic: Traffic::Full };
    let began = Instant::now();
    let report = report::run(&mut board, &run).expect("it runs");
    let factor = SECONDS as f64 / began.elapsed().as_secs_f64();
    println!("{report:#}\n{factor:.1} times real time");
    for never in ["late_ticks", "parity_mismatches"] {
        assert_eq!(report[never], 0, "{never}");
    }
    for line in ["can", "uart"] {
        assert_eq!(report["drops"][line], 0, "{line}");
    }
    // Nothing is wrong, so no fault is reported.
    assert_eq!(report["emergencies"], json!([]));
    let count = |value: &Value| value.as_u64().unwrap_or(0);
    let ticks = SECONDS * 1000 - STARTING;
    assert!(count(&report["ticks"]) >= ticks);
    assert!(count(&report["missed_ticks"]) < STARTING);
    for line in ["can", "uart"] {
        assert!(count(&report["parity_compared"][line]) >= ticks, "{line}");
    }
    let longest_us = report["drdy_to_can_us"]["max"].as_f64().expect("a time");
    assert!(longest_us <= f64::from(EDGE_TO_MAILBOX_US), "{longest_us} µs");
    assert_reproduced_on(&[Wiring::reference().program], measurement(&report));
}

/// Whole figures of the result, each with its place in the report.
const FIGURES: [(&str, &str); 17] = [
    ("ticks", "/ticks"),
    ("late_ticks", "/late_ticks"),
    ("edge_to_mailbox_us_median", "/drdy_to_can_us/median"),
    ("edge_to_mailbox_us_99_9_percent", "/drdy_to_can_us/p99_9"),
    ("edge_to_mailbox_us_longest", "/drdy_to_can_us/max"),
    ("instructions_per_tick_median", "/instructions_per_tick/median"),
    ("instructions_per_tick_longest", "/instructions_per_tick/max"),
    ("cycles_per_tick_median", "/estimated_cycles_per_tick/median"),
    ("cycles_per_tick_longest", "/estimated_cycles_per_tick/max"),
    ("deepest_stack_bytes", "/stack_high_water_bytes"),
    ("frames_over_serial_line", "/uart_frames"),
    ("frames_over_can", "/can_frames"),
    ("dropped_over_serial_line", "/drops/uart"),
    ("dropped_over_can", "/drops/can"),
    ("compared_over_serial_line", "/parity_compared/uart"),
    ("compared_over_can", "/parity_compared/can"),
    ("different", "/parity_mismatches"),
];

fn measurement(report: &Value) -> Measurement {
    let mut result = Measurement::new(
        "hour",
        "An hour of a walk under full load: all streams on, the streams of three more feet on the bus, a SYNC every 10 ms, \
         and requests over both lines. Cycles, times and load are estimates.",
    )
    .measured_by("cargo test -p virtual-board hour:: -- --ignored");
    let measured = |place| report.pointer(place).and_then(Value::as_f64).expect("it is measured");
    for (key, place) in FIGURES {
        result = result.value(key, measured(place).round() as u64);
    }
    result.value("processor_load_percent", rounded(measured("/cpu_load_percent"), 1))
}
