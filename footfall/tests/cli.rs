//! The `footfall` command from outside: what it prints, writes and returns.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use estimator_core::Params;
use footfall::input::{self, Format, Hints};
use footfall::plot;
use footfall::replay::replay;
use tempfile::TempDir;

/// A directory of its own for each test, in which the command runs.
struct Bench {
    directory: TempDir,
}

impl Bench {
    fn new() -> Self {
        Self {
            directory: tempfile::tempdir().expect("a temporary directory"),
        }
    }

    /// A bench with one file in it.
    fn with(name: &str, content: impl AsRef<[u8]>) -> Self {
        let bench = Self::new();
        fs::write(bench.path(name), content).expect("a file in a temporary directory");
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    fn run(&self, arguments: &str) -> Output {
        Command::new(env!("CARGO_BIN_EXE_footfall"))
            .args(arguments.split_whitespace())
            .current_dir(&self.directory)
            .output()
            .expect("the command that was just built")
    }

    /// What a command that succeeds prints on stdout.
    fn stdout(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert!(output.status.success(), "{output:?}");
        text(&output.stdout)
    }

    /// What a command that fails prints on stderr. It prints nothing on stdout.
    fn error(&self, arguments: &str) -> String {
        let output = self.run(arguments);
        assert!(!output.status.success(), "{output:?}");
        assert!(output.stdout.is_empty(), "{output:?}");
        text(&output.stderr)
    }

    /// The names of the files that are there.
    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.directory).expect("a directory");
        let name = |entry: std::io::Result<fs::DirEntry>| {
            let name = entry.expect("an entry").file_name();
            name.to_string_lossy().into_owned()
        };
        let mut names: Vec<_> = entries.map(name).collect();
        names.sort();
        names
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).expect("a file that was just written")
}

const AXES: &str = "ax,ay,az,wx,wy,wz";

/// A foot that stands for a second at 1 kHz, gravity included.
fn standing() -> String {
    let row = |k: u32| format!("{:.3},0,0,9.81,0,0,0,50,1\n", f64::from(k) * 1e-3);
    let rows: String = (0..1000).map(row).collect();
    format!("t,{AXES},force,label\n{rows}")
}

#[test]
fn a_replay_writes_one_row_per_sample_under_the_documented_header() {
    let bench = Bench::with("walk.csv", standing());
    bench.stdout("replay walk.csv --format csv --output out.csv");
    let table = read(&bench.path("out.csv"));
    let mut lines = table.lines();
    assert_eq!(
        lines.next(),
        Some(
            "t,p_stable,p_tangential,p_vertical,p_ax,p_ay,p_az,p_wx,p_wy,p_wz,\
             qw,qx,qy,qz,lax,lay,laz,bwx,bwy,bwz,state,flags"
        )
    );
    assert_eq!(lines.clone().count(), 1000);
    let last: Vec<_> = lines.last().expect("rows").split(',').collect();
    assert_eq!(
        (last[0], last[1], last[20], last[21]),
        ("0.999000", "1", "stance", "")
    );
}

#[test]
fn times_come_out_as_they_went_in_wherever_the_clock_starts() {
    for start in [-500, 0, 1_700_000_000_000_i64] {
        let time = |k: i64| {
            let ms = start + k;
            let sign = if ms < 0 { "-" } else { "" };
            format!("{sign}{}.{:03}", ms.abs() / 1000, ms.abs() % 1000)
        };
        let row = |k: i64| format!("{},0,0,9.81,0,0,0\n", time(k));
        let rows: String = (0..1000).map(row).collect();
        let bench = Bench::with("walk.csv", format!("t,{AXES}\n{rows}"));
        bench.stdout("replay walk.csv --output out.csv --plot out.svg");
        let table = read(&bench.path("out.csv"));
        let times = table
            .lines()
            .skip(1)
            .map(|row| row.split(',').next().unwrap_or_default());
        assert!(times.eq((0..1000).map(|k| time(k) + "000")));
        let svg = read(&bench.path("out.svg"));
        match start {
            0 => assert!(!svg.contains("since t =")),
            -500 => assert!(svg.contains("time (s) since t = -0.5 s")),
            _ => assert!(svg.contains("time (s) since t = 1700000000 s")),
        }
        assert!(svg.contains("\n0.5\n"), "ticks count from the start");
    }
}

