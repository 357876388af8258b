//! Tests of `footfall replay` of bags with the contacts that a foot sent.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::sync::Arc;

use crate::common::{Bench, assert_has, page_data, read, text};
use estimator_core::Timestamp;
use footfall::ros::message::{Header, Imu, RosContact, Time, TwistWithCovarianceStamped};
use footfall::ros::{McapFile, Published, RosMessage};
use serde_json::Value;

/// Time of the first contact, µs since 1970.
const START_US: u64 = 1_700_000_000_000_000;

/// Contacts of the bag, one per millisecond.
const CONTACTS: u64 = 2000;

/// Milliseconds in which the foot reports a swing, although its sensor rests.
const SWING: std::ops::Range<u64> = 1000..1400;

/// Returns probability and standard deviation of the velocity of a contact.
fn numbers(ms: u64) -> (f32, f32) {
    let swings = SWING.contains(&ms);
    let stable = if swings { 0.01 } else { 0.9 } + ms as f32 * 1.0e-5;
    (stable, 0.25 + ms as f32 * 1.0e-3)
}

/// Writes a bag of a foot whose sensor rests, with samples at 50 Hz, and with contacts that report a step.
fn bag(bench: &Bench) {
    bag_of(bench, [0.0, 0.0, 9.81]);
}

/// Writes the same with these readings of the accelerometer.
fn bag_of(bench: &Bench, linear_acceleration: [f64; 3]) {
    write_bag(bench, "walk.mcap", Some(linear_acceleration));
}

/// Writes the bag with these readings of the accelerometer, or without samples.
fn write_bag(bench: &Bench, name: &str, acceleration: Option<[f64; 3]>) {
    let file = File::create(bench.path(name)).expect("a file");
    let mut bag = McapFile::new(file).expect("a bag");
    for ms in 0..CONTACTS {
        let at = Timestamp::from_micros(START_US + 1000 * ms);
        let header = Header { stamp: Time::from(at), frame_id: "footfall_FL".to_owned() };
        let (p_stable, sigma) = numbers(ms);
        let swings = SWING.contains(&ms);
        let contact = RosContact {
            header: header.clone(),
            foot: "FL".to_owned(),
            p_stable,
            p_tangential: if swings { 0.3 } else { 0.95 },
            p_vertical: if swings { 0.02 } else { 0.99 },
            p_axes: [f32::NAN; 6],
            decision: !swings,
            valid: true,
            ..RosContact::default()
        };
        let mut velocity =
            TwistWithCovarianceStamped { header: header.clone(), ..Default::default() };
        velocity.covariance[0][0] = f64::from(sigma).powi(2);
        let mut messages = vec![
            ("contact", RosMessage::Contact(contact)),
            ("velocity", RosMessage::Velocity(Box::new(velocity))),
        ];
        // The first sample is later than the first contact.
        if let Some(linear_acceleration) = acceleration
            && ms % 20 == 7
        {
            let imu = Imu {
                header,
                orientation: [0.0, 0.0, 0.0, 1.0],
                linear_acceleration,
                ..Imu::default()
            };
            messages.push(("imu", RosMessage::Imu(Box::new(imu))));
        }
        for (topic, message) in messages {
            let topic: Arc<str> = format!("/footfall/FL/{topic}").into();
            let published = Published { topic, at, message };
            bag.write(&published).expect("a message");
        }
    }
    bag.finish().expect("a bag");
}

fn json(text: &[u8]) -> Value {
    serde_json::from_slice(text).expect("JSON")
}

const USED: &str = "walk.mcap has contacts on /footfall/FL/contact, which are used as they were recorded: --estimate-again computes the estimate from the samples";
const AGAIN: &str = "walk.mcap has contacts on /footfall/FL/contact, which are not read: the estimate is computed again from the samples";

#[test]
fn recorded_contacts_are_the_rows_of_the_table() {
    let bench = Bench::new();
    bag(&bench);
    let output = bench.run("replay walk.mcap --output rows.csv");
    assert_eq!(text(&output.stderr), format!("footfall: {USED}\n"));
    assert!(output.status.success());
    let table = read(&bench.path("rows.csv"));
    let mut rows = table.lines();
    let header: Vec<&str> = rows.next().expect("a header").split(',').collect();
    let rows: Vec<Vec<&str>> = rows.map(|row| row.split(',').collect()).collect();
    assert_eq!(rows.len() as u64, CONTACTS);
    let at = |name: &str| header.iter().position(|column| *column == name);
    let at = |name: &str| at(name).expect(name);
    for (ms, row) in (0..).zip(&rows) {
        let (stable, sigma) = numbers(ms);
        let number = |name: &str| row[at(name)].parse::<f32>().expect(name);
        assert_eq!((number("p_stable"), number("sigma_v")), (stable, sigma));
        let us = START_US + 1000 * ms;
        let time = format!("{}.{:06}", us / 1_000_000, us % 1_000_000);
        assert_eq!(row[at("t")], time);
        let decision = if SWING.contains(&ms) { "0" } else { "1" };
        assert_eq!(row[at("decision")], decision, "{ms}");
        // A contact has no attitude, and this bag has no probabilities of single axes.
        assert!(row[at("p_ax")..at("sigma_v")].iter().all(|cell| cell.is_empty()));
        assert_eq!((row[at("state")], row[at("flags")]), ("unknown", ""));
    }
}

