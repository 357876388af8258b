//! A foot that follows a plan, recorded by a sensor that is read 1000 times a second.

use estimator_core::{Gravity, Load, Timestamp};

use super::codes::{RawSample, Scale};
use super::label::labels;
use super::motion::{FootState, Motion};
use super::plan::Plan;
use super::sensor::{Analogue, CONVERSION_PERIOD_US, SensorParams};
use crate::recording::{RecordedSample, Recording};

/// Time between recorded samples, µs: the firmware's tick.
const TICK_US: u64 = 1000;

/// A recording together with what really happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulation {
    /// What a robot would have recorded.
    pub recording: Recording,
    /// The state of the foot at each sample's timestamp.
    pub truth: Vec<FootState>,
}

/// Simulates a plan with the sensor that belongs to `seed`, from time 0 on.
///
/// At each tick the sensor's newest conversion is read, which is up to 150 µs old; its filters
/// delay by another 0.7 ms. Truth, load and label are those of the tick itself; the load is
/// without error. The same arguments give the same bits on every machine.
#[must_use]
pub fn simulate(plan: &Plan, sensor: &SensorParams, seed: u64) -> Simulation {
    let motion = Motion::new(plan);
    let mut analogue = Analogue::new(sensor, seed);
    let scale = Scale::LSM6DSOX_16G_2000DPS;
    let ticks = libm::floor(plan.duration * 1e6 / TICK_US as f64) as u64;

    let truth: Vec<FootState> = (0..ticks)
        .map(|tick| motion.at(seconds(tick * TICK_US)))
        .collect();
    let mut samples = Vec::with_capacity(truth.len());
    let mut conversion = 0;
    for (tick, (state, label)) in (0..).zip(truth.iter().zip(labels(&truth, seconds(TICK_US)))) {
        let now = tick * TICK_US;
        let mut raw = RawSample::default();
        while conversion * CONVERSION_PERIOD_US <= now {
            let t = seconds(conversion * CONVERSION_PERIOD_US);
            raw = scale.digitise(&analogue.convert(&motion.at(t), t));
            conversion += 1;
        }
        samples.push(RecordedSample {
            imu: scale.imu_sample(&raw, Timestamp::from_micros(now)),
            load: Some(Load(state.load as f32)),
            label: Some(label),
        });
    }
    Simulation {
        recording: Recording {
            name: plan.name.clone(),
            sample_rate: 1e6 / TICK_US as f32,
            gravity: Gravity::Included,
            load_title: "vertical force (N)".to_owned(),
            samples,
        },
        truth,
    }
}

/// The recording of [`simulate`] alone.
#[must_use]
pub fn record(plan: &Plan, sensor: &SensorParams, seed: u64) -> Recording {
    simulate(plan, sensor, seed).recording
}

