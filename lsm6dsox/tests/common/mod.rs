//! A part at rest, and its driver.

use lsm6dsox::sim::{Part, PartOptions, SharedPart, SimSpi, Stimulus};
use lsm6dsox::{Config, Lsm6dsox};

/// A quiet part: no noise, no jitter.
pub const QUIET: PartOptions = PartOptions {
    jitter_ns: 0,
    noise: false,
    accel_test_signal: [4.9; 3],
    gyro_test_signal: [7.0; 3],
    ..PartOptions::DEFAULT
};

pub fn at_rest(_seconds: f64) -> Stimulus {
    Stimulus::REST
}

pub fn part(options: PartOptions) -> SharedPart {
    Part::with_options(at_rest, options).shared()
}

/// Initialises a driver and waits for a millisecond.
pub fn sensor(part: &SharedPart, config: Config) -> Lsm6dsox<SimSpi> {
    let mut sensor = Lsm6dsox::new(part.spi(), config);
    sensor.init(&mut part.delay()).expect("the part is sound");
    part.advance_by(1_000_000);
    sensor
}
