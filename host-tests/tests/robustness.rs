//! Sample defects of real installations: the default preset on the walk of `footfall demo`, and a foot that has
//! stood for long before it walks. Limits are on the RMSE of P against the labels.

use std::f32::consts::TAU;

use estimator_core::any::{AnyParams, Method};
use estimator_core::{Probabilities, Saturation, Validity, Vec3};
use gait::{Plan, SensorParams, record};
use host_tests::changed::{
    Chance, after, changed, jittering, losing_bursts, losing_single, stood, with_force_bias,
    with_gaps, with_rate_bias,
};
use host_tests::labelled;
use host_tests::resample::resample;
use host_tests::sets::{Labelled, Set};
use labelled::{averaged, of_sets, pooled, rmse, rmse_from};
use samples::Recording;
use samples::estimate::estimates_of;
use wire::Faults;
use wire::pdo::{Contact, P16};
use wire::uart::ContactMessage;

const SEED: u64 = 1;

/// Maximum increase of the RMSE by a minute of standing. It usually decreases, since the foot is proven at once.
///
/// The simulated ATLAS of 7,000 samples has no noise. So standing adds nothing to the speed of its slide test, whereas
/// each of its steps adds something.
fn standing_costs(recording: &str) -> f64 {
    match recording {
        "ATLAS_7k_04ground" => 0.18,
        _ => 0.02,
    }
}

fn demo() -> Recording {
    record(&Plan::demo(SEED), &SensorParams::LSM6DSOX, SEED)
}

fn assert_rmse(recording: &Recording, limit: f64) {
    let rmse = rmse(recording, &AnyParams::DEFAULT);
    println!("RMSE {rmse:.4}, limit {limit}");
    assert!(rmse <= limit, "RMSE {rmse:.4}, limit {limit}");
}

#[test]
fn defects_of_samples_are_tolerated() {
    let demo = demo();
    assert_rmse(&losing_single(&demo, 0.05, SEED), 0.28);
    assert_rmse(&losing_bursts(&demo, 0.05, 10, SEED), 0.28);
    assert_rmse(&jittering(&demo, 0.5, SEED), 0.28);
    for sign in [1.0_f32, -1.0] {
        let all = |bias: f32| Vec3::new(sign * bias, sign * bias, sign * bias);
        assert_rmse(&with_rate_bias(&demo, all(2.0_f32.to_radians())), 0.28);
        assert_rmse(&with_force_bias(&demo, all(0.3)), 0.3);
    }
}

#[test]
fn invalid_samples_have_probability_zero_in_every_frame() {
    let invalid =
        [Validity::Stale, Validity::Invalid, Validity::Saturated(Saturation::Accelerometer)];
    let mut count = 0;
    let spoilt = changed(&demo(), |sample| {
        count += 1;
        if count % 21 == 0 {
            sample.imu.validity = invalid[count / 21 % invalid.len()];
        }
    });
    for method in [Method::SelfCalibrating, Method::HalfWidths] {
        let params = AnyParams { method, ..AnyParams::DEFAULT };
        let estimates = estimates_of(&spoilt, &params).expect("valid parameters");
        let (mut in_stances, mut probable) = (0, false);
        for (sample, estimate) in spoilt.samples.iter().zip(&estimates) {
            if sample.imu.validity == Validity::Valid {
                probable = estimate.probabilities.stable > 0.5;
                continue;
            }
            in_stances += u32::from(probable);
            assert_eq!(estimate.probabilities, Probabilities::default(), "{estimate:?}");
            let message = ContactMessage::new(estimate, Faults::NONE);
            assert_eq!((message.stable, message.status.is_valid()), (P16(0), false));
            let frame = Contact::new(estimate, 0, Faults::NONE);
            assert_eq!((frame.stable, frame.status.is_valid()), (P16(0), false));
        }
        // Where P was above ½ before.
        assert!(in_stances > 100, "{method:?}: {in_stances}");
    }
}

