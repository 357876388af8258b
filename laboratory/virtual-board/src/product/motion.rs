//! Motions of the sensor: a simulated gait, or a recording.

use std::path::Path;

use estimator_core::Gravity;
use gait::sensor::{GRAVITY, felt_by};
use gait::{GaitName, Ground, Plan, Track};
use lsm6dsox::sim::{Interpolation, Motion, Recording, Stimulus};
use options::{Format, InputOptions};
use recordings::Opened;
use samples::space::components;

/// The temperature of the sensor, °C.
pub const TEMPERATURE: f64 = 25.0;

/// A steady gait of `seconds`, then standing still; the sensor stays at [`TEMPERATURE`].
#[must_use]
pub fn gait(name: GaitName, seconds: f64, seed: u64) -> impl Motion + 'static {
    let track = Track::new(&Plan::steady(name, Ground::Hard, seconds, seed));
    move |time: f64| felt_by(&track.at(time), TEMPERATURE)
}

/// Reads a recording as the input of the sensor, without its first `skip` seconds.
///
/// A sensor measures gravity. If a simulator has removed it, which loses the tilt, it is added along z, as for a
/// sole that stays level: the input is then the recorded motion of a foot that does not tilt. Samples are
/// interpolated linearly to the ticks of the sensor's clock, 6.67 kHz, and pass through the noise, filters and
/// ranges of the sensor.
///
/// # Errors
/// If it cannot be read, or no sample is left.
pub fn recorded(path: &Path, format: Option<Format>, skip: f64) -> Result<Recording, String> {
    let loaded = Opened::new(path, format)
        .and_then(|opened| opened.read(&InputOptions::default()))
        .map_err(|error| error.to_string())?;
    let recording = loaded.recording;
    let added = match recording.gravity {
        Gravity::Included => 0.0,
        Gravity::Removed => GRAVITY,
    };
    let rate = f64::from(recording.sample_rate);
    let samples = recording
        .samples
        .iter()
        .skip((skip * rate) as usize)
        .map(|sample| {
            let (force, rate) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
            let [ax, ay, az] = components(force).map(f64::from);
            Stimulus {
                specific_force: [ax, ay, az + added],
                angular_rate: components(rate).map(f64::from),
                temperature: 25.0,
            }
        })
        .collect();
    Recording::new(rate, samples, Interpolation::Linear).map_err(|error| error.to_string())
}
