//! Tests of `footfall attitude` as a program: output and rejected inputs.

use crate::common::{AXES, Bench};

/// Returns a level sensor for two seconds. The truth counts from the second on and leans by 2 · asin(0.01) about x.
fn leaning(movement: &str) -> String {
    let rows: String = (0..200)
        .map(|k| {
            let truth = if k < 100 { ",,," } else { "0.99995,0.01,0,0" };
            format!(
                "{:.2},0,0,9.81,0,0,0,{truth},{movement}\n",
                f64::from(k) * 0.01
            )
        })
        .collect();
    format!("t,{AXES},qw,qx,qy,qz,movement\n{rows}")
}

#[test]
fn each_recording_and_the_mean_are_scored() {
    let bench = Bench::with("level.csv", leaning("1"));
    let text = bench.stdout("attitude level.csv");
    assert!(text.contains("level   1.146   1.146\n"), "{text}");
    std::fs::write(bench.path("again.csv"), leaning("1")).expect("a file");
    let markdown = bench.stdout("attitude level.csv again.csv --markdown");
    assert!(markdown.ends_with("| again | 1.15° | 1.15° |\n| mean | 1.15° | 1.15° |\n"));
    let json: serde_json::Value =
        serde_json::from_str(&bench.stdout("attitude level.csv --json")).expect("JSON");
    assert_eq!(json["recordings"][0]["scored_samples"], 100);
    assert!((json["mean_rms_deg"].as_f64().expect("a number") - 1.146).abs() < 0.001);
}

#[test]
fn foreign_table_is_read_with_replay_options() {
    let ours = leaning("1");
    let bench = Bench::with("level.csv", &ours);
    let score = |text: String| {
        let mean = text.lines().last().map(|line| line.replace(' ', ""));
        mean.expect("a line")
    };
    let expected = score(bench.stdout("attitude level.csv"));
    // In g and ms, with other column names.
    let theirs = format!(
        "stamp,a,b,c,d,e,f,{}",
        ours.split_once("wz,").expect("axes").1
    )
    .replace("0,0,9.81,", "0,0,1,")
    .lines()
    .enumerate()
    .map(|(k, line)| match line.split_once(',') {
        Some((_, rest)) if k > 0 => format!("{},{rest}\n", 10 * (k - 1)),
        _ => format!("{line}\n"),
    })
    .collect::<String>();
    std::fs::write(bench.path("theirs.csv"), theirs).expect("a file");
    let map = "--map t=stamp,ax=a,ay=b,az=c,wx=d,wy=e,wz=f --time-unit ms";
    let read = bench.stdout(&format!("attitude theirs.csv {map} --units g"));
    assert_eq!(score(read), expected);
    let said = crate::common::text(&bench.run(&format!("attitude theirs.csv {map}")).stderr);
    assert!(said.contains("which looks like g: --units g"), "{said}");
    let said = bench.error(&format!("attitude theirs.csv {map} --strict"));
    assert!(said.contains("--strict"), "{said}");
}

#[test]
fn recording_counts_once() {
    let bench = Bench::with("level.csv", leaning("1"));
    assert_eq!(
        bench.error("attitude level.csv ./level.csv"),
        "footfall: ./level.csv is named twice: what it shows would count twice\n"
    );
}

#[test]
fn configuration_changes_the_filter() {
    let bench = Bench::with("level.csv", leaning("1"));
    std::fs::write(bench.path("wrong.toml"), "[attitude]\nquiet_gain = 0.5\n").expect("a file");
    let error = bench.error("attitude level.csv --config wrong.toml");
    assert_eq!(
        error,
        "footfall: wrong.toml, line 2, column 1, key attitude.quiet_gain is 0.5, allowed is 1 to 10000\n"
    );
}

#[test]
fn recording_without_truth_is_rejected_with_reason() {
    let bench = Bench::with("plain.csv", crate::common::standing());
    assert_eq!(
        bench.error("attitude plain.csv"),
        "footfall: plain.csv, line 1: missing in the header: qw, qx, qy, qz\n"
    );
    let bench = Bench::with("unmoved.csv", leaning("0"));
    assert!(
        bench
            .error("attitude unmoved.csv")
            .contains("no row has an orientation that counts")
    );
    let bench = Bench::with("wrong.csv", leaning("2"));
    assert!(bench.error("attitude wrong.csv").starts_with(
        "footfall: wrong.csv, line 2, column 12 (movement): 2 where 0 (does not count) or 1 (counts) is expected"
    ));
    let bench = Bench::with("long.csv", leaning("1").replace("0.99995", "1.99995"));
    assert!(bench.error("attitude long.csv").contains(
        "line 102, column 8 (qw): 1.99995 where the first of a quaternion of length 1 is expected"
    ));
    let bench = Bench::with("part.csv", leaning("1").replace("0.99995,0.01", "0.99995,"));
    assert!(
        bench
            .error("attitude part.csv")
            .contains("column 9 (qx): blank")
    );
}

#[test]
fn estimate_is_rejected_as_truth() {
    let bench = Bench::with(
        "level.csv",
        leaning("1").replacen("movement", "p_stable", 1),
    );
    assert!(
        bench
            .error("attitude level.csv")
            .contains("level.csv: qw, qx, qy and qz are estimates here")
    );
    let bench = Bench::with("twice.csv", leaning("1").replacen("movement", "qw", 1));
    assert_eq!(
        bench.error("attitude twice.csv"),
        "footfall: twice.csv, line 1, column 12 (qw): this name stands in the header twice\n"
    );
}

#[test]
fn sample_rate_option_replaces_missing_times() {
    let timeless = leaning("1").replacen("t,ax", "when,ax", 1);
    let bench = Bench::with("level.csv", timeless);
    assert!(bench.error("attitude level.csv").contains("--sample-rate"));
    let text = bench.stdout("attitude level.csv --sample-rate 100");
    assert!(text.contains("level   1.146   1.146\n"), "{text}");
}

#[test]
fn replay_ignores_the_truth() {
    let bench = Bench::with("level.csv", leaning("1"));
    let output = bench.run("replay level.csv");
    assert!(
        crate::common::text(&output.stderr).contains("ignored columns: qw, qx, qy, qz, movement")
    );
}
