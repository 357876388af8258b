//! The fault matrix: each row run on the product's ELF, judged, and the table of the README made
//! from it.

mod common;

use common::{product, readme};
use host_tests::committed::assert_block;
use virtual_board::scenario::{self, Invalid, Outcome, Scenario};

/// What is wrong with a row, beyond what its table says.
fn objections(scenario: &Scenario, outcome: &Outcome) -> Vec<String> {
    let mut all = Vec::new();
    let mut object = |wrong: bool, text: String| {
        if wrong {
            all.push(format!("{}: {text}", scenario.name));
        }
    };
    object(
        outcome.stable_while_invalid > 0,
        format!("{} frames said stable", outcome.stable_while_invalid),
    );
    object(
        outcome.late_us > Invalid::OLD_MS as f64 * 1000.0,
        format!("a frame said stable {} µs late", outcome.late_us),
    );
    object(
        !outcome.has_told(scenario.tells),
        format!("{:?} was not told", scenario.tells),
    );
    object(
        scenario.invalid != Invalid::Never && outcome.checked == 0,
        "no frame was looked at".into(),
    );
    object(
        outcome.kept[2] > 0,
        format!("settings old, new, other: {:?}", outcome.kept),
    );
    if scenario.name == "time-wrap" {
        object(
            !outcome.steady_clock || outcome.last_sample_us < 1 << 32,
            format!("the clock came to {} µs", outcome.last_sample_us),
        );
    }
    let stays = scenario.name == "no-sensor";
    object(outcome.well == stays, format!("well: {}", outcome.well));
    all
}

#[test]
fn every_fault_is_told_and_recovered_from_and_no_frame_says_stable_without_data() {
    let Some(elf) = product() else { return };
    let rows = scenario::matrix(&elf).expect("every scenario runs");
    let mut table = String::from(scenario::HEAD);
    let mut wrong = Vec::new();
    for (scenario, outcome) in &rows {
        table += &scenario::row(scenario, outcome);
        wrong.extend(objections(scenario, outcome));
    }
    assert!(wrong.is_empty(), "{table}\n{wrong:#?}");
    assert!(rows.len() >= 25, "{} rows", rows.len());
    if std::env::var_os("FOOTFALL_ELF").is_none() {
        assert_block(&readme(), "faults", &table);
    }
}
