//! An hour of virtual time with everything enabled; with `FOOTFALL_UPDATE=1` the result is written to the README.

use std::process::Command;
use std::time::Instant;

use crate::common::digest::assert_block_of;
use crate::common::product;
use gait::GaitName;
use host_tests::committed::workspace;
use serde_json::Value;
use virtual_board::emulator::board::{Board, BoardOptions};
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::motion;
use virtual_board::product::report::{self, RunOptions};
use virtual_board::product::traffic::Traffic;

const SECONDS: u64 = 3600;

/// Ticks without a sample while the sensor starts.
const STARTING: u64 = 100;

/// Output of a program, without its last line break.
fn said_by(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).current_dir(workspace()).args(arguments).output();
    let text = output.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    text.unwrap_or_else(|_| "?".into())
}

#[test]
#[ignore = "full: an hour of virtual time, half an hour"]
fn an_hour_has_no_late_tick_no_drop_and_the_hosts_bits() {
    let commit = said_by("git", &["rev-parse", "--short", "HEAD"]);
    let Some(elf) = product() else { return };
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
    // Nothing is wrong, so no fault is reported.
    assert_eq!(report["emergencies"], serde_json::json!([]));
    for line in ["can", "uart"] {
        assert_eq!(report["drops"][line], 0, "{line}");
    }
    let count = |value: &Value| value.as_u64().unwrap_or(0);
    let ticks = SECONDS * 1000 - STARTING;
    assert!(count(&report["ticks"]) >= ticks);
    assert!(count(&report["missed_ticks"]) < STARTING);
    for line in ["can", "uart"] {
        assert!(count(&report["parity_compared"][line]) >= ticks, "{line}");
    }
    if std::env::var_os("FOOTFALL_UPDATE").is_some_and(|value| value == "1") {
        let table = table(&commit, &report, factor);
        assert_block_of(&[Wiring::reference().program], "hour", &table);
    }
}

/// Rows of the table: name, and text with places in the report, whose numbers are whole but for the load.
const ROWS: &str = "\
ticks | /ticks
late ticks | /late_ticks
frames: serial line, CAN | /uart_frames, /can_frames
drops: serial line, CAN | /drops/uart, /drops/can
estimates compared with the host: serial line, CAN | /parity_compared/uart, /parity_compared/can
of which differ in a bit | /parity_mismatches
instructions in a tick | /instructions_per_tick/median median, /instructions_per_tick/max at most
estimated cycles in a tick | /estimated_cycles_per_tick/median median, /estimated_cycles_per_tick/max at most
estimated load of the processor | /cpu_load_percent %
data-ready edge to CAN mailbox | /drdy_to_can_us/median median, /drdy_to_can_us/max at most µs
deepest stack | /stack_high_water_bytes bytes
";

fn table(commit: &str, report: &Value, factor: f64) -> String {
    let with_numbers = |word: &str| {
        let place = word.trim_end_matches(',');
        let decimals = usize::from(place == "/cpu_load_percent");
        match report.pointer(place).and_then(Value::as_f64) {
            Some(number) => word.replace(place, &format!("{number:.decimals$}")),
            None => word.to_owned(),
        }
    };
    let date = said_by("date", &["+%F"]);
    let mut table = format!("| | |\n|---|---|\n| when | {date} |\n| commit | {commit} |\n");
    for row in ROWS.lines() {
        let words: Vec<String> = row.split(' ').map(with_numbers).collect();
        table += &format!("| {} |\n", words.join(" "));
    }
    format!("{table}| speed on one core | {factor:.1} times real time |\n")
}
