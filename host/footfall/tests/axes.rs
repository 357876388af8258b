//! Tests of `--axes` and the key `axes` as a program: orientation of the sensor in the foot.

use std::fs;

use crate::common::{AXES, Bench, assert_has, cases, read, text};
use gait::{GaitName, Ground, Plan, SensorParams, record};
use samples::Recording;
use tables::output::write_recording;

use estimator_core::{AngularRate, SpecificForce, Vec3};

fn table(recording: &Recording) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_recording(&recording.samples, &mut bytes).expect("memory is enough");
    bytes
}

/// Returns a bench with a walk as `walk.csv` with z up, and as `side.csv` from a sensor on its side, with y up.
fn bench() -> Bench {
    turned_by(|v| Vec3::new(v.x, v.z, -v.y))
}

/// Returns the same with the sensor axes given by `to_sensor`.
fn turned_by(to_sensor: impl Fn(Vec3) -> Vec3) -> Bench {
    let plan = Plan::steady(GaitName::Walk, Ground::Hard, 12.0, 3);
    let mut recording = record(&plan, &SensorParams::LSM6DSOX, 3);
    let bench = Bench::with("walk.csv", table(&recording));
    for sample in &mut recording.samples {
        let imu = &mut sample.imu;
        imu.specific_force = SpecificForce(to_sensor(imu.specific_force.0));
        imu.angular_rate = AngularRate(to_sensor(imu.angular_rate.0));
    }
    fs::write(bench.path("side.csv"), table(&recording)).expect("a file");
    bench
}

/// Returns the table of estimates of a replay.
fn estimates(bench: &Bench, arguments: &str) -> String {
    bench.stdout(&format!("replay {arguments} --output out.csv --overwrite"));
    read(&bench.path("out.csv"))
}

#[test]
fn axes_option_gives_the_table_of_an_upright_sensor() {
    let bench = bench();
    let expected = estimates(&bench, "walk.csv");
    assert_eq!(estimates(&bench, "side.csv --axes x,-z,y"), expected);
    assert_ne!(estimates(&bench, "side.csv"), expected);
    fs::write(bench.path("robot.toml"), "axes = 'x,-z,y'\n").expect("a file");
    assert_eq!(estimates(&bench, "side.csv --config robot.toml"), expected);
    fs::write(bench.path("robot.toml"), "axes = '-x,z,y'\n").expect("a file");
    let by_file = estimates(&bench, "side.csv --config robot.toml");
    assert_eq!(by_file, estimates(&bench, "side.csv --axes -x,z,y"));
    let both = estimates(&bench, "side.csv --config robot.toml --axes x,-z,y");
    assert_eq!(both, expected);
}

#[test]
fn impossible_axes_are_rejected_with_a_correction() {
    let bench = bench();
    for (axes, expected) in cases(
        "
        x,z,y => flip the sign of one axis, as in x,-z,y or -x,z,y
        x,x,z => has an axis twice
        1,1,0,0 => has the length 1.4142135, allowed is 0.999 to 1.001
        up => is neither axes nor a quaternion: write for the foot's x
        ",
    ) {
        for command in ["replay", "calibrate"] {
            bench.refuses(&format!("{command} side.csv --axes {axes}"), expected);
        }
        fs::write(bench.path("robot.toml"), format!("axes = '{axes}'\n")).expect("a file");
        let error = bench.error("replay side.csv --config robot.toml");
        assert!(error.starts_with("footfall: robot.toml, line 1, column 8, key axes: "), "{error}");
        assert!(error.contains(expected), "{error}");
    }
    bench.refuses("calibrate side.csv --rests --axes x,-z,y", "cannot be used with");
}

#[test]
fn finding_suggests_the_axes() {
    let row = |k: u32| format!("{:.3},0,9.81,0,0,0,0\n", f64::from(k) * 1e-3);
    let rows: String = (0..1000).map(row).collect();
    let bench = Bench::with("side.csv", format!("t,{AXES}\n{rows}"));
    let stderr = |arguments: &str| text(&bench.run(arguments).stderr);
    assert_eq!(
        stderr("replay side.csv"),
        "footfall: side.csv: y is up at rest, where the foot has z: --axes x,-z,y\n"
    );
    assert_eq!(stderr("replay side.csv --axes x,-z,y --strict"), "");
    // If the given axes are wrong, it suggests their replacement.
    assert_eq!(
        stderr("replay side.csv --axes x,z,-y"),
        "footfall: side.csv: -z is up at rest, where the foot has z: --axes x,-z,y\n"
    );
}

