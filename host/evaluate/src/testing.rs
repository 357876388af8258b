//! Synthetic recordings with labels for tests.

use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{AngularRate, Gravity, ImuSample, SpecificForce, Timestamp, Vec3};
use recordings::input::published::simulated::Wrench;
use samples::recording::{Label, RecordedSample, Recording};

use crate::labelled::Labelled;
use crate::sets::{Family, Set};
use crate::window::Reading;

/// Creates a recording at 1 kHz for a set. If the set's recordings contain gravity, it is added to each motion,
/// and the wrenches are omitted.
pub(crate) fn labelled(set: Set, rows: impl Iterator<Item = (Wrench, Reading, Label)>) -> Labelled {
    let gravity = match set.family() {
        Family::Atlas | Family::Lcd => Gravity::Removed,
        Family::Shoe | Family::Simulated | Family::Robots => Gravity::Included,
    };
    let up = match gravity {
        Gravity::Removed => 0.0,
        Gravity::Included => STANDARD_GRAVITY,
    };
    let (mut samples, mut wrenches) = (Vec::new(), Vec::new());
    for (k, (wrench, motion, label)) in (0..).zip(rows) {
        let [ax, ay, az, wx, wy, wz] = motion.map(|value| value as f32);
        samples.push(RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(1000 * k),
                specific_force: SpecificForce(Vec3::new(ax, ay, az + up)),
                angular_rate: AngularRate(Vec3::new(wx, wy, wz)),
                ..ImuSample::default()
            },
            load: None,
            label: Some(label),
        });
        wrenches.push(wrench);
    }
    let recording = Recording {
        name: format!("made up for {}", set.name()),
        sample_rate: 1000.0,
        gravity,
        load_title: String::new(),
        samples,
    };
    let wrenches = match gravity {
        Gravity::Removed => Some(wrenches),
        Gravity::Included => None,
    };
    Labelled::new(set, recording, wrenches)
}
