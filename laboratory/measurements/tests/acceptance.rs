//! The document of an acceptance shows its limits beside the figures of a healthy foot on the virtual board.

use feet::foot::accept::LimitedQuantity;
use feet::foot::accept::figure::LIMITS;
use host_tests::committed::assert_block;
use results::tables::origin;
use results::{Figures, Stored, rounded};

#[test]
fn the_document_lists_every_limit_of_an_acceptance() {
    let result = Stored::read("acceptance").expect("a result");
    let rows = result.rows();
    let mut block = String::from(
        "| step | quantity | unit | limits | virtual board | limits from |\n|---|---|---|---|---|---|\n",
    );
    for limit in LIMITS {
        let LimitedQuantity { step, name, unit, source, .. } = limit;
        let (step, range) = (step.name(), limit.range());
        let is_this = |row: &&Figures| {
            row.text("step").ok() == Some(step) && row.text("quantity").ok() == Some(name)
        };
        let row = rows.iter().find(is_this).unwrap_or_else(|| panic!("no figure of {name}"));
        // Counts have no decimals.
        let value = rounded(row.number("value").expect("a value"), 3);
        block += &format!("| {step} | {name} | {unit} | {range} | {value} | {source} |\n");
    }
    block += &format!("\n{}\n", origin(&result, "docs/guide/acceptance.md").expect("an origin"));
    assert_block("docs/guide/acceptance.md", "acceptance", &block);
}
