//! What the sensor feels: a simulated gait, or a recording.

use estimator_core::{Gravity, Vec3};
use footfall::gait::space::Vector;
use footfall::gait::{GaitName, Ground, Motion, Plan};
use footfall::recording::Recording;
use lsm6dsox::sim::{Interpolation, Stimulus};

/// m/s².
const GRAVITY: f64 = 9.806_65;

/// A steady gait of so many seconds, which then stands still.
#[must_use]
pub fn gait(name: GaitName, seconds: f64, seed: u64) -> impl lsm6dsox::sim::Motion + 'static {
    let motion = Motion::new(&Plan::steady(name, Ground::Hard, seconds, seed));
    move |time: f64| {
        let foot = motion.at(time);
        let against_gravity = foot.acceleration + Vector::new(0.0, 0.0, GRAVITY);
        Stimulus {
            specific_force: foot.orientation.to_sensor(against_gravity).to_array(),
            angular_rate: foot.angular_rate.to_array(),
            temperature: 25.0,
        }
    }
}

/// A recording, resampled by straight lines to the sensor's clock.
///
/// # Errors
/// Where gravity was taken out of it, or there is nothing in it.
pub fn recording(recording: &Recording) -> Result<lsm6dsox::sim::Recording, String> {
    if recording.gravity != Gravity::Included {
        return Err("a sensor feels gravity, which is not in this recording".into());
    }
    let samples = recording
        .samples
        .iter()
        .map(|sample| Stimulus {
            specific_force: wide(sample.imu.specific_force.0),
            angular_rate: wide(sample.imu.angular_rate.0),
            temperature: 25.0,
        })
        .collect();
    let rate = f64::from(recording.sample_rate);
    lsm6dsox::sim::Recording::new(rate, samples, Interpolation::Linear)
        .map_err(|error| error.to_string())
}

fn wide(vector: Vec3) -> [f64; 3] {
    [vector.x, vector.y, vector.z].map(f64::from)
}
