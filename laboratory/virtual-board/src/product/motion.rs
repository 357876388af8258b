//! Motion of the sensor: a simulated gait.

use gait::sensor::felt_by;
use gait::{GaitName, Ground, Plan, Track};
use lsm6dsox::sim::Motion;

/// The temperature of the sensor, °C.
pub const TEMPERATURE: f64 = 25.0;

/// A steady gait of `seconds`, then standing still; the sensor stays at [`TEMPERATURE`].
#[must_use]
pub fn gait(name: GaitName, seconds: f64, seed: u64) -> impl Motion + 'static {
    let track = Track::new(&Plan::steady(name, Ground::Hard, seconds, seed));
    move |time: f64| felt_by(&track.at(time), TEMPERATURE)
}
