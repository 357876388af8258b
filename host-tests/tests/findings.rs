//! Findings on recorded walks: none about a sensor that is right, and one about each that was made wrong.

use estimator_core::{Gravity, Timestamp, Vec3};
use host_tests::datasets::recorded;
use host_tests::sets::Set;
use options::{Format, InputOptions};
use plausible::{Finding, check};
use samples::{RecordedSample, Recording};

use host_tests::labelled::of_sets;

/// People who walked with an IMU on each foot.
const PEOPLE: [u8; 9] = [2, 4, 6, 8, 10, 12, 14, 16, 18];

/// Walks of both feet of people; `None` if one is absent.
fn walks() -> Option<Vec<[Recording; 2]>> {
    let foot = |person: u8, side: &str| {
        let path = recorded(&format!("walkers/strides/{person}-1_{side}.csv"))?;
        let loaded = recordings::read(&path, Format::Csv, &InputOptions::default());
        Some(loaded.expect("a readable file").recording)
    };
    PEOPLE.iter().map(|person| Some([foot(*person, "lf")?, foot(*person, "rf")?])).collect()
}

/// Twelve walks in a shoe.
fn shoes() -> Option<Vec<Recording>> {
    Some(Set::Shoe.read()?.into_iter().map(|labelled| labelled.recording).collect())
}

/// Each foot of people and each walk in a shoe.
fn all() -> Option<Vec<Recording>> {
    Some(walks()?.into_iter().flatten().chain(shoes()?).collect())
}

fn changed(recording: &Recording, change: impl Fn(&mut Vec3, &mut Vec3)) -> Recording {
    let mut recording = recording.clone();
    for sample in &mut recording.samples {
        let imu = &mut sample.imu;
        change(&mut imu.specific_force.0, &mut imu.angular_rate.0);
    }
    recording
}

fn is_wrong(finding: &Finding) -> bool {
    matches!(
        finding,
        Finding::LeftHanded { .. }
            | Finding::DifferentAxes { .. }
            | Finding::DeadAxis { .. }
            | Finding::MixedFeet { .. }
    )
}

/// Number of recordings with a finding of this kind.
fn count(recordings: &[Recording], is_found: fn(&Finding) -> bool) -> usize {
    recordings.iter().filter(|recording| check(recording).iter().any(is_found)).count()
}

#[test]
fn right_recordings_have_no_findings_about_axes() {
    let sets = of_sets(&Set::ALL).into_iter().flatten().map(|labelled| labelled.recording);
    for recording in sets.chain(all().into_iter().flatten()) {
        let findings = check(&recording);
        assert!(!findings.iter().any(is_wrong), "{}: {findings:?}", recording.name);
    }
}

#[test]
fn mirrored_axes_are_found_on_walks_of_people() {
    let Some(recordings) = all() else { return };
    let mirror: [fn(&mut Vec3, &mut Vec3); 2] = [
        |a, w| (a.x, w.x) = (-a.x, -w.x),
        |a, w| ((a.y, a.z), (w.y, w.z)) = ((a.z, a.y), (w.z, w.y)),
    ];
    for mirror in mirror {
        let mirrored: Vec<_> = recordings.iter().map(|one| changed(one, mirror)).collect();
        let found = count(&mirrored, |f| matches!(f, Finding::LeftHanded { .. }));
        let either = count(&mirrored, |f| {
            matches!(f, Finding::LeftHanded { .. } | Finding::DifferentAxes { .. })
        });
        // Two swings decide nothing.
        assert!(found >= 25 && either >= 28, "{found}, {either} of {}", mirrored.len());
    }
}

