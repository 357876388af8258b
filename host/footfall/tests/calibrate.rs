//! Tests of `footfall calibrate` as a program: output, files and rejected inputs.

use std::fs;

use crate::common::feet::{csv, lying};
use crate::common::{AXES, Bench, assert_has, cases, kill, read, text, wait_until};
use config::Overrides;
use estimator_core::any::AnyParams;
use estimator_core::correction::AccelerometerCorrection;
use estimator_core::{Learning, Learnt};
use gait::GaitName;
use options::{Format, InputOptions};
use samples::estimate::estimates_and_learnt;

/// Returns the learnt values of a configuration file.
fn learnt(bench: &Bench, file: &str) -> Learnt {
    let overrides = Overrides::parse(&read(&bench.path(file)), file).expect("a configuration");
    let mut params = AnyParams::DEFAULT;
    overrides.apply(&mut params);
    params.params.learnt.expect("a warm start")
}

#[test]
fn all_feet_of_a_line_are_calibrated_from_one_walk() {
    for line in ["can", "uart"] {
        let bench = Bench::new();
        let source = format!("demo:feet=4,line={line},speed=max");
        let report = bench.json(&format!("calibrate {source} --write --output robot.toml"));
        assert_eq!(report["written"], true, "{line}: {report}");
        let feet = report["feet"].as_object().expect("feet");
        let names: Vec<&str> = feet.keys().map(String::as_str).collect();
        assert_eq!(names, ["FL", "FR", "RL", "RR"], "{line}");
        let file = read(&bench.path("robot.toml"));
        for name in names {
            assert_has(&file, &format!("[feet.{name}"));
        }
    }
}

#[test]
fn configuration_on_stdout_is_alone_there() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    bench.stdout("calibrate walk.csv --output robot.toml");
    let output = bench.run("calibrate walk.csv --output -");
    assert_eq!(text(&output.stdout), read(&bench.path("robot.toml")));
    assert_has(&text(&output.stderr), "acceleration at rest ");
    bench.refuses("calibrate walk.csv --output - --json", "standard output takes one result");
}

#[test]
fn learnt_values_are_reported_and_replayed() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    let report = bench.stdout("calibrate walk.csv --output robot.toml");
    assert!(report.starts_with("learnt from walk 12."), "{report}");
    assert!(report.contains(" s of swing: settled\n"), "{report}");
    assert!(report.contains("\nacceleration at rest "), "{report}");
    assert!(report.ends_with("written  robot.toml\n"), "{report}");
    let said = |arguments: &str| text(&bench.run(arguments).stderr);
    assert_has(&said("calibrate walk.csv"), "not kept: --output robot.toml writes it to a file");
    for kept in ["calibrate walk.csv -o robot.toml --overwrite", "calibrate walk.csv --json"] {
        assert_eq!(said(kept), "", "{kept}");
    }

    // The file, the object values in the report, the JSON and the estimator agree to the bit.
    let found = learnt(&bench, "robot.toml");
    let numbers = found.to_array().map(|number| number.to_string()).into_iter();
    let names =
        Learnt::ROWS.map(|row| row.name).into_iter().chain(["learnt.version", "learnt.crc"]);
    let values: Vec<String> = names
        .zip(numbers.chain([Learnt::VERSION, found.crc()].map(|word| word.to_string())))
        .map(|(name, value)| format!("{name}={value}"))
        .collect();
    let object = format!("\nif the foot has a footfall board: set {}\n", values.join(" "));
    assert!(report.contains(&object), "{report}");
    let json = bench.json("calibrate walk.csv");
    assert_eq!(json["settled"], true);
    for (place, value) in found.to_array().into_iter().enumerate() {
        let reported = json["object"][place].as_f64().expect("a number");
        assert_eq!(reported as f32, value);
    }
    let loaded = recordings::read(&bench.path("walk.csv"), Format::Csv, &InputOptions::default());
    let recording = loaded.expect("a recording").recording;
    let (_, expected) =
        estimates_and_learnt(&recording, &AnyParams::DEFAULT, || ()).expect("the preset");
    assert_eq!(found, expected);

    // A warm start is settled from the first sample.
    let flags = |arguments: &str| {
        let summary = bench.json(&format!("replay walk.csv {arguments}"));
        summary["recordings"][0]["flag_counts"]["settling"].clone()
    };
    assert!(flags("").is_number());
    assert!(flags("--config robot.toml").is_null());
}

