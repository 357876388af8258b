//! `footfall calibrate` from outside: what it prints, writes and refuses.

mod common;

use std::fs;

use analysis::config::Overrides;
use common::feet::{csv, lying};
use common::{AXES, Bench, read};
use estimator_core::{AccelerometerCorrection, Learning, Learnt, Params};
use gait::GaitName;
use recordings::input::{self, Format, Hints};
use recordings::replay::replay_and_learn;

/// What a configuration file starts with.
fn learnt(bench: &Bench, file: &str) -> Learnt {
    let overrides = Overrides::parse(&read(&bench.path(file)), file).expect("a configuration");
    let mut params = Params::DEFAULT;
    overrides.apply(&mut params);
    params.learnt.expect("a warm start")
}

#[test]
fn what_is_learnt_is_reported_drawn_and_accepted_by_a_replay() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    let report = bench.stdout("calibrate walk.csv --output robot.toml --plot amplitudes.svg");
    assert!(report.starts_with("learnt from walk 12."), "{report}");
    assert!(report.contains(" s of swing: settled\n"), "{report}");
    for quantity in ["acceleration", "rate", "velocity"] {
        assert!(report.contains(&format!("\n{quantity} ")), "{report}");
    }
    assert!(report.ends_with("written  robot.toml\nwritten  amplitudes.svg\n"));
    let picture = read(&bench.path("amplitudes.svg"));
    assert!(picture.contains("amplitudes, learnt from"));

    // The file, the report for the foot, the JSON and the estimator itself agree to the bit.
    let found = learnt(&bench, "robot.toml");
    let values: Vec<String> = (1..)
        .zip(found.to_array())
        .map(|(subindex, value)| format!("{subindex} = {value}"))
        .collect();
    let object = format!("\non the foot, 0x2018: {}\n", values.join(", "));
    assert!(report.contains(&object), "{report}");
    let json: serde_json::Value =
        serde_json::from_str(&bench.stdout("calibrate walk.csv --json")).expect("JSON");
    assert_eq!(json["settled"], true);
    for (place, value) in found.to_array().into_iter().enumerate() {
        let reported = json["object"][place].as_f64().expect("a number");
        assert_eq!(reported as f32, value);
    }
    let loaded = input::read(&bench.path("walk.csv"), Format::Csv, &Hints::default());
    let recording = loaded.expect("a recording").recording;
    let (_, expected) = replay_and_learn(&recording, &Params::DEFAULT).expect("the preset");
    assert_eq!(found, expected);

    // A warm start is settled from the first sample on.
    let flags = |arguments: &str| {
        let summary = bench.stdout(&format!("replay walk.csv --json {arguments}"));
        let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
        summary["recordings"][0]["flag_counts"]["settling"].clone()
    };
    assert!(flags("").is_number());
    assert!(flags("--config robot.toml").is_null());
}

#[test]
fn several_recordings_are_learnt_one_after_another() {
    let bench = Bench::with("one.csv", csv(GaitName::Walk, 3.4));
    fs::write(bench.path("two.csv"), csv(GaitName::Walk, 9.0)).expect("a file");
    let error = bench.error("calibrate one.csv");
    assert!(
        error.contains("s of swing were seen; 1 s of each is needed: record more steps"),
        "{error}"
    );
    bench.stdout("calibrate one.csv two.csv --output both.toml");
    bench.stdout("calibrate two.csv --output two.toml");
    bench.stdout("calibrate one.csv --config two.toml --output more.toml");
    let [both, two, more] = ["both.toml", "two.toml", "more.toml"].map(|f| learnt(&bench, f));
    assert!(both.still_seconds > two.still_seconds);
    // What was learnt before a start counts for a second at most.
    assert!(more.still_seconds > 1.0 && more.still_seconds < two.still_seconds);
    assert!(both != more && more != two);
}

