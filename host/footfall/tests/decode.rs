//! Tests of `footfall decode` as a program: output, files and exit codes.

use std::fs;
use std::process::Command;

use crate::common::{Bench, assert_has, cases, read, standing, text};

#[test]
fn demo_output_is_decoded() {
    let bench = Bench::new();
    bench.stdout("demo --output walk");
    let rows = read(&bench.path("walk/samples.csv")).lines().count() - 1;
    for (file, format) in [("can.log", "CAN log"), ("uart.bin", "serial line")] {
        let report = bench.stdout(&format!("decode walk/{file} --output rows.csv --overwrite"));
        assert!(report.starts_with(&format!("{format}: {rows} rows, ")), "{report}");
        assert_has(&report, "\nmissing  0 in 0 gaps\nproblems none\n");
        assert!(report.ends_with("\nwritten  rows.csv\n"), "{report}");
        let table = read(&bench.path("rows.csv"));
        assert!(table.starts_with(
            "t,t_received,t_common,clock,interface,foot,node,segment,sequence,p_stable,"
        ));
        assert_eq!(table.lines().count(), rows + 1);
    }
    let report = bench.json("decode walk/uart.bin");
    assert_eq!(report["frames"]["contact"], rows);
    assert_eq!(report["format"], "uart");
}

#[test]
fn decode_error_names_the_file() {
    let bench = Bench::with("walk.csv", standing());
    fs::write(bench.path("x.log"), "(1.000000) can0 711#00\n").expect("a file");
    for (arguments, expected) in cases(
        "
        walk.csv => footfall: walk.csv is neither a log of candump
        absent.bin --output rows.csv => footfall: absent.bin cannot be read:
        x.log --output x.log => it is the recording itself
        x.log --output rows.csv.gz => tables are CSV, so the name must end in .csv
        ",
    ) {
        bench.refuses(&format!("decode {arguments}"), expected);
    }
    assert!(!bench.path("rows.csv").exists());
}

#[test]
fn node_option_adds_a_foot_with_another_id() {
    let bench = Bench::with("x.log", "(1.000000) can1 1A1#FFFF80800C00071A\n");
    let output = bench.run("decode x.log");
    assert!(text(&output.stdout).starts_with("CAN log: 0 rows\nframes   of_other_nodes 1\n"));
    assert!(text(&output.stderr).ends_with("but node 33 may be one: --node 33\n"));
    for id in ["33", "0x21"] {
        bench.stdout(&format!("decode x.log --node 5 --node {id} --output rows.csv --overwrite"));
        let row = read(&bench.path("rows.csv"));
        let row = row.lines().nth(1).expect("a row");
        assert!(row.starts_with("0.000120,1.000000,1.000000,received,can1,,33,0,7,1,0.5"), "{row}");
    }
    for id in ["0", "128", "foot"] {
        bench.refuses(
            &format!("decode x.log --node {id}"),
            "write a node id, 1 to 127 or 0x01 to 0x7F",
        );
    }
}

/// Returns one contact per millisecond with consecutive sequence numbers.
fn log(count: u32) -> String {
    let line = |k: u32| {
        let [low, high, ..] = (100 * k).to_le_bytes();
        let (seconds, micros, sequence) = (1 + k / 1000, k % 1000 * 1000, k % 256);
        format!("({seconds}.{micros:06}) can0 191#FFFF8080{low:02X}{high:02X}{sequence:02X}1A\n")
    };
    (0..count).map(line).collect()
}

#[test]
fn hyphen_selects_stdin_and_stdout() {
    let bench = Bench::new();
    let output = bench.piped("decode - --output rows.csv", &log(5));
    assert!(output.status.success());
    assert!(text(&output.stdout).starts_with("CAN log: 5 rows, "));
    let rows = read(&bench.path("rows.csv"));

    let output = bench.piped("decode - --output -", &log(5));
    assert!(output.status.success());
    // Rows only; the report goes to standard error.
    assert_eq!(text(&output.stdout), rows);
    assert!(text(&output.stderr).starts_with("CAN log: 5 rows, "));
    assert_eq!(bench.files(), ["rows.csv"]);

    let said = text(&bench.piped("decode -", "").stderr);
    assert_eq!(said, "footfall: standard input is empty\n");
    let output = bench.piped("decode - --output -", "nothing of a log\n");
    assert!(output.stdout.is_empty() && !output.status.success());
    bench.refuses("decode x.log --json --output -", "standard output takes one result");
}

#[test]
fn feet_are_listed_with_name_and_id() {
    let two = log(2) + &log(2).replace(" 191#", " 181#");
    let bench = Bench::with("x.log", two);
    let foot = |row: &str| {
        let cells: Vec<_> = row.split(',').collect();
        format!("{} {}", cells[5], cells[6])
    };
    for (options, expected) in [
        ("", &["FL 17", "FL 17"][..]),
        (" --names 1=FR,0x11=left", &["left 17", "left 17", "FR 1", "FR 1"]),
        (" --node 1", &["FL 17", "FL 17", " 1", " 1"]),
    ] {
        bench.stdout(&format!("decode x.log --output rows.csv --overwrite{options}"));
        let rows = read(&bench.path("rows.csv"));
        let feet: Vec<_> = rows.lines().skip(1).map(foot).collect();
        assert_eq!(feet, expected, "{options}");
    }
    let output = bench.run("decode x.log --output rows.csv --overwrite --names y.bin=FL");
    let said = "footfall: --names y.bin=FL names no line; the lines are x.log\n";
    assert_eq!(text(&output.stderr), said);
    assert!(read(&bench.path("rows.csv")).contains(",FL,17,"), "its name is kept");
    for (names, said) in [
        ("FL", "such as 1=FL"),
        ("1=", "1 to 32 letters"),
        ("0=FL", "write a node id"),
        ("1=F L", "1 to 32 letters"),
        ("33=FL,x.log=FL", "two feet are given the name FL"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_footfall"))
            .args(["decode", "x.log", "--names", names])
            .output()
            .expect("the command that was just built");
        assert!(text(&output.stderr).contains(said), "{output:?}");
    }
}

#[test]
fn foreign_files_are_identified_with_a_remedy() {
    let bench = Bench::with("x.blf", b"LOGG\x90\0\0\0");
    assert_eq!(
        bench.error("decode x.blf"),
        "footfall: x.blf is a BLF log of a CAN bus, which is not read here; convert it with python-can: \
         pip install python-can, then can_logconvert x.blf can.log\n"
    );
}
