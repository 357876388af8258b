//! Attacks on the guarantees of the default preset: other feet, other orders of events, two disturbances at once.

mod foot;

use std::f64::consts::{PI, TAU};

use estimator_core::stillness::Classes;
use estimator_core::{
    ContactEstimate, Decision, Flag, Gravity, Learning, Learnt, Params, Probabilities, Saturation,
    Validity,
};
use host_tests::changed::Chance;

use foot::{
    Foot, GRAVITY, Gait, NOISE, Part, STEPS, Sample, assert_told_right, biased, measured, mounted,
    params, shares, walk_after,
};

/// The bias is found from the corrections of the inclination, as there is no rest to observe it.
#[test]
fn stances_are_found_without_rest_at_any_gyroscope_bias() {
    let slow = Gait {
        stride: 1.8,
        ..Gait::WALK
    };
    for (gait, bias) in [
        (Gait::WALK, [0.0, 4.0, 0.0]),
        (Gait::WALK, [3.0; 3]),
        (slow, [1.0; 3]),
    ] {
        let walk = measured(&gait, 1000.0, 60.0, Gravity::Included);
        let walk = biased(&walk, [0.0; 3], bias.map(f64::to_radians));
        let estimates = Foot::new(&params(1000.0, Gravity::Included)).measures(&walk);
        let name = format!("{bias:?} °/s, {} s", gait.stride);
        assert_told_right(&name, shares(&walk, &estimates, 40.0));
    }
}

/// At half the rate each sample follows a gap, and is limited by the result before it.
#[test]
fn stances_are_found_with_every_second_sample_lost() {
    for gravity in [Gravity::Included, Gravity::Removed] {
        let mut foot = Foot::new(&params(1000.0, gravity));
        foot.measures(&measured(&Gait::WALK, 1000.0, 9.0, gravity));
        let walk = measured(&Gait::WALK, 500.0, 18.0, gravity);
        foot.period = 2000;
        let estimates = foot.measures(&walk);
        let name = format!("{gravity:?}");
        assert_told_right(&name, shares(&walk, &estimates, 9.0));
    }
}

/// The classes of the trot are larger. Mostly still motion shrinks them.
#[test]
fn slowing_down_from_a_trot_keeps_swings_unstable() {
    let slow = Gait {
        stride: 1.5,
        length: 0.25,
        height: 0.04,
        pitch: 0.1,
        impact: 15.0,
        shake: 0.05,
        ..Gait::WALK
    };
    for rate in [100.0, 200.0] {
        let params = params(rate, Gravity::Included);
        assert_told_right("at once", walk_after(&params, &[], &slow, STEPS));
        let trot = measured(&Gait::TROT, rate, 60.0, Gravity::Included);
        let shares = walk_after(&params, &trot, &slow, STEPS);
        assert_told_right(&format!("{rate} Hz, after a trot"), shares);
    }
}

/// At 100 Hz one sample is more than half of a window.
#[test]
fn a_gap_of_an_hour_is_not_followed_by_a_stable_sample() {
    for rate in [100.0, 125.0, 200.0, 1000.0] {
        let mut foot = Foot::new(&params(rate, Gravity::Removed));
        let stood = measured(&Gait::STANDING, rate, 2.0, Gravity::Removed);
        foot.measures(&stood);
        let next = foot.after(3_600_000_000, &stood[0], Validity::Valid);
        let p = next.probabilities.stable;
        println!("{rate} Hz: {p}, {:?}", next.decision);
        assert_eq!(next.decision, Decision::NotStable, "{rate} Hz: P {p}");
        assert!(p < 0.5, "{rate} Hz: P {p}");
    }
}

/// With gravity removed the vertical is unknown, and the slide test assumes the sensor's z.
#[test]
fn heading_is_irrelevant_with_gravity_removed() {
    for (rate, axes) in [
        (200.0, [[1.0, 0.0, 0.0], [1.0, 0.7, 0.3]]),
        (1000.0, [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]]),
    ] {
        let walk = measured(&Gait::WALK, rate, 18.0, Gravity::Removed);
        let estimates = |walk: &[Sample]| Foot::new(&params(rate, Gravity::Removed)).measures(walk);
        let expected = estimates(&walk);
        for axis in axes {
            let other = estimates(&mounted(&walk, axis, 0.3 * PI));
            let most = largest_difference(&expected, &other);
            assert!(
                most <= 0.01,
                "{rate} Hz, about {axis:?}: P differs by {most}"
            );
        }
    }
}

