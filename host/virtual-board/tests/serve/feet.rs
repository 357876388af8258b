//! Feet in any order of threads, and orders to them.

use virtual_board::emulator::corner::Corner;
use virtual_board::product::serve::robot::{BoardRobot, ControlNode, RobotOptions};

use super::server::Server;
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
    let Some(elf) = product() else { return };
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
    let Some(mut server) = Server::start("none", &["--seconds", "60"]) else {
        return;
    };
    server.say("RR: gait trot");
    server.wait_for("error: the robot has no foot RR");
    server.say("RR gait trot");
    server.wait_for("is not a command; help lists them");
    server.order("FL: power-cycle");
    server.say("fault no-crystal");
    server.wait_for("all feet: fault no-crystal");
    server.run(500);
    server.end();
}