#[test]
fn frozen_or_not_a_calibration_learns() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    fs::write(bench.path("frozen.toml"), "learning = 'frozen'\n").expect("a file");
    bench.stdout("calibrate walk.csv --output robot.toml");
    bench.stdout("calibrate walk.csv --config frozen.toml --output frozen.toml");
    assert_eq!(learnt(&bench, "frozen.toml"), learnt(&bench, "robot.toml"));
    assert!(read(&bench.path("frozen.toml")).contains("learning = \"frozen\"\n"));
}

#[test]
fn the_papers_method_has_nothing_to_learn() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 2.0));
    let error = bench.error("calibrate walk.csv --preset paper");
    assert!(
        error.starts_with("footfall: method = \"half_widths\" learns nothing"),
        "{error}"
    );
}

#[test]
fn a_recording_that_is_named_twice_does_not_count_twice() {
    let bench = Bench::with("one.csv", csv(GaitName::Walk, 6.0));
    for command in ["calibrate", "calibrate --rests"] {
        assert_eq!(
            bench.error(&format!("{command} one.csv ./one.csv")),
            "footfall: ./one.csv is named twice: what it shows would count twice\n"
        );
    }
}

#[test]
fn where_no_sample_is_valid_that_is_what_is_said() {
    let rows: String = (0..2000)
        .map(|k| format!("{:.3},nan,nan,nan,0,0,0\n", f64::from(k) * 1e-3))
        .collect();
    let bench = Bench::with("nan.csv", format!("t,{AXES}\n{rows}"));
    let error = bench.error("calibrate nan.csv");
    assert!(
        error.contains("2000 of 2000 samples are invalid"),
        "{error}"
    );
}

#[test]
fn a_refused_parameter_is_named_as_in_a_replay() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 2.0));
    let complaint = |text: &str| {
        fs::write(bench.path("wrong.toml"), text).expect("a file");
        bench.error("calibrate walk.csv --config wrong.toml")
    };
    assert_eq!(
        complaint("decision.threshold = 2.0\n"),
        "footfall: wrong.toml, line 1, column 10, key decision.threshold is 2, allowed is 0.01 to 0.99\n"
    );
    assert!(
        complaint("[half_width]\nacceleration_m_s2 = 1.0\n").starts_with(
            "footfall: wrong.toml, line 1, column 2, key half_width has an effect with method"
        ),
    );
}

#[test]
fn a_foot_that_has_not_walked_is_refused_with_what_may_be_the_matter() {
    let bench = Bench::with("stand.csv", csv(GaitName::Stand, 12.0));
    let error = bench.error("calibrate stand.csv --output robot.toml");
    assert!(error.contains("the foot never swung"), "{error}");
    assert_eq!(bench.files(), ["stand.csv"]);
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    let error = bench.error("calibrate walk.csv --gravity removed");
    assert!(
        error.contains("see whether units and --gravity are right"),
        "{error}"
    );
}

#[test]
fn a_configuration_is_kept_and_what_is_found_replaces_what_it_says() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    let before = "learning = 'frozen'\n[load]\non_threshold = 20.0\n[learnt]\nstill_seconds = 0\n\
                  moving_seconds = 0\nidle_seconds = 0\n";
    let classes = "{ still = -1, moving = 2, width = 0.3 }";
    let classes = format!("acceleration = {classes}\nrate = {classes}\nvelocity = {classes}\n");
    fs::write(bench.path("robot.toml"), before.to_owned() + &classes).expect("a file");
    fs::write(bench.path("rests.csv"), lying(6, 9.81)).expect("a file");
    bench.stdout("calibrate walk.csv --config robot.toml --output robot.toml");
    bench.stdout("calibrate rests.csv --rests --config robot.toml --output robot.toml");
    let text = read(&bench.path("robot.toml"));
    let overrides = Overrides::parse(&text, "robot.toml").expect("a configuration");
    let on = overrides
        .load
        .get(estimator_core::Parameter::LoadOnThreshold);
    assert_eq!(on, Some(20.0));
    let learnt = learnt(&bench, "robot.toml");
    assert!(learnt.is_settled() && learnt.rate.width != 0.3);
    assert_eq!(overrides.learning, Some(Learning::Frozen));
    let corrected = overrides.correction("robot.toml").expect("a sensor");
    assert!(
        (corrected.accelerometer.bias.x - 0.1).abs() < 1e-3,
        "{text}"
    );
    // A second time, what was found before is not found in addition.
    bench.stdout("calibrate rests.csv --rests --config robot.toml --output again.toml");
    assert_eq!(read(&bench.path("again.toml")), text);
}

