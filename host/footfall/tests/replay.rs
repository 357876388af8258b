//! Tests of `footfall replay` as a program: output, files and exit codes.

use std::fs;
use std::iter;

use crate::common::{AXES, Bench, Lines, assert_has, read, standing, text};
use estimator_core::any::AnyParams;
use footfall::plot;
use options::{Format, InputOptions};
use samples::estimate::estimates_of;

#[cfg(unix)]
#[test]
fn row_of_a_stream_is_printed_before_the_next_line_comes() {
    use std::io::Write;
    use std::process::Stdio;

    let bench = Bench::with("walk.csv", standing());
    bench.stdout("replay walk.csv --output out.csv");
    let (input, expected) = (standing(), read(&bench.path("out.csv")));
    for (arguments, held) in [("--sample-rate 1000", 20), ("", 1000)] {
        let mut command = bench.command(&format!("replay - --output - {arguments}"));
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program that was just built");
        let mut to = child.stdin.take().expect("a pipe");
        let rows = Lines::of(child.stdout.take().expect("a pipe"));
        let mut lines = input.lines();
        let mut printed = Vec::new();
        // The first rows show the format. Without a given rate, the rows of the first second are needed, too.
        for line in lines.by_ref().take(1 + held) {
            writeln!(to, "{line}").expect("it is read");
        }
        if held < 1000 {
            printed.extend((0..1 + held).map_while(|_| rows.next()));
            for line in lines {
                writeln!(to, "{line}").expect("it is read");
                printed.push(rows.next().expect("its row"));
            }
        }
        drop(to);
        printed.extend(iter::from_fn(|| rows.next()));
        assert!(child.wait().expect("it ends").success());
        assert_eq!(printed, expected.lines().collect::<Vec<_>>(), "{arguments}");
    }
}

#[cfg(unix)]
#[test]
fn finding_about_a_stream_is_reported_before_its_end() {
    use std::io::Write;
    use std::process::Stdio;

    let bench = Bench::new();
    let mut command = bench.command("replay - --output - --sample-rate 100");
    let child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = child.spawn().expect("the program that was just built");
    let mut to = child.stdin.take().expect("a pipe");
    // Six seconds at rest, in g.
    let row = |k: u32| format!("{:.2},0.00{},0,1.0{},0,0,0\n", f64::from(k) / 100.0, k % 7, k % 5);
    let rows: String = (0..600).map(row).collect();
    to.write_all(format!("t,{AXES}\n{rows}").as_bytes()).expect("it is read");
    to.flush().expect("it is sent");
    let said = Lines::of(child.stderr.take().expect("a pipe"));
    assert_has(&said.next().expect("a finding"), "which looks like g: --units g");
    drop(to);
    // It is said once.
    let mut rest = iter::from_fn(|| said.next());
    assert!(rest.all(|line| !line.contains("looks like g")));
    assert!(child.wait().expect("it ends").success());
}

#[test]
fn replay_writes_header_and_one_row_per_sample() {
    let bench = Bench::with("walk.csv", standing());
    bench.stdout("replay walk.csv --format csv --output out.csv");
    let table = read(&bench.path("out.csv"));
    let mut lines = table.lines();
    assert_eq!(
        lines.next(),
        Some(
            "t,p_stable,p_tangential,p_vertical,p_ax,p_ay,p_az,p_wx,p_wy,p_wz,\
             qw,qx,qy,qz,lax,lay,laz,bwx,bwy,bwz,sigma_v,state,decision,flags"
        )
    );
    assert_eq!(lines.clone().count(), 1000);
    let last: Vec<_> = lines.last().expect("rows").split(',').collect();
    assert_eq!((last[0], last[21], last[22], last[23]), ("0.999000", "stance", "1", "settling"));
    let sigma: f64 = last[20].parse().expect("a number");
    assert!(sigma > 0.0 && sigma < 0.01, "{sigma}");
    let stable: f64 = last[1].parse().expect("a number");
    assert!(stable > 0.99 && stable <= 1.0, "{stable}");
}

