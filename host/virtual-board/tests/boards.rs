//! Every board: its program uses the pins that its table says, and no other program does.

use crate::common::rig::Rig;
use crate::common::{product, products, run};
use lsm6dsox::sim::{PartFault, Stimulus};
use virtual_board::emulator::board::{Board, BoardOptions, Injection};
use virtual_board::emulator::wiring::{ChipPin, Wiring};
use virtual_board::product::motion;
use virtual_board::product::report::{self, RunOptions, TimedStep};
use virtual_board::product::scenario::ScenarioStep;
use virtual_board::product::traffic::Traffic;
use wire::dictionary::index;
use wire::uart::Message;
use wire::{Address, Value};

/// Time in which the sensor starts and tests itself, ms.
const STARTING_MS: u64 = 100;

/// Boots an ELF on a board, at rest.
fn boot(elf: &[u8], wiring: &'static Wiring) -> Board {
    let options = BoardOptions {
        wiring: Some(wiring),
        load: 2000,
        ..BoardOptions::default()
    };
    Board::with_motion(elf, options, |_| Stimulus::REST).expect("it fits the flash")
}

/// The text of the misuse that ends a run of half a second, if one does.
fn misuse(elf: &[u8], wiring: &'static Wiring) -> Option<String> {
    let mut board = boot(elf, wiring);
    let failure = board.run_for(crate::common::MILLISECOND * 500).err()?;
    Some(failure.what)
}

#[test]
fn contacts_arrive_on_both_lines_of_every_board() {
    for (wiring, elf) in products() {
        let mut rig = Rig::of(boot(&elf, wiring));
        rig.run(1_000);
        rig.forget();
        rig.run(1_000);
        let serial = rig.messages.iter();
        let serial = serial.filter(|(_, message)| matches!(message, Message::Contact(_)));
        let counts = [rig.contacts(), serial.count()];
        let is_full = |count: &usize| (995..=1005).contains(count);
        assert!(counts.iter().all(is_full), "{}: {counts:?}", wiring.name);
        assert!(rig.stable().len() > 1_900, "{}", wiring.name);
        assert!(rig.count(0x711) > 0, "{}: no heartbeat", wiring.name);
        assert_eq!((rig.resets(), rig.emergencies()), (vec![], vec![]));
        let machine = rig.board.cpu().machine();
        let sensor = machine.chip.sensor.as_ref().expect("there is a sensor");
        assert_eq!(sensor.violations(), [], "registers were misused");
    }
}

/// Walks for `seconds` with each board, whose samples have to have the times and bits of their edges.
fn assert_samples(seconds: u64) {
    for (wiring, elf) in products() {
        let gait = motion::gait(gait::GaitName::Walk, seconds as f64, 1);
        let mut board = Board::with_motion(&elf, BoardOptions::default(), gait).expect("it fits");
        let run = RunOptions {
            milliseconds: 1_000 * seconds,
            ..RunOptions::default()
        };
        let report = report::run(&mut board, &run).expect("it runs");
        let [compared, over_can] = ["uart", "can"].map(|line| {
            assert_eq!(report["drops"][line], 0, "{}: {line}", wiring.name);
            report["parity_compared"][line].as_u64().expect("a count")
        });
        let measured = report["parity_measured"].as_u64().expect("a count");
        assert_eq!(report["late_ticks"], 0, "{}", wiring.name);
        let least = compared.min(over_can) + 100;
        assert!(least > run.milliseconds, "{}: {least}", wiring.name);
        // A sample is found by the time of its edge, to 2 µs; there is none until the sensor has started.
        assert!(
            measured + STARTING_MS > compared,
            "{}: {measured}",
            wiring.name
        );
        assert_eq!(report["parity_mismatches"], 0, "{}", wiring.name);
    }
}

#[test]
fn samples_of_every_board_have_times_and_bits_of_their_edges() {
    assert_samples(3);
}

#[test]
#[ignore = "full: 60 s of a walk on each board"]
fn samples_of_a_longer_walk_have_times_and_bits_of_their_edges() {
    assert_samples(60);
}

#[test]
fn the_led_blinks_and_the_load_is_analogue_on_every_board() {
    const OUTPUT: u32 = 1;
    const ANALOGUE: u32 = 3;
    for (wiring, elf) in products() {
        let mut board = boot(&elf, wiring);
        let mut levels = Vec::new();
        run(&mut board, 100);
        for _ in 0..200 {
            run(&mut board, 10);
            let machine = board.cpu().machine();
            let ports = &machine.chip.ports;
            let ChipPin { port, number } = wiring.led;
            assert_eq!(ports[port].mode(number), OUTPUT, "{}", wiring.name);
            levels.push(ports[port].level(number));
            let ChipPin { port, number } = wiring.load.0;
            assert_eq!(ports[port].mode(number), ANALOGUE, "{}", wiring.name);
        }
        levels.dedup();
        assert!(levels.len() > 4, "{}: {levels:?}", wiring.name);
    }
}