#[test]
fn a_replay_puts_readings_right() {
    let bench = Bench::with("rests.csv", lying(6, 9.81));
    let report = bench.stdout("calibrate --rests rests.csv --output robot.toml");
    assert!(report.contains("6 rests in 6 orientations"), "{report}");
    // The report names for the foot what the file says.
    let text = read(&bench.path("robot.toml"));
    let overrides = Overrides::parse(&text, "robot.toml").expect("a configuration");
    let accelerometer = overrides.correction("robot.toml").expect("a sensor");
    let AccelerometerCorrection { bias, scale } = accelerometer.accelerometer;
    let object = format!(
        "on the foot, 0x2017: 1 = {}, 2 = {}, 3 = {}, 4 = {}, 5 = {}, 6 = {}\n",
        bias.x, bias.y, bias.z, scale.x, scale.y, scale.z
    );
    assert!(report.contains(&object), "{report}");
    let residual = |config: &str| -> f64 {
        bench.stdout(&format!("replay rests.csv --output out.csv {config}"));
        let table = read(&bench.path("out.csv"));
        let last: Vec<&str> = table.lines().last().expect("rows").split(',').collect();
        last[14..17]
            .iter()
            .map(|cell| cell.parse::<f64>().expect("a number").abs())
            .sum()
    };
    // What the estimator learns of gravity's remains by itself is not what is asked here.
    let paper = "method = 'half_widths'\n";
    fs::write(bench.path("paper.toml"), paper).expect("a file");
    let calibrated = paper.to_owned() + &read(&bench.path("robot.toml"));
    fs::write(bench.path("robot.toml"), calibrated).expect("a file");
    let (as_read, corrected) = (
        residual("--config paper.toml"),
        residual("--config robot.toml"),
    );
    assert!(as_read > 0.05 && corrected < 0.01, "{as_read}, {corrected}");
}

#[test]
fn rests_that_do_not_tell_are_refused() {
    let bench = Bench::with("four.csv", lying(4, 9.81));
    assert!(bench.error("calibrate --rests four.csv").contains(
        "4 rests in 4 of the 6 orientations that are needed: lay the sensor still for two seconds on each of its six sides"
    ));
    assert!(
        bench
            .error("calibrate --rests four.csv --gravity removed")
            .contains("gravity has been removed")
    );
    let bench = Bench::with("in_g.csv", lying(6, 1.0));
    assert!(
        bench
            .error("calibrate --rests in_g.csv")
            .contains("accelerations are in m/s²")
    );
}

#[test]
fn results_do_not_go_over_any_recording() {
    let bench = Bench::with("one.csv", lying(6, 9.81));
    fs::write(bench.path("two.csv"), lying(6, 9.81)).expect("a file");
    let error = bench.error("calibrate --rests one.csv two.csv --output two.csv");
    assert!(error.contains("it is the recording itself"), "{error}");
}

#[cfg(unix)]
#[test]
fn a_configuration_that_can_be_read_only_once_is_kept_all_the_same() {
    let bench = Bench::with("rests.csv", lying(6, 9.81));
    fs::write(bench.path("robot.toml"), "learning = 'frozen'\n").expect("a file");
    let command = format!(
        "cat robot.toml | {} calibrate --rests rests.csv --config /dev/stdin --output out.toml",
        env!("CARGO_BIN_EXE_footfall")
    );
    let output = std::process::Command::new("sh")
        .args(["-c", &command])
        .current_dir(&bench.directory)
        .output()
        .expect("a shell");
    assert!(output.status.success(), "{output:?}");
    assert!(read(&bench.path("out.toml")).contains("learning = \"frozen\""));
}