#[test]
fn the_figure_is_that_of_the_whole_recording() {
    let bench = Bench::with("walk.csv", standing());
    bench.stdout("replay walk.csv --plot out.svg");
    let loaded = input::read(&bench.path("walk.csv"), Format::Csv, &Hints::default());
    let recording = loaded.expect("a recording").recording;
    let estimates = replay(&recording, &Params::DEFAULT).expect("the preset");
    let expected = plot::svg(&recording, &estimates).expect("a picture");
    assert!(read(&bench.path("out.svg")) == expected);
    // The same as in the process, and not the same as with the first estimate alone.
    assert!(expected != plot::svg(&recording, &estimates[..1]).expect("a picture"));
}

#[test]
fn a_replay_prints_a_summary() {
    let bench = Bench::with("walk.csv", standing());
    let summary = bench.stdout("replay walk.csv");
    assert!(
        summary.starts_with("walk: 1000 samples, 0.999 s at 1000 Hz\nstate    "),
        "{summary}"
    );
    assert!(summary.contains("\nlabels   RMSE "), "{summary}");
}

#[test]
fn with_json_stdout_holds_one_object_and_nothing_else() {
    let bench = Bench::with("walk.csv", standing());
    let stdout = bench.stdout("replay walk.csv --json --output out.csv --plot out.svg");
    let summary: serde_json::Value = serde_json::from_str(&stdout).expect("one JSON object");
    assert_eq!(summary["samples"], 1000);
    assert_eq!(summary["sample_rate_hz"], 1000.0);
    assert!(summary["metrics"]["rmse"].is_number());
}

#[test]
fn a_replay_draws_the_figure() {
    let bench = Bench::with("walk.csv", standing());
    bench.stdout("replay walk.csv --plot out.svg");
    let svg = read(&bench.path("out.svg"));
    assert!(svg.starts_with("<svg") && svg.contains("force (N)"));
}

#[test]
fn options_win_over_the_configuration_file_which_wins_over_the_preset() {
    let bench = Bench::with("walk.csv", standing());
    fs::write(
        bench.path("robot.toml"),
        "window = '30samples'\ngravity = 'removed'\n",
    )
    .expect("a file");
    let window = |arguments: &str| {
        let arguments = format!("replay walk.csv --json {arguments}");
        let summary: serde_json::Value =
            serde_json::from_str(&bench.stdout(&arguments)).expect("JSON");
        summary["flag_counts"]["window_not_full"].clone()
    };
    assert_eq!(window("--gravity removed"), 49);
    assert_eq!(window("--config robot.toml"), 29);
    assert_eq!(window("--config robot.toml --window 10ms"), 9);
}

#[test]
fn columns_nobody_asked_for_are_named_in_one_line_on_stderr() {
    let bench = Bench::with(
        "walk.csv",
        format!("t,{AXES},qw,mood\n0,0,0,9,0,0,0,,\n1,0,0,9,0,0,0,,\n"),
    );
    let output = bench.run("replay walk.csv --sample-rate 100 --format csv");
    assert_eq!(
        text(&output.stderr).lines().next(),
        Some("footfall: walk.csv: column t says 1.00 Hz, but the sample rate was given as 100 Hz")
    );
    let rows = "0,0,0,9,0,0,0,,\n0.01,0,0,9,0,0,0,,\n";
    let bench = Bench::with("walk.csv", format!("t,{AXES},qw,mood\n{rows}"));
    let output = bench.run("replay walk.csv");
    assert!(output.status.success());
    assert_eq!(
        text(&output.stderr),
        "footfall: walk.csv: ignored columns: qw, mood\n"
    );
}

#[test]
fn go1_rows_without_imu_values_are_accounted_for_on_stderr() {
    let rows = "250,0,0,1,0,0,0\n".repeat(40) + &"250,,,,,,\n".repeat(60);
    let bench = Bench::with("go1.csv", rows);
    let output = bench.run("replay go1.csv --format pce-go1 --preset paper");
    assert!(output.status.success(), "{output:?}");
    assert_eq!(
        text(&output.stderr),
        "footfall: go1.csv: 60 of 100 rows are force only; IMU row k takes the load of force \
         row 1.9 k + 50, which leaves 0 force rows at the end unused and 13 samples without load\n"
    );
}

#[test]
fn samples_that_are_not_finite_are_flagged_and_not_refused() {
    let rows = standing().replace("0.500,0,", "0.500,nan,");
    let bench = Bench::with("walk.csv", rows);
    let summary = bench.stdout("replay walk.csv");
    assert!(summary.contains("invalid_sample 1"), "{summary}");
}

