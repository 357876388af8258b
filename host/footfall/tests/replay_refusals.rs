//! Tests of inputs and results rejected by `footfall replay`, and of its error messages.

use std::fs;

use crate::common::{AXES, Bench, cases, read, standing};

/// Returns the error about a file x.csv with this content, without its beginning.
fn complaint(content: impl AsRef<[u8]>, options: &str) -> String {
    let said = Bench::with("x.csv", content).error(&format!("replay x.csv {options}"));
    let said = said.strip_prefix("footfall: ").and_then(|said| said.strip_suffix('\n'));
    said.expect("one line of this program").to_owned()
}

/// Contents of tables, with our columns as AXES and options after a tilde, and the error about each. Numbers are shown as
/// they were written, and comments count as lines.
const CONTENTS: &str = r#"
    time,mood\n0,0\n => x.csv has no header that names the six axes; write one, such as t,ax,ay,az,wx,wy,wz, or give its format: --format pce-atlas, pce-go1, lcd or csv
    250,0,0,1,0,0,0\n => x.csv has no header that names the six axes; write one, such as t,ax,ay,az,wx,wy,wz, or give its format: --format pce-atlas, pce-go1, lcd or csv
    t,ax,ay,az,wx,wy,gz\n0,0,0,0,0,0,0\n => x.csv, line 1: missing in the header: wz
    T,AX,AY,AZ,WX,WY,WZ\n0,0,0,0,0,0,0\n => x.csv, line 1: missing in the header: ax, ay, az, wx, wy, wz; names are written in lower case
    t|ax|ay|az|wx|wy|wz\n0,0,0,0,0,0,0\n => x.csv, line 1: missing in the header: ax, ay, az, wx, wy, wz; columns are separated by commas, semicolons or tabs, not by '|'
    t,AXES\r0,0,0,0,0,0,0\r0.1,0,0,0,0,0,0 => x.csv, line 1: missing in the header: ax, ay, az, wx, wy, wz; lines end in a carriage return alone: save the table with line feeds, such as with tr '\r' '\n'
    AXES,ay\n0,0,0,0,0,0,0\n => x.csv, line 1, column 7 (ay): the header has this name twice
    0,0,0,0,0,0,0,0,0,0,0,0,1\n0,0,0\n ~ --format pce-atlas => x.csv, line 2: 3 columns where 13 are expected
    AXES\n0,0,0,0,0,0,0\n ~ --sample-rate 100 => x.csv, line 2: 7 columns where 6 are expected
    AXES\r\n0,0,0,0,0,0\r\n0,0,1.2.3,0,0,0\r\n => x.csv, line 3, column 3 (az): "1.2.3" is not a number
    # one\nAXES\n# three\n\n0,0,0,0,0,0\n#\n0,0,x,0,0,0\n ~ --sample-rate 100 => x.csv, line 7, column 3 (az): "x" is not a number
    AXES\n0,0,0, ,0,0\n => x.csv, line 2, column 4 (wx): blank where a number is needed; nan marks a missing reading
    t,AXES\n1e300,0,0,0,0,0,0\n => x.csv, line 2, column 1 (t): 1e300 is not a time in s: -4e9 to 4e9 is expected
    AXES,label\n0,0,0,0,0,0,1e300\n => x.csv, line 2, column 7 (label): label 1e300 where 0 (not stable) or 1 (stable) is expected
    1,0,0,1,0,0,0\n1,,,,,,\n1,0,0,1,0,0,0\n ~ --format pce-go1 => x.csv, line 3, column 2 (ax): IMU values after a row that had none; rows with only a force are allowed only at the end
    \n\n => x.csv is empty: it holds no sample
    ~ --format pce-go1 => x.csv is empty: it holds no sample
    AXES\n ~ --format csv => x.csv is empty: it holds no sample
"#;

#[test]
fn contents_of_tables_are_rejected_with_their_place() {
    for (case, expected) in cases(CONTENTS) {
        let (content, options) = case.split_once('~').unwrap_or((case, ""));
        let content = content.trim_end().replace("AXES", AXES);
        let content = content.replace("\\n", "\n").replace("\\r", "\r");
        assert_eq!(complaint(content, options), expected);
    }
    let content = [AXES.as_bytes(), b"\n0,0,\xff,0,0,0\n"].concat();
    assert_eq!(complaint(content, ""), "x.csv, line 2, column 3: not UTF-8 text");
    assert_eq!(complaint("", ""), "x.csv is empty: it holds no sample");
    assert_eq!(
        Bench::new().error("replay none.csv --format csv"),
        "footfall: none.csv cannot be read: No such file or directory (os error 2)\n"
    );
}

