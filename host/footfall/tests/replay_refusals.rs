//! Tests of inputs and results rejected by `footfall replay`, and of its error messages.

use std::fs;

use crate::common::{AXES, Bench, read, standing};

/// Returns the error about a file x.csv with this content, without its beginning.
fn complaint(content: impl AsRef<[u8]>, options: &str) -> String {
    let said = Bench::with("x.csv", content).error(&format!("replay x.csv {options}"));
    let said = said
        .strip_prefix("footfall: ")
        .and_then(|said| said.strip_suffix('\n'));
    said.expect("one line of this program").to_owned()
}

/// Returns a table of our columns, and of others after them, with these rows.
fn table(header: &str, rows: &str) -> String {
    format!("{header}\n{rows}")
}

#[test]
fn contents_of_tables_are_rejected_with_their_place() {
    let timed = format!("t,{AXES}");
    for (content, options, expected) in [
        (
            table("time,mood", "0,0\n"),
            "",
            "x.csv has no header that names the six axes, so its format must be given: --format pce-atlas, pce-go1, lcd or csv",
        ),
        (
            "250,0,0,1,0,0,0\n".to_owned(),
            "",
            "x.csv has no header that names the six axes, so its format must be given: --format pce-atlas, pce-go1, lcd or csv",
        ),
        (
            table("t,ax,ay,az,wx,wy,gz", "0,0,0,0,0,0,0\n"),
            "",
            "x.csv, line 1: missing in the header: wz",
        ),
        (
            table("T,AX,AY,AZ,WX,WY,WZ", "0,0,0,0,0,0,0\n"),
            "",
            "x.csv, line 1: missing in the header: ax, ay, az, wx, wy, wz; names are written in lower case",
        ),
        (
            table("t|ax|ay|az|wx|wy|wz", "0,0,0,0,0,0,0\n"),
            "",
            "x.csv, line 1: missing in the header: ax, ay, az, wx, wy, wz; columns are separated by commas, semicolons or tabs, not by '|'",
        ),
        (
            table(&format!("{AXES},ay"), "0,0,0,0,0,0,0\n"),
            "",
            "x.csv, line 1, column 7 (ay): this name stands in the header twice",
        ),
        (
            "0,0,0,0,0,0,0,0,0,0,0,0,1\n0,0,0\n".to_owned(),
            "--format pce-atlas",
            "x.csv, line 2: 3 columns where 13 are expected",
        ),
        (
            table(AXES, "0,0,0,0,0,0,0\n"),
            "--sample-rate 100",
            "x.csv, line 2: 7 columns where 6 are expected",
        ),
        (
            table(AXES, "0,0,0,0,0,0\n0,0,1.2.3,0,0,0\n").replace('\n', "\r\n"),
            "",
            "x.csv, line 3, column 3 (az): \"1.2.3\" is not a number",
        ),
        // Comments count as lines.
        (
            format!("# one\n{AXES}\n# three\n\n0,0,0,0,0,0\n#\n0,0,x,0,0,0\n"),
            "--sample-rate 100",
            "x.csv, line 7, column 3 (az): \"x\" is not a number",
        ),
        (
            table(AXES, "0,0,0, ,0,0\n"),
            "",
            "x.csv, line 2, column 4 (wx): blank where a number is needed",
        ),
        // Numbers are shown as they were written.
        (
            table(&timed, "1e300,0,0,0,0,0,0\n"),
            "",
            "x.csv, line 2, column 1 (t): 1e300 is no time in s: -4e9 to 4e9 is expected",
        ),
        (
            standing().replace(",50,1\n", ",50,1e300\n"),
            "",
            "x.csv, line 2, column 9 (label): label 1e300 where 0 (not stable) or 1 (stable) is expected",
        ),
        (
            "1,0,0,1,0,0,0\n1,,,,,,\n1,0,0,1,0,0,0\n".to_owned(),
            "--format pce-go1",
            "x.csv, line 3, column 2 (ax): IMU values after a row that had none; rows of force alone may only stand at the end",
        ),
    ] {
        assert_eq!(complaint(content, options), expected);
    }
    let content = [AXES.as_bytes(), b"\n0,0,\xff,0,0,0\n"].concat();
    assert_eq!(
        complaint(content, ""),
        "x.csv, line 2, column 3: not UTF-8 text"
    );
    for (content, options) in [
        ("", ""),
        ("\n\n", ""),
        ("", "--format pce-go1"),
        ("ax,ay,az,wx,wy,wz\n", "--format csv"),
    ] {
        assert_eq!(
            complaint(content, options),
            "x.csv is empty: it holds no sample"
        );
    }
    assert_eq!(
        Bench::new().error("replay none.csv --format csv"),
        "footfall: none.csv cannot be read: No such file or directory (os error 2)\n"
    );
}

