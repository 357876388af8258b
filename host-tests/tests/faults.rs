//! The document of faults, flags and rejections matches the table of `footfall explain`, and that of acceptance its
//! limits.

use feet::foot::accept::LimitedQuantity;
use feet::foot::accept::figure::LIMITS;
use feet::remedy::Trouble;
use host_tests::committed::assert_block;
use results::tables::origin;
use results::{Figures, Stored, rounded};

fn table(kind: &str) -> String {
    let all = Trouble::all().filter(|trouble| trouble.kind() == kind);
    match kind {
        "flag" => {
            let row = |trouble: Trouble| {
                let (name, meanwhile) = (trouble.name(), trouble.consequence());
                format!("| `{name}` | {meanwhile} | {} |\n", trouble.remedy())
            };
            let rows: String = all.map(row).collect();
            format!("| flag | meanwhile | what to do |\n|---|---|---|\n{rows}")
        }
        "fault" => {
            let row = |trouble: Trouble| {
                let Trouble::Fault(fault) = trouble else {
                    return String::new();
                };
                let voided = if fault.voids_estimate() { "yes" } else { "" };
                format!(
                    "| {} | {} | {} | {voided} | {} | {} |\n",
                    trouble.code_text(),
                    fault.number(),
                    fault.name(),
                    fault.detail(),
                    trouble.remedy()
                )
            };
            let rows: String = all.map(row).collect();
            format!(
                "| code | number | fault | P is 0 | detail | what to do |\n|---|---|---|---|---|---|\n{rows}"
            )
        }
        _ => {
            let row = |trouble: Trouble| {
                let (code, name) = (trouble.code_text(), trouble.name());
                format!("| {code} | {name} | {} |\n", trouble.remedy())
            };
            let rows: String = all.map(row).collect();
            format!("| code | refusal | what to do |\n|---|---|---|\n{rows}")
        }
    }
}

#[test]
fn the_document_lists_every_fault_flag_and_rejection() {
    for (block, kind) in [("faults", "fault"), ("flags", "flag"), ("refusals", "refusal")] {
        assert_block("docs/reference/faults.md", block, &table(kind));
    }
}

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