#[test]
fn the_demo_needs_nothing_and_writes_samples_a_picture_and_what_the_foot_sends() {
    let bench = Bench::new();
    let summary = bench.stdout("");
    assert!(summary.contains("labels   RMSE "), "{summary}");
    assert_eq!(bench.files(), ["footfall-demo"]);
    let directory = bench.path("footfall-demo");
    assert!(read(&directory.join("plot.svg")).starts_with("<svg"));
    assert!(
        read(&directory.join("samples.csv"))
            .starts_with("t,ax,ay,az,wx,wy,wz,force,label,validity,p_stable,")
    );
    let log = read(&directory.join("can.log"));
    assert!(log.starts_with("(1609459200.000111) can0 711#00\n"));
    for file in ["samples.csv", "plot.svg", "can.log", "uart.bin"] {
        assert!(directory.join(file).is_file(), "{file}");
        assert!(summary.contains(file), "{summary}");
    }
}

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
            "t,interface,node,segment,sequence,p_stable,p_tangential,p_vertical,p_ax,"
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
        said.starts_with("footfall: walk.csv is neither a log of candump -l"),
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
}

#[test]
fn what_the_demo_wrote_can_be_replayed() {
    let bench = Bench::new();
    bench.stdout("demo --out walk --seed 3");
    let summary = bench.stdout("replay walk/samples.csv");
    assert!(summary.starts_with("samples: "), "{summary}");
}

#[test]
fn the_same_seed_gives_the_same_demo_and_another_one_another() {
    let bench = Bench::new();
    for (out, seed) in [("a", 7), ("b", 7), ("c", 8)] {
        bench.stdout(&format!("demo --out {out} --seed {seed}"));
    }
    let samples = |out: &str| read(&bench.path(out).join("samples.csv"));
    assert!(samples("a") == samples("b"));
    assert!(samples("a") != samples("c"));
}

/// What is said about a file named x.csv with this content.
fn complaint(content: impl AsRef<[u8]>, options: &str) -> String {
    Bench::with("x.csv", content).error(&format!("replay x.csv {options}"))
}

#[test]
fn a_missing_file_is_an_error() {
    assert_eq!(
        Bench::new().error("replay none.csv --format csv"),
        "footfall: none.csv cannot be read: No such file or directory (os error 2)\n"
    );
}

#[test]
fn an_empty_file_is_an_error() {
    for format in ["pce-atlas", "pce-go1", "csv"] {
        assert_eq!(
            complaint("", &format!("--format {format}")),
            "footfall: x.csv is empty: it holds no sample\n"
        );
    }
    assert_eq!(
        complaint(format!("{AXES}\n"), "--format csv"),
        "footfall: x.csv is empty: it holds no sample\n"
    );
}

#[test]
fn a_file_that_does_not_tell_its_format_is_an_error_that_lists_the_formats() {
    let expected = "footfall: x.csv has no header that names the six axes, so its format must \
                    be given: --format pce-atlas, pce-go1 or csv\n";
    for content in ["250,0,0,1,0,0,0\n", "time,mood\n0,0\n"] {
        assert_eq!(complaint(content, ""), expected);
    }
}

#[test]
fn without_a_format_an_empty_file_is_called_empty() {
    for content in ["", "\n\n"] {
        assert_eq!(
            complaint(content, ""),
            "footfall: x.csv is empty: it holds no sample\n"
        );
    }
}

#[test]
fn without_a_format_a_header_that_lacks_an_axis_is_told_which() {
    let missing = |header: &str| {
        let stderr = complaint(format!("{header}\n0,0,0,0,0,0,0\n"), "");
        let said = stderr.strip_prefix("footfall: x.csv, line 1: missing in the header: ");
        said.expect("the header's fault").trim_end().to_owned()
    };
    assert_eq!(missing("t,ax,ay,az,wx,wy,gz"), "wz");
    assert_eq!(
        missing("T,AX,AY,AZ,WX,WY,WZ"),
        "ax, ay, az, wx, wy, wz; names are written in lower case"
    );
    assert_eq!(
        missing("t;ax;ay;az;wx;wy;wz"),
        "ax, ay, az, wx, wy, wz; columns are separated by commas, not by ';'"
    );
}

#[test]
fn a_recording_may_come_through_a_pipe() {
    let bench = Bench::with("walk.csv", standing());
    let output = Command::new("sh")
        .args(["-c", "cat walk.csv | \"$0\" replay /dev/stdin --json"])
        .arg(env!("CARGO_BIN_EXE_footfall"))
        .current_dir(&bench.directory)
        .output()
        .expect("a shell");
    assert!(output.status.success(), "{output:?}");
    assert!(text(&output.stdout).contains("\"samples\": 1000"));
}