#[test]
fn recorded_contacts_make_events_plot_and_summary() {
    let bench = Bench::new();
    bag(&bench);
    let output = bench.run("replay walk.mcap --json --events events.csv --plot walk.html");
    let summary = &json(&output.stdout)["recordings"][0];
    assert_eq!(summary["samples"], CONTACTS);
    assert_eq!(summary["sample_rate_hz"], 1000.0);
    assert_eq!(summary["estimation"], Value::Null);
    assert_eq!(summary["input"]["notices"], serde_json::json!([USED]));
    let [before, after] = [999, 1999].map(|ms| numbers(ms).0);
    assert_eq!(
        read(&bench.path("events.csv")),
        format!(
            "t,event,duration,p_peak,distance\n\
             1700000001.000000,lift_off,,{before},\n\
             1700000001.400000,touch_down,,{after},\n"
        )
    );
    let foot = &page_data(&read(&bench.path("walk.html")))["feet"][0];
    assert_eq!(foot["samples"], CONTACTS);
    assert_eq!(foot["rate"], 1000.0);
    assert_eq!(foot["counts"]["touch_down"], 1);
    assert_eq!(foot["counts"]["lift_off"], 1);
}

#[test]
fn estimate_again_computes_it_from_the_samples() {
    let bench = Bench::new();
    bag(&bench);
    let output = bench.run("replay walk.mcap --estimate-again --json --events events.csv");
    let said = text(&output.stderr);
    assert!(said.contains(AGAIN) && !said.contains(USED), "{said}");
    let summary = &json(&output.stdout)["recordings"][0];
    assert_eq!(summary["samples"], CONTACTS / 20);
    assert_eq!(summary["sample_rate_hz"], 50.0);
    assert_eq!(summary["estimation"]["preset"], "default");
    let events = read(&bench.path("events.csv"));
    assert_eq!(events.lines().count(), 1, "a resting sensor: {events}");
}

#[test]
fn option_of_the_estimate_is_remarked_as_without_effect() {
    let bench = Bench::new();
    bag(&bench);
    let said = text(&bench.run("replay walk.mcap --preset paper --axes x,y,z").stderr);
    let remark = "footfall: walk.mcap: --preset, --axes apply to estimates, not to contacts as they were recorded: --estimate-again\n";
    assert!(said.contains(remark), "{said}");
    let again = "replay walk.mcap --preset paper --axes x,y,z --estimate-again";
    let said = text(&bench.run(again).stderr);
    assert!(!said.contains("apply to estimates"), "{said}");
}

#[test]
fn recording_of_a_foot_on_can_replays_at_its_rate() {
    let bench = Bench::new();
    bench.stdout("record demo:feet=2,seconds=6,speed=max -o walk.mcap");
    let samples = |options: &str| {
        let output = bench.run(&format!("replay walk.mcap --topic all --json{options}"));
        assert!(output.status.success(), "{output:?}");
        let json = json(&output.stdout);
        let of = |foot: usize| json["recordings"][foot]["samples"].as_u64();
        [of(0), of(1)].map(|samples| samples.expect("a count"))
    };
    assert_eq!(samples(" --strict"), [6000, 6000]);
    assert!(samples(" --estimate-again").iter().all(|n| *n < 400));
    bench.stdout("replay walk.mcap --topic all --events events.csv");
    let events = read(&bench.path("events.csv"));
    let count = |event: &str| events.lines().filter(|row| row.contains(event)).count();
    assert!(count("touch_down") >= 4, "{events}");
}

#[test]
fn playback_repeats_recorded_contacts() {
    let bench = Bench::new();
    bag(&bench);
    let output = bench.run("record file:walk.mcap -o again.mcap");
    assert_eq!(text(&output.stderr), format!("footfall: {USED}\n"));
    // The foot keeps its name.
    let contacts = format!("{CONTACTS:>9} /footfall/FL/contact\n");
    assert!(text(&output.stdout).contains(&contacts), "{output:?}");
    let rows = |bag: &str| {
        bench.stdout(&format!("replay {bag} --output rows.csv --overwrite"));
        read(&bench.path("rows.csv"))
    };
    assert_eq!(rows("again.mcap"), rows("walk.mcap"));
    // The samples of the copy are the samples of the recording, at their own times.
    let samples = |bag: &str| {
        bench.stdout(&format!("convert {bag} samples.csv --overwrite"));
        read(&bench.path("samples.csv"))
    };
    assert_eq!(samples("again.mcap"), samples("walk.mcap"));
    let shown = bench.stdout("monitor file:walk.mcap@max");
    assert!(shown.contains(USED), "{shown}");
    let shown = bench.stdout("monitor file:walk.mcap@max --estimate-again");
    assert!(shown.contains(AGAIN) && !shown.contains(USED), "{shown}");
    let output = bench.run("record file:walk.mcap --preset paper -o paper.mcap");
    let remark = "footfall: walk.mcap: --preset apply to estimates, not to contacts as they were recorded: --estimate-again\n";
    assert!(text(&output.stderr).contains(remark), "{output:?}");
    assert_eq!(rows("paper.mcap"), rows("walk.mcap"));
}

