//! Setup of a new robot, on the ELF: position of each board, self-test of the sensor, calibration.

use std::process::{Command, Stdio};

use serde_json::Value as Json;

use super::server::{Server, footfall, program};

#[test]
fn a_board_is_tested_and_repositioned_over_both_lines() {
    let server = Server::start(&["--gait", "stand"]);
    let (serial, bus) = (server.serial("FL"), server.bus());
    for (source, name) in [(&serial, "FR"), (&bus, "RL")] {
        let passed = server.foot(source, &["selftest"]);
        assert_eq!(passed, "the sensor has passed its self-test\n");
        let info = server.foot(source, &["id", name]);
        assert!(info.starts_with(&format!("foot     {name}, ")), "{info}");
        server.foot(source, &["reset"]);
        let changed = server.foot(source, &["diff"]);
        assert!(!changed.contains("self_test_at_start"), "{changed}");
    }
    let scan = server.foot(&bus, &["scan"]);
    assert!(scan.ends_with("  node 19  RL\n"), "{scan}");
    server.end();
}

#[test]
fn a_walking_board_keeps_its_learnt_values_over_a_reset() {
    let server = Server::start(&[]);
    let serial = server.serial("FL");
    let learnt = server.foot(&serial, &["calibrate", "--json"]);
    let learnt: Json = serde_json::from_str(&learnt).expect("JSON");
    let still = learnt["learnt"]["still"].as_f64();
    let moving = learnt["learnt"]["moving"].as_f64();
    assert!(still < moving, "{learnt}");
    let bias = learnt["gyroscope_bias_rad_s"].as_array().expect("axes");
    assert!(bias.iter().all(Json::is_number), "{learnt}");
    let kept = |server: &Server| {
        let stored = server.foot(&serial, &["get", "learnt.still", "--json"]);
        let stored: Json = serde_json::from_str(&stored).expect("JSON");
        stored["learnt.still"].as_f64().expect("a number")
    };
    let before = kept(&server);
    assert_ne!(before, 0.0);
    // The displayed values are the stored ones, although the foot has learnt more since then.
    let stored = server.foot(&serial, &["get", "--json"]);
    let stored: Json = serde_json::from_str(&stored).expect("JSON");
    for (name, shown) in learnt["learnt"].as_object().expect("numbers") {
        assert_eq!(stored[format!("learnt.{name}")], *shown, "{name}");
    }
    server.foot(&serial, &["reset"]);
    assert_eq!(kept(&server).to_bits(), before.to_bits());
    server.foot(&server.bus(), &["calibrate", "--forget"]);
    assert_eq!(kept(&server), 0.0);
}

#[test]
fn a_board_with_a_custom_node_id_is_found_set_and_watched() {
    let server = Server::start(&["--feet", "2", "--gait", "stand"]);
    let bus = server.bus();
    let set = ["--node", "22", "set", "node_id=34", "--save"];
    assert_eq!(server.foot(&bus, &set), "node_id: 0 → 34\nstored\n");
    server.foot(&bus, &["--node", "22", "reset"]);
    let scan = server.foot(&bus, &["scan"]);
    let nodes: Vec<_> = scan.lines().filter_map(|line| line.split_once("node ")).collect();
    let nodes: Vec<_> = nodes.iter().map(|(_, node)| *node).collect();
    assert_eq!(nodes, ["21  L", "34"], "{scan}");
    let info = server.foot(&bus, &["--node", "34", "info"]);
    assert!(info.starts_with("foot     R, node 34\n"), "{info}");
    let watch = ["monitor", &bus, "--names", "34=R", "--json", "--seconds", "3"];
    let (lines, _) = footfall(server.folder(), &watch);
    let of_foot = lines.lines().filter(|line| line.contains("\"foot\":\"R\""));
    assert!(of_foot.filter(|line| line.contains("\"p_stable\":")).count() > 0, "{lines}");
}

#[test]
fn a_board_left_pre_operational_reports_it_and_resumes() {
    let server = Server::start(&["--gait", "stand"]);
    let bus = server.bus();
    // No time passes between the reset and the end of the program.
    let mut holder = server.hold("FL.uart");
    let mut setting = Command::new(program())
        .args(["foot", &bus, "--node", "17", "selftest"])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the program runs");
    server.wait_for("bus.slcan: opened");
    while !server.error_output().contains("FL: reset by its program") {
        holder.run(1);
    }
    setting.kill().expect("killed");
    setting.wait().expect("it ends");
    drop(holder);
    let info = server.foot(&bus, &["--node", "17", "info"]);
    assert!(info.contains("\nstate    pre-operational: it sends no contacts"), "{info}");
    server.foot(&bus, &["--node", "17", "reset"]);
    let info = server.foot(&bus, &["info", "--json"]);
    let info: Json = serde_json::from_str(&info).expect("JSON");
    assert_eq!(info["state"], "operational");
}

#[test]
fn settings_lost_by_a_power_failure_are_not_reported_stored() {
    let mut server = Server::start(&["--gait", "stand"]);
    for (line, delay_ms, value) in
        [("serial", 150, 0.61), ("serial", 250, 0.62), ("bus", 700, 0.63), ("bus", 1100, 0.64)]
    {
        let source = match line {
            "bus" => server.bus(),
            _ => server.serial("FL"),
        };
        let threshold = format!("decision.threshold={value}");
        server.plan(delay_ms, "FL: power-cycle");
        let output = Command::new(program())
            .args(["foot", &source, "set", &threshold, "--save"])
            .output()
            .expect("the program runs");
        // The state after a further power cycle is decisive.
        server.order("FL: power-cycle");
        server.run(1000);
        let now = server.foot(&source, &["get", "decision.threshold"]);
        let is_there = now.contains(&threshold.replace('=', " = "));
        let words = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success() || is_there, "{line} after {delay_ms} ms: {now}{words}");
    }
}
