//! The product's ELF on the board: it starts, measures, sends, survives faults, and is deterministic.

mod common;

use common::{MILLISECOND, boot_product, directory, options, product, run};
use virtual_board::emulator::board::{Board, BoardOptions, Injection};
use virtual_board::emulator::chip::Crystal;
use virtual_board::emulator::part::can::{BusFault, BusFrame, TimedFrame};
use virtual_board::product::motion;
use virtual_board::product::report::{self, RunOptions, TimedStep};
use virtual_board::product::scenario::ScenarioStep;
use virtual_board::product::traffic::Traffic;

/// Function codes of `CANopen`; the node's number is added.
const EMERGENCY: u32 = 0x080;
const ESTIMATE: u32 = 0x180;
const HEARTBEAT: u32 = 0x700;

fn of(frames: &[TimedFrame], function: u32) -> Vec<&TimedFrame> {
    frames
        .iter()
        .filter(|sent| sent.frame.id & !0x7F == function && sent.frame.id & 0x7F != 0)
        .collect()
}

/// Returns whether a frame says "stable": a probability above one half, in the first two bytes of the estimate.
fn stable(frame: &BusFrame) -> bool {
    matches!(frame.data[..], [_, high, ..] if high >= 0x80)
}

#[test]
fn it_sends_estimates_every_millisecond_and_is_stable_at_rest() {
    let Some(elf) = product() else { return };
    let mut board = boot_product(&elf);
    run(&mut board, 2_000);
    assert_eq!(board.resets(), []);
    assert_eq!(board.faults(), []);
    assert!(!board.take_uart().is_empty(), "the serial line is silent");
    let frames = board.take_can();
    assert!(!of(&frames, HEARTBEAT).is_empty(), "no heartbeat");
    let estimates = of(&frames, ESTIMATE);
    let last_second: Vec<_> = estimates
        .iter()
        .filter(|sent| sent.time > 1_000 * MILLISECOND)
        .collect();
    assert!(
        (995..=1005).contains(&last_second.len()),
        "{}",
        last_second.len()
    );
    assert!(last_second.iter().all(|sent| stable(&sent.frame)));
    let offences = {
        let machine = board.cpu().machine();
        machine
            .chip
            .sensor
            .as_ref()
            .map(|sensor| sensor.violations().to_vec())
    };
    assert_eq!(
        offences,
        Some(Vec::new()),
        "registers of the sensor were misused"
    );
}

#[test]
fn two_runs_give_identical_bytes_at_identical_times() {
    let Some(elf) = product() else { return };
    let outcome = || {
        let mut board = boot_product(&elf);
        run(&mut board, 500);
        board.push_uart(b"garbage \x00\x01\x02");
        board.push_can(BusFrame::new(0x000, &[0x80, 0x00]));
        run(&mut board, 500);
        (
            board.take_uart(),
            board.take_can(),
            board.counters(),
            board.exceptions(),
        )
    };
    assert_eq!(outcome(), outcome());
}

#[test]
fn it_recovers_from_bus_off() {
    let Some(elf) = product() else { return };
    let mut board = boot_product(&elf);
    run(&mut board, 1_500);
    board.inject(Injection::Bus(BusFault::Shorted));
    run(&mut board, 200);
    let off = board.cpu().machine().chip.can.off;
    assert!(off, "a shorted bus has to end in bus-off");
    board.take_can();
    board.inject(Injection::Clear);
    run(&mut board, 300);
    let frames = board.take_can();
    assert!(
        of(&frames, ESTIMATE).len() > 200,
        "{} estimates",
        of(&frames, ESTIMATE).len()
    );
    assert!(
        !of(&frames, EMERGENCY).is_empty(),
        "bus-off was not reported"
    );
}

#[test]
fn it_continues_without_acknowledge_and_on_a_full_bus() {
    let Some(elf) = product() else { return };
    for fault in [BusFault::NoAcknowledge, BusFault::Saturated] {
        let mut board = boot_product(&elf);
        run(&mut board, 1_000);
        board.inject(Injection::Bus(fault));
        run(&mut board, 500);
        board.take_can();
        board.take_uart();
        board.inject(Injection::Clear);
        run(&mut board, 500);
        assert_eq!(board.resets(), [], "{fault:?}");
        assert!(
            !board.take_uart().is_empty(),
            "{fault:?}: the serial line stopped"
        );
        assert!(of(&board.take_can(), ESTIMATE).len() > 400, "{fault:?}");
    }
}