#[test]
fn recordings_are_learnt_in_sequence() {
    let bench = Bench::with("one.csv", csv(GaitName::Walk, 2.6));
    fs::write(bench.path("two.csv"), csv(GaitName::Walk, 9.0)).expect("a file");
    let error = bench.error("calibrate one.csv");
    assert_has(&error, "s of swing were seen; 0.5 s of each is needed: record more steps");
    bench.stdout("calibrate one.csv two.csv --output both.toml");
    bench.stdout("calibrate two.csv --output two.toml");
    bench.stdout("calibrate one.csv --config two.toml --output more.toml");
    let [both, two, more] = ["both.toml", "two.toml", "more.toml"].map(|f| learnt(&bench, f));
    assert!(both.still_seconds >= two.still_seconds);
    // Values learnt before a start count as half a second at most.
    assert!(more.still_seconds > 0.5 && more.still_seconds < two.still_seconds);
    assert!(both != more && more != two && both != two);
}

#[test]
fn recordings_of_two_mountings_are_reported() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    bench.stdout("convert walk.csv turned.csv --axes x,-z,y");
    let said = |arguments: &str| text(&bench.run(arguments).stderr);
    let differs = "the direction of up differs by ";
    assert!(!said("calibrate walk.csv walk.csv").contains(differs));
    let both = said("calibrate walk.csv turned.csv");
    assert_has(&both, differs);
    assert_has(&both, "so no axes are found: calibrate recordings of one mounting together\n");
}

#[test]
fn calibration_reports_the_rows_that_are_left_out() {
    let walk = text(&csv(GaitName::Walk, 12.0));
    let (header, rows) = walk.split_once('\n').expect("a header");
    let first = rows.lines().next().expect("a row");
    let content = format!("{header}\n{first}\n{rows}");
    let bench = Bench::with("walk.csv", content.clone());
    let left_out = "walk.csv: 1 row left out, whose times do not advance\n";
    let output = bench.run("calibrate walk.csv --times drop-bad");
    assert_has(&text(&output.stderr), left_out);
    // A calibration of the sensor fails on a walk, after it has reported the notices.
    assert_has(&bench.error("calibrate --rests walk.csv --times drop-bad"), left_out);
}

#[test]
fn calibration_learns_even_if_learning_is_frozen() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    fs::write(bench.path("frozen.toml"), "learning = 'frozen'\n").expect("a file");
    bench.stdout("calibrate walk.csv --output robot.toml");
    bench.stdout("calibrate walk.csv --config frozen.toml --output frozen.toml --overwrite");
    assert_eq!(learnt(&bench, "frozen.toml"), learnt(&bench, "robot.toml"));
    assert!(read(&bench.path("frozen.toml")).contains("learning = \"frozen\"\n"));
}

#[test]
fn recordings_without_a_lesson_are_rejected_with_causes() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    fs::write(bench.path("stand.csv"), csv(GaitName::Stand, 12.0)).expect("a file");
    let rows = (0..2000).map(|k| format!("{:.3},nan,nan,nan,0,0,0\n", f64::from(k) * 1e-3));
    let rows: String = rows.collect();
    fs::write(bench.path("nan.csv"), format!("t,{AXES}\n{rows}")).expect("a file");
    let before = bench.files();
    for (arguments, expected) in cases(
        r#"
        walk.csv --preset paper => method = "half_widths" learns nothing
        walk.csv ./walk.csv => ./walk.csv is named twice, and its samples would count twice
        --rests walk.csv ./walk.csv => ./walk.csv is named twice, and its samples would count twice
        nan.csv => 2000 of 2000 samples are invalid
        stand.csv => the foot never swung
        walk.csv --gravity removed => check the units and --gravity
        "#,
    ) {
        let arguments = format!("calibrate {arguments} --output robot.toml");
        bench.refuses(&arguments, expected);
        assert_eq!(bench.files(), before, "{arguments}");
    }
}