/// Gap in every two seconds, s, as of samples lost by a radio, and maximum increase of the RMSE by such gaps. The longer
/// gaps hide a whole stance or swing.
const GAP_COSTS: [(f64, f64); 4] = [(0.06, 0.06), (0.15, 0.09), (0.4, 0.09), (0.7, 0.09)];

#[test]
fn gaps_in_a_recording_cost_little() {
    let sets = [Set::Shoe, Set::Talos, Set::RealNao, Set::Go1, Set::PushedNao];
    for (gap, most) in GAP_COSTS {
        for set in sets {
            let Some(files) = of_sets(&[set]) else { return };
            let whole: Vec<Recording> = files.into_iter().map(|file| file.recording).collect();
            let gaps: Vec<Recording> = whole.iter().map(|of| with_gaps(of, 2.0, gap)).collect();
            let [before, after] = [&whole, &gaps].map(|of| pooled(of, &AnyParams::DEFAULT));
            println!("{} {gap} s: {before:.4} → {after:.4}", set.name());
            assert!(after - before < most, "{} {gap} s: {before:.4} → {after:.4}", set.name());
        }
    }
}

/// Rate of a foot, Hz.
const RATE: f32 = 1000.0;

#[test]
fn single_lost_samples_cost_little_at_the_rate_of_a_foot() {
    for set in [Set::Shoe, Set::Talos, Set::RealNao, Set::Go1] {
        let Some(files) = of_sets(&[set]) else { return };
        let whole: Vec<Recording> =
            files.iter().map(|file| resample(&file.recording, RATE)).collect();
        let lost: Vec<Recording> = whole.iter().map(|of| losing_single(of, 0.05, SEED)).collect();
        let [before, after] = [&whole, &lost].map(|of| pooled(of, &AnyParams::DEFAULT));
        println!("{}: {before:.4} → {after:.4}", set.name());
        assert!(after - before < 0.01, "{}: {before:.4} → {after:.4}", set.name());
    }
}

#[test]
fn landings_without_a_stance_revoke_what_was_learnt() {
    let Some(files) = of_sets(&[Set::Nao, Set::Atlas7k]) else { return };
    let [other, own] = [&files[0], &files[1]].map(|file| resample(&file.recording, RATE));
    let joined = after(readings(&other), &own);
    let [start, second] = [other.samples.len(), 5 * RATE as usize];
    let [alone, joined] = [(second, &own), (start + second, &joined)]
        .map(|(first, of)| rmse_from(first, of, &AnyParams::DEFAULT));
    println!("{alone:.4} → {joined:.4}");
    assert!(joined - alone < 0.11, "{alone:.4} → {joined:.4}");
}

#[test]
fn noise_of_the_rate_keeps_no_bias_from_being_learnt() {
    let mut chance = Chance::new(SEED);
    for set in [Set::Talos, Set::RealNao, Set::Go1] {
        let Some(files) = of_sets(&[set]) else { return };
        let stood = files.iter().map(|file| {
            let stood = stood(&resample(&file.recording, RATE), 10.0, SEED);
            with_rate_bias(&stood, Vec3::new(0.03, -0.03, 0.03))
        });
        let quiet: Vec<Recording> = stood.collect();
        let noisy = quiet.iter().map(|recording| {
            changed(recording, |sample| {
                sample.imu.angular_rate.0 += chance.vector(0.01);
            })
        });
        let noisy: Vec<Recording> = noisy.collect();
        let [before, after] = [&quiet, &noisy].map(|of| pooled(of, &AnyParams::DEFAULT));
        println!("{}: {before:.4} → {after:.4}", set.name());
        assert!(after - before < 0.01, "{}: {before:.4} → {after:.4}", set.name());
    }
}