#[test]
fn numbers_in_messages_are_as_short_as_they_were_written() {
    assert_eq!(
        complaint(format!("t,{AXES}\n1e300,0,0,0,0,0,0\n"), ""),
        "footfall: x.csv, line 2, column 1 (t): 1e300 is no time in s: -4e9 to 4e9 is expected\n"
    );
    assert_eq!(
        complaint(standing(), "--sample-rate 1e-30"),
        "footfall: x.csv: column t says 1000.00 Hz, but the sample rate was given as 1e-30 Hz\n"
    );
    assert_eq!(
        complaint(standing().replace(",50,1\n", ",50,1e300\n"), ""),
        "footfall: x.csv, line 2, column 9 (label): label 1e300 where 0 (not stable) or 1 \
         (stable) is expected\n"
    );
}

#[test]
fn times_in_milliseconds_are_suspected_where_the_rate_given_says_so() {
    let in_ms = format!("t,{AXES}\n0,0,0,9,0,0,0\n1,0,0,9,0,0,0\n2,0,0,9,0,0,0\n");
    assert_eq!(
        complaint(in_ms, "--sample-rate 1000"),
        "footfall: x.csv: column t says 1.00 Hz, but the sample rate was given as 1000 Hz; \
         column t looks like milliseconds, but is in s\n"
    );
}

#[test]
fn missing_columns_are_named() {
    assert_eq!(
        complaint("t,ax,ay,az,wx\n0,0,0,0,0\n", "--format csv"),
        "footfall: x.csv, line 1: missing in the header: wy, wz\n"
    );
}

#[test]
fn a_column_that_stands_twice_is_named() {
    assert_eq!(
        complaint(format!("{AXES},ay\n0,0,0,0,0,0,0\n"), ""),
        "footfall: x.csv, line 1, column 7 (ay): this name stands in the header twice\n"
    );
}

#[test]
fn a_wrong_number_of_columns_names_the_line() {
    assert_eq!(
        complaint("0,0,0,0,0,0,0,0,0,0,0,0,1\n0,0,0\n", "--format pce-atlas"),
        "footfall: x.csv, line 2: 3 columns where 13 are expected\n"
    );
    assert_eq!(
        complaint(format!("{AXES}\n0,0,0,0,0,0,0\n"), "--sample-rate 100"),
        "footfall: x.csv, line 2: 7 columns where 6 are expected\n"
    );
}

#[test]
fn what_is_no_number_is_quoted_with_its_place() {
    assert_eq!(
        complaint(format!("{AXES}\r\n0,0,0,0,0,0\r\n0,0,1.2.3,0,0,0\r\n"), ""),
        "footfall: x.csv, line 3, column 3 (az): \"1.2.3\" is not a number\n"
    );
}

#[test]
fn a_blank_cell_in_an_axis_is_an_error() {
    assert_eq!(
        complaint(format!("{AXES}\n0,0,0, ,0,0\n"), ""),
        "footfall: x.csv, line 2, column 4 (wx): blank where a number is needed\n"
    );
}

#[test]
fn what_is_not_utf8_is_named_with_its_place() {
    let content = [AXES.as_bytes(), b"\n0,0,\xff,0,0,0\n"].concat();
    assert_eq!(
        complaint(content, ""),
        "footfall: x.csv, line 2, column 3: not UTF-8 text\n"
    );
}

#[test]
fn a_label_that_is_neither_0_nor_1_is_an_error() {
    assert_eq!(
        complaint("0,0,0,0,0,0,0,0,0,0,0,0,2\n", "--format pce-atlas"),
        "footfall: x.csv, line 1, column 13 (label): label 2 where 0 (not stable) or 1 (stable) \
         is expected\n"
    );
}

#[test]
fn a_time_that_does_not_advance_is_an_error() {
    assert_eq!(
        complaint(
            format!("t,{AXES}\n0.02,0,0,0,0,0,0\n0.01,0,0,0,0,0,0\n"),
            ""
        ),
        "footfall: x.csv, line 3, column 1 (t): time 0.01 s does not come after 0.02 s in the \
         row before\n"
    );
}

#[test]
fn a_time_that_is_no_time_is_an_error() {
    assert_eq!(
        complaint(format!("t,{AXES}\nnan,0,0,0,0,0,0\n"), ""),
        "footfall: x.csv, line 2, column 1 (t): nan is no time in s: -4e9 to 4e9 is expected\n"
    );
}

