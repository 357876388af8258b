//! Feet in any order of threads, and a program that does not read.

use std::fs::OpenOptions;
use std::io::Write as _;
use std::thread;
use std::time::Duration;

use virtual_board::emulator::corner::Corner;
use virtual_board::product::serve::robot::{BoardRobot, ControlNode, RobotOptions};

use crate::common::product;
use crate::server::Server;

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
            frames.extend(
                robot
                    .step()
                    .unwrap_or_else(|error| panic!("{error}"))
                    .carried,
            );
        }
        frames
    };
    let first = run();
    assert!(first.len() > 500);
    assert!(first == run());
}

#[test]
#[ignore = "real time"]
fn a_program_that_does_not_read_loses_bytes_but_blocks_nothing() {
    let Some(mut server) = Server::start_in_real_time("slow", &["--feet", "1", "--speed", "max"])
    else {
        return;
    };
    let open = |name: &str| {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .open(server.path(name));
        file.expect("it opens")
    };
    let serial = open("FL.uart");
    let mut bus = open("bus.slcan");
    bus.write_all(b"\rC\rS8\rO\r").expect("written");
    // Ten seconds of the boards fill all buffers.
    let end_s = server.order("FL: gait walk") + 10.0;
    while server.order("FL: gait walk") < end_s {
        thread::sleep(Duration::from_millis(100));
    }
    drop((serial, bus));
    let links = ["FL.uart", "bus.slcan"].map(|name| server.path(name));
    let (said, status) = server.end();
    assert!(status.success(), "{said}");
    assert!(
        said.contains("FL.uart: ") && said.contains("bytes lost"),
        "{said}"
    );
    assert!(
        links.iter().all(|link| link.symlink_metadata().is_err()),
        "links are left"
    );
}

#[test]
fn an_unknown_foot_is_an_error() {
    let Some(mut server) = Server::start("none", &["--seconds", "60"]) else {
        return;
    };
    server.say("RR: gait trot");
    server.wait_for("error: the robot has no foot RR");
    server.say("RR gait trot");
    server.wait_for("is no command; help lists them");
    server.order("FL: power-cycle");
    server.say("fault no-crystal");
    server.wait_for("all feet: fault no-crystal");
    server.run(500);
    let (said, status) = server.end();
    assert!(status.success(), "{said}");
}
