//! Tables of walking feet and of sensors at rest, and an image of a foot's program.

use bootloader::image::{Board, Header, Kind, SHORTEST, Sources};
use gait::{GaitName, Ground, Plan, SensorParams, record};
use tables::output::write_recording;

use super::AXES;

/// Returns a simulated walk.
pub fn csv(gait: GaitName, seconds: f64) -> Vec<u8> {
    let plan = Plan::steady(gait, Ground::Hard, seconds, 3);
    let recording = record(&plan, &SensorParams::LSM6DSOX, 3);
    let mut bytes = Vec::new();
    write_recording(&recording.samples, &mut bytes).expect("memory is enough");
    bytes
}

/// Returns a sensor in g times `unit` at rest on some of its six sides, two seconds each.
pub fn lying(sides: usize, unit: f64) -> String {
    let mut rows = String::new();
    for k in 0..sides * 200 {
        let side = k / 200;
        let mut force = [0.1, -0.05, 0.08];
        force[side / 2] += unit * if side % 2 == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = force;
        rows += &format!("{:.2},{x},{y},{z},0.01,0,-0.02\n", k as f64 * 0.01);
    }
    format!("t,{AXES}\n{rows}")
}

/// Returns the shortest image of a program with the number that a simulated foot has, whose bytes are not checked.
pub fn image() -> Vec<u8> {
    let header = Header {
        kind: Kind::Signed,
        board: Board::Reference,
        length: SHORTEST,
        sequence: 0,
        version: [0, 0, 0],
        sources: Sources::Committed,
        commit: [0; 20],
        hash: [0; 32],
        signature: [0; 64],
    };
    let mut bytes = header.encode().to_vec();
    bytes.resize(bytes.len() + SHORTEST as usize, 0);
    bytes
}