#[test]
fn imu_values_after_rows_of_force_alone_are_an_error() {
    assert_eq!(
        complaint(
            "1,0,0,1,0,0,0\n1,,,,,,\n1,0,0,1,0,0,0\n",
            "--format pce-go1"
        ),
        "footfall: x.csv, line 3, column 2 (ax): IMU values after a row that had none; rows of \
         force alone may only stand at the end\n"
    );
}

#[test]
fn without_times_the_sample_rate_must_be_given() {
    assert_eq!(
        complaint(format!("{AXES}\n0,0,0,0,0,0\n"), ""),
        "footfall: x.csv has no times that tell the sample rate, so it must be given: \
         --sample-rate HZ\n"
    );
}

#[test]
fn a_sample_rate_that_contradicts_the_times_is_an_error_that_names_both() {
    assert_eq!(
        complaint(standing(), "--sample-rate 500"),
        "footfall: x.csv: column t says 1000.00 Hz, but the sample rate was given as 500 Hz\n"
    );
}

#[test]
fn times_in_another_unit_than_s_are_suspected_where_the_rate_says_so() {
    for (step, rate, unit) in [(1, "1", "milliseconds"), (1000, "0.001", "microseconds")] {
        let row = |k: u32| format!("{},0,0,9.81,0,0,0\n", k * step);
        let rows: String = (0..100).map(row).collect();
        assert_eq!(
            complaint(format!("t,{AXES}\n{rows}"), ""),
            format!(
                "footfall: x.csv: the sample rate is {rate} Hz, allowed is 20 to 10000 Hz; \
                 column t looks like {unit}, but is in s\n"
            )
        );
    }
}

#[test]
fn a_sample_rate_out_of_range_names_the_option() {
    assert_eq!(
        complaint(
            "0,0,0,0,0,0,0,0,0,0,0,0,1\n",
            "--format pce-atlas --sample-rate 1e-30"
        ),
        "footfall: --sample-rate is 1e-30 Hz, allowed is 20 to 10000 Hz\n"
    );
}

#[test]
fn the_configuration_files_sample_rate_counts_where_the_recording_has_none() {
    let bench = Bench::with("x.csv", format!("{AXES}\n0,0,9,0,0,0\n0,0,9,0,0,0\n"));
    fs::write(bench.path("robot.toml"), "sample_rate_hz = 400\n").expect("a file");
    let summary = bench.stdout("replay x.csv --config robot.toml");
    assert!(
        summary.starts_with("x: 2 samples, 0.003 s at 400 Hz"),
        "{summary}"
    );
    let summary = bench.stdout("replay x.csv --config robot.toml --sample-rate 100");
    assert!(summary.contains("at 100 Hz"), "{summary}");
}

#[test]
fn the_default_preset_takes_the_load_trigger_of_the_formats_robot() {
    // 100 N would be a loaded GO1, but not a loaded ATLAS; 100 raw is no loaded GO1.
    let atlas = |load: u32| format!("0,0,{load},0,0,0,0,0,0,0,0,0,1\n").repeat(400);
    let go1 = |load: u32| format!("{load},0,0,1,0,0,0\n").repeat(400);
    for (content, format, state) in [
        (atlas(100), "pce-atlas", "quiet_swing"),
        (atlas(200), "pce-atlas", "stance"),
        (go1(100), "pce-go1", "quiet_swing"),
        (go1(200), "pce-go1", "stance"),
    ] {
        let bench = Bench::with("x.csv", content);
        let json = bench.stdout(&format!("replay x.csv --format {format} --json"));
        let summary: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        let shares = &summary["state_shares"];
        let largest = |other: &str| shares[other].as_f64() <= shares[state].as_f64();
        assert!(
            ["stance", "quiet_swing", "swing", "slip"]
                .into_iter()
                .all(largest),
            "{json}"
        );
        assert!(shares[state].as_f64() > Some(0.2), "{json}");
    }
}

#[test]
fn a_parameter_out_of_its_range_is_named_with_value_and_range() {
    assert_eq!(
        complaint(standing(), "--window 9000samples"),
        "footfall: --window comes to 9000 samples at this sample rate, allowed is 1 to \
         4096\n"
    );
    let bench = Bench::with("x.csv", standing());
    fs::write(bench.path("robot.toml"), "decision.threshold = 1.5\n").expect("a file");
    assert_eq!(
        bench.error("replay x.csv --config robot.toml"),
        "footfall: robot.toml, key decision.threshold is 1.5, allowed is 0.01 to 0.99\n"
    );
    assert_eq!(
        complaint(standing(), "--window=-5ms"),
        "footfall: --window is -5 ms, allowed is 0.1 to 1000000 ms\n"
    );
}

