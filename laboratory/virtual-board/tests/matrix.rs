//! The fault matrix: runs each row on the product's ELF, judges it, and compares it with the stored results, which
//! `faults.md` shows. By default one fault of each class runs, once.

use crate::common::{product, products};
use crate::digest::assert_reproduced_on;
use results::Measurement;
use virtual_board::emulator::corner::Corner;
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::scenario::{self, Case, Scenario};

/// Rows to run: the rows that `FOOTFALL_ROWS` names, separated by commas, or all.
fn chosen() -> Vec<&'static Scenario> {
    match std::env::var("FOOTFALL_ROWS") {
        Ok(names) => {
            let row = |name| Scenario::named(name).unwrap_or_else(|| panic!("no row {name}"));
            names.split(',').map(row).collect()
        }
        Err(_) => scenario::ALL.iter().collect(),
    }
}

/// One row of each class of faults, which the default run takes at one phase of the sampling.
const OF_EACH_CLASS: &str = "sensor-reset gyroscope-axis-stuck self-test-on miso-low spi-dma-error data-ready-lost \
    edge-noise crystal-lost bus-shorted uart-break flood-then-sensor load-open flash-corrupted power-cut-erasing \
    hang-at-start hang hard-fault brown-out";

#[test]
fn a_fault_of_each_class_is_reported_and_recovered_from() {
    let elf = product();
    let mut wrong = Vec::new();
    for name in OF_EACH_CLASS.split_whitespace() {
        let row = Scenario::named(name).expect("a row");
        let (first, last, _) = row.variants;
        let case = Case { variant: first.midpoint(last), phase: 0 };
        match row.run(&elf, case, Corner::Typical) {
            Ok(outcome) => wrong.extend(outcome.violations),
            Err(problem) => wrong.push(format!("{name}: {problem}")),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
#[ignore = "full: every row of the fault matrix, 5 minutes"]
fn every_fault_is_reported_and_recovered_from() {
    let elf = product();
    let chosen = chosen();
    let rows = scenario::matrix(&elf, Corner::Typical, &chosen);
    let mut result =
        Measurement::new("faults", "Detection, reports and recovery of each fault of the matrix.")
            .measured_by(
                "cargo test -p virtual-board matrix::every_fault_is_reported_and_recovered_from -- --ignored",
            );
    let mut wrong = Vec::new();
    for (scenario, outcome) in &rows {
        let figures = scenario::figures(scenario, outcome);
        println!("{figures:?}");
        result.row(figures);
        wrong.extend(outcome.violations.iter().cloned());
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    if chosen.len() < scenario::ALL.len() {
        return;
    }
    assert_eq!(rows.len(), scenario::ALL.len());
    assert_reproduced_on(&[Wiring::reference().program], result);
}

/// Rows for boards other than the reference board: the rows that depend on pins, crystal, timer or streams, and one of
/// each other kind. The other rows depend on nothing that differs between the boards.
const OF_OTHER_BOARDS: &str = "miso-low miso-high spi-dma-error spi-hung sensor-reset no-sensor data-ready-lost data-ready-storm \
    edge-glitches edge-noise clock-fast data-line-late-at-start bus-shorted bus-saturated uart-break uart-dma-error \
    uart-receive-dma-error load-open time-wrap no-crystal crystal-lost hard-fault hang power-cut debugger-halt";

#[test]
#[ignore = "full: 25 rows of the fault matrix on each other board, 2 minutes"]
fn other_boards_recover_from_faults_of_their_pins() {
    let names = OF_OTHER_BOARDS.split_whitespace();
    let rows: Vec<&Scenario> = names.map(|name| Scenario::named(name).expect("a row")).collect();
    for (board, elf) in products().into_iter().skip(1) {
        let mut wrong = Vec::new();
        for (_, outcome) in scenario::matrix(&elf, Corner::Typical, &rows) {
            wrong.extend(outcome.violations);
        }
        assert!(wrong.is_empty(), "{}: {wrong:#?}", board.name);
    }
}

#[test]
#[ignore = "full: every row of the fault matrix in the other corners of the chip, 10 minutes"]
fn every_fault_is_survived_in_every_corner_of_the_chip() {
    let elf = product();
    let mut result =
        Measurement::new("corners", "All faults of the matrix in the other corners of the chip.")
            .measured_by(
                "cargo test -p virtual-board matrix::every_fault_is_survived_in_every_corner_of_the_chip -- --ignored",
            );
    let mut wrong = Vec::new();
    for corner in [Corner::Fast, Corner::Slow] {
        let rows = scenario::matrix(&elf, corner, &chosen());
        let violations = rows.iter().flat_map(|(_, outcome)| &outcome.violations);
        let violations: Vec<String> =
            violations.map(|text| format!("{}: {text}", corner.name())).collect();
        result.row([
            ("corner", corner.name().into()),
            ("rows", rows.len().into()),
            ("beyond_their_bounds", violations.len().into()),
        ]);
        wrong.extend(violations);
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    if chosen().len() == scenario::ALL.len() {
        assert_reproduced_on(&[Wiring::reference().program], result);
    }
}