#[test]
fn a_start_in_mid_walk_is_forgotten_after_ten_seconds() {
    for set in [Set::Talos, Set::RealNao, Set::PushedNao] {
        let Some(files) = of_sets(&[set]) else { return };
        let whole = resample(&files[0].recording, RATE);
        for late in [2, 5, 10, 16, 20_usize] {
            let from = |second: usize| second * RATE as usize;
            let mut cut = whole.clone();
            cut.samples.drain(..from(late));
            let [before, after] = [(late + 10, &whole), (10, &cut)]
                .map(|(second, of)| rmse_from(from(second), of, &AnyParams::DEFAULT));
            println!("{} {late} s: {before:.4} → {after:.4}", set.name());
            assert!(after - before < 0.03, "{} {late} s: {before:.4} → {after:.4}", set.name());
        }
    }
}

/// Specific forces and angular rates of a recording.
fn readings(of: &Recording) -> impl Iterator<Item = (Vec3, Vec3)> {
    of.samples.iter().map(|of| (of.imu.specific_force.0, of.imu.angular_rate.0))
}

#[test]
fn limits_of_another_robot_give_way_to_those_of_a_foot() {
    for (before, set, most) in [(Set::Talos, Set::Go1, 0.08), (Set::Nao, Set::Atlas7k, 0.14)] {
        let Some(files) = of_sets(&[before, set]) else { return };
        let [other, own] = [&files[0], &files[1]].map(|file| resample(&file.recording, RATE));
        let joined = after(readings(&other), &own);
        let [start, second] = [other.samples.len(), 10 * RATE as usize];
        let [alone, joined] = [(second, &own), (start + second, &joined)]
            .map(|(first, of)| rmse_from(first, of, &AnyParams::DEFAULT));
        println!("{} after {}: {alone:.4} → {joined:.4}", set.name(), before.name());
        assert!(joined - alone < most, "{}: {alone:.4} → {joined:.4}", set.name());
    }
}

#[test]
fn turns_of_a_foot_that_stands_teach_no_wide_limits() {
    let Some(files) = of_sets(&[Set::Go1]) else { return };
    let walk = resample(&files[0].recording, RATE);
    let standing: Vec<_> = readings(&stood(&walk, 10.0, SEED)).take(10 * RATE as usize).collect();
    let errors = [0.0, 0.08_f32].map(|turning| {
        let turned = (0_u16..).zip(&standing).map(|(k, &(force, rate))| {
            let phase = TAU * 0.1 * f32::from(k) / RATE;
            (force, rate + force * (turning * phase.cos() / force.dot(force).sqrt()))
        });
        let joined = after(readings(&walk).chain(turned), &walk);
        // A second later evidence is found again.
        rmse_from(walk.samples.len() + 11 * RATE as usize, &joined, &AnyParams::DEFAULT)
    });
    assert!(errors[1] - errors[0] < 0.01, "{errors:.4?}");
}

#[test]
fn a_residual_of_removed_gravity_is_found() {
    let Some(recordings) = averaged() else {
        return;
    };
    let ground = recordings.into_iter().find(|file| file.set == Set::Ground);
    let ground = ground.expect("a set that is averaged").recording;
    // The limit is high, because in the first stances the estimator takes the effect of the bias for the usual speed of the
    // foot.
    assert_rmse(&with_force_bias(&ground, Vec3::new(0.1, 0.1, 0.1)), 0.47);
}

#[test]
fn a_minute_of_standing_before_a_walk_changes_little() {
    let Some(recordings) = averaged() else {
        return;
    };
    let changes: Vec<(String, f64)> = recordings
        .iter()
        .map(|Labelled { recording, .. }| {
            let stood = stood(recording, 60.0, SEED);
            let [before, after] = [recording, &stood].map(|r| rmse(r, &AnyParams::DEFAULT));
            println!("{:24} {before:.4}, after a minute {after:.4}", recording.name);
            (recording.name.clone(), after - before)
        })
        .collect();
    let changed = changes.iter().filter(|(name, by)| *by > standing_costs(name));
    let changed: Vec<_> = changed.collect();
    assert!(changed.is_empty(), "{changed:?}");
}
