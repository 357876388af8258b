//! Tests of `footfall replay --events` and `--plot` as a program.

use std::fs;

use crate::common::{Bench, read, standing};
use gait::{Plan, SensorParams, simulate};
use tables::output::write_recording;

/// Returns the demo walk as a table.
fn walk() -> Vec<u8> {
    let walk = simulate(&Plan::demo(1), &SensorParams::LSM6DSOX, 1).recording;
    let mut table = Vec::new();
    write_recording(&walk.samples, &mut table).expect("memory");
    table
}

/// Returns the cells of a table without its header.
fn rows(table: &str) -> Vec<Vec<&str>> {
    let rows = table.lines().skip(1);
    rows.map(|row| row.split(',').collect()).collect()
}

#[test]
fn each_event_of_a_walk_has_one_row() {
    let bench = Bench::with("walk.csv", walk());
    let said = bench.stdout("replay walk.csv --events events.csv");
    assert!(said.ends_with("written  events.csv\n"), "{said}");
    let table = read(&bench.path("events.csv"));
    assert!(table.starts_with("t,event,duration,p_peak,distance\n"));
    let rows = rows(&table);
    let count = |event| rows.iter().filter(|row| row[1] == event).count();
    let counts = ["touch_down", "lift_off", "slip_start", "slip_end"].map(count);
    assert_eq!(counts, [12, 12, 4, 4]);
    for row in &rows {
        assert_eq!(row[4].is_empty(), !row[1].starts_with("slip"), "{row:?}");
    }
    // The recording begins and ends in stance.
    let blank: Vec<_> = rows.iter().filter(|row| row[2].is_empty()).collect();
    assert_eq!(blank.iter().map(|row| row[1]).collect::<Vec<_>>(), ["lift_off", "touch_down"]);
    assert_eq!((blank[0], blank[1]), (&rows[0], &rows[rows.len() - 1]));
}

#[test]
fn events_of_several_feet_name_the_foot_on_stdout() {
    let bench = Bench::with("RL.csv", walk());
    fs::write(bench.path("R,R.csv"), walk()).expect("a file");
    let table = bench.stdout("replay RL.csv R,R.csv --events -");
    let mut lines = table.lines();
    assert_eq!(lines.next(), Some("foot,t,event,duration,p_peak,distance"));
    let of = |foot: &str| lines.clone().filter(|line| line.starts_with(foot)).count();
    assert_eq!((of("RL,"), of("\"R,R\",")), (32, 32));
    assert_eq!(lines.count(), 64);
}

#[test]
fn event_times_are_on_the_recording_clock() {
    let late = |line: &str| {
        let (time, rest) = line.split_once(',').expect("a row");
        let time: f64 = time.parse().expect("a time");
        format!("{:.6},{rest}\n", time + 1000.0)
    };
    let table = String::from_utf8(walk()).expect("UTF-8");
    let (header, rest) = table.split_once('\n').expect("a header");
    let bench = Bench::with("walk.csv", &table);
    let later: String = rest.lines().map(late).collect();
    fs::write(bench.path("later.csv"), format!("{header}\n{later}")).expect("a file");
    let first = |file: &str| -> f64 {
        let table = bench.stdout(&format!("replay {file} --events -"));
        rows(&table)[0][0].parse().expect("a time")
    };
    assert!((first("later.csv") - first("walk.csv") - 1000.0).abs() < 1e-5);
}

#[test]
fn span_contains_its_events() {
    let bench = Bench::with("walk.csv", walk());
    let whole = bench.stdout("replay walk.csv --events -");
    let part = bench.stdout("replay walk.csv --events - --from 5 --to 6.2");
    let (whole, part) = (rows(&whole), rows(&part));
    let within: Vec<_> = whole
        .iter()
        .filter(|row| (5.0..6.2).contains(&row[0].parse::<f64>().expect("a time")))
        .collect();
    assert_eq!(part.len(), within.len());
    // The last stance and its slip have not ended.
    let complete = part.iter().zip(within).filter(|(part, whole)| part == whole);
    assert_eq!(complete.count(), part.len() - 2);
    assert!(part[part.len() - 2..].iter().all(|row| row[2].is_empty()));
}

#[test]
fn page_is_one_file_for_all_feet() {
    let bench = Bench::with("RL.csv", standing());
    fs::write(bench.path("<!--<script>.csv"), standing()).expect("a file");
    let said = bench.stdout("replay RL.csv <!--<script>.csv --plot out.html");
    assert!(said.ends_with("written  out.html\n"), "{said}");
    assert_eq!(bench.files(), ["<!--<script>.csv", "RL.csv", "out.html"]);
    let page = read(&bench.path("out.html"));
    assert!(page.contains("<title>RL, &lt;!--&lt;script&gt;</title>"));
    assert_eq!(page.matches("\"load_title\"").count(), 0);
    assert_eq!(page.matches("\"name\":\"force (N)\"").count(), 2);
}