#[test]
fn times_are_preserved_for_any_clock_origin() {
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
        let times = table.lines().skip(1).map(|row| row.split(',').next().unwrap_or_default());
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
fn figure_covers_the_whole_recording() {
    let bench = Bench::with("walk.csv", standing());
    bench.stdout("replay walk.csv --plot out.svg");
    let loaded = recordings::read(&bench.path("walk.csv"), Format::Csv, &InputOptions::default());
    let recording = loaded.expect("a recording").recording;
    let estimates = estimates_of(&recording, &AnyParams::DEFAULT).expect("the preset");
    let expected = plot::svg(&recording, &estimates).expect("a picture");
    assert!(read(&bench.path("out.svg")) == expected);
    // The figure equals the one drawn in process, and differs from a figure of the first estimate alone.
    assert!(expected != plot::svg(&recording, &estimates[..1]).expect("a picture"));
}

#[test]
fn options_override_configuration_and_preset() {
    let bench = Bench::with("walk.csv", standing());
    fs::write(
        bench.path("robot.toml"),
        "method = 'half_widths'\nwindow = '30samples'\ngravity = 'removed'\n",
    )
    .expect("a file");
    let window = |arguments: &str| {
        let summary = bench.json(&format!("replay walk.csv {arguments}"));
        summary["recordings"][0]["flag_counts"]["window_not_full"].clone()
    };
    assert_eq!(window("--gravity removed --preset paper"), 49);
    assert_eq!(window("--config robot.toml"), 29);
    assert_eq!(window("--config robot.toml --window 10ms"), 9);
}

#[test]
fn ignored_columns_are_listed_on_stderr() {
    let bench =
        Bench::with("walk.csv", format!("t,{AXES},qw,mood\n0,0,0,9,0,0,0,,\n1,0,0,9,0,0,0,,\n"));
    let output = bench.run("replay walk.csv --sample-rate 100 --format csv");
    assert_eq!(
        text(&output.stderr).lines().next(),
        Some("footfall: walk.csv: column t gives 1.00 Hz, but the given sample rate is 100 Hz")
    );
    let rows = "0,0,0,9,0,0,0,,\n0.01,0,0,9,0,0,0,,\n";
    let bench = Bench::with("walk.csv", format!("t,{AXES},qw,mood\n{rows}"));
    let output = bench.run("replay walk.csv");
    assert!(output.status.success());
    assert_eq!(text(&output.stderr), "footfall: walk.csv: ignored columns: qw, mood\n");
}

#[test]
fn skipped_go1_rows_are_reported_on_stderr() {
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
fn pipes_are_read_and_written() {
    let bench = Bench::with("walk.csv", standing());
    let output = bench
        .shell("sh", "cat walk.csv | \"$0\" replay /dev/stdin --plot /dev/stdout")
        .expect("a shell");
    assert!(output.status.success(), "{output:?}");
    assert!(text(&output.stdout).starts_with("<svg"));
}

#[cfg(target_os = "linux")]
#[test]
fn unwritable_output_streams_cause_no_panic() {
    let bench = Bench::with("x.csv", format!("{AXES},more\n0,0,9,0,0,0,1\n"));
    // Exit code of a panic is 101.
    for (arguments, expected) in [
        // This command warns about an ignored column.
        ("replay x.csv --sample-rate 100 2>/dev/full", 0),
        ("replay absent.csv 2>/dev/full", 1),
        ("replay x.csv --sample-rate 100 >/dev/full", 1),
        ("replay x.csv --sample-rate 100 >/dev/full 2>/dev/full", 1),
    ] {
        let output = bench.shell("sh", &format!("\"$0\" {arguments}")).expect("a shell");
        assert_eq!(output.status.code(), Some(expected), "{arguments}: {output:?}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn full_disk_error_names_the_result() {
    let bench = Bench::with("x.csv", format!("{AXES}\n0,0,9,0,0,0\n"));
    for (result, expected) in [
        ("--output /dev/full", "footfall: /dev/full cannot be written: No space left"),
        ("--output - >/dev/full", "footfall: standard output cannot be written: No space left"),
        ("--json >/dev/full", "footfall: standard output cannot be written: No space left"),
    ] {
        let line = format!("\"$0\" replay x.csv --sample-rate 100 {result}");
        let output = bench.shell("sh", &line).expect("a shell");
        assert_eq!(output.status.code(), Some(1), "{result}");
        assert!(text(&output.stderr).starts_with(expected), "{result}: {output:?}");
    }
}

#[test]
fn configuration_sets_a_missing_sample_rate() {
    let bench = Bench::with("x.csv", format!("{AXES}\n0,0,9,0,0,0\n0,0,9,0,0,0\n"));
    fs::write(bench.path("robot.toml"), "sample_rate_hz = 400\n").expect("a file");
    let summary = bench.stdout("replay x.csv --config robot.toml");
    assert!(summary.starts_with("x: 2 samples, 0.003 s at 400 Hz"), "{summary}");
    let summary = bench.stdout("replay x.csv --config robot.toml --sample-rate 100");
    assert!(summary.contains("at 100 Hz"), "{summary}");
}

#[test]
fn default_preset_uses_load_threshold_of_the_format() {
    // 100 N exceeds the threshold of a GO1, but not of an ATLAS; 100 raw units do not exceed that of a GO1.
    // After 1000 rows the estimator has evidence that the foot stands.
    let atlas = |load: u32| format!("0,0,{load},0,0,0,0,0,0,0,0,0,1\n").repeat(1000);
    let go1 = |load: u32| format!("{load},0,0,1,0,0,0\n").repeat(1000);
    for (content, format, state) in [
        (atlas(100), "pce-atlas", "quiet_swing"),
        (atlas(200), "pce-atlas", "stance"),
        // A NAO weighs 50 N, so 12 N is already a load.
        (atlas(5), "lcd", "quiet_swing"),
        (atlas(20), "lcd", "stance"),
        (go1(100), "pce-go1", "quiet_swing"),
        (go1(200), "pce-go1", "stance"),
    ] {
        let bench = Bench::with("x.csv", content);
        let summary = bench.json(&format!("replay x.csv --format {format}"));
        let shares = &summary["recordings"][0]["state_shares"];
        let largest = |other: &str| shares[other].as_f64() <= shares[state].as_f64();
        assert!(["stance", "quiet_swing", "swing", "slip"].into_iter().all(largest), "{summary}");
        assert!(shares[state].as_f64() > Some(0.2), "{summary}");
    }
}

#[test]
fn streamed_rows_have_the_notices_of_a_file() {
    let row = |k: u32| format!("{:.3},0,0,9.81,0,0,0\n", f64::from(k) * 0.01);
    let rows: String = (0..100).map(row).collect();
    let output =
        Bench::new().piped("replay - --output - --preset paper", &format!("t,{AXES}\n{rows}"));
    assert!(output.status.success(), "{output:?}");
    let window = "the window of the paper's preset, 50 samples, lasts 500 ms at 100 Hz";
    assert_has(&text(&output.stderr), window);
}

#[test]
fn paper_window_duration_is_reported_at_other_rates() {
    let rows = |seconds: f64| -> String {
        let row = |k: u32| format!("{:.3},0,0,9.81,0,0,0\n", f64::from(k) * seconds);
        (0..100).map(row).collect()
    };
    let notice = |seconds: f64, arguments: &str| {
        let bench = Bench::with("walk.csv", format!("t,{AXES}\n{}", rows(seconds)));
        let output = bench.run(&format!("replay walk.csv {arguments}"));
        assert!(output.status.success(), "{output:?}");
        text(&output.stderr)
    };
    assert_eq!(
        notice(0.01, "--preset paper"),
        "footfall: walk: the window of the paper's preset, 50 samples, lasts 500 ms at 100 Hz \
         and 50 ms at the paper's rate: --window 50ms has the same duration\n"
    );
    for (seconds, arguments) in
        [(0.001, "--preset paper"), (0.01, "--preset paper --window 50ms"), (0.01, "")]
    {
        assert_eq!(notice(seconds, arguments), "");
    }
}