#[test]
fn calibration_stores_axes_for_the_replay() {
    let bench = bench();
    let report = bench.stdout("calibrate side.csv --output robot.toml");
    assert_has(&report, "\naxes x,-z,y\nz was not up where ");
    assert_has(&report, "\nif the foot has a footfall board: set axes=x,-z,y\n");
    let text = read(&bench.path("robot.toml"));
    assert!(text.contains("\naxes = \"x,-z,y\"\n"), "{text}");
    let with_file = estimates(&bench, "side.csv --config robot.toml");
    bench.stdout("calibrate walk.csv --output level.toml");
    assert!(!read(&bench.path("level.toml")).contains("axes"));
    let columns = |table: &str| -> Vec<f64> {
        let row = |row: &str| row.split(',').nth(1).expect("p_stable").parse().expect("P");
        table.lines().skip(1).map(row).collect()
    };
    // Values learnt in the sensor's own axes also hold in the foot's, except for rounding.
    let level = columns(&estimates(&bench, "walk.csv --config level.toml"));
    let side = columns(&with_file);
    let differs = |(a, b): (&f64, &f64)| (a - b).abs() > 1e-3;
    assert!(!level.iter().zip(&side).any(differs));

    let report = bench.json("calibrate side.csv");
    assert_eq!(report["mounting"]["axes"], "x,-z,y");
    assert_eq!(report["mounting"]["source"], "found");
    assert_eq!(report["mounting"]["object"][0], 162);
    assert!(bench.json("calibrate walk.csv")["mounting"].is_null());

    // Given axes are kept if they are right, and replaced if wrong.
    let given = bench.json("calibrate side.csv --axes -x,z,y --output given.toml");
    assert_eq!(given["mounting"]["source"], "given");
    assert!(read(&bench.path("given.toml")).contains("axes = \"-x,z,y\"\n"));
    bench.stdout("calibrate side.csv --config given.toml --axes x,z,-y --output again.toml");
    assert!(read(&bench.path("again.toml")).contains("axes = \"x,-z,y\"\n"));
    bench.stdout("calibrate walk.csv --config given.toml --axes x,y,z --output none.toml");
    assert!(!read(&bench.path("none.toml")).contains("axes"));
}

#[test]
fn quaternion_of_tilted_sensor_round_trips_exactly() {
    // 37° about x, from the foot to the sensor.
    let bench = turned_by(|v| Vec3::new(v.x, 0.8 * v.y + 0.6 * v.z, 0.8 * v.z - 0.6 * v.y));
    let report = bench.stdout("calibrate side.csv --output robot.toml");
    let axes = report.lines().find_map(|line| line.strip_prefix("axes "));
    let axes = axes.expect("a mounting");
    assert_eq!(axes.split(',').count(), 4, "{report}");
    assert!(report.contains("it is, within 0°\n"), "{report}");
    let written = read(&bench.path("robot.toml"));
    assert_has(&written, &format!("axes = \"{axes}\"\n"));
    fs::write(bench.path("axes.toml"), format!("axes = \"{axes}\"\n")).expect("a file");
    assert_eq!(
        estimates(&bench, &format!("side.csv --axes {axes}")),
        estimates(&bench, "side.csv --config axes.toml")
    );
}

/// Rows of a foot in the table `out.csv`, without its name.
fn rows_of(bench: &Bench, foot: &str) -> Vec<String> {
    let table = read(&bench.path("out.csv"));
    let own = |line: &str| line.strip_prefix(&format!("{foot},")).map(str::to_owned);
    table.lines().filter_map(own).collect()
}

#[test]
fn each_foot_has_axes_of_its_own() {
    let bench = bench();
    let expected = estimates(&bench, "walk.csv");
    let expected: Vec<&str> = expected.lines().skip(1).collect();
    fs::write(
        bench.path("robot.toml"),
        "axes = 'z,y,-x'\n[feet.SIDE]\naxes = 'x,-z,y'\n[feet.walk]\naxes = 'x,y,z'\n",
    )
    .expect("a file");
    for settings in ["--axes side=x,-z,y", "--axes walk=x,y,z,Side=x,-z,y", "--config robot.toml"] {
        bench.stdout(&format!("replay walk.csv side.csv {settings} --output out.csv --overwrite"));
        for foot in ["walk", "side"] {
            assert_eq!(rows_of(&bench, foot), expected, "{settings}: {foot}");
        }
    }
    // An option for all feet replaces the axes of each.
    bench.stdout("replay walk.csv --config robot.toml --axes x,y,z --output out.csv --overwrite");
    assert_eq!(read(&bench.path("out.csv")).lines().skip(1).collect::<Vec<_>>(), expected);
}