#[test]
fn results_replace_keys_and_other_settings_are_kept() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    let before = "learning = 'frozen'\n[load]\non_threshold = 20.0\n[learnt]\nstill_seconds = 0\n\
                  moving_seconds = 0\nstill = -1\nmoving = 2\nspeed = -5\nversion = 1\n";
    fs::write(bench.path("robot.toml"), before).expect("a file");
    fs::write(bench.path("rests.csv"), lying(6, 9.81)).expect("a file");
    bench.stdout("calibrate walk.csv --config robot.toml --output robot.toml --overwrite");
    bench.stdout("calibrate rests.csv --rests --config robot.toml --output robot.toml --overwrite");
    let text = read(&bench.path("robot.toml"));
    let overrides = Overrides::parse(&text, "robot.toml").expect("a configuration");
    let on = overrides.all.get(estimator_core::parameter::Parameter::LoadOnThreshold);
    assert_eq!(on, Some(20.0));
    let learnt = learnt(&bench, "robot.toml");
    assert!(learnt.is_settled());
    assert_eq!(overrides.all.learning, Some(Learning::Frozen));
    let corrected = overrides.correction();
    assert!((corrected.accelerometer.bias.x - 0.1).abs() < 1e-3, "{text}");
    // A second calibration replaces the first result and does not add to it.
    bench.stdout("calibrate rests.csv --rests --config robot.toml --output again.toml");
    assert_eq!(read(&bench.path("again.toml")), text);
}

#[test]
fn walking_foot_is_calibrated_and_keeps_it_if_told() {
    let bench = Bench::new();
    for line in ["can", "uart"] {
        let source = format!("demo:speed=max,line={line}");
        let output = bench.run(&format!("calibrate {source} --output robot.toml --overwrite"));
        let said = text(&output.stderr);
        assert!(output.status.success(), "{said}");
        for expected in ["FL: let the foot stand still\n", "FL: let the foot walk: ", "--write"] {
            assert_has(&said, expected);
        }
        let file = read(&bench.path("robot.toml"));
        assert_has(&file, "# learnt by the foot FL while it walked\n");
        assert_has(&file, "[feet.FL.learnt]\n");
        Overrides::parse(&file, "robot.toml").expect("a configuration");
        let report = bench.json(&format!("calibrate {source} --write"));
        assert_eq!(report["written"], true, "{report}");
        assert!(report["feet"]["FL"]["learnt"]["still_seconds"].as_f64() > Some(0.0), "{report}");
    }
    bench.refuses("calibrate demo:speed=max walk.csv", "footfall: files and walking feet are");
}

#[test]
fn options_of_the_other_kind_of_input_are_refused() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    for (arguments, expected) in cases(
        "
        demo:speed=max --rests --strict => walking feet does not use --rests, --strict
        demo:speed=max --foot FL -o a.toml --units g,dps => walking feet does not use --foot, --units
        demo:speed=max --topic all --preset paper => walking feet does not use --topic, --preset
        walk.csv --write --node 17 --seconds 60 => recordings does not use --write, --seconds, --node
        walk.csv --rests --write => recordings does not use --write
        ",
    ) {
        bench.refuses(&format!("calibrate {arguments}"), expected);
    }
}

#[test]
fn two_walking_boards_of_one_name_are_refused() {
    let bench = Bench::new();
    let error = bench.error("calibrate demo:speed=max demo:speed=max,line=uart");
    assert_has(&error, "two boards are FL, demo:");
    assert_has(&error, "; calibrate them one at a time");
    assert!(!error.contains("let the foot stand"), "{error}");
}

#[cfg(unix)]
#[test]
fn interrupted_wait_for_a_walk_writes_nothing() {
    let bench = Bench::new();
    let said = fs::File::create(bench.path("said.txt")).expect("a file");
    // The foot learns enough after seconds of its own, which are minutes here.
    let child = bench
        .command_with_signals("calibrate demo:speed=0.2 --write -o robot.toml", None)
        .stderr(said)
        .spawn()
        .expect("the command that was just built");
    wait_until("the wait for a walk", || {
        read(&bench.path("said.txt")).contains("let the foot walk")
    });
    assert!(kill("INT", &child));
    let output = child.wait_with_output().expect("it ends");
    let said = read(&bench.path("said.txt"));
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_has(&said, "footfall: interrupted: nothing was written\n");
    assert!(!bench.path("robot.toml").exists());
}

