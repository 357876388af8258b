//! Tests of inputs rejected by `footfall replay`, and of its error messages.

use std::fs;

use crate::common::{AXES, Bench, read, standing};

/// Returns the error about a file x.csv with this content.
fn complaint(content: impl AsRef<[u8]>, options: &str) -> String {
    Bench::with("x.csv", content).error(&format!("replay x.csv {options}"))
}

#[test]
fn missing_file_is_rejected() {
    assert_eq!(
        Bench::new().error("replay none.csv --format csv"),
        "footfall: none.csv cannot be read: No such file or directory (os error 2)\n"
    );
}

#[test]
fn empty_file_is_rejected() {
    for format in ["pce-atlas", "pce-go1", "lcd", "csv"] {
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
fn unrecognised_file_error_lists_the_formats() {
    let expected = "footfall: x.csv has no header that names the six axes, so its format must \
                    be given: --format pce-atlas, pce-go1, lcd or csv\n";
    for content in ["250,0,0,1,0,0,0\n", "time,mood\n0,0\n"] {
        assert_eq!(complaint(content, ""), expected);
    }
}

#[test]
fn empty_file_of_unknown_format_is_called_empty() {
    for content in ["", "\n\n"] {
        assert_eq!(
            complaint(content, ""),
            "footfall: x.csv is empty: it holds no sample\n"
        );
    }
}

#[test]
fn missing_axis_is_named_without_a_format() {
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
        missing("t|ax|ay|az|wx|wy|wz"),
        "ax, ay, az, wx, wy, wz; columns are separated by commas, semicolons or tabs, not by '|'"
    );
}

#[test]
fn numbers_in_messages_are_as_written() {
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
fn rate_option_reveals_times_in_milliseconds() {
    let in_ms = format!("t,{AXES}\n0,0,0,9,0,0,0\n1,0,0,9,0,0,0\n2,0,0,9,0,0,0\n");
    assert_eq!(
        complaint(in_ms, "--sample-rate 1000"),
        "footfall: x.csv: column t says 1.00 Hz, but the sample rate was given as 1000 Hz; \
         column t looks like milliseconds, but is read in s: --time-unit ms\n"
    );
}

#[test]
fn table_of_a_slow_sensor_is_not_taken_for_milliseconds() {
    let rows = |step: f64| -> String {
        let row = |k: u32| format!("{},0,0,9.81,0,0,0\n", f64::from(k) * step);
        format!("t,{AXES}\n{}", (0..50).map(row).collect::<String>())
    };
    for (step, rate) in [(0.2, 5), (0.1, 10)] {
        assert_eq!(
            complaint(rows(step), ""),
            format!("footfall: x.csv: the sample rate is {rate} Hz, allowed is 20 to 10000 Hz\n")
        );
    }
    assert!(complaint(rows(2.0), "").ends_with("--time-unit ms\n"));
}

#[test]
fn missing_columns_are_named() {
    assert_eq!(
        complaint("t,ax,ay,az,wx\n0,0,0,0,0\n", "--format csv"),
        "footfall: x.csv, line 1: missing in the header: wy, wz\n"
    );
}

#[test]
fn duplicate_column_is_named() {
    assert_eq!(
        complaint(format!("{AXES},ay\n0,0,0,0,0,0,0\n"), ""),
        "footfall: x.csv, line 1, column 7 (ay): this name stands in the header twice\n"
    );
}

#[test]
fn wrong_column_count_error_names_the_line() {
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
fn invalid_number_is_quoted_with_its_place() {
    assert_eq!(
        complaint(format!("{AXES}\r\n0,0,0,0,0,0\r\n0,0,1.2.3,0,0,0\r\n"), ""),
        "footfall: x.csv, line 3, column 3 (az): \"1.2.3\" is not a number\n"
    );
}

#[test]
fn blank_axis_cell_is_rejected() {
    assert_eq!(
        complaint(format!("{AXES}\n0,0,0, ,0,0\n"), ""),
        "footfall: x.csv, line 2, column 4 (wx): blank where a number is needed\n"
    );
}

#[test]
fn invalid_utf8_is_reported_with_its_place() {
    let content = [AXES.as_bytes(), b"\n0,0,\xff,0,0,0\n"].concat();
    assert_eq!(
        complaint(content, ""),
        "footfall: x.csv, line 2, column 3: not UTF-8 text\n"
    );
}

#[test]
fn label_other_than_0_or_1_is_rejected() {
    assert_eq!(
        complaint("0,0,0,0,0,0,0,0,0,0,0,0,2\n", "--format pce-atlas"),
        "footfall: x.csv, line 1, column 13 (label): label 2 where 0 (not stable) or 1 (stable) \
         is expected\n"
    );
}

#[test]
fn non_increasing_time_is_rejected() {
    assert_eq!(
        complaint(
            format!("t,{AXES}\n0.02,0,0,0,0,0,0\n0.01,0,0,0,0,0,0\n"),
            ""
        ),
        "footfall: x.csv, line 3, column 1 (t): time 0.01 s does not come after 0.02 s in the \
         row before: sort the rows, leave such rows out with --times drop-bad, or space all by the sample rate with \
         --times rate\n"
    );
}

#[test]
fn invalid_time_is_rejected() {
    assert_eq!(
        complaint(format!("t,{AXES}\nnan,0,0,0,0,0,0\n"), ""),
        "footfall: x.csv, line 2, column 1 (t): nan is no time in s: -4e9 to 4e9 is expected\n"
    );
}

#[test]
fn imu_values_after_force_only_rows_are_rejected() {
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
fn missing_times_require_a_sample_rate() {
    assert_eq!(
        complaint(format!("{AXES}\n0,0,0,0,0,0\n"), ""),
        "footfall: x.csv has no times that tell the sample rate, so it must be given: \
         --sample-rate HZ\n"
    );
}

#[test]
fn contradictory_sample_rate_error_names_both_rates() {
    assert_eq!(
        complaint(standing(), "--sample-rate 500"),
        "footfall: x.csv: column t says 1000.00 Hz, but the sample rate was given as 500 Hz\n"
    );
}

#[test]
fn implausible_rate_error_suspects_unit_of_times() {
    for (step, rate, unit, name) in [
        (1, "1", "milliseconds", "ms"),
        (1000, "0.001", "microseconds", "us"),
    ] {
        let row = |k: u32| format!("{},0,0,9.81,0,0,0\n", k * step);
        let rows: String = (0..100).map(row).collect();
        assert_eq!(
            complaint(format!("t,{AXES}\n{rows}"), ""),
            format!(
                "footfall: x.csv: the sample rate is {rate} Hz, allowed is 20 to 10000 Hz; \
                 column t looks like {unit}, but is read in s: --time-unit {name}\n"
            )
        );
    }
}

#[test]
fn too_close_times_are_suspected_to_be_batches() {
    let row = |k: u32| {
        format!(
            "{:.6},0,0,9.81,0,0,0\n",
            f64::from(k / 10 * 10_000 + k % 10) / 1e6
        )
    };
    let rows: String = (0..100).map(row).collect();
    assert_eq!(
        complaint(format!("t,{AXES}\n{rows}"), ""),
        "footfall: x.csv: the sample rate is 1000000 Hz, allowed is 20 to 10000 Hz; rows that \
         arrive in batches are spaced by --times rate\n"
    );
}

#[test]
fn out_of_range_sample_rate_error_names_the_option() {
    assert_eq!(
        complaint(
            "0,0,0,0,0,0,0,0,0,0,0,0,1\n",
            "--format pce-atlas --sample-rate 1e-30"
        ),
        "footfall: --sample-rate is 1e-30 Hz, allowed is 20 to 10000 Hz\n"
    );
}

#[test]
fn out_of_range_parameter_error_gives_value_and_range() {
    assert_eq!(
        complaint(standing(), "--preset paper --window 9000samples"),
        "footfall: --window comes to 9000 samples at this sample rate, allowed is 1 to \
         4096\n"
    );
    let bench = Bench::with("x.csv", standing());
    fs::write(bench.path("robot.toml"), "decision.threshold = 1.5\n").expect("a file");
    assert_eq!(
        bench.error("replay x.csv --config robot.toml"),
        "footfall: robot.toml, line 1, column 10, key decision.threshold is 1.5, allowed is 0.01 to 0.99\n"
    );
    assert_eq!(
        complaint(standing(), "--preset paper --window=-5ms"),
        "footfall: --window is -5 ms, allowed is 0.1 to 1000000 ms\n"
    );
}

#[test]
fn half_widths_without_their_method_are_rejected() {
    assert_eq!(
        complaint(standing(), "--window 20ms"),
        "footfall: --window has an effect with method = \"half_widths\" only, and the method is \
         \"self_calibrating\", which needs no half-widths: leave it out, or set method = \
         \"half_widths\" in the configuration\n"
    );
    let bench = Bench::with("x.csv", standing());
    let table = "[half_width]\nangular_rate_rad_s = 0.1\n";
    fs::write(bench.path("robot.toml"), table).expect("a file");
    assert!(bench.error("replay x.csv --config robot.toml").starts_with(
        "footfall: robot.toml, line 1, column 2, key half_width has an effect with method"
    ),);
    bench.stdout("replay x.csv --config robot.toml --preset paper");
}

#[test]
fn out_of_range_warm_start_error_gives_value_and_range() {
    let classes = "{ still = -1, moving = -2, width = 0.5 }";
    let text = format!(
        "[learnt]\nstill_seconds = 2\nmoving_seconds = 3\nidle_seconds = 4\n\
         acceleration = {classes}\nrate = {classes}\nvelocity = {classes}\n"
    );
    let bench = Bench::with("x.csv", standing());
    fs::write(bench.path("robot.toml"), text).expect("a file");
    assert_eq!(
        bench.error("replay x.csv --config robot.toml"),
        "footfall: robot.toml, line 5, column 30, key learnt.acceleration.moving is -2, allowed \
         is -1 to 9.3\n"
    );
}

#[test]
fn configuration_error_names_file_line_and_key() {
    let bench = Bench::with("x.csv", standing());
    let complaint = |content: &str| {
        fs::write(bench.path("robot.toml"), content).expect("a file");
        bench.error("replay x.csv --config robot.toml")
    };
    assert_eq!(
        complaint("[decision]\nthresold = 0.6\n"),
        "footfall: robot.toml, line 2, column 1, key decision.thresold: unknown field `thresold`, \
         expected one of `threshold`, `on_delay_s`, `off_delay_s`\n"
    );
    assert_eq!(
        complaint("window = '50'\n"),
        "footfall: robot.toml, line 1, column 10, key window: \"50\" is no window: write a duration such \
         as 50ms or a count such as 50samples\n"
    );
    assert_eq!(
        bench.error("replay x.csv --config none.toml"),
        "footfall: none.toml cannot be read: No such file or directory (os error 2)\n"
    );
}

#[test]
fn invalid_option_error_states_the_syntax() {
    let bench = Bench::with("x.csv", standing());
    for (option, hint) in [
        (
            "--window 50",
            "write a duration such as 50ms or a count such as 50samples",
        ),
        ("--gravity maybe", "possible values: included, removed"),
        ("--sample-rate -5", "write a number of Hz above 0"),
        (
            "--format xml",
            "possible values: pce-atlas, pce-go1, lcd, csv",
        ),
    ] {
        let (name, value) = option.split_once(' ').expect("a value");
        let stderr = bench.error(&format!("replay x.csv {name}={value}"));
        assert!(stderr.contains(hint), "{stderr}");
    }
}

#[test]
fn missing_result_directory_is_rejected() {
    assert_eq!(
        complaint(standing(), "--output no/out.csv"),
        "footfall: no/out.csv cannot be written: there is no directory no\n"
    );
}

#[test]
fn result_never_overwrites_the_recording() {
    let bench = Bench::with("x.csv", standing());
    assert_eq!(
        bench.error("replay x.csv --output ./x.csv"),
        "footfall: ./x.csv cannot be written: it is the recording itself\n"
    );
    assert_eq!(read(&bench.path("x.csv")), standing());
}

#[test]
fn two_results_in_one_file_are_rejected() {
    let bench = Bench::with("x.csv", standing());
    assert_eq!(
        bench.error("replay x.csv --output - --json"),
        "footfall: standard output takes one result: a table or picture (-), or --json\n"
    );
    for same in ["a.csv", "./a.csv"] {
        assert_eq!(
            bench.error(&format!("replay x.csv --output a.csv --events {same}")),
            format!("footfall: {same} cannot be written: it is named for two results\n")
        );
    }
    assert_eq!(bench.files(), ["x.csv"]);
}

#[test]
fn unwritable_result_is_rejected_before_writing() {
    let bench = Bench::with("x.csv", standing());
    fs::create_dir(bench.path("walks.svg")).expect("a directory");
    for (picture, why) in [
        ("no/x.svg", "there is no directory no"),
        ("walks.svg", "it is a directory"),
        (
            "x.jpg",
            "pictures are SVG or pages, so the name must end in .svg or .html",
        ),
        (
            "x",
            "pictures are SVG or pages, so the name must end in .svg or .html",
        ),
    ] {
        assert_eq!(
            bench.error(&format!("replay x.csv --output ok.csv --plot {picture}")),
            format!("footfall: {picture} cannot be written: {why}\n")
        );
        assert_eq!(bench.files(), ["walks.svg", "x.csv"]);
    }
}

#[test]
fn failed_replay_leaves_no_result() {
    let bench = Bench::with("x.csv", standing() + "1.0,0,0,oops,0,0,0,50,1\n");
    bench.error("replay x.csv --output out.csv --plot out.svg");
    assert_eq!(bench.files(), ["x.csv"]);
}
