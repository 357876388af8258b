//! Files of recordings become what the sensor feels.
//!
//! A sensor feels gravity. Where a simulator has taken it out, which says nothing about the tilt, it
//! is put back along z, as on a sole that stays level: what is fed is then the recorded motion of a
//! foot that does not tilt in the field of gravity. Samples are resampled by straight lines to the
//! ticks of the sensor's clock, 6.67 kHz, and reach its codes by its noise, filters and ranges.

use std::path::Path;

use estimator_core::Gravity;
use gait::sensor::GRAVITY;
use lsm6dsox::sim::{Interpolation, Recording, Stimulus};
use recordings::input::{Format, Hints, Opened};

/// Reads a file, but for what comes before `skip` seconds.
///
/// # Errors
/// Where it cannot be read, or nothing is left.
pub fn read(path: &Path, format: Option<Format>, skip: f64) -> Result<Recording, String> {
    let loaded = Opened::new(path, format)
        .and_then(|opened| opened.read(&Hints::default()))
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
            let [ax, ay, az] = [force.x, force.y, force.z].map(f64::from);
            Stimulus {
                specific_force: [ax, ay, az + added],
                angular_rate: [rate.x, rate.y, rate.z].map(f64::from),
                temperature: 25.0,
            }
        })
        .collect();
    Recording::new(rate, samples, Interpolation::Linear).map_err(|error| error.to_string())
}
