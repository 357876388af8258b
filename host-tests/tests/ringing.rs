//! Ringing of a leg's structure after a landing, from 0.5 to 3 kHz, with the foot's setting of the sensor: one sample at
//! each tick, behind filters of 333 Hz.
//!
//! The simulated foot has springs of its own up to 80 Hz; a decaying sine at each impact is added to what its sensor
//! feels.

use config::default_params;
use estimator_core::{ImuSample, Timestamp};
use gait::sensor::felt_by;
use gait::{GaitName, Ground, Plan, SensorParams, Track, simulate};
use lsm6dsox::imu::{Conversion, missing_sample};
use lsm6dsox::sim::{Part, SharedPart, SimSpi, Stimulus};
use lsm6dsox::{Config, Lsm6dsox, Pin};
use replay::scoring::{Metrics, Scored};
use samples::Recording;
use samples::estimate::estimates_of;

/// Duration of the walk, s.
const SECONDS: f64 = 30.0;

const SEED: u64 = 21;

/// Time from power-up to the first tick, ns.
const START_NS: u64 = 100_000_000;

const TICK_NS: u64 = 1_000_000;

/// Amplitude of the ringing along each axis, m/s², and its time constant, s.
const AMPLITUDE: f64 = 60.0;
const DECAY: f64 = 0.015;

/// Frequencies, Hz; 0 is without ringing. The part's converter runs at 6.7 kHz.
const FREQUENCIES: [f64; 5] = [0.0, 500.0, 1000.0, 2000.0, 3000.0];

/// Limit of the RMSE with ringing, for the foot's setting.
const RMSE: f64 = 0.222;

/// A part on the walking foot, with ringing of this frequency after each impact.
fn mounted(plan: &Plan, frequency: f64) -> SharedPart {
    let track = Track::new(plan);
    let impacts: Vec<f64> = track.impacts().collect();
    let felt = move |seconds: f64| -> Stimulus {
        let t = seconds - START_NS as f64 * 1e-9;
        let mut felt = felt_by(&track.at(t), 25.0);
        let last = impacts[..impacts.partition_point(|impact| *impact <= t)].last();
        if let Some(since) = last.map(|impact| t - impact).filter(|_| frequency > 0.0) {
            let phase = std::f64::consts::TAU * frequency * since;
            let ring = AMPLITUDE * (-since / DECAY).exp() * phase.sin();
            for force in &mut felt.specific_force {
                *force += ring;
            }
        }
        felt
    };
    Part::with_options(felt, SensorParams::LSM6DSOX.specimen(SEED)).shared()
}

/// Reads the next sample at its edge.
fn next(
    part: &SharedPart,
    driver: &mut Lsm6dsox<SimSpi>,
    conversion: &mut Conversion,
) -> ImuSample {
    if let Some(edge) = part.next_rising_edge_ns(Pin::Int1) {
        part.advance_to(edge);
    }
    let timestamp = Timestamp::from_micros((part.now_ns() - START_NS) / 1000);
    match driver.sample() {
        Ok(raw) => conversion.imu_sample(&raw, timestamp),
        Err(_) => missing_sample(timestamp),
    }
}

/// The walk as the foot records it, with the labels of its own motion.
fn recorded(plan: &Plan, labelled: &Recording, frequency: f64) -> Recording {
    let part = mounted(plan, frequency);
    let mut driver = Lsm6dsox::new(part.spi(), Config::FRESH_KILOHERTZ);
    driver.init(&mut part.delay()).expect("it starts");
    part.advance_to(START_NS);
    let mut conversion = Conversion::new(&Config::FRESH_KILOHERTZ);
    let mut recording = labelled.clone();
    for (tick, sample) in (0..).zip(&mut recording.samples) {
        part.advance_to(START_NS + tick * TICK_NS);
        sample.imu = next(&part, &mut driver, &mut conversion);
    }
    recording
}

fn metrics(recording: &Recording) -> Metrics {
    let estimates = estimates_of(recording, &default_params()).expect("the preset");
    Metrics::of(&Scored::collect(&recording.samples, &estimates)).expect("labels")
}

#[test]
fn ringing_of_the_leg_costs_the_foots_setting_little() {
    let plan = Plan::steady(GaitName::Walk, Ground::Hard, SECONDS, SEED);
    let labelled = simulate(&plan, &SensorParams::LSM6DSOX, SEED).recording;
    for frequency in FREQUENCIES {
        let recording = recorded(&plan, &labelled, frequency);
        let rmse = metrics(&recording).rmse;
        assert!(rmse <= RMSE, "{frequency} Hz: {rmse}");
    }
}
