//! Tests of the settings of recordings that are played as sources: `--config` and `--preset`.

use std::fs;

use crate::common::feet::csv;
use crate::common::{Bench, assert_has, read, text};
use crate::record::column;
use gait::GaitName;

/// Settings of the foot `walk` alone, and its contacts with them.
const SETTINGS: &str = "\
[feet.walk]
axes = '-x,-y,z'

[feet.walk.decision]
threshold = 0.95
";

/// Returns a bench with the recording `walk.csv`, and settings as `robot.toml`.
fn bench() -> Bench {
    let bench = Bench::with("walk.csv", csv(GaitName::Walk, 8.0));
    fs::write(bench.path("robot.toml"), SETTINGS).expect("a file");
    bench
}

const COMPARED: [&str; 3] = ["p_stable", "p_tangential", "decision"];

/// Returns the compared columns of a replay with these options.
fn replayed(bench: &Bench, options: &str) -> [Vec<String>; 3] {
    bench.stdout(&format!("replay {options} --output out.csv --overwrite"));
    let table = read(&bench.path("out.csv"));
    COMPARED.map(|name| column(&table, name))
}

#[test]
fn config_applies_to_a_played_recording() {
    let bench = bench();
    let plain = replayed(&bench, "walk.csv");
    for options in ["--config robot.toml", "--preset paper"] {
        let expected = replayed(&bench, &format!("walk.csv {options}"));
        assert_ne!(expected, plain, "{options}");
        bench.stdout(&format!("record file:walk.csv {options} -o played.mcap --overwrite"));
        assert_eq!(replayed(&bench, "played.mcap"), expected, "{options}");
    }
}

#[test]
fn sections_of_feet_apply_to_a_played_bag() {
    let bench = Bench::new();
    bench.stdout("record demo:feet=2,line=uart,seconds=6,speed=max -o feet.mcap");
    fs::write(bench.path("robot.toml"), "feet.L.decision.threshold = 0.95\n").expect("a file");
    let feet = "--topic all --config robot.toml";
    let expected = replayed(&bench, &format!("feet.mcap {feet} --estimate-again"));
    bench.stdout(&format!("record file:feet.mcap {feet} --estimate-again -o played.mcap"));
    assert_eq!(replayed(&bench, "played.mcap --topic all"), expected);
    let other = replayed(&bench, "feet.mcap --topic all --estimate-again");
    assert_ne!(expected, other);
}

/// Returns the error of a monitor that fails after its start.
fn failed(bench: &Bench, options: &str) -> String {
    let output = bench.run(&format!("monitor {options}"));
    assert!(!output.status.success(), "{output:?}");
    text(&output.stderr)
}

#[test]
fn monitor_names_settings_of_other_feet() {
    let bench = bench();
    fs::copy(bench.path("walk.csv"), bench.path("other.csv")).expect("a copy");
    let shown = bench.stdout("monitor file:other.csv@max --config robot.toml");
    let remark = "robot.toml has settings of walk, but there is other";
    assert!(shown.contains(remark), "{shown}");
    let error = failed(&bench, "file:other.csv@max --axes walk=x,y,z");
    assert_has(&error, "--axes names the foot walk, but there is other");
}

#[test]
fn settings_of_no_recording_are_refused() {
    let bench = bench();
    for command in ["monitor", "view", "record -o x.mcap", "ros2"] {
        for option in ["--config robot.toml", "--estimate-again"] {
            bench.refuses(
                &format!("{command} demo {option}"),
                "demo:feet=1 is not a recording of an IMU: ",
            );
        }
    }
    let frame = "(0.000001) can0 1A1#0000000000000000\n";
    fs::write(bench.path("can.log"), frame.repeat(3)).expect("a file");
    let error = failed(&bench, "file:can.log@max --config robot.toml");
    assert_has(&error, "can.log has contacts that feet sent");
    fs::write(bench.path("bad.toml"), "decision.threshold = 2\n").expect("a file");
    bench.refuses("monitor file:walk.csv@max --config bad.toml", "bad.toml, line 1");
}