/// Such classes would carry no information, and P would be 1 for any motion.
#[test]
fn overlapping_frozen_classes_do_not_make_shaking_stable() {
    let together = Classes {
        still: -1.0,
        moving: -1.0,
        width: 0.5,
    };
    let params = Params {
        learning: Learning::Frozen,
        learnt: Some(Learnt {
            acceleration: together,
            rate: together,
            velocity: together,
            still_seconds: 8.0,
            moving_seconds: 8.0,
            idle_seconds: 0.0,
        }),
        ..params(100.0, Gravity::Included)
    };
    let mut foot = Foot::new(&params);
    let mut samples = measured(&Gait::STANDING, 100.0, 4.0, Gravity::Included);
    for sample in &mut samples[200..] {
        sample.force[0] += 50.0 * (TAU * 23.0 * sample.time).sin();
    }
    let last = *foot.measures(&samples).last().expect("a sample");
    let p = last.probabilities.stable;
    assert!(p < 0.5 && last.decision == Decision::NotStable, "P {p}");
}

fn largest_difference(expected: &[ContactEstimate], other: &[ContactEstimate]) -> f32 {
    let pairs = expected.iter().zip(other);
    let differences = pairs.map(|(a, b)| (a.probabilities.stable - b.probabilities.stable).abs());
    differences.fold(0.0, f32::max)
}

/// Random number between two bounds, of any magnitude.
fn scale(chance: &mut Chance, low: f64, high: f64) -> f64 {
    low * (high / low).powf(chance.even())
}

fn any_gait(chance: &mut Chance) -> Gait {
    let stride = scale(chance, 0.5, 2.5);
    let duty = 0.5 + 0.25 * chance.even();
    let swing = stride * (1.0 - duty);
    Gait {
        stride,
        duty,
        length: (scale(chance, 3.0, 60.0) * swing * swing / TAU).min(1.5),
        height: (scale(chance, 2.0, 30.0) * swing * swing * 2.0 / (TAU * TAU)).min(0.4),
        pitch: scale(chance, 0.02, 0.8),
        impact: scale(chance, 1.0, 120.0),
        ring: 25.0 + 55.0 * chance.even(),
        fade: scale(chance, 0.004, 0.02),
        shake: scale(chance, 0.01, 0.2),
        shake_hertz: 10.0 + 30.0 * chance.even(),
        phase: chance.even(),
    }
}

/// All of 1481 such gaits were estimated correctly.
#[test]
fn random_gaits_are_estimated_within_ten_steps_at_every_rate() {
    let mut chance = Chance::new(1);
    for k in 0..60 {
        let gait = any_gait(&mut chance);
        let rate = [100.0, 200.0, 400.0, 1000.0][k % 4];
        let gravity = [Gravity::Included, Gravity::Included, Gravity::Removed][k % 3];
        let shares = walk_after(&params(rate, gravity), &[], &gait, STEPS);
        assert_told_right(&format!("{rate} Hz, {gravity:?}, {gait:.3?}"), shares);
    }
}

#[test]
fn p_does_not_depend_on_mounting_or_starting_phase() {
    let mut chance = Chance::new(2);
    for phase in [0.0, 0.3, 0.7, 0.95] {
        let gait = Gait {
            phase,
            ..Gait::WALK
        };
        let walk = measured(&gait, 1000.0, 4.5, Gravity::Included);
        let walk = biased(&walk, [0.1, -0.2, 0.1], [0.0, -0.02, 0.01]);
        let estimates = |walk: &[Sample]| Foot::new(&Params::DEFAULT).measures(walk);
        let expected = estimates(&walk);
        let mut mountings = vec![([1.0, 0.0, 0.0], PI), ([0.0, 1.0, 0.0], PI)];
        mountings.extend((0..6).map(|_| {
            let axis = [(); 3].map(|()| chance.gaussian());
            (axis, PI * chance.even())
        }));
        for (axis, angle) in mountings {
            let most = largest_difference(&expected, &estimates(&mounted(&walk, axis, angle)));
            assert!(most <= 0.01, "{axis:?} by {angle}: P differs by {most}");
        }
    }
}

