//! The program that measures a new board passes on a healthy board, and names the defects of faulty boards.

use std::cell::Cell;
use std::rc::Rc;

use crate::common::{build_bring_up, options, run};
use lsm6dsox::sim::{PartFault, Stimulus};
use virtual_board::emulator::board::{Board, BoardOptions, Injection};
use virtual_board::emulator::chip::Crystal;
use virtual_board::emulator::part::can::BusFault;
use virtual_board::emulator::part::rcc::ResetCause;
use virtual_board::emulator::wiring::Wiring;

/// Longest time of a report, ms.
const REPORT_MS: u64 = 40_000;

/// Report of a board after a change, as its lines.
fn report(wiring: &Wiring, change: impl FnOnce(&mut Board)) -> Vec<String> {
    let mut board = boot(wiring, options());
    change(&mut board);
    lines(&mut board)
}

fn boot(wiring: &Wiring, options: BoardOptions) -> Board {
    let elf = std::fs::read(build_bring_up(wiring)).expect("it was built");
    Board::with_motion(&elf, options, |_| Stimulus::REST).expect("it fits")
}

/// Lines of the serial line until the last of a report.
fn lines(board: &mut Board) -> Vec<String> {
    let mut text = String::new();
    for _ in 0..REPORT_MS / 100 {
        run(board, 100);
        text.extend(board.take_uart().iter().map(|timed| char::from(timed.byte)));
        if text.contains("starts again") {
            break;
        }
    }
    text.lines().map(str::to_owned).collect()
}

/// Lines that do not pass, each with its name and verdict.
fn troubles(lines: &[String]) -> Vec<&str> {
    let lines = lines.iter().map(String::as_str);
    lines.filter(|line| line.contains("FAIL") || line.contains("not tested:")).collect()
}

/// Asserts that exactly these lines do not pass: the beginning of each, and a part of its verdict.
fn assert_troubles(lines: &[String], expected: &[[&str; 2]]) {
    let found = troubles(lines);
    assert_eq!(found.len(), expected.len(), "{lines:#?}");
    for (line, [name, part]) in found.iter().zip(expected) {
        assert!(line.starts_with(name) && line.contains(part), "{lines:#?}");
    }
}

/// Asserts that a board without a defect passes every measurement.
fn assert_healthy(wiring: &Wiring) {
    let lines = report(wiring, |_| ());
    assert_troubles(&lines, &[]);
    let last = lines.last().expect("a summary");
    assert!(last.starts_with("passed 23, failed 0, not tested 0"), "{}: {last}", wiring.name);
    assert_board(&lines, wiring);
}

/// Lines about the board after the measurements, as `footfall foot … report` names them.
const OF_BOARD: [&str; 13] = [
    "device", "version", "crash", "reset", "clock", "options", "chip", "sensor", "bus", "noise",
    "mean", "supply", "costs",
];

/// Measurements, lines about the board, and the summary.
const LINES: usize = 23 + OF_BOARD.len() + 1;

/// Asserts that the board is described before the summary.
fn assert_board(lines: &[String], wiring: &Wiring) {
    assert_eq!(lines.len(), LINES, "{lines:#?}");
    let described = &lines[23..LINES - 1];
    let names: Vec<&str> = described.iter().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(names, OF_BOARD);
    let device = format!("device   bring-up, {} board, serial number 0x", wiring.name);
    assert!(described[0].starts_with(&device), "{described:#?}");
    assert_eq!(described[2], "crash    none");
}

#[test]
fn healthy_board_passes_every_measurement() {
    assert_healthy(Wiring::reference());
}

#[test]
#[ignore = "full: all measurements on the other boards"]
fn other_healthy_boards_pass_every_measurement() {
    for wiring in Wiring::all().iter().skip(1) {
        assert_healthy(wiring);
    }
}

#[test]
#[ignore = "full: the measurements of a new board, twice"]
fn any_byte_starts_the_measurements_again() {
    let mut board = boot(Wiring::reference(), options());
    assert_eq!(lines(&mut board).len(), LINES);
    board.push_uart(b"x");
    assert_eq!(lines(&mut board).len(), LINES);
    let causes: Vec<_> = board.resets().iter().map(|(_, cause)| *cause).collect();
    assert_eq!(causes, [ResetCause::Software]);
}

/// A chip from the factory has no brown-out level.
#[test]
fn missing_crystal_and_brown_out_level_are_named() {
    for (crystal, part) in [
        (Crystal::Hertz(12_000_000), "FAIL: another crystal"),
        (Crystal::Missing, "FAIL: it does not start"),
    ] {
        let mut options = options();
        (options.chip.crystal, options.chip.brown_out_level) = (crystal, 0);
        let mut board = boot(Wiring::reference(), options);
        let lines = lines(&mut board);
        let level = ["brown-out level", "not tested"];
        let can = ["CAN", "not tested: it needs the crystal"];
        assert_troubles(&lines, &[["crystal", part], level, can]);
    }
}

