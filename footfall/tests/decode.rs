//! `footfall decode` from outside: what it prints, writes and returns.

mod common;

use std::fs;

use common::{Bench, read, standing, text};

#[test]
fn what_the_demos_foot_sent_can_be_decoded() {
    let bench = Bench::new();
    bench.stdout("demo --out walk");
    let rows = read(&bench.path("walk/samples.csv")).lines().count() - 1;
    for (file, format) in [("can.log", "CAN log"), ("uart.bin", "serial line")] {
        let report = bench.stdout(&format!("decode walk/{file} --output rows.csv"));
        assert!(
            report.starts_with(&format!("{format}: {rows} rows, ")),
            "{report}"
        );
        assert!(
            report.contains("\nmissing  0 in 0 gaps\nproblems none\n"),
            "{report}"
        );
        assert!(report.ends_with("\nwritten  rows.csv\n"), "{report}");
        let table = read(&bench.path("rows.csv"));
        assert!(table.starts_with(
            "t,t_received,t_common,clock,interface,foot,node,segment,sequence,p_stable,"
        ));
        assert_eq!(table.lines().count(), rows + 1);
    }
    let json = bench.stdout("decode walk/uart.bin --json");
    let report: serde_json::Value = serde_json::from_str(&json).expect("one JSON object");
    assert_eq!(report["frames"]["contact"], rows);
    assert_eq!(report["format"], "uart");
}

#[test]
fn a_broken_line_of_a_log_is_named_and_not_fatal() {
    let bench = Bench::with("x.log", "(1.000000) can0 711#00\n(1.000000) can0 191#0\n");
    let output = bench.run("decode x.log");
    assert!(output.status.success());
    let said = text(&output.stderr);
    assert!(said.starts_with("footfall: x.log, line 2: "), "{said}");
    assert!(text(&output.stdout).contains("problems malformed_lines 1"));
}

#[test]
fn what_cannot_be_decoded_is_an_error_that_names_the_file() {
    let bench = Bench::with("walk.csv", standing());
    let said = bench.error("decode walk.csv");
    assert!(
        said.starts_with("footfall: walk.csv is neither a log of CAN frames"),
        "{said}"
    );
    let said = bench.error("decode absent.bin");
    assert!(
        said.starts_with("footfall: absent.bin cannot be read: "),
        "{said}"
    );
    fs::write(bench.path("x.log"), "(1.000000) can0 711#00\n").expect("a file");
    let said = bench.error("decode x.log --output x.log");
    assert!(said.contains("x.log cannot be written"), "{said}");
    let said = bench.error("decode absent.bin --output rows.csv");
    assert!(
        said.starts_with("footfall: absent.bin cannot be read"),
        "{said}"
    );
    assert!(!bench.path("rows.csv").exists());
}

#[test]
fn a_program_is_neither_a_log_nor_a_recording() {
    // Zeros look like the ends of frames.
    let program: Vec<u8> = (0..100_000_u32)
        .map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8 & if k % 3 == 0 { 0 } else { 0xFF })
        .collect();
    let said = Bench::with("program", program).error("decode program --json");
    assert!(
        said.starts_with("footfall: program is neither a log of CAN frames"),
        "{said}"
    );
}

#[test]
fn a_node_with_another_id_is_a_foot_where_it_is_named() {
    let bench = Bench::with("x.log", "(1.000000) can1 1A1#FFFF80800C00071A\n");
    let output = bench.run("decode x.log");
    assert!(text(&output.stdout).starts_with("CAN log: 0 rows\nframes   of_other_nodes 1\n"));
    assert!(text(&output.stderr).ends_with("but node 33 may be one: --node 33\n"));
    for id in ["33", "0x21"] {
        bench.stdout(&format!(
            "decode x.log --node 5 --node {id} --output rows.csv"
        ));
        let row = read(&bench.path("rows.csv"));
        let row = row.lines().nth(1).expect("a row");
        assert!(
            row.starts_with("0.000120,1.000000,1.000000,received,can1,,33,0,7,1,0.5"),
            "{row}"
        );
    }
    for id in ["0", "128", "foot"] {
        let said = bench.error(&format!("decode x.log --node {id}"));
        assert!(
            said.contains("write a node id, 1 to 127 or 0x01 to 0x7F"),
            "{said}"
        );
    }
}