#[test]
fn walks_on_a_ship_or_in_a_lift_are_estimated_correctly() {
    let walk = measured(&Gait::WALK, 200.0, 27.0, Gravity::Included);
    for (hertz, degrees, heave) in [(0.1, 10.0_f64, 0.0), (0.3, 5.0, 0.0), (0.3, 0.0, 1.0)] {
        let moved = walk.iter().map(|sample| {
            let turn = TAU * hertz * sample.time;
            let roll = degrees.to_radians() * turn.sin();
            let [x, y, z] = sample.force;
            let z = z + heave * turn.sin();
            let (sine, cosine) = roll.sin_cos();
            let mut moved = *sample;
            moved.force = [x, cosine * y + sine * z, cosine * z - sine * y];
            moved.rate[0] += degrees.to_radians() * TAU * hertz * turn.cos();
            moved
        });
        let moved: Vec<Sample> = moved.collect();
        let estimates = Foot::new(&params(200.0, Gravity::Included)).measures(&moved);
        assert_told_right("afloat", shares(&moved, &estimates, 9.0));
    }
}

#[test]
fn stances_are_found_after_turning_about_up_from_power_up() {
    for degrees in [2.0_f64, 5.0] {
        let turned = measured(&Gait::STANDING, 1000.0, 3.0, Gravity::Included);
        let turned = biased(&turned, [0.0; 3], [0.0, 0.0, degrees.to_radians()]);
        let shares = walk_after(&Params::DEFAULT, &turned, &Gait::WALK, STEPS);
        assert_told_right("turned", shares);
    }
}

#[test]
fn a_clipped_landing_after_a_foreign_warm_start_is_not_stable() {
    let loud = Gait {
        length: 1.0,
        height: 0.16,
        impact: 80.0,
        shake: 3.0,
        ..Gait::WALK
    };
    let mut foot = Foot::new(&Params::DEFAULT);
    foot.measures(&measured(&loud, 1000.0, 60.0, Gravity::Included));
    let params = Params {
        learnt: Some(foot.learnt()),
        ..Params::DEFAULT
    };
    let hard = Gait {
        impact: 300.0,
        phase: 0.999,
        ..Gait::WALK
    };
    let walk = measured(&hard, 1000.0, 18.0, Gravity::Included);
    let mut foot = Foot::new(&params);
    for sample in &walk {
        let clips = sample.force.iter().any(|force| force.abs() > 156.0);
        let validity = match clips {
            true => Validity::Saturated(Saturation::Accelerometer),
            false => Validity::Valid,
        };
        let estimate = foot.after(1000, sample, validity);
        let lands = matches!(sample.part, Part::Stance(since) if since < 0.01);
        let stable = estimate.decision == Decision::Stable || estimate.probabilities.stable > 0.5;
        assert!(!(stable && (clips || lands)), "{} s", sample.time);
    }
}

/// All probabilities as an array.
fn all(p: &Probabilities) -> [f32; 9] {
    let [ax, ay, az, wx, wy, wz] = p.axes.to_array();
    [ax, ay, az, wx, wy, wz, p.tangential, p.vertical, p.stable]
}

/// Applies a random event to a sample and its time.
fn disturb(
    event: u64,
    first: bool,
    period: u64,
    sample: &mut Sample,
    chance: &mut Chance,
) -> (u64, Validity) {
    let mut micros = period;
    let mut validity = Validity::Valid;
    match event {
        0 => sample.force = [(); 3].map(|()| 40.0 * chance.gaussian()),
        1 => {
            let doubts = [
                Validity::Stale,
                Validity::Invalid,
                Validity::Saturated(Saturation::Both),
                Validity::Saturated(Saturation::Gyroscope),
            ];
            validity = doubts[chance.bits() as usize % doubts.len()];
        }
        2 if first => micros += (12.0 * chance.even() * period as f64) as u64,
        3 if first => micros = [10_001, 30_000, 100_000, 3_600_000_000][chance.bits() as usize % 4],
        // A step back in time.
        4 if first => {
            micros = [0, u64::MAX, 0_u64.wrapping_sub(60_000_000)][chance.bits() as usize % 3];
        }
        5 => micros = (period as f64 * (0.3 + 1.4 * chance.even())) as u64 + 1,
        6 if chance.bits().is_multiple_of(3) => {
            sample.force[chance.bits() as usize % 3] =
                [f64::NAN, f64::INFINITY, -1.0e30][chance.bits() as usize % 3];
        }
        7 => micros = chance.bits() % 3,
        _ => {}
    }
    (micros, validity)
}

