//! The input of the benches: a simulated walk with swings, impacts and stances, so that the share
//! of samples that need the error function is that of a real gait.

use estimator_core::{
    AngularRate, ContactEstimator, ImuSample, LinearAcceleration, Params, SpecificForce, Timestamp,
    Validity, Vec3,
};

/// Five seconds at 1 kHz; made by the simulator and checked in host-tests.
const RECORDING: &str = include_str!("../../host-tests/recordings/walk.csv");

/// The samples as the sensor gave them.
pub fn samples() -> Vec<ImuSample> {
    RECORDING.lines().skip(1).map(sample).collect()
}

/// The motion that is left of the samples once gravity and bias are out.
pub fn motion() -> Vec<(LinearAcceleration, AngularRate)> {
    let config = Params::DEFAULT.validate::<256>().expect("a preset");
    let mut estimator = ContactEstimator::new(&config);
    let estimates = samples().into_iter().map(|s| estimator.update(&s, None));
    estimates
        .map(|e| (e.linear_acceleration, e.angular_rate))
        .collect()
}

fn sample(line: &str) -> ImuSample {
    let columns: Vec<f64> = line
        .split(',')
        .take(7)
        .map(|column| column.parse().expect("a number"))
        .collect();
    let vector = |from: usize| {
        let [x, y, z] = [0, 1, 2].map(|i| columns[from + i] as f32);
        Vec3::new(x, y, z)
    };
    ImuSample {
        timestamp: Timestamp::from_micros((columns[0] * 1.0e6).round() as u64),
        specific_force: SpecificForce(vector(1)),
        angular_rate: AngularRate(vector(4)),
        validity: Validity::Valid,
    }
}
