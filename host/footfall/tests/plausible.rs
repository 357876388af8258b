//! Tests of findings: each is printed on one line, and fails the command with `--strict`.

use std::fs;

use crate::common::{AXES, Bench, standing, text};

/// Returns a foot at rest with 1000 rows `seconds` apart; `row` maps the time, s, to a row.
fn resting(seconds: f64, row: impl Fn(f64) -> String) -> Bench {
    let rows: String = (0..1000).map(|k| row(f64::from(k) * seconds) + "\n").collect();
    Bench::with("x.csv", format!("t,{AXES}\n{rows}"))
}

/// Returns the findings on stderr and their names in the JSON.
fn replayed(bench: &Bench, options: &str) -> (String, Vec<String>) {
    let output = bench.run(&format!("replay x.csv --json {options}"));
    assert!(output.status.success(), "{output:?}");
    let summary: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let findings = summary["recordings"][0]["input"]["findings"].as_array().expect("a list");
    let name = |finding: &serde_json::Value| finding["name"].as_str().expect("a name").to_owned();
    (text(&output.stderr), findings.iter().map(name).collect())
}

#[test]
fn plausible_recording_has_no_finding() {
    let bench = Bench::with("x.csv", standing());
    assert_eq!(replayed(&bench, "--strict"), (String::new(), vec![]));
}

#[test]
fn finding_has_a_line_and_a_name() {
    let at = |force: &'static str| move |t: f64| format!("{t:.4},{force},0,0,0");
    for (bench, options, name, line) in [
        (
            resting(0.001, at("0,0,1")),
            "",
            "acceleration_in_g",
            "the acceleration is 1.00 m/s² at rest, which looks like g: --units g",
        ),
        (
            resting(0.001, |t| {
                let rate = if t < 0.3 { 0.1 } else { 900.0 };
                format!("{t:.4},0,0,9.81,{},0,0", rate * (30.0 * t).sin())
            }),
            "",
            "rate_in_degrees",
            "the angular rate exceeds 899 rad/s in every hundredth sample, which looks like °/s: \
             --units dps",
        ),
        (
            resting(0.02, |t| format!("{t:.4},0,0,9.81,{},0,0", 0.001 * (30.0 * t).sin())),
            "",
            "low_rate",
            "50 Hz is too low for the windows of the estimate, which was chosen with 100 Hz and \
             more",
        ),
    ] {
        let line = format!("footfall: x.csv: {line}\n");
        assert_eq!(replayed(&bench, options), (line.clone(), vec![name.to_owned()]));
        assert_eq!(
            bench.error(&format!("replay x.csv --strict --output o.csv {options}")),
            format!("{line}footfall: x.csv: --strict rejects 1 of the findings above\n")
        );
        assert_eq!(bench.files(), ["x.csv"]);
    }
}

#[test]
fn batched_rows_finding_is_resolved_by_spacing() {
    // Two rows 0.1 ms apart, every 2 ms.
    let bench = resting(0.001, |t| {
        let row = (t * 1e3).round() as i64;
        let micros = row / 2 * 2_000 + row % 2 * 100;
        format!("{:.6},0,0,9.81,0,0,0", micros as f64 / 1e6)
    });
    let (stderr, names) = replayed(&bench, "");
    assert_eq!(names, ["batches"]);
    assert_eq!(
        stderr,
        "footfall: x.csv: 50 % of the rows come right after another, as if they arrive in batches: \
         --times rate\n"
    );
    let (stderr, names) = replayed(&bench, "--times rate");
    assert!(stderr.contains("500 rows moved"), "{stderr}");
    assert_eq!(names, [""; 0]);
}

#[test]
fn negative_load_finding_is_resolved_by_its_factor() {
    let load = |row: u32| if row % 200 < 100 { -40 } else { 0 };
    let row = |k: u32| format!("{:.3},0,0,9.81,0,0,0,{}\n", f64::from(k) * 0.001, load(k));
    let rows: String = (0..1000).map(row).collect();
    let bench = Bench::with("x.csv", format!("t,{AXES},force\n{rows}"));
    let (stderr, names) = replayed(&bench, "");
    assert_eq!(names, ["load_negative"]);
    assert_eq!(
        stderr,
        "footfall: x.csv: the load is -40 in stances, as of a sensor whose z points down (on a foot, set \
         load_input.scale): --scale 1,1,-1 turns its sign\n"
    );
    assert_eq!(replayed(&bench, "--scale 1,1,-1"), (String::new(), vec![]));
}

#[test]
fn calibrate_reports_the_same_findings() {
    let bench = resting(0.001, |t| format!("{t:.4},0,0,1,0,0,0"));
    bench.refuses("calibrate x.csv --strict", "which looks like g: --units g");
}

#[test]
fn calibrate_json_has_findings_of_each_file() {
    // Each side of the sensor has a rate that is too low. Gravity does not have to be along z here.
    let bench = Bench::new();
    let mut files = Vec::new();
    for (k, side) in ["g,0,0", "-g,0,0", "0,g,0", "0,-g,0", "0,0,g", "0,0,-g"].iter().enumerate() {
        let force = side.replace('g', "9.81");
        let row = |row: u32| format!("{:.2},{force},0,0,0\n", f64::from(row) * 0.02);
        let rows: String = (0..500).map(row).collect();
        let name = format!("side{k}.csv");
        fs::write(bench.path(&name), format!("t,{AXES}\n{rows}")).expect("a file");
        files.push(name);
    }
    let report = bench.json(&format!("calibrate --rests {}", files.join(" ")));
    for file in files {
        let findings = &report["inputs"][&file]["findings"];
        assert_eq!(findings[0]["name"], "low_rate", "{report}");
        assert!(findings[1].is_null(), "{report}");
    }
}
