//! The fault matrix: each row run on the product's ELF, judged, and the table of the README made
//! from it.

mod common;

use common::{is_built_here, product};
use host_tests::committed::assert_block;
use virtual_board::corner::Corner;
use virtual_board::scenario;

#[test]
fn every_fault_is_told_and_recovered_from_and_no_frame_says_stable_without_data() {
    let Some(elf) = product() else { return };
    let rows = scenario::matrix(&elf, Corner::Typical).expect("every scenario runs");
    let mut table = String::from(scenario::HEAD);
    let mut wrong = Vec::new();
    for (scenario, outcome) in &rows {
        table += &scenario::row(scenario, outcome);
        wrong.extend(outcome.objections.iter().cloned());
    }
    assert!(wrong.is_empty(), "{table}\n{wrong:#?}");
    assert!(rows.len() >= 55, "{} rows", rows.len());
    if is_built_here() {
        assert_block("virtual-board/README.md", "faults", &table);
    }
}

#[test]
fn every_fault_has_a_name_of_its_own() {
    let mut names: Vec<&str> = scenario::ALL.iter().map(|found| found.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), scenario::ALL.len());
}