#[test]
fn it_measures_without_its_crystal_and_stays_off_the_bus() {
    let Some(elf) = product() else { return };
    let mut options = options();
    options.chip.crystal = Crystal::Missing;
    let still = |_| lsm6dsox::sim::Stimulus::REST;
    let mut board = Board::with_motion(&elf, options, still).expect("it fits the flash");
    run(&mut board, 1_500);
    assert_eq!(board.resets(), []);
    assert!(!board.take_uart().is_empty(), "the serial line is silent");
    assert!(
        board.take_can().is_empty(),
        "1 % of clock error is too much for CAN"
    );
}

fn walking(elf: &[u8], seconds: f64) -> Board {
    let gait = motion::gait(gait::GaitName::Walk, seconds, 1);
    Board::with_motion(elf, BoardOptions::default(), gait).expect("it fits the flash")
}

/// Walks for `seconds`: each estimate has to have the bits of the host.
fn assert_parity(seconds: u64) {
    let Some(elf) = product() else { return };
    let mut board = walking(&elf, seconds as f64);
    let run = RunOptions {
        milliseconds: 1_000 * seconds,
        ..RunOptions::default()
    };
    let report = report::run(&mut board, &run, &directory("parity")).expect("it runs");
    for line in ["uart", "can"] {
        let compared = report["parity_compared"][line].as_u64();
        assert!(
            compared > Some(run.milliseconds - 100),
            "{line}: {report:#}"
        );
    }
    assert_eq!(report["parity_mismatches"], 0, "{report:#}");
    assert_eq!(report["late_ticks"], 0, "{report:#}");
    assert_eq!(report["drops"]["can"], 0, "{report:#}");
    assert_eq!(report["drops"]["uart"], 0, "{report:#}");
    println!("{report:#}");
}

#[test]
fn every_estimate_of_a_walk_has_the_bits_of_the_host() {
    assert_parity(5);
}

#[test]
#[ignore = "full: 60 s of a walk"]
fn every_estimate_of_a_longer_walk_has_the_bits_of_the_host() {
    assert_parity(60);
}

#[test]
fn two_reports_of_the_same_run_are_identical() {
    let Some(elf) = product() else { return };
    let files = [
        "uart.bin",
        "can.log",
        "samples.csv",
        "plot.svg",
        "report.json",
    ];
    let run = RunOptions {
        milliseconds: 1_500,
        faults: vec!["frozen@1000".into()],
        actions: vec![TimedStep {
            ms: 1_000,
            step: ScenarioStep::Inject(Injection::Sensor(lsm6dsox::sim::PartFault::FrozenOutput)),
        }],
        traffic: Traffic::Full,
    };
    let outcome = |name: &str| {
        let out = directory(name);
        report::run(&mut walking(&elf, 2.0), &run, &out).expect("it runs");
        files.map(|file| std::fs::read(out.join(file)).expect("it was written"))
    };
    let (first, second) = (outcome("first"), outcome("second"));
    for ((file, first), second) in files.iter().zip(first).zip(second) {
        assert!(!first.is_empty(), "{file} is empty");
        assert!(first == second, "{file} differs");
    }
}

#[test]
fn the_board_survives_garbage_and_a_command_flood() {
    let Some(elf) = product() else { return };
    let mut board = boot_product(&elf);
    run(&mut board, 1_000);
    board.take_can();
    let garbage: Vec<u8> = (0..20_000_u32)
        .map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8)
        .collect();
    board.push_uart(&garbage);
    for _ in 0..500 {
        // An identity request, then a SYNC.
        board.push_can(BusFrame::new(0x611, &[0x40, 0x18, 0x10, 1, 0, 0, 0, 0]));
        board.push_can(BusFrame::new(0x080, &[]));
    }
    run(&mut board, 1_000);
    println!(
        "{} estimates in the second of the flood",
        of(&board.take_can(), ESTIMATE).len()
    );
    run(&mut board, 1_000);
    assert_eq!(board.resets(), []);
    assert_eq!(board.faults(), []);
    let estimates = of(&board.take_can(), ESTIMATE).len();
    assert!(
        (995..=1005).contains(&estimates),
        "{estimates} estimates in the second after it"
    );
}