/// None of 30 000 such sequences violated it.
#[test]
fn samples_in_doubt_are_never_stable_and_gaps_never_raise_p() {
    for seed in 0..1500 {
        let mut chance = Chance::new(seed);
        let rate = [100.0, 200.0, 333.0, 400.0, 1000.0][chance.bits() as usize % 5];
        let gravity = [Gravity::Included, Gravity::Removed][chance.bits() as usize % 2];
        let mut foot = Foot::new(&params(rate, gravity));
        let mut before: Option<ContactEstimate> = None;
        let rest = match gravity {
            Gravity::Included => [0.0, 0.0, GRAVITY],
            Gravity::Removed => [0.0; 3],
        };
        for _ in 0..10 {
            let event = chance.bits() % 12;
            for k in 0..scale(&mut chance, 1.0, 200.0) as u64 {
                let mut sample = Sample {
                    time: 0.0,
                    force: rest.map(|force| force + NOISE.0 * chance.gaussian()),
                    rate: [(); 3].map(|()| NOISE.1 * chance.gaussian()),
                    part: Part::Stance(0.0),
                };
                let (micros, validity) =
                    disturb(event, k == 0, foot.period, &mut sample, &mut chance);
                let then = foot.now;
                let estimate = foot.after(micros, &sample, validity);
                let context = || format!("seed {seed}, event {event}: {estimate:?}");
                let p = all(&estimate.probabilities);
                assert!(p.iter().all(|p| (0.0..=1.0).contains(p)), "{}", context());
                let backwards = before.is_some() && foot.now <= then;
                let finite = sample.force.iter().all(|force| force.abs() < 1.0e4);
                if validity != Validity::Valid || backwards || !finite {
                    assert!(estimate.flags.are_doubt(), "{}", context());
                }
                if estimate.flags.are_doubt() {
                    assert_eq!(estimate.decision, Decision::NotStable, "{}", context());
                }
                if let Some(before) = before.filter(|_| !backwards && micros >= 2 * foot.period) {
                    assert!(estimate.flags.contains(Flag::TimeGap), "{}", context());
                    let pairs = p.iter().zip(all(&before.probabilities));
                    let mut risen = pairs.filter(|(p, before)| **p > before + 1.0e-6);
                    // After two consecutive gaps the limit is the result of the sample between them.
                    if !before.flags.contains(Flag::TimeGap) {
                        assert_eq!(risen.next(), None, "{}", context());
                    }
                }
                before = Some(estimate);
            }
        }
    }
}

/// Of 900 such starts at all rates some take longer than ten steps, and none takes half a minute.
#[test]
fn any_learnable_start_recovers_within_half_a_minute_at_1_khz() {
    let mut chance = Chance::new(5);
    for _ in 0..20 {
        let mut classes = || {
            let still = 18.6 * chance.even() - 9.3;
            Classes {
                still: still as f32,
                moving: (still + (9.3 - still) * chance.even()).min(9.3) as f32,
                width: (9.3 * chance.even()) as f32,
            }
        };
        let learnt = Learnt {
            acceleration: classes(),
            rate: classes(),
            velocity: classes(),
            still_seconds: 8.0,
            moving_seconds: 8.0,
            idle_seconds: 0.0,
        };
        let params = Params {
            learnt: Some(learnt),
            ..Params::DEFAULT
        };
        let steps = 30.0 / Gait::WALK.stride;
        let shares = walk_after(&params, &[], &Gait::WALK, steps);
        assert_told_right(&format!("{learnt:.1?}"), shares);
    }
}

#[test]
fn stances_are_found_with_alternating_or_jittering_times() {
    let mut chance = Chance::new(6);
    let walk = measured(&Gait::WALK, 500.0, 27.0, Gravity::Included);
    for name in ["alternating", "jittering"] {
        let mut foot = Foot::new(&params(500.0, Gravity::Included));
        let mut late = 0;
        let estimates: Vec<ContactEstimate> = (0_u64..)
            .zip(&walk)
            .map(|(k, sample)| {
                let next = match name {
                    "alternating" => 1200 * (k % 2),
                    _ => chance.bits() % 1400,
                };
                let micros = 2000 + next - late;
                late = next;
                foot.after(micros, sample, Validity::Valid)
            })
            .collect();
        assert_told_right(name, shares(&walk, &estimates, 9.0));
    }
}