#[test]
#[ignore = "full: all measurements once more"]
fn crystal_that_cannot_be_measured_is_named_and_used() {
    let mut options = options();
    options.chip.crystal = Crystal::NotMeasurable;
    let mut board = boot(Wiring::reference(), options);
    assert_troubles(&lines(&mut board), &[["crystal", "not tested: it starts"]]);
}

#[test]
fn faults_of_sensor_and_bus_are_named() {
    let report = |injections: &[Injection]| {
        report(Wiring::reference(), |board| {
            injections.iter().for_each(|one| board.inject(*one));
        })
    };
    let dead = report(&[Injection::Sensor(PartFault::MisoStuckLow)]);
    assert_troubles(
        &dead,
        &[
            ["sensor's bus, 1.25 MHz", "1000 of 1000 wrong"],
            ["sensor's bus, 2.5 MHz", "FAIL: wires of SPI"],
            ["sensor's bus, 5 MHz", "FAIL: wires of SPI"],
            ["sensor's bus, 10 MHz", "not tested"],
            ["sensor's clock", "0 kHz without error"],
            ["sensor ", "FAIL: see the lines of the bus"],
        ],
    );
    // The loop inside the chip disregards the bus, even one that is never idle.
    let lost = Injection::Sensor(PartFault::DataReadyLost);
    let no_edges = report(&[lost, Injection::Bus(BusFault::Shorted)]);
    assert_troubles(
        &no_edges,
        &[
            ["interval of INT1", "FAIL: the wire from INT1"],
            ["jitter of INT1", "FAIL"],
            ["ticks without INT1", "1000 of 1000"],
            ["polarity of INT1", "not tested: no edge came"],
            ALONE,
        ],
    );
    let weak = report(&[
        Injection::Supply(2_900),
        Injection::Sensor(PartFault::SdoDelay { ns: 60 }),
        Injection::Sensor(PartFault::PinsInverted),
    ]);
    let late = ["sensor's bus, 10 MHz", "1000 of 1000 wrong"];
    let inverted = ["polarity of INT1", "FAIL: INT1 is inverted"];
    assert_troubles(&weak, &[["supply", "2.90 V"], late, inverted]);
}

/// Line of a bus without another node.
const ALONE: [&str; 2] = ["CAN with another node", "FAIL: one node at 1 Mbit/s"];

#[test]
#[ignore = "full: all measurements once more"]
fn part_with_another_scale_and_a_bus_without_nodes_are_named() {
    let elf = std::fs::read(build_bring_up(Wiring::reference())).expect("it was built");
    let half = Stimulus {
        specific_force: Stimulus::REST.specific_force.map(|force| force / 2.0),
        ..Stimulus::REST
    };
    let mut board = Board::with_motion(&elf, options(), move |_| half).expect("it fits");
    board.inject(Injection::Bus(BusFault::NoAcknowledge));
    let force = ["force at rest", " 4.9"];
    assert_troubles(&lines(&mut board), &[force, ALONE]);
}

/// Misreads occur only at 5 MHz. The reference board starts there, the Feather at half of it.
#[test]
#[ignore = "full: all measurements once more"]
fn fastest_clock_without_error_is_named_and_used() {
    let late = Injection::Sensor(PartFault::SdoDelay { ns: 105 });
    for (wiring, is_enough) in Wiring::all().iter().zip([false, true]) {
        let lines = report(wiring, |board| board.inject(late));
        let full = ["sensor's bus, 5 MHz", "1000 of 1000 wrong"];
        let limit = ["sensor's bus, 10 MHz", "not tested"];
        let clock = ["sensor's clock", "2500 kHz without error"];
        if is_enough {
            assert_troubles(&lines, &[full, limit]);
        } else {
            assert_troubles(&lines, &[full, limit, clock]);
        }
    }
}

/// The sensor feels a vibration while frames are sent.
#[test]
#[ignore = "full: all measurements once more"]
fn noise_of_a_busy_bus_is_named() {
    let elf = std::fs::read(build_bring_up(Wiring::reference())).expect("it was built");
    let is_busy = Rc::new(Cell::new(false));
    let felt = Rc::clone(&is_busy);
    let motion = move |seconds: f64| {
        let mut felt_now = Stimulus::REST;
        if felt.get() {
            felt_now.specific_force[0] += 0.05 * (seconds * 400.0).sin();
        }
        felt_now
    };
    let mut board = Board::with_motion(&elf, options(), motion).expect("it fits");
    let mut text = String::new();
    while !text.contains("starts again") {
        run(&mut board, 10);
        is_busy.set(board.take_can().len() > 10);
        text.extend(board.take_uart().iter().map(|timed| char::from(timed.byte)));
    }
    let lines: Vec<String> = text.lines().map(str::to_owned).collect();
    assert_troubles(&lines, &[["noise with a busy CAN", "FAIL: keep it still"]]);
}
