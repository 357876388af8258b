//! The document of faults, flags and rejections matches the table of `footfall explain`.

use feet::remedy::Trouble;
use host_tests::committed::assert_block;

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