#[test]
fn load_thresholds_are_proposed_and_then_crossed() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 12.0));
    // In kN.
    let walk = read(&bench.path("walk.csv"));
    let header: Vec<&str> = walk.lines().next().expect("a header").split(',').collect();
    let at = header.iter().position(|name| *name == "force").expect("a load");
    let row = |(k, line): (usize, &str)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let (1.., Ok(load)) = (k, cells[at].parse::<f64>()) {
            cells[at] = (load / 1000.0).to_string();
        }
        cells.join(",") + "\n"
    };
    let in_kilonewtons: String = walk.lines().enumerate().map(row).collect();
    fs::write(bench.path("kn.csv"), in_kilonewtons).expect("a file");
    bench.refuses(
        "replay kn.csv --strict",
        "does not cross both of its thresholds: on_threshold = ",
    );
    assert_has(&bench.stdout("calibrate kn.csv --output robot.toml"), "\nload: on_threshold 0.");
    assert_has(&read(&bench.path("robot.toml")), "\n[load]\n");
    let output = bench.run("replay kn.csv --strict --config robot.toml");
    assert!(output.status.success(), "{}", text(&output.stderr));
}

#[test]
fn replay_corrects_the_readings() {
    let bench = Bench::with("rests.csv", lying(6, 9.81));
    let report = bench.stdout("calibrate --rests rests.csv --output robot.toml");
    assert!(report.contains("6 rests in 6 orientations"), "{report}");
    // The object values in the report match the file.
    let text = read(&bench.path("robot.toml"));
    let overrides = Overrides::parse(&text, "robot.toml").expect("a configuration");
    let accelerometer = overrides.correction();
    let AccelerometerCorrection { bias, scale } = accelerometer.accelerometer;
    let object = format!(
        "if the foot has a footfall board: set accelerometer.bias_m_s2.ax={} accelerometer.bias_m_s2.ay={} \
         accelerometer.bias_m_s2.az={} accelerometer.scale.ax={} accelerometer.scale.ay={} \
         accelerometer.scale.az={}\n",
        bias.x, bias.y, bias.z, scale.x, scale.y, scale.z
    );
    assert!(report.contains(&object), "{report}");
    let residual = |config: &str| -> f64 {
        bench.stdout(&format!("replay rests.csv --output out.csv --overwrite {config}"));
        let table = read(&bench.path("out.csv"));
        let last: Vec<&str> = table.lines().last().expect("rows").split(',').collect();
        last[14..17].iter().map(|cell| cell.parse::<f64>().expect("a number").abs()).sum()
    };
    // Replay with the paper's method, because it does not learn the residual gravity. Learning is not under test.
    let paper = "method = 'half_widths'\n";
    fs::write(bench.path("paper.toml"), paper).expect("a file");
    let calibrated = paper.to_owned() + &read(&bench.path("robot.toml"));
    fs::write(bench.path("robot.toml"), calibrated).expect("a file");
    let (as_read, corrected) = (residual("--config paper.toml"), residual("--config robot.toml"));
    assert!(as_read > 0.05 && corrected < 0.01, "{as_read}, {corrected}");
}

#[test]
fn insufficient_rests_are_rejected() {
    let bench = Bench::with("four.csv", lying(4, 9.81));
    bench.refuses(
        "calibrate --rests four.csv",
        "4 rests in 4 of the 6 orientations that are needed: lay the sensor still for two seconds on each of its six sides",
    );
    bench.refuses("calibrate --rests four.csv --gravity removed", "gravity has been removed");
    let bench = Bench::with("in_g.csv", lying(6, 1.0));
    bench.refuses("calibrate --rests in_g.csv", "accelerations are in m/s²");
}

#[test]
fn results_never_overwrite_a_recording() {
    let bench = Bench::with("one.csv", lying(6, 9.81));
    fs::write(bench.path("two.csv"), lying(6, 9.81)).expect("a file");
    bench.refuses(
        "calibrate --rests one.csv two.csv --output two.csv",
        "it is the recording itself",
    );
}

#[cfg(unix)]
#[test]
fn piped_configuration_is_kept() {
    let bench = Bench::with("rests.csv", lying(6, 9.81));
    fs::write(bench.path("robot.toml"), "learning = 'frozen'\n").expect("a file");
    let line =
        "cat robot.toml | \"$0\" calibrate --rests rests.csv --config /dev/stdin --output out.toml";
    let output = bench.shell("sh", line).expect("a shell");
    assert!(output.status.success(), "{output:?}");
    assert!(read(&bench.path("out.toml")).contains("learning = \"frozen\""));
}

#[test]
fn foot_without_a_name_is_refused() {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 1.0));
    bench.refuses("calibrate walk.csv --foot= --output robot.toml", "--foot <NAME>");
    assert!(!bench.path("robot.toml").exists());
}
