//! Every board: its program uses the pins of its table, and no other program does.

use crate::common::rig::Rig;
use crate::common::{products, run};
use lsm6dsox::sim::Stimulus;
use serde_json::json;
use virtual_board::emulator::board::{Board, BoardOptions, Injection};
use virtual_board::emulator::wiring::{ChipPin, Wiring};
use virtual_board::product::motion;
use virtual_board::product::report::{self, RunOptions};
use virtual_board::product::scenario::ScenarioStep;
use wire::dictionary::index;
use wire::{Address, Value};

/// Time in which the sensor starts and tests itself, ms.
const STARTING_MS: u64 = 100;

/// Additional time in which a board whose wires are not known tries the faster clock of its bus, ms.
const TRYING_MS: u64 = 100;

/// Boots an ELF on a board, at rest.
fn boot(elf: &[u8], wiring: &'static Wiring) -> Board {
    let options = BoardOptions { wiring: Some(wiring), load: 2000, ..BoardOptions::default() };
    Board::with_motion(elf, options, |_| Stimulus::REST).expect("it fits the flash")
}

/// The text of the misuse that ends a run of half a second, if one does.
fn misuse(elf: &[u8], wiring: &'static Wiring) -> Option<String> {
    let mut board = boot(elf, wiring);
    let failure = board.run_for(crate::common::MILLISECOND * 500).err()?;
    Some(failure.what)
}

#[test]
fn samples_of_every_board_have_times_and_bits_of_their_edges() {
    for (wiring, elf) in products() {
        let gait = motion::gait(gait::GaitName::Walk, 3.0, 1);
        let mut board = Board::with_motion(&elf, BoardOptions::default(), gait).expect("it fits");
        let run = RunOptions { milliseconds: 3_000, ..RunOptions::default() };
        let report = report::run(&mut board, &run).expect("it runs");
        let [compared, over_can] = ["uart", "can"].map(|line| {
            assert_eq!(report["drops"][line], 0, "{}: {line}", wiring.name);
            report["parity_compared"][line].as_u64().expect("a count")
        });
        let measured = report["parity_measured"].as_u64().expect("a count");
        for (name, expected) in
            [("late_ticks", 0.into()), ("resets", json!([])), ("emergencies", json!([]))]
        {
            assert_eq!(report[name], expected, "{}: {name}", wiring.name);
        }
        let machine = board.cpu().machine();
        let sensor = machine.chip.sensor.as_ref().expect("there is a sensor");
        assert_eq!(sensor.violations(), [], "registers were misused");
        let least = compared.min(over_can) + 100;
        assert!(least > run.milliseconds, "{}: {least}", wiring.name);
        // A sample is found by the time of its edge, to 2 µs; there is none until the sensor has started.
        let trying = if wiring.name == "feather" { TRYING_MS } else { 0 };
        assert!(measured + STARTING_MS + trying > compared, "{}: {measured}", wiring.name);
        assert_eq!(report["parity_mismatches"], 0, "{}", wiring.name);
    }
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
    let [(reference, of_reference), (feather, of_feather), ..] = &products[..] else {
        panic!("the programs of two boards");
    };
    // The Feather connects both pins of the reference board's serial line to its supply.
    let wrong = misuse(of_reference, feather).expect("PA9 or PA10 is driven");
    assert!(wrong.contains("the board connects it to a supply"), "{wrong}");
    let wrong = misuse(of_feather, reference).expect("the serial line is elsewhere");
    assert!(wrong.starts_with("USART1_TX is used, and PA9 is not connected to it"));
    for (wiring, elf) in &products {
        assert_eq!(misuse(elf, wiring), None, "{}", wiring.name);
    }
}
