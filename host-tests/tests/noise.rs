//! The sensor's noise and the estimator's bandwidths: two crates without a common dependency.

use estimator_core::{Axis, Params};
use lsm6dsox::Config;
use recordings::config::default_params;

#[test]
fn the_default_bandwidths_match_the_sensor_noise() {
    let noise = Config::FRESH_KILOHERTZ.noise();
    let force = noise.specific_force.expect("a known cut-off");
    let rate = noise.angular_rate.expect("a known cut-off");
    let expected = [force, force, force, rate, rate, rate];
    let defaults = Params::DEFAULT.bandwidth.to_array();
    for ((axis, default), noise) in Axis::ALL.into_iter().zip(defaults).zip(expected) {
        let off = (default / noise - 1.0).abs();
        assert!(off < 0.01, "{}: {default} for {noise}", axis.name());
    }
    assert_eq!(default_params().bandwidth.to_array(), expected);
}
