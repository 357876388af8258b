//! Tests of several recordings at once, standard input and output, and spans.

use std::fs;

use crate::common::{AXES, Bench, cases, read, standing, text};

/// Returns a bench with three recordings, each of a foot at rest in a different orientation.
fn three() -> Bench {
    let bench = Bench::new();
    for (name, tilt) in [("one", 0.0), ("two", 0.5), ("three", 1.0)] {
        let row = |k: u32| format!("{:.3},{tilt},0,9.81,0,0,0\n", f64::from(k) * 1e-3);
        let rows: String = (0..500).map(row).collect();
        let path = bench.path(&format!("{name}.csv"));
        fs::write(path, format!("t,{AXES}\n{rows}")).expect("a file");
    }
    bench
}

fn recordings(json: &str) -> Vec<serde_json::Value> {
    let json: serde_json::Value = serde_json::from_str(json).expect("JSON");
    json["recordings"].as_array().expect("a list").clone()
}

#[test]
fn table_of_several_recordings_is_in_order_with_names() {
    let bench = three();
    bench.stdout("replay one.csv two.csv three.csv --output all.csv");
    let all = read(&bench.path("all.csv"));
    let mut expected = String::new();
    for name in ["one", "two", "three"] {
        bench.stdout(&format!("replay {name}.csv --output {name}-p.csv"));
        let table = read(&bench.path(&format!("{name}-p.csv")));
        let (header, rows) = table.split_once('\n').expect("a header");
        if expected.is_empty() {
            expected = format!("foot,{header}\n");
        }
        expected.extend(rows.lines().map(|row| format!("{name},{row}\n")));
    }
    assert!(all == expected);
}

#[test]
fn same_name_in_two_folders_is_kept_apart() {
    let bench = Bench::new();
    for folder in ["left", "right"] {
        fs::create_dir(bench.path(folder)).expect("a folder");
        fs::write(bench.path(folder).join("walk.csv"), standing()).expect("a file");
    }
    bench.stdout("replay left/walk.csv right/walk.csv --output all.csv --plot all.svg");
    let all = read(&bench.path("all.csv"));
    let rows = |foot: &str| all.lines().filter(|row| row.starts_with(foot)).count();
    assert_eq!((rows("left/walk.csv,"), rows("right/walk.csv,")), (1000, 1000));
    for picture in ["all-left_walk.csv.svg", "all-right_walk.csv.svg"] {
        assert!(bench.path(picture).exists(), "{:?}", bench.files());
    }
    for name in ["a+b.csv", "a~b.csv"] {
        fs::write(bench.path(name), standing()).expect("a file");
    }
    bench.stdout("replay a+b.csv a~b.csv --plot all.svg");
    assert!(bench.path("all-a_b.svg").exists() && bench.path("all-a_b-2.svg").exists());
}

#[test]
fn stdin_is_read_once() {
    let bench = Bench::new();
    let said = text(&bench.piped("replay - -", "").stderr);
    assert_eq!(said, "footfall: - is named twice, and its samples would count twice\n");
    fs::write(bench.path("x.csv"), standing()).expect("a file");
    bench.stdout("replay x.csv --output out.csv");
    let output = bench.piped("replay - --output -", &standing());
    assert!(output.stdout == read(&bench.path("out.csv")).as_bytes());
    assert!(output.stderr.is_empty(), "{output:?}");
    assert_eq!(bench.files(), ["out.csv", "x.csv"]);
}

#[test]
fn impossible_spans_are_rejected() {
    let bench = Bench::with("x.csv", standing());
    for (span, expected) in cases(
        "
        --from 2 => x.csv: --from 2 is after its end; the recording lasts 0.999 s
        --from 0.5001 --to 0.5005 => footfall: x.csv: there is no sample from --from to --to
        --from 2 --to 1.5 => --to 1.5 is not after --from 2
        --from=-1 => is not a time since the first sample
        --to soon => is not a time since the first sample
        --from nan => is not a time since the first sample
        ",
    ) {
        bench.refuses(&format!("replay x.csv {span} --output p.csv"), expected);
    }
    assert_eq!(bench.files(), ["x.csv"]);
}

#[test]
fn results_are_independent_of_jobs() {
    let bench = three();
    let inputs = "one.csv two.csv three.csv";
    let outputs = |jobs: u32| {
        let json =
            bench.stdout(&format!("replay {inputs} --jobs {jobs} --json --output {jobs}.csv"));
        (json, read(&bench.path(&format!("{jobs}.csv"))))
    };
    let alone = outputs(1);
    assert!(outputs(2) == alone && outputs(9) == alone);
    let names: Vec<_> = recordings(&alone.0)
        .iter()
        .map(|one| one["recording"].as_str().expect("a name").to_owned())
        .collect();
    assert_eq!(names, ["one", "two", "three"]);
}

#[test]
fn unreadable_recording_is_named_and_nothing_written() {
    let bench = three();
    fs::write(bench.path("two.csv"), "t,ax\n0,0\n").expect("a file");
    bench.refuses(
        "replay one.csv two.csv three.csv --output all.csv",
        "footfall: two.csv, line 1: missing",
    );
    assert!(!bench.path("all.csv").exists());
}

#[test]
fn span_has_the_estimates_of_the_whole_recording() {
    let bench = Bench::with("x.csv", standing());
    bench.stdout("replay x.csv --output whole.csv");
    let json = bench.stdout("replay x.csv --from 0.25 --to 0.5 --output part.csv --json");
    let whole = read(&bench.path("whole.csv"));
    let part = read(&bench.path("part.csv"));
    assert_eq!(part.lines().count(), 251);
    let rows: Vec<_> = whole.lines().skip(251).take(250).collect();
    assert!(part.lines().skip(1).eq(rows));
    assert_eq!(recordings(&json)[0]["samples"], 250);
    assert_eq!(recordings(&json)[0]["duration_s"], 0.249);
}

#[test]
#[cfg(feature = "bags")]
fn stdin_does_not_become_a_copy_of_a_bag() {
    let said = Bench::new().piped("replay - --output out.mcap", "").stderr;
    let said = text(&said);
    assert!(said.contains("which is read twice"), "{said}");
    assert!(!said.contains("give one mcap"), "{said}");
}