#[test]
fn the_load_is_read_at_the_input_of_every_board() {
    let from_analog = ScenarioStep::Set(Address::new(index::LOAD_INPUT, 1), Value::U8(1));
    let open = wire::Fault::LoadSensorOpen.code();
    for (wiring, elf) in products() {
        let mut rig = Rig::of(boot(&elf, wiring));
        rig.run(300);
        from_analog.act(&mut rig.board);
        rig.run(500);
        assert!(!rig.emergencies().contains(&open), "{}", wiring.name);
        rig.board.inject(Injection::Load(0));
        rig.run(200);
        assert!(rig.emergencies().contains(&open), "{}", wiring.name);
    }
}

#[test]
fn program_of_another_board_is_noticed_by_its_first_pin() {
    let products = products();
    let [(reference, of_reference), (feather, of_feather)] = &products[..] else {
        return;
    };
    // The Feather connects both pins of the reference board's serial line to its supply.
    let wrong = misuse(of_reference, feather).expect("PA9 or PA10 is driven");
    assert!(
        wrong.contains("the board connects it to a supply"),
        "{wrong}"
    );
    let wrong = misuse(of_feather, reference).expect("the serial line is elsewhere");
    assert!(wrong.starts_with("USART1_TX is used, and PA9 is not connected to it"));
    for (wiring, elf) in &products {
        assert_eq!(misuse(elf, wiring), None, "{}", wiring.name);
    }
}

/// Moves a wire of a board to another pin.
type Move = fn(&mut Wiring, ChipPin);

/// A board with one wire at a pin that no board uses.
fn moved(wiring: &Wiring, change: Move) -> &'static Wiring {
    let mut moved = wiring.clone();
    change(
        &mut moved,
        ChipPin {
            port: 2,
            number: 13,
        },
    );
    Box::leak(Box::new(moved))
}

#[test]
fn a_wire_at_another_pin_fails_the_run() {
    let moves: [(&str, Move); 7] = [
        ("SPI1_SCK", |board, pin| board.sensor_bus[0].pin = pin),
        ("SPI1_MOSI", |board, pin| board.sensor_bus[1].pin = pin),
        ("SPI1_MISO", |board, pin| board.sensor_bus[2].pin = pin),
        ("CAN1_TX", |board, pin| board.can[0].pin = pin),
        ("CAN1_RX", |board, pin| board.can[1].pin = pin),
        ("USART1_TX", |board, pin| board.serial[0].pin = pin),
        ("USART1_RX", |board, pin| board.serial[1].pin = pin),
    ];
    for (wiring, elf) in products() {
        for (function, change) in moves {
            let wrong = misuse(&elf, moved(wiring, change)).unwrap_or_default();
            let expected = format!("{function} is used, and PC13 is not connected to it");
            assert!(wrong.starts_with(&expected), "{}: {wrong}", wiring.name);
        }
    }
}

/// Whether a standing foot is found stable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Estimates {
    Void,
    Valid,
}

#[test]
fn a_select_or_data_ready_wire_at_another_pin_is_a_fault() {
    // Without the data-ready line, samples are read by the timer.
    let wires: [(wire::Fault, Move, Estimates); 2] = [
        (
            wire::Fault::SensorWrongId,
            |board, pin| board.select = pin,
            Estimates::Void,
        ),
        (
            wire::Fault::DataReadyDead,
            |board, pin| board.data_ready = pin,
            Estimates::Valid,
        ),
    ];
    for (wiring, elf) in products() {
        for (fault, change, expected) in wires {
            let mut rig = Rig::of(boot(&elf, moved(wiring, change)));
            rig.run(1000);
            assert!(rig.emergencies().contains(&fault.code()), "{}", wiring.name);
            let estimates = match rig.stable().is_empty() {
                true => Estimates::Void,
                false => Estimates::Valid,
            };
            assert_eq!(estimates, expected, "{}: {fault:?}", wiring.name);
        }
    }
}

#[test]
fn two_reports_of_the_same_run_are_identical() {
    let Some(elf) = product() else { return };
    let run = RunOptions {
        milliseconds: 1_500,
        actions: vec![TimedStep {
            ms: 1_000,
            step: ScenarioStep::Inject(Injection::Sensor(PartFault::FrozenOutput)),
        }],
        traffic: Traffic::Full,
    };
    let outcome = || {
        let gait = motion::gait(gait::GaitName::Walk, 2.0, 1);
        let mut board = Board::with_motion(&elf, BoardOptions::default(), gait).expect("it fits");
        report::run(&mut board, &run).expect("it runs")
    };
    let first = outcome();
    for frames in ["uart_frames", "can_frames"] {
        assert!(first[frames].as_u64() > Some(0), "{frames}");
    }
    assert_eq!(outcome(), first);
}
