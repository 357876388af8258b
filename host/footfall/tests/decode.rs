//! Tests of `footfall decode` as a program: output, files and exit codes.

use std::fs;
use std::process::{Command, Stdio};

use crate::common::{Bench, read, standing, text};

#[test]
fn demo_output_is_decoded() {
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
fn invalid_log_line_is_reported_and_skipped() {
    let bench = Bench::with("x.log", "(1.000000) can0 711#00\n(1.000000) can0 191#0\n");
    let output = bench.run("decode x.log");
    assert!(output.status.success());
    let said = text(&output.stderr);
    assert!(said.starts_with("footfall: x.log, line 2: "), "{said}");
    assert!(text(&output.stdout).contains("problems malformed_lines 1"));
}

#[test]
fn decode_error_names_the_file() {
    let bench = Bench::with("walk.csv", standing());
    let said = bench.error("decode walk.csv");
    assert!(
        said.starts_with("footfall: walk.csv is neither a log of candump"),
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
fn executable_is_rejected_as_input() {
    // Zeros look like the ends of frames.
    let program: Vec<u8> = (0..100_000_u32)
        .map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8 & if k % 3 == 0 { 0 } else { 0xFF })
        .collect();
    let said = Bench::with("program", program).error("decode program --json");
    assert!(
        said.starts_with("footfall: program is neither a log of candump"),
        "{said}"
    );
}

#[test]
fn node_option_adds_a_foot_with_another_id() {
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
    let said = bench.error("decode x.log --json --output -");
    assert!(said.contains("standard output takes one result"), "{said}");
}

#[test]
fn closed_stdout_is_not_an_error() {
    // More than the capacity of a pipe.
    let bench = Bench::with("x.log", log(10_000));
    for arguments in [
        "decode x.log --output -",
        "decode x.log",
        "decode x.log --json",
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_footfall"))
            .args(arguments.split_whitespace())
            .current_dir(&bench.directory)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the command that was just built");
        // The reader closes the pipe before anything is read.
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert!(output.status.success(), "{arguments}: {output:?}");
        assert_eq!(text(&output.stderr), "", "{arguments}");
    }
}

#[test]
fn table_with_wrong_extension_is_rejected() {
    let bench = Bench::with("x.log", log(5));
    for name in ["rows.mcap", "rows.csv.gz", "rows"] {
        let said = bench.error(&format!("decode x.log --output {name}"));
        assert_eq!(
            said,
            format!(
                "footfall: {name} cannot be written: tables are CSV or Parquet, so the name must end in .csv or .parquet\n"
            )
        );
    }
    assert_eq!(bench.files(), ["x.log"]);
    bench.stdout("decode x.log --output rows.CSV");
    bench.stdout("decode x.log --output /dev/null");
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
        (
            " --names 1=FR,0x11=left",
            &["left 17", "left 17", "FR 1", "FR 1"],
        ),
        (" --node 1", &["FL 17", "FL 17", " 1", " 1"]),
    ] {
        bench.stdout(&format!("decode x.log --output rows.csv{options}"));
        let rows = read(&bench.path("rows.csv"));
        let feet: Vec<_> = rows.lines().skip(1).map(foot).collect();
        assert_eq!(feet, expected, "{options}");
    }
    for (names, said) in [
        ("FL", "such as 1=FL"),
        ("1=", "1 to 32 letters"),
        ("0=FL", "write a node id"),
        ("1=F L", "1 to 32 letters"),
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

/// Returns a log in which feet swing from 1 s to 1.4 s of three seconds; their clocks are 250 ms before that of the log.
fn steps(feet: &[&str]) -> String {
    let mut log = String::new();
    for k in 0..3000_u32 {
        let swings = (1000..1400).contains(&k);
        // Stable in 16 bits, tangential and vertical in 8; the state is unknown.
        let (p, status) = if swings {
            ("02004D02", "10")
        } else {
            ("F0F0F5FA", "18")
        };
        let [low, high, ..] = (100 * k + 25_000).to_le_bytes();
        let (seconds, micros, sequence) = (5 + k / 1000, k % 1000 * 1000 + 300, k % 256);
        for id in feet {
            log += &format!(
                "({seconds}.{micros:06}) can0 {id}#{p}{low:02X}{high:02X}{sequence:02X}{status}\n"
            );
        }
    }
    log
}

#[test]
fn events_of_a_log_are_those_that_the_foot_decided() {
    let bench = Bench::with("x.log", steps(&["191"]));
    let said = bench.stdout("decode x.log --events events.csv --output rows.csv");
    assert!(
        said.ends_with("\nwritten  rows.csv\nwritten  events.csv\n"),
        "{said}"
    );
    let peak = read(&bench.path("rows.csv"));
    let peak = peak.lines().nth(1).and_then(|row| row.split(',').nth(9));
    let peak = peak.expect("a probability").to_owned();
    let events = read(&bench.path("events.csv"));
    assert_eq!(
        events,
        format!(
            "t,event,duration,p_peak,distance\n\
             6.000300,lift_off,,{peak},\n\
             6.400300,touch_down,,{peak},\n"
        )
    );
    assert_eq!(bench.stdout("decode x.log --events -"), events);
}

#[test]
fn events_and_plot_of_a_log_name_its_feet() {
    let bench = Bench::with("x.log", steps(&["191", "192"]));
    bench.stdout("decode x.log --events events.csv --plot page.html");
    let events = read(&bench.path("events.csv"));
    assert!(events.starts_with("foot,t,event,duration,p_peak,distance\nFL,6.000300,lift_off,"));
    assert!(events.contains("\nFR,6.000300,lift_off,"), "{events}");
    assert_eq!(events.lines().count(), 5, "{events}");
    let page = read(&bench.path("page.html"));
    assert!(page.contains("<title>x FL, x FR</title>"));
    assert_eq!(page.matches("\"samples\":3000,\"rate\":1000,").count(), 2);
    assert_eq!(page.matches("\"touch_down\":1,\"lift_off\":1,").count(), 2);
    bench.stdout("decode x.log --plot walk.svg");
    for foot in ["FL", "FR"] {
        let name = format!("walk-x_{foot}.svg");
        assert!(read(&bench.path(&name)).starts_with("<svg"), "{name}");
    }
}

#[test]
fn feet_of_one_name_differ_by_interface_in_events() {
    let one = steps(&["191"]);
    let bench = Bench::with("x.log", one.clone() + &one.replace(" can0 ", " can1 "));
    let events = bench.stdout("decode x.log --events -");
    for foot in ["can0 FL", "can1 FL"] {
        let of_foot = events.lines().filter(|row| row.starts_with(foot));
        assert_eq!(of_foot.count(), 2, "{events}");
    }
}

#[test]
fn events_of_a_log_without_times_are_on_the_clock_of_the_foot() {
    let line = |line: &str| {
        let frame = line.split(' ').nth(2).expect("a frame");
        let (id, bytes) = frame.split_once('#').expect("data");
        let bytes: Vec<&str> = (0..8).map(|k| &bytes[2 * k..2 * k + 2]).collect();
        format!("  can0  {id}   [8]  {}\n", bytes.join(" "))
    };
    let log: String = steps(&["191", "192"]).lines().map(line).collect();
    let bench = Bench::with("x.log", log);
    let events = bench.stdout("decode x.log --events -");
    for expected in ["\nFL,1.250000,lift_off,", "\nFR,1.650000,touch_down,"] {
        assert!(events.contains(expected), "{events}");
    }
}

#[test]
fn events_of_the_demo_are_those_of_its_replay() {
    let bench = Bench::new();
    bench.stdout("demo --out walk");
    bench.stdout("replay walk/samples.csv --events replayed.csv");
    let events = |file: &str| -> Vec<String> {
        let table = read(&bench.path(file));
        let rows = table.lines().skip(1);
        let name = |row: &str| row.split(',').nth(1).expect("an event").to_owned();
        rows.map(name).collect()
    };
    let replayed = events("replayed.csv");
    assert_eq!(replayed.len(), 32);
    for file in ["can.log", "uart.bin"] {
        bench.stdout(&format!(
            "decode walk/{file} --events decoded.csv --plot walk.svg"
        ));
        assert_eq!(events("decoded.csv"), replayed, "{file}");
        let picture = read(&bench.path("walk.svg"));
        assert!(picture.contains("state: swing"), "{file}");
    }
}

#[test]
fn result_that_cannot_be_written_is_rejected_before_decoding() {
    let bench = Bench::with("x.log", log(5));
    for (options, said) in [
        (
            "--events e.txt",
            "tables are CSV, so the name must end in .csv",
        ),
        ("--plot p.pdf", "pictures are SVG or pages"),
        ("--events x.log", "it is the recording itself"),
        (
            "--events r.csv --output r.csv",
            "it is named for two results",
        ),
        ("--events - --output -", "standard output takes one result"),
        ("--plot - --json", "standard output takes one result"),
    ] {
        let error = bench.error(&format!("decode x.log {options}"));
        assert!(error.contains(said), "{options}: {error}");
    }
    assert_eq!(bench.files(), ["x.log"]);
}

#[cfg(feature = "parquet")]
#[test]
fn table_of_rows_is_the_same_in_parquet() {
    use recordings::parquet_rows;
    use serde_json::{Map, Value};

    let bench = Bench::new();
    bench.stdout("demo --out walk");
    for file in ["can.log", "uart.bin"] {
        bench.stdout(&format!("decode walk/{file} --output rows.csv"));
        let said = bench.stdout(&format!("decode walk/{file} --output rows.parquet"));
        assert!(said.ends_with("written  rows.parquet\n"), "{said}");
        let table = fs::File::open(bench.path("rows.parquet")).expect("a table");
        let rows: Vec<Map<String, Value>> = parquet_rows::read(table).expect("rows");
        let csv = read(&bench.path("rows.csv"));
        let mut lines = csv.lines();
        let columns: Vec<_> = lines.next().expect("a header").split(',').collect();
        assert_eq!(lines.clone().count(), rows.len());
        for (line, row) in lines.zip(&rows) {
            for (column, cell) in columns.iter().zip(line.split(',')) {
                let is_same = match row.get(*column).unwrap_or(&Value::Null) {
                    Value::Null => cell.is_empty(),
                    Value::String(text) => text == cell,
                    Value::Number(number) => {
                        number.as_f64().map(|number| number as f32) == cell.parse().ok()
                    }
                    _ => false,
                };
                assert!(is_same, "{file}: {column} {cell}\n{row:?}");
            }
        }
    }
}