#[test]
fn recordings_of_feet_are_recorded_again_alike() {
    for line in ["can", "uart"] {
        let bench = Bench::new();
        bench.stdout(&format!("record demo:feet=2,seconds=6,speed=max,line={line} -o walk.mcap"));
        bench.stdout("record file:walk.mcap --topic all -o again.mcap");
        let rows = |bag: &str| {
            bench.stdout(&format!("replay {bag} --topic all --output rows.csv --overwrite"));
            read(&bench.path("rows.csv"))
        };
        assert!(rows("again.mcap") == rows("walk.mcap"), "{line}");
    }
}

/// A sensor whose readings of gravity are in g, in a bag with contacts; it lies on its side.
const IN_G: [f64; 3] = [1.0, 0.0, 0.0];

#[test]
fn samples_beside_recorded_contacts_are_checked() {
    let bench = Bench::new();
    bag_of(&bench, IN_G);
    let finding =
        "walk.mcap: the acceleration is 1.00 m/s² at rest, which looks like g: --units g\n";
    let said = text(&bench.run("replay walk.mcap").stderr);
    assert_eq!(said, format!("footfall: {USED}\nfootfall: {finding}"));
    // The advised option changes the check and leaves the contacts as they are.
    let said = text(&bench.run("replay walk.mcap --units g --strict").stderr);
    assert_eq!(said, format!("footfall: {USED}\n"));
    let output = bench.run("replay walk.mcap --strict");
    assert!(!output.status.success(), "{output:?}");
}

#[test]
fn recorded_contacts_play_without_samples() {
    let bench = Bench::new();
    bag(&bench);
    write_bag(&bench, "alone.mcap", None);
    let probabilities = |bag: &str| -> Vec<String> {
        bench.stdout(&format!("replay {bag} --output rows.csv --overwrite"));
        let rows = read(&bench.path("rows.csv"));
        let cells = rows.lines().map(|row| row.split(',').take(4).collect::<Vec<_>>().join(","));
        cells.collect()
    };
    assert_eq!(probabilities("alone.mcap").len(), 1 + CONTACTS as usize);
    assert_eq!(probabilities("alone.mcap"), probabilities("walk.mcap"));
    let advice = "while its setting uart_streams.raw_sample is 1";
    let said = text(&bench.run("replay alone.mcap").stderr);
    assert!(
        said.contains("/footfall/FL/contact without samples") && said.contains(advice),
        "{said}"
    );
    let shown = bench.stdout("monitor file:alone.mcap@max");
    assert!(shown.contains("FL    P 0.9"), "{shown}");
    let said = text(&bench.run("record file:alone.mcap -o again.mcap").stderr);
    assert_has(&said, "/footfall/FL/imu is not in the recording");
    for command in ["convert alone.mcap samples.csv", "replay alone.mcap --estimate-again"] {
        let error = bench.error(command);
        assert!(
            error.contains("no topic of sensor_msgs/msg/Imu") && error.contains(advice),
            "{error}"
        );
    }
}

/// Messages of a whole bag by topic; `None` if it has no summary.
fn counts(bench: &Bench, name: &str) -> Option<BTreeMap<String, u64>> {
    let bytes = fs::read(bench.path(name)).expect("a bag");
    let summary = mcap::Summary::read(&bytes).ok()??;
    let counts = summary.stats?.channel_message_counts;
    let topic = |id: &u16| summary.channels[id].topic.clone();
    Some(counts.iter().map(|(id, count)| (topic(id), *count)).collect())
}

#[test]
fn copy_makes_a_cut_recording_whole() {
    let bench = Bench::new();
    bag(&bench);
    let whole = fs::read(bench.path("walk.mcap")).expect("a bag");
    bench.stdout("replay walk.mcap --output copy.mcap");
    assert_eq!(counts(&bench, "copy.mcap"), counts(&bench, "walk.mcap"));
    let mut most = 0;
    for length in (0..whole.len()).step_by(1000) {
        fs::write(bench.path("cut.mcap"), &whole[..length]).expect("a file");
        let output = bench.run("replay cut.mcap --output copy.mcap --overwrite");
        if !output.status.success() {
            // If no chunk is complete, there is nothing to rescue.
            assert_eq!(most, 0, "{length}: {output:?}");
            continue;
        }
        let counts = counts(&bench, "copy.mcap").expect("a whole bag");
        let contacts = counts["/footfall/FL/contact"];
        assert!(contacts >= most, "{length}: {contacts} after {most}");
        most = contacts;
    }
    assert_eq!(most, CONTACTS);
}