#[test]
fn permuted_accelerometers_are_found_on_walks_of_people() {
    let Some(recordings) = all() else { return };
    /// Change of the forces, and the axes of the gyroscope that lie along them then.
    type Permutation = (fn(&mut Vec3, &mut Vec3), [i8; 3]);
    let permute: [Permutation; 3] = [
        (|a, _| *a = Vec3::new(a.y, a.z, a.x), [2, 3, 1]),
        (|a, _| *a = Vec3::new(a.z, a.x, a.y), [3, 1, 2]),
        (|a, _| *a = Vec3::new(-a.y, a.x, a.z), [-2, 1, 3]),
    ];
    for (permute, right) in permute {
        let permuted: Vec<_> = recordings.iter().map(|one| changed(one, permute)).collect();
        let found = count(&permuted, |f| {
            matches!(f, Finding::DifferentAxes { .. } | Finding::LeftHanded { .. })
        });
        assert!(found >= 24, "{found} of {}", permuted.len());
        let findings = permuted.iter().flat_map(check);
        let ways: Vec<[i8; 3]> = findings.filter_map(|finding| way_in(&finding)).collect();
        // Where two ways fit the swings about as well, none is advised.
        assert!(ways.len() >= 10, "{} of {}", ways.len(), permuted.len());
        assert!(ways.iter().all(|way| *way == right), "{right:?}: {ways:?}");
    }
}

/// Returns the way in which a finding advises to lay the axes of the gyroscope along the axes of the accelerometer.
fn way_in(finding: &Finding) -> Option<[i8; 3]> {
    match finding {
        Finding::DifferentAxes { gyroscope } => *gyroscope,
        _ => None,
    }
}

#[test]
fn unit_of_rates_is_right_or_not_advised_on_each_recording() {
    let sets = of_sets(&Set::ALL).into_iter().flatten().map(|labelled| labelled.recording);
    let recordings: Vec<Recording> = sets.chain(all().into_iter().flatten()).collect();
    for (per_radian, name) in [
        (57.295_78, "rate_in_degrees"),
        (9.549_297, "rate_in_rpm"),
        (57_295.78, "rate_in_millidegrees"),
    ] {
        let (mut right, mut undecided) = (0, Vec::new());
        for recording in &recordings {
            let scaled = changed(recording, |_, w| *w = *w * per_radian);
            let findings = check(&scaled);
            let unit = findings.iter().find(|finding| finding.name().starts_with("rate_in"));
            match unit.map(Finding::name) {
                // A foot that turns little has rates that are plausible in any unit.
                None => {}
                Some(found) if found == name => right += 1,
                Some(found) => {
                    assert_eq!(found, "rate_in_degrees_or_rpm", "{}", recording.name);
                    undecided.push(&recording.name);
                }
            }
        }
        // Measured once: by unit, 41 to 56 of 56 recordings are right, and at most 4 have swings that do not
        // distinguish the units.
        let all = recordings.len();
        assert!(10 * right >= 7 * all, "{name}: {right} of {all}");
        assert!(10 * undecided.len() <= all, "{name}: {undecided:?}");
    }
}

#[test]
fn dead_axes_are_found_on_each_walk() {
    let Some(recordings) = all() else { return };
    let kill: [fn(&mut Vec3, &mut Vec3); 4] =
        [|_, w| w.y = 0.0, |_, w| w.z = 0.0, |_, w| w.x = 0.1, |a, _| a.x = 0.0];
    for kill in kill {
        let dead: Vec<_> = recordings.iter().map(|one| changed(one, kill)).collect();
        let found = count(&dead, |f| matches!(f, Finding::DeadAxis { .. }));
        assert_eq!(found, dead.len());
        // Advice to exchange axes would be wrong.
        let advised = count(&dead, |f| {
            matches!(f, Finding::DifferentAxes { .. } | Finding::LeftHanded { .. })
        });
        assert_eq!(advised, 0);
    }
}

#[test]
fn alternating_feet_are_found_on_walks_of_people() {
    let Some(walks) = walks() else { return };
    let mut missed: Vec<String> = Vec::new();
    for [left, right] in walks {
        let period_us = 1.0e6 / left.sample_rate;
        let pairs =
            left.samples.iter().zip(&right.samples).flat_map(|(left, right)| [*left, *right]);
        let samples: Vec<RecordedSample> = (0..)
            .zip(pairs)
            .map(|(k, mut sample): (u64, RecordedSample)| {
                let time_us = (k / 2) as f32 * period_us + 0.4 * period_us * (k % 2) as f32;
                sample.imu.timestamp = Timestamp::from_micros(time_us as u64);
                sample
            })
            .collect();
        let mixed = Recording {
            sample_rate: 2.0 * left.sample_rate,
            gravity: Gravity::Included,
            samples,
            ..left
        };
        let findings = check(&mixed);
        if !findings.contains(&Finding::MixedFeet { feet: 2 }) {
            missed.push(mixed.name);
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}