fn seconds(micros: u64) -> f64 {
    micros as f64 * 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gait::motion::Activity;
    use crate::gait::plan::{GaitName, Ground};
    use crate::gait::space::Vector;
    use crate::recording::Label;
    use estimator_core::{ContactEstimator, Params, Validity, Vec3};

    fn demo(seed: u64) -> Simulation {
        simulate(&Plan::demo(seed), &SensorParams::LSM6DSOX, seed)
    }

    /// FNV-1a over the bits of all that a recording holds.
    fn fingerprint(recording: &Recording) -> u64 {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        let mut add = |bits: u64| {
            for byte in bits.to_le_bytes() {
                hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
            }
        };
        for sample in &recording.samples {
            add(sample.imu.timestamp.as_micros());
            for v in [sample.imu.specific_force.0, sample.imu.angular_rate.0] {
                for value in [v.x, v.y, v.z] {
                    add(u64::from(value.to_bits()));
                }
            }
            add(u64::from(sample.imu.validity != Validity::Valid));
            add(u64::from(sample.load.map_or(0, |load| load.0.to_bits())));
            add(u64::from(sample.label == Some(Label::Stable)));
        }
        hash
    }

    #[test]
    fn the_same_seed_gives_the_same_bits_on_every_machine() {
        // Where this number changes, so does every recording that was ever simulated.
        const SEED_1: u64 = 0x5458_3af6_432a_a742;
        assert_eq!(fingerprint(&demo(1).recording), SEED_1);
        assert_ne!(fingerprint(&demo(2).recording), SEED_1);
    }

    #[test]
    fn samples_come_at_exact_milliseconds_with_load_and_label() {
        let Simulation { recording, truth } = demo(1);
        assert_eq!(recording.samples.len(), truth.len());
        assert_eq!(recording.sample_rate, 1000.0);
        for (k, sample) in (0..).zip(&recording.samples) {
            assert_eq!(sample.imu.timestamp.as_micros(), k * 1000);
            assert!(sample.load.is_some_and(|load| load.0 >= 0.0));
            assert!(sample.label.is_some());
        }
    }

    #[test]
    fn some_hard_landings_saturate_the_sensor_and_nothing_else_does() {
        let Simulation { recording, truth } = demo(1);
        let saturated: Vec<Activity> = recording
            .samples
            .iter()
            .zip(&truth)
            .filter(|(sample, _)| sample.imu.validity != Validity::Valid)
            .map(|(_, state)| state.activity)
            .collect();
        assert!((1..40).contains(&saturated.len()), "{}", saturated.len());
        assert!(
            saturated
                .iter()
                .all(|activity| *activity == Activity::Landing)
        );
    }

    /// P per sample from the estimator's default preset, gravity taken out with the true
    /// orientation so that no attitude filter has a part in it.
    fn probabilities(simulation: &Simulation) -> Vec<f32> {
        let params = Params {
            gravity: Gravity::Removed,
            ..Params::DEFAULT
        };
        let config = params.validate::<256>().expect("a preset");
        let mut estimator = ContactEstimator::new(&config);
        let samples = simulation.recording.samples.iter();
        samples
            .zip(&simulation.truth)
            .map(|(sample, state)| {
                let gravity = Vector::new(0.0, 0.0, crate::gait::sensor::GRAVITY);
                let [x, y, z] = state.orientation.to_sensor(gravity).to_array();
                let mut imu = sample.imu;
                imu.specific_force.0 =
                    imu.specific_force.0 - Vec3::new(x as f32, y as f32, z as f32);
                estimator.update(&imu, sample.load).probabilities.stable
            })
            .collect()
    }

    #[test]
    fn good_stances_look_stable_to_the_estimator_and_slips_and_swings_do_not() {
        for gait in [GaitName::Walk, GaitName::Trot, GaitName::Run] {
            for ground in [Ground::Hard, Ground::Greased] {
                let plan = Plan::steady(gait, ground, 20.0, 4);
                let simulation = simulate(&plan, &SensorParams::LSM6DSOX, 4);
                let p = probabilities(&simulation);
                let by_activity: Vec<(Activity, f32)> = simulation
                    .truth
                    .iter()
                    .map(|state| state.activity)
                    .zip(p)
                    .collect();
                for phase in by_activity.chunk_by(|a, b| a.0 == b.0) {
                    let (activity, _) = phase[0];
                    let mean = phase.iter().map(|(_, p)| p).sum::<f32>() / phase.len() as f32;
                    let peak = phase.iter().map(|(_, p)| *p).fold(0.0, f32::max);
                    let whole = phase.len() > 20;
                    match (activity, ground) {
                        (Activity::Standing, Ground::Hard) if whole => assert!(peak > 0.9),
                        (Activity::Slipping, _) if whole => assert!(mean < 0.3, "{gait}: {mean}"),
                        (Activity::Swinging, _) if whole => assert!(mean < 0.1, "{gait}: {mean}"),
                        _ => {}
                    }
                }
            }
        }
    }
}
