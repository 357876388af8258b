//! What the sensor feels of a simulated gait.

use footfall::gait::sensor::GRAVITY;
use footfall::gait::space::Vector;
use footfall::gait::{GaitName, Ground, Motion, Plan};
use lsm6dsox::sim::Stimulus;

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