#[test]
fn a_wrong_configuration_file_is_an_error_that_names_file_line_and_key() {
    let bench = Bench::with("x.csv", standing());
    let complaint = |content: &str| {
        fs::write(bench.path("robot.toml"), content).expect("a file");
        bench.error("replay x.csv --config robot.toml")
    };
    assert_eq!(
        complaint("[decision]\nthresold = 0.6\n"),
        "footfall: robot.toml, line 2, key decision.thresold: unknown field `thresold`, \
         expected one of `threshold`, `on_delay_s`, `off_delay_s`\n"
    );
    assert_eq!(
        complaint("window = '50'\n"),
        "footfall: robot.toml, line 1, key window: \"50\" is no window: write a duration such \
         as 50ms or a count such as 50samples\n"
    );
    assert_eq!(
        bench.error("replay x.csv --config none.toml"),
        "footfall: none.toml cannot be read: No such file or directory (os error 2)\n"
    );
}

#[test]
fn a_wrong_option_is_an_error_that_says_how_to_write_it() {
    let bench = Bench::with("x.csv", standing());
    for (option, hint) in [
        (
            "--window 50",
            "write a duration such as 50ms or a count such as 50samples",
        ),
        ("--gravity maybe", "neither \"included\" nor \"removed\""),
        ("--sample-rate -5", "write a number of Hz above 0"),
        ("--format xml", "possible values: pce-atlas, pce-go1, csv"),
    ] {
        let (name, value) = option.split_once(' ').expect("a value");
        let stderr = bench.error(&format!("replay x.csv {name}={value}"));
        assert!(stderr.contains(hint), "{stderr}");
    }
}

#[test]
fn a_result_in_a_directory_that_does_not_exist_is_an_error() {
    assert_eq!(
        complaint(standing(), "--output no/out.csv"),
        "footfall: no/out.csv cannot be written: there is no directory no\n"
    );
}

#[test]
fn a_result_never_takes_the_place_of_the_recording() {
    let bench = Bench::with("x.csv", standing());
    assert_eq!(
        bench.error("replay x.csv --output ./x.csv"),
        "footfall: ./x.csv cannot be written: it is the recording itself\n"
    );
    assert_eq!(read(&bench.path("x.csv")), standing());
}

#[test]
fn two_results_never_go_into_one_file() {
    let bench = Bench::with("x.csv", standing());
    for same in ["a.svg", "./a.svg"] {
        assert_eq!(
            bench.error(&format!("replay x.csv --output a.svg --plot {same}")),
            format!(
                "footfall: {same} cannot be written: it is named for the table and for the \
                 picture\n"
            )
        );
    }
    assert_eq!(bench.files(), ["x.csv"]);
}

#[test]
fn what_cannot_be_written_is_found_before_anything_is() {
    let bench = Bench::with("x.csv", standing());
    fs::create_dir(bench.path("walks.svg")).expect("a directory");
    for (picture, why) in [
        ("no/x.svg", "there is no directory no"),
        ("walks.svg", "it is a directory"),
        ("x.png", "pictures are SVG, so the name must end in .svg"),
        ("x", "pictures are SVG, so the name must end in .svg"),
    ] {
        assert_eq!(
            bench.error(&format!("replay x.csv --output ok.csv --plot {picture}")),
            format!("footfall: {picture} cannot be written: {why}\n")
        );
        assert_eq!(bench.files(), ["walks.svg", "x.csv"]);
    }
}

#[test]
fn the_figure_may_go_into_a_pipe() {
    let bench = Bench::with("x.csv", standing());
    let stdout = bench.stdout("replay x.csv --plot /dev/stdout");
    assert!(stdout.starts_with("<svg"), "{stdout}");
}

#[test]
fn a_file_where_the_demos_directory_should_be_is_called_one() {
    let bench = Bench::with("walk", "");
    assert_eq!(
        bench.error("demo --out walk"),
        "footfall: walk is a file, but results go into a directory\n"
    );
}

#[test]
fn an_error_leaves_no_result_behind() {
    let bench = Bench::with("x.csv", standing() + "1.0,0,0,oops,0,0,0,50,1\n");
    bench.error("replay x.csv --output out.csv --plot out.svg");
    assert_eq!(bench.files(), ["x.csv"]);
}
