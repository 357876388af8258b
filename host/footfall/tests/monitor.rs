//! Tests of `footfall monitor` and `footfall explain` as programs.

use crate::common::{Bench, text};

/// Returns the standard output, the standard error and the status of a command.
fn outcome(bench: &Bench, arguments: &str) -> (String, String, Option<i32>) {
    let output = bench.run(arguments);
    (text(&output.stdout), text(&output.stderr), output.status.code())
}

fn monitor(arguments: &str) -> (String, String, Option<i32>) {
    outcome(&Bench::new(), &format!("monitor {arguments}"))
}

/// Returns the output about four feet, for two and a half seconds on their clocks.
fn lines_of_four_feet(speed: &str) -> String {
    let (lines, warnings, code) = monitor(&format!("demo:feet=4,seconds=2.5,speed={speed}"));
    assert_eq!((warnings.as_str(), code), ("", Some(0)));
    assert!(lines.contains("missing 0, dropped 0"), "{lines}");
    assert!(lines.contains("the demo has ended"), "{lines}");
    lines
}

/// Counts the lines of a foot with a probability.
fn lines_with_p(lines: &str, foot: &str) -> usize {
    let of_foot = lines.lines().filter(|line| line.contains(&format!("s  {foot}  ")));
    of_foot.filter(|line| line.contains("  P ")).count()
}

#[test]
fn output_without_terminal_has_lines_of_each_foot() {
    let lines = lines_of_four_feet("max");
    for foot in ["FL", "FR", "RL", "RR"] {
        assert!(lines_with_p(&lines, foot) > 0, "{foot}:\n{lines}");
    }
}

#[test]
#[ignore = "real time"]
fn output_without_terminal_is_one_line_per_foot_and_second() {
    let lines = lines_of_four_feet("1");
    for foot in ["FL", "FR", "RL", "RR"] {
        assert_eq!(lines_with_p(&lines, foot), 3, "{foot}:\n{lines}");
    }
}

#[test]
fn json_output_has_one_object_per_line() {
    let (lines, _, code) = monitor("demo:feet=2,speed=max,seconds=3 --json");
    assert_eq!(code, Some(0));
    let objects: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}")))
        .collect();
    let feet: Vec<_> = objects.iter().filter(|o| o["p_stable"].is_number()).collect();
    // Each foot has one object at the end, and before that one per second on the clock of this machine.
    let [.., left, right] = feet.as_slice() else {
        panic!("{lines}");
    };
    assert_eq!((&left["foot"], &right["foot"]), (&"L".into(), &"R".into()));
    assert_eq!(left["missing"], 0);
    assert!(objects.iter().any(|object| object["event"] == "has started"));
}

#[test]
fn feet_of_a_bus_and_of_two_serial_lines_are_one_robot() {
    let lines = "demo:feet=2,seconds=2.5,speed=max demo:feet=2,line=uart,seconds=2.5,speed=max";
    let names = "--names 0x15=FL,0x16=FR,L=RL,R=RR";
    let (lines, warnings, code) = monitor(&format!("{lines} {names}"));
    assert_eq!((warnings.as_str(), code), ("", Some(0)));
    for foot in ["FL", "FR", "RL", "RR"] {
        assert!(lines_with_p(&lines, foot) > 0, "{foot}:\n{lines}");
    }
    let of_others = lines.lines().filter(|line| line.contains("  P "));
    assert!(
        of_others.filter(|line| !line.contains("missing 0, dropped 0")).count() == 0,
        "{lines}"
    );
}

#[test]
fn invalid_source_is_a_command_line_error() {
    let (_, error, code) = monitor("ttyACM0");
    assert_eq!(code, Some(2));
    assert!(error.contains("sources are usb, usb:FR, uart:PORT[@BAUD]"), "{error}");
}

#[test]
fn demo_log_and_recording_are_played() {
    let bench = Bench::new();
    bench.stdout("demo --output walk");
    for file in ["can.log", "uart.bin", "samples.csv"] {
        let (lines, warnings, code) = outcome(&bench, &format!("monitor file:walk/{file}@max"));
        assert_eq!((warnings.as_str(), code), ("", Some(0)), "{file}: {lines}");
        assert!(lines.contains("  P "), "{file}: {lines}");
    }
}

#[test]
fn unplayable_source_is_an_error() {
    let (lines, error, code) = monitor("file:there-is-none.log");
    assert_eq!((lines.as_str(), code), ("", Some(1)));
    assert!(error.contains("there-is-none.log"), "{error}");
}

#[test]
fn faults_flags_and_refusals_are_explained() {
    let bench = Bench::new();
    let explain = |arguments: &str| outcome(&bench, &format!("explain {arguments}"));
    let (text, _, code) = explain("0x7007");
    assert_eq!(code, Some(0));
    assert!(text.starts_with("fault 0x7007 sensor out of step\n"), "{text}");
    assert!(text.contains("what to do: "), "{text}");
    assert!(explain("sensor frozen").0.starts_with("fault 0x7002"));
    assert!(explain("settling").0.contains("walk four or five steps"));
    assert!(explain("0x06090031").0.contains("value too high"));
    assert!(explain("").0.lines().count() > 40);
    let (_, error, code) = explain("0x1234");
    assert_eq!(code, Some(1));
    assert!(error.contains("footfall explain lists all"), "{error}");
}
