//! Recordings with labels, made up for tests.

use estimator_core::{AngularRate, Gravity, ImuSample, SpecificForce, Timestamp, Vec3};

use super::labelled::Labelled;
use super::window::Motion;
use crate::input::pce::Wrench;
use crate::recording::{Label, RecordedSample, Recording};

/// A recording at 1 kHz.
pub(super) fn labelled(rows: impl Iterator<Item = (Wrench, Motion, Label)>) -> Labelled {
    let (mut samples, mut wrenches) = (Vec::new(), Vec::new());
    for (k, (wrench, motion, label)) in (0..).zip(rows) {
        let [ax, ay, az, wx, wy, wz] = motion.map(|value| value as f32);
        samples.push(RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(1000 * k),
                specific_force: SpecificForce(Vec3::new(ax, ay, az)),
                angular_rate: AngularRate(Vec3::new(wx, wy, wz)),
                ..ImuSample::default()
            },
            load: None,
            label: Some(label),
        });
        wrenches.push(wrench);
    }
    let recording = Recording {
        name: "made up".to_owned(),
        sample_rate: 1000.0,
        gravity: Gravity::Removed,
        load_title: String::new(),
        samples,
    };
    Labelled::new(recording, wrenches)
}
