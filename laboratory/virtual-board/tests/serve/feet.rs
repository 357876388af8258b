//! Feet in any order of threads, and orders to them.

use std::path::PathBuf;

use host_tests::one_robot::{FEET, OneRobot};
use host_tests::requirements::unmet;
use serde_json::Value as Json;
use virtual_board::emulator::corner::Corner;
use virtual_board::product::serve::robot::{BoardRobot, ControlNode, RobotOptions};

use super::server::{Server, footfall};
use crate::common::product;

fn robot(elf: Vec<u8>, feet: usize) -> BoardRobot {
    let options = RobotOptions {
        feet,
        gait: gait::GaitName::Walk,
        seed: 1,
        corner: Corner::Typical,
        control: ControlNode::Present,
        settings: Vec::new(),
    };
    BoardRobot::start(elf, &options).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_seed_gives_the_same_frames_in_any_thread_order() {
    let elf = product();
    let run = || {
        let mut robot = robot(elf.clone(), 2);
        let mut frames = Vec::new();
        for _ in 0..600 {
            frames.extend(robot.step().unwrap_or_else(|error| panic!("{error}")).carried);
        }
        frames
    };
    let first = run();
    assert!(first.len() > 500);
    assert!(first == run());
}

#[test]
fn wrong_orders_are_errors_and_the_robot_runs_on() {
    let mut server = Server::start(&["--seconds", "60"]);
    server.type_line("RR: gait trot");
    server.wait_for("error: the robot has no foot RR");
    server.type_line("RR gait trot");
    server.wait_for("is not a command; help lists them");
    server.order("FL: power-cycle");
    server.type_line("fault no-crystal");
    server.wait_for("all feet: fault no-crystal");
    server.run(500);
    server.end();
}

#[test]
fn feet_on_lines_of_their_own_are_one_robot() {
    let server = Server::start(&["--feet", "2", "--gait", "stand"]);
    let [left, right] = ["L", "R"].map(|foot| server.serial(foot));
    let (lines, said) =
        footfall(server.folder(), &["monitor", &left, &right, "--json", "--seconds", "3"]);
    assert_eq!(said, "");
    for foot in ["L", "R"] {
        let of_foot = |line: &Json| line["foot"] == foot && line["rate_hz"].is_number();
        let mut lines = lines.lines().map(|line| serde_json::from_str::<Json>(line).expect("JSON"));
        let line = lines.rfind(of_foot).unwrap_or_else(|| panic!("no {foot}: {said}"));
        let rate = line["rate_hz"].as_f64().expect("a number");
        assert!((990.0..=1010.0).contains(&rate), "{line}");
        assert_eq!((&line["missing"], &line["dropped"]), (&0.into(), &0.into()), "{line}");
    }
    server.end();
}

/// On one bus: with the program that `.ci/full` builds, which can record and publish.
#[test]
#[ignore = "full: four boards, and a program with all features"]
fn four_boards_on_a_bus_walk_as_one_robot() {
    let server = Server::start(&["--feet", "4"]);
    let Some(program) = std::env::var_os("FOOTFALL_PROGRAM").map(PathBuf::from) else {
        return unmet("FOOTFALL_PROGRAM: footfall with all features");
    };
    let sources = [server.bus()];
    let robot =
        OneRobot { program: &program, folder: server.folder(), sources: &sources, rate: 1000.0 };
    robot.walk();
    // The same feet on their serial lines.
    let sources = FEET.map(|foot| server.serial(foot));
    OneRobot { sources: &sources, ..robot }.walk();
    server.end();
}