/// Returns a foot at rest with these times of its rows.
fn resting(rows: u32, time: impl Fn(u32) -> String) -> String {
    let rows: String = (0..rows)
        .map(|k| format!("{},0,0,9.81,0,0,0\n", time(k)))
        .collect();
    table(&format!("t,{AXES}"), &rows)
}

#[test]
fn implausible_rates_and_times_are_rejected_with_their_remedy() {
    let every = |step: f64| resting(100, |k| format!("{}", f64::from(k) * step));
    for (content, options, expected) in [
        (
            table(AXES, "0,0,0,0,0,0\n"),
            "",
            "x.csv has no times that tell the sample rate, so it must be given: --sample-rate HZ",
        ),
        (
            standing(),
            "--sample-rate 1e-30",
            "x.csv: column t says 1000.00 Hz, but the sample rate was given as 1e-30 Hz",
        ),
        (
            every(1.0),
            "--sample-rate 1000",
            "x.csv: column t says 1.00 Hz, but the sample rate was given as 1000 Hz; column t looks like milliseconds, \
             but is read in s: --time-unit ms",
        ),
        (
            every(1.0),
            "",
            "x.csv: the sample rate is 1 Hz, allowed is 20 to 10000 Hz; column t looks like milliseconds, but is read in \
             s: --time-unit ms",
        ),
        (
            every(1000.0),
            "",
            "x.csv: the sample rate is 0.001 Hz, allowed is 20 to 10000 Hz; column t looks like microseconds, but is \
             read in s: --time-unit us",
        ),
        // A slow sensor is not taken for milliseconds.
        (
            every(0.2),
            "",
            "x.csv: the sample rate is 5 Hz, allowed is 20 to 10000 Hz",
        ),
        (
            every(0.1),
            "",
            "x.csv: the sample rate is 10 Hz, allowed is 20 to 10000 Hz",
        ),
        (
            resting(100, |k| {
                format!("{:.6}", f64::from(k / 10 * 10_000 + k % 10) / 1e6)
            }),
            "",
            "x.csv: the sample rate is 1000000 Hz, allowed is 20 to 10000 Hz; rows that arrive in batches are spaced by \
             --times rate",
        ),
        (
            "0,0,0,0,0,0,0,0,0,0,0,0,1\n".to_owned(),
            "--format pce-atlas --sample-rate 1e-30",
            "--sample-rate is 1e-30 Hz, allowed is 20 to 10000 Hz",
        ),
        (
            standing(),
            "--preset paper --window 9000samples",
            "--window comes to 9000 samples at this sample rate, allowed is 1 to 4096",
        ),
        (
            standing(),
            "--preset paper --window=-5ms",
            "--window is -5 ms, allowed is 0.1 to 1000000 ms",
        ),
        (
            standing(),
            "--window 20ms",
            "--window has an effect with method = \"half_widths\" only, and the method is \"self_calibrating\", which \
             needs no half-widths: leave it out, or set method = \"half_widths\" in the configuration",
        ),
    ] {
        assert_eq!(complaint(content, options), expected);
    }
}

#[test]
fn unwritable_result_is_rejected_before_writing() {
    let bench = Bench::with("x.csv", standing());
    fs::create_dir(bench.path("walks.svg")).expect("a directory");
    let one = "standard output takes one result: a table or picture (-), or --json";
    let pictures = "pictures are SVG or pages, so the name must end in .svg or .html";
    let tables = "tables are CSV or Parquet, so the name must end in .csv or .parquet";
    for (options, expected) in [
        (
            "--output no/out.csv",
            "no/out.csv cannot be written: there is no directory no",
        ),
        (
            "--output ./x.csv",
            "./x.csv cannot be written: it is the recording itself",
        ),
        (
            "--output table.svg",
            &format!("table.svg cannot be written: {tables}"),
        ),
        ("--output - --json", one),
        ("--events - --output -", one),
        ("--plot - --events -", one),
        (
            "--output a.csv --events ./a.csv",
            "./a.csv cannot be written: it is named for two results",
        ),
        (
            "--output ok.csv --plot no/x.svg",
            "no/x.svg cannot be written: there is no directory no",
        ),
        (
            "--output ok.csv --plot walks.svg",
            "walks.svg cannot be written: it is a directory",
        ),
        (
            "--output ok.csv --plot x.jpg",
            &format!("x.jpg cannot be written: {pictures}"),
        ),
        (
            "--output ok.csv --plot x",
            &format!("x cannot be written: {pictures}"),
        ),
    ] {
        let said = bench.error(&format!("replay x.csv {options}"));
        assert_eq!(said, format!("footfall: {expected}\n"), "{options}");
        assert_eq!(bench.files(), ["walks.svg", "x.csv"]);
    }
    assert_eq!(read(&bench.path("x.csv")), standing());
}

#[test]
fn failed_replay_leaves_no_result() {
    let bench = Bench::with("x.csv", standing() + "1.0,0,0,oops,0,0,0,50,1\n");
    bench.error("replay x.csv --output out.csv --plot out.svg");
    assert_eq!(bench.files(), ["x.csv"]);
}
