//! The estimate is independent of the sensor's orientation in the foot: the same motion, recorded by a sensor with
//! other axes and read with its mounting.

use estimator_core::any::{AnyParams, Method};
use estimator_core::mounting::{Mounting, MountingParams, SensorAxis};
use estimator_core::{AngularRate, ContactEstimate, SpecificForce, Vec3};
use gait::{GaitName, Ground, Plan, SensorParams, record};
use host_tests::datasets::recorded;
use options::{Correction, Format, InputOptions};
use samples::Recording;
use samples::estimate::estimates_of;
use samples::mounting::{parse_axes, rotation, then};
use samples::space::Vector;
use tables::output::write_recording;

/// Parameters with half-widths, which judge each axis separately, so that a missing mounting changes the estimate.
const HALF_WIDTHS: AnyParams = AnyParams { method: Method::HalfWidths, ..AnyParams::DEFAULT };

fn walk() -> Recording {
    let plan = Plan::steady(GaitName::Walk, Ground::Hard, 6.0, 3);
    record(&plan, &SensorParams::LSM6DSOX, 3)
}

fn go1() -> Option<Recording> {
    let path = recorded("pce/GO1_normal_surface.csv")?;
    let loaded = recordings::read(&path, Format::PceGo1, &InputOptions::default());
    Some(loaded.expect("a readable file").recording)
}

/// Mountings with axes along axes.
fn mountings() -> Vec<Mounting> {
    let mut all = Vec::new();
    for x in SensorAxis::ALL {
        for y in SensorAxis::ALL {
            let axes = SensorAxis::ALL.map(|z| MountingParams::Axes([x, y, z]).validate());
            all.extend(axes.into_iter().flatten());
        }
    }
    assert_eq!(all.len(), 24);
    all
}

fn mounting(text: &str) -> Mounting {
    parse_axes(text).expect(text)
}

/// Recording of the same motion by a sensor in another orientation.
fn recorded_by(recording: &Recording, to_sensor: impl Fn(Vec3) -> Vec3) -> Recording {
    let mut turned = recording.clone();
    for sample in &mut turned.samples {
        let imu = &mut sample.imu;
        imu.specific_force = SpecificForce(to_sensor(imu.specific_force.0));
        imu.angular_rate = AngularRate(to_sensor(imu.angular_rate.0));
    }
    turned
}

/// Estimates of a recording that is written to a table and read with a mounting.
fn estimates(
    recording: &Recording,
    mounting: Mounting,
    params: &AnyParams,
) -> Vec<ContactEstimate> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("walk.csv");
    let mut table = Vec::new();
    write_recording(&recording.samples, &mut table).expect("memory");
    std::fs::write(&path, table).expect("a file");
    let input_options = InputOptions {
        sample_rate: Some(recording.sample_rate),
        gravity: Some(recording.gravity),
        correction: Correction { mounting, ..Correction::NONE },
        ..InputOptions::default()
    };
    let loaded = recordings::read(&path, Format::Csv, &input_options).expect("a readable file");
    estimates_of(&loaded.recording, params).expect("a preset")
}

/// All of the estimates, to the bit.
fn bits(estimates: &[ContactEstimate]) -> Vec<String> {
    // The shortest unambiguous text, which distinguishes −0 from 0.
    estimates.iter().map(|e| format!("{e:?}")).collect()
}

#[test]
fn any_of_24_mountings_gives_the_same_bits() {
    let walk = walk();
    let mut cases = vec![(&walk, HALF_WIDTHS), (&walk, AnyParams::DEFAULT)];
    let go1 = go1();
    cases.extend(go1.iter().map(|go1| (go1, AnyParams::PAPER_GO1)));
    for (recording, params) in cases {
        let expected = bits(&estimates(recording, Mounting::IDENTITY, &params));
        for mounting in mountings() {
            let mut back = mountings().into_iter();
            let back = back.find(|back| then(back, &mounting) == Mounting::IDENTITY);
            let back = back.expect("each way has a way back");
            let turned = recorded_by(recording, |vector| back.turn(vector));
            let found = bits(&estimates(&turned, mounting, &params));
            let difference = found.iter().zip(&expected).find(|(a, b)| a != b);
            assert_eq!(difference, None, "{mounting:?}");
            assert_eq!(found.len(), expected.len());
        }
    }
}

/// The largest differences of P: total, tangential and vertical.
fn differences(found: &[ContactEstimate], expected: &[ContactEstimate]) -> [f32; 3] {
    let mut largest = [0.0_f32; 3];
    for (found, expected) in found.iter().zip(expected) {
        let [found, expected] = [found, expected].map(|e| {
            let p = e.probabilities;
            [p.stable, p.tangential, p.vertical]
        });
        for (largest, (a, b)) in largest.iter_mut().zip(found.iter().zip(expected)) {
            *largest = largest.max((a - b).abs());
        }
    }
    largest
}

#[test]
fn an_oblique_sensor_with_its_quaternion_agrees_closely() {
    let walk = walk();
    for text in ["0.8,0.6,0,0", "0.1,-0.7,0.5,0.5", "0.3,0.2,-0.9,0.24494897"] {
        let mounting = mounting(text);
        let rotation = rotation(&mounting);
        let turned = recorded_by(&walk, |v| {
            let turned = rotation.to_sensor(Vector::new(v.x.into(), v.y.into(), v.z.into()));
            let [x, y, z] = turned.to_array().map(|part| part as f32);
            Vec3::new(x, y, z)
        });
        for params in [HALF_WIDTHS, AnyParams::DEFAULT] {
            let expected = estimates(&walk, Mounting::IDENTITY, &params);
            let found = differences(&estimates(&turned, mounting, &params), &expected);
            println!("{text}, {:?}: {found:?}", params.method);
            assert!(found.into_iter().all(|difference| difference < 1e-4), "{found:?}");
        }
        // Without the mounting the components differ.
        let [_, tangential, vertical] = differences(
            &estimates(&turned, Mounting::IDENTITY, &HALF_WIDTHS),
            &estimates(&walk, Mounting::IDENTITY, &HALF_WIDTHS),
        );
        assert!(tangential.max(vertical) > 0.5, "{tangential}, {vertical}");
    }
}
