//! The schemas in `docs/schemas` match those of the program, and so do the columns in `docs/batch.md`.

use analysis::batch::BatchRow;
use clap::ValueEnum;
use footfall::schema::SchemaKind;
use host_tests::committed::{assert_block, assert_current, workspace};
use serde_json::Value;

#[test]
fn the_documented_schemas_match_the_program() {
    for &kind in SchemaKind::value_variants() {
        let path = workspace().join(format!("docs/schemas/{}.json", kind.name()));
        assert_current(&path, &kind.text().expect("all features"));
    }
}

#[test]
fn the_documented_summary_columns_match_the_program() {
    let schema: Value =
        serde_json::from_str(&SchemaKind::Batch.text().expect("all features")).expect("JSON");
    let meanings = &schema["$defs"]["Row"]["properties"];
    let mut table = "| column | type | meaning |\n|---|---|---|\n".to_owned();
    for column in BatchRow::columns() {
        let name = column.name();
        let kind = match format!("{:?}", column.data_type()).as_str() {
            "Utf8" => "text",
            "Int64" => "int64",
            "Float64" => "double",
            "Float32" => "float",
            "Boolean" => "bool",
            list if list.starts_with("List") => "list of texts",
            other => panic!("{name} is a {other}"),
        };
        let meaning = meanings[name]["description"]
            .as_str()
            .expect("a description");
        table += &format!("| `{name}` | {kind} | {meaning} |\n");
    }
    assert_block("docs/batch.md", "columns", &table);
}