/// Steps of the times of a foot at rest, or `standing`, with the options of a replay and the error. A slow sensor must not
/// be mistaken for a sensor with times in milliseconds.
const RATES: &str = r#"
    standing --sample-rate 1e-30 => x.csv: column t gives 1000.00 Hz, but the given sample rate is 1e-30 Hz
    1 --sample-rate 1000 => x.csv: column t gives 1.00 Hz, but the given sample rate is 1000 Hz; column t looks like milliseconds, but is read in s: --time-unit ms
    1 => x.csv: the sample rate is 1 Hz, allowed is 20 to 10000 Hz; column t looks like milliseconds, but is read in s: --time-unit ms
    100 => x.csv: the sample rate is 0.01 Hz, allowed is 20 to 10000 Hz; column t looks like ticks of 100 µs, but is read in s: --time-unit 100us
    40 => x.csv: the sample rate is 0.025 Hz, allowed is 20 to 10000 Hz; column t may be in another unit: in milliseconds it gives 25 Hz: --time-unit ms; in ticks of 100 µs it gives 250 Hz: --time-unit 100us
    100 --time-unit ms => x.csv: column t gives 10.00 Hz in milliseconds; column t may be in another unit: in ticks of 100 µs it gives 100 Hz: --time-unit 100us
    1000 => x.csv: the sample rate is 0.001 Hz, allowed is 20 to 10000 Hz; column t looks like microseconds, but is read in s: --time-unit us
    1000000 => x.csv: the sample rate is 1e-6 Hz, allowed is 20 to 10000 Hz; column t looks like nanoseconds, but is read in s: --time-unit ns
    1000000 --sample-rate 1000 => x.csv: column t gives 1.00e-6 Hz, but the given sample rate is 1000 Hz; column t looks like nanoseconds, but is read in s: --time-unit ns
    0.2 => x.csv: the sample rate is 5 Hz, allowed is 20 to 10000 Hz
    0.1 => x.csv: the sample rate is 10 Hz, allowed is 20 to 10000 Hz
    batches => x.csv: the sample rate is 1000000 Hz, allowed is 20 to 10000 Hz; rows that arrive in batches are spaced by --times rate
    standing --preset paper --window 9000samples => --window comes to 9000 samples at this sample rate, allowed is 1 to 4096
    standing --preset paper --window=-5ms => --window is -5 ms, allowed is 0.1 to 1000000 ms
    standing --window 20ms => --window has an effect with method = "half_widths" only: leave it out, or set this method in the configuration
"#;

#[test]
fn implausible_rates_and_times_are_rejected_with_their_remedy() {
    let resting = |time: &dyn Fn(u32) -> f64| {
        let row = |k| format!("{},0,0,9.81,0,0,0\n", time(k));
        format!("t,{AXES}\n") + &(0..100).map(row).collect::<String>()
    };
    for (case, expected) in cases(RATES) {
        let (times, options) = case.split_once(' ').unwrap_or((case, ""));
        let content = match times.parse::<f64>() {
            Ok(step) => resting(&|k| f64::from(k) * step),
            Err(_) if times == "batches" => resting(&|k| f64::from(k / 10 * 10_000 + k % 10) / 1e6),
            Err(_) => standing(),
        };
        assert_eq!(complaint(content, options), expected);
    }
    assert_eq!(
        complaint(format!("{AXES}\n0,0,0,0,0,0\n"), ""),
        "x.csv has no times that determine the sample rate, so it must be given: --sample-rate HZ"
    );
    assert_eq!(
        complaint("0,0,0,0,0,0,0,0,0,0,0,0,1\n", "--format pce-atlas --sample-rate 1e-30"),
        "--sample-rate is 1e-30 Hz, allowed is 20 to 10000 Hz"
    );
}

#[test]
fn unwritable_result_is_rejected_before_writing() {
    let bench = Bench::with("x.csv", standing());
    fs::create_dir(bench.path("walks.svg")).expect("a directory");
    for (options, expected) in cases(
        "
        --output no/out.csv => no/out.csv cannot be written: there is no directory no
        --output ./x.csv => ./x.csv cannot be written: it is the recording itself
        --output table.svg => table.svg cannot be written: tables are CSV or Parquet, so the name must end in .csv or .parquet
        --output - --json => standard output takes one result: a table or picture (-), or --json
        --events - --output - => standard output takes one result: a table or picture (-), or --json
        --plot - --events - => standard output takes one result: a table or picture (-), or --json
        --output a.csv --events ./a.csv => ./a.csv cannot be written: two results have this name
        --output ok.csv --plot no/x.svg => no/x.svg cannot be written: there is no directory no
        --output ok.csv --plot walks.svg => walks.svg cannot be written: it is a directory
        --output ok.csv --plot x.jpg => x.jpg cannot be written: pictures are SVG or pages, so the name must end in .svg or .html
        --output ok.csv --plot x => x cannot be written: pictures are SVG or pages, so the name must end in .svg or .html
        ",
    ) {
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