#[test]
fn settings_of_absent_or_unknown_feet_are_an_error() {
    let bench = bench();
    for command in ["replay walk.csv", "convert walk.csv out.csv"] {
        let said = bench.error(&format!("{command} --axes FL=x,-z,y"));
        assert_eq!(said, "footfall: --axes names the foot FL, but there is walk\n");
    }
    for (file, expected) in cases(
        r"
        [feet.FL]\n[feet.fl]\n => feet.FL and feet.fl are one foot
        [feet.FL]\naxis = 'x,-z,y'\n => robot.toml, line 2, column 1, key feet.FL.axis
        [feet.FL.accelerometer]\nbias_m_s2 = { ax = 7 }\n => key feet.FL.accelerometer.bias_m_s2: ax is 7, allowed is -5 to 5
        ",
    ) {
        fs::write(bench.path("robot.toml"), file.replace("\\n", "\n")).expect("a file");
        bench.refuses("replay walk.csv --config robot.toml", expected);
    }
    fs::write(bench.path("robot.toml"), "[feet.FL]\naxes = 'x,-z,y'\n").expect("a file");
    let said = text(&bench.run("replay walk.csv --config robot.toml").stderr);
    assert_has(&said, "robot.toml has settings of FL, but there is walk");
}

#[test]
fn calibration_of_a_foot_keeps_those_of_others() {
    let bench = bench();
    bench.stdout("calibrate walk.csv --foot walk --output robot.toml");
    bench.stdout(
        "calibrate side.csv --foot side --config robot.toml --output robot.toml --overwrite",
    );
    let file = read(&bench.path("robot.toml"));
    assert!(file.contains("[feet.side]\naxes = \"x,-z,y\"\n"), "{file}");
    assert_eq!(file.matches("axes = ").count(), 1, "{file}");
    for table in ["[feet.side.learnt]", "[feet.walk.learnt]"] {
        assert!(file.contains(table), "{file}");
    }
    bench.refuses(
        "calibrate walk.csv --config robot.toml",
        "name the foot to calibrate with --foot",
    );
    bench.refuses(
        "calibrate walk.csv --axes side=x,y,z --foot walk --output robot.toml --overwrite",
        "--axes names the foot side, but there is walk",
    );
    // A foot without axes of its own would get the axes of all feet, so even the axes `x,y,z` are written.
    fs::write(bench.path("all.toml"), "axes = 'z,y,-x'\n").expect("a file");
    bench.stdout("calibrate walk.csv --axes x,y,z --foot walk --config all.toml --output all.toml --overwrite");
    let all = read(&bench.path("all.toml"));
    assert!(all.contains("[feet.walk]\naxes = \"x,y,z\"\n"), "{all}");
    // Each foot has the axes and the warm start that were found for it.
    let summary = |file: &str| {
        let json = bench.json(&format!("replay {file} --config robot.toml"));
        json["recordings"][0]["estimation"].clone()
    };
    let [walk, side] = ["walk.csv", "side.csv"].map(summary);
    assert_eq!(side["correction"]["axes"], "x,-z,y");
    assert_ne!(walk["parameters"], side["parameters"]);
}

#[test]
#[cfg(feature = "bags")]
fn warning_about_axes_names_its_foot() {
    let bench = Bench::new();
    bench.stdout("record demo:feet=2,line=uart,seconds=12,speed=max -o walk.mcap");
    let lying = "--topic all --axes L=x,-z,y";
    for command in [
        format!("replay walk.mcap --estimate-again {lying}"),
        format!("calibrate walk.mcap {lying}"),
        format!("convert walk.mcap out.mcap {lying}"),
        "calibrate walk.mcap --topic /footfall/L/imu --foot L --axes x,-z,y --output l.toml"
            .to_owned(),
    ] {
        let said = text(&bench.run(&command).stderr);
        let warnings = said.lines().filter(|line| line.contains("is up at rest"));
        let warnings: Vec<&str> = warnings.collect();
        assert_eq!(warnings.len(), 1, "{command}:\n{said}");
        let place = "footfall: walk.mcap, foot L: ";
        assert!(warnings[0].starts_with(place), "{command}:\n{said}");
    }
}
