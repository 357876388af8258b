//! Invariances of the estimate: the sample rate, the amplitude of the motion, and the start of the recording.
//! `mounting.rs` tests the invariance to the 24 mountings.
//!
//! At 250 Hz and above every set is judged alike. Against its own, lower rate a set may change by more: below 250
//! Hz the slide counts less and less. Limits that are not kept yet are in tests of their own, which say by how much.

use std::sync::{LazyLock, OnceLock};

use crate::labelled;
use estimator_core::{AngularRate, Gravity, Params, SpecificForce};
use host_tests::changed::starting_later;
use host_tests::resample::resample;
use host_tests::sets::{Labelled, Set};
use labelled::{of_sets, pooled};
use recordings::replay::replay;
use recordings::samples::recording::Recording;
use recordings::scoring::metrics::brier_score;
use recordings::scoring::scored::Scored;

/// Sample rates that all sets are judged at, Hz; 1000 Hz is the product's.
const HIGH_RATES: [f32; 4] = [390.0, 500.0, 1000.0, 1660.0];

/// Limit of the change of a set's RMSE between rates from 390 to 1660 Hz.
const AMONG_HIGH_RATES: f64 = 0.02;

/// Limit of the change of a set's RMSE by interpolation to a higher rate.
///
/// The contact forces of the simulated ATLAS alternate from sample to sample, which another rate turns into a push. TALOS
/// gains 0.032.
fn interpolated(set: Set) -> f64 {
    match set {
        Set::Ground | Set::ThreeSteps | Set::Slip => 0.1,
        Set::Atlas7k | Set::Talos => 0.035,
        _ => 0.02,
    }
}

/// Limit of the change of the RMSE on ATLAS by decimation, for the same reason.
const DECIMATED: f64 = 0.16;

/// Limit of the change of a set's RMSE by half or twice the amplitude.
const SCALED: f64 = 0.04;

/// Limit of the change of a set's RMSE by a later start.
const CUT: f64 = 0.03;

/// Time from which a cut recording is scored, s after its first sample.
const SETTLED: f64 = 10.0;

/// The sets of the mean, and ATLAS at 500 Hz, read once for all tests.
fn recordings() -> Option<&'static [Labelled]> {
    static RECORDINGS: LazyLock<Option<Vec<Labelled>>> = LazyLock::new(|| {
        let sets = [&Set::AVERAGED[..], &Set::ROBOTS, &[Set::Atlas500]];
        of_sets(&sets.concat())
    });
    RECORDINGS.as_deref()
}

/// RMSE of each set of [`recordings`] at each of [`HIGH_RATES`], computed once for all tests.
fn rmse_at_high_rates(recordings: &[Labelled]) -> &'static [Vec<(Set, f64)>] {
    static RMSE: OnceLock<Vec<Vec<(Set, f64)>>> = OnceLock::new();
    RMSE.get_or_init(|| {
        let rates = HIGH_RATES.iter();
        rates.map(|hz| rmse_at(recordings, Some(*hz))).collect()
    })
}

fn sets(recordings: &[Labelled]) -> Vec<Set> {
    let mut sets: Vec<Set> = recordings.iter().map(|file| file.set).collect();
    sets.dedup();
    sets
}

/// Collects the values outside their limits, so that one run shows all of them.
#[derive(Default)]
struct Outside(Vec<String>);

impl Outside {
    fn check(&mut self, name: &str, was: f64, is: f64, limit: f64) {
        println!("{name}: {was:.4} → {is:.4}");
        if (is - was).abs() > limit {
            self.0.push(format!("{name}: {was:.4} → {is:.4}"));
        }
    }

    fn assert_none(&self) {
        assert!(self.0.is_empty(), "{:#?}", self.0);
    }

    /// Asserts that a limit is still exceeded: once it is kept, its test requires that.
    fn assert_some(&self) {
        assert!(!self.0.is_empty(), "the limit is kept now");
    }
}

/// RMSE of each set as recorded, or at a sample rate, Hz.
fn rmse_at(recordings: &[Labelled], rate: Option<f32>) -> Vec<(Set, f64)> {
    let at_rate = |file: &Labelled| match rate {
        Some(hz) => resample(&file.recording, hz),
        None => file.recording.clone(),
    };
    let of_set = |set| {
        let files = recordings.iter().filter(|file| file.set == set);
        let files: Vec<Recording> = files.map(at_rate).collect();
        (set, pooled(&files, &Params::DEFAULT))
    };
    sets(recordings).into_iter().map(of_set).collect()
}

/// Returns whether a recording is interpolated, as it was recorded at a lower rate.
fn is_interpolated(recordings: &[Labelled], set: Set, hz: f32) -> bool {
    let file = recordings.iter().find(|file| file.set == set);
    file.is_some_and(|file| file.recording.sample_rate < hz)
}

#[test]
fn all_rates_from_390_to_1660_hz_agree() {
    let Some(recordings) = recordings() else {
        return;
    };
    let mut outside = Outside::default();
    let at_high_rates = rmse_at_high_rates(recordings);
    let mut at_rates = HIGH_RATES.iter().zip(at_high_rates);
    let product = at_rates.find(|(hz, _)| **hz == 1000.0);
    let (_, product) = product.expect("the product's rate");
    for (hz, of_sets) in HIGH_RATES.iter().zip(at_high_rates) {
        for ((set, was), (_, is)) in product.iter().zip(of_sets) {
            if is_interpolated(recordings, *set, hz.min(1000.0)) {
                let name = format!("{} at {hz} Hz", set.name());
                outside.check(&name, *was, *is, AMONG_HIGH_RATES);
            }
        }
    }
    outside.assert_none();
}

#[test]
fn interpolation_to_a_higher_rate_changes_rmse_little() {
    let Some(recordings) = recordings() else {
        return;
    };
    let mut outside = Outside::default();
    let native = rmse_at(recordings, None);
    for (hz, of_sets) in HIGH_RATES.iter().zip(rmse_at_high_rates(recordings)) {
        for ((set, was), (_, is)) in native.iter().zip(of_sets) {
            if is_interpolated(recordings, *set, *hz) {
                let name = format!("{} at {hz} Hz", set.name());
                outside.check(&name, *was, *is, interpolated(*set));
            }
        }
    }
    outside.assert_none();
}

/// Checks the RMSE on ATLAS as recorded and decimated to these rates, Hz.
fn decimated(rates_hz: &[f32]) -> Option<Outside> {
    let recordings = of_sets(&Set::ATLAS)?;
    let mut outside = Outside::default();
    let native = rmse_at(&recordings, None);
    for &hz in rates_hz {
        let decimated = rmse_at(&recordings, Some(hz));
        for ((set, was), (_, is)) in native.iter().zip(&decimated) {
            let name = format!("{} at {hz} Hz", set.name());
            outside.check(&name, *was, *is, DECIMATED);
        }
    }
    Some(outside)
}

#[test]
fn decimation_to_250_hz_keeps_rmse_on_atlas() {
    if let Some(outside) = decimated(&[500.0, 250.0]) {
        outside.assert_none();
    }
}

/// Not kept: by 0.34, where the slide does not count.
#[test]
#[ignore = "full: a limit that is not kept"]
fn decimation_to_100_hz_keeps_rmse_on_atlas() {
    if let Some(outside) = decimated(&[100.0]) {
        outside.assert_some();
    }
}

/// RMSE over the recordings of a set, from a time after the first sample on, s, for copies modified by `change`.
fn rmse_of(
    recordings: &[Labelled],
    set: Set,
    from_s: f64,
    change: impl Fn(&Recording) -> Recording,
) -> f64 {
    let of_set = recordings.iter().filter(|file| file.set == set);
    let scored: Vec<Scored> = of_set
        .flat_map(|file| {
            let changed = change(&file.recording);
            let start = file.recording.samples[0].time_s();
            let estimates = replay(&changed, &Params::DEFAULT).expect("the preset");
            let pairs = changed.samples.iter().zip(&estimates);
            let late = pairs.filter(|(sample, _)| sample.time_s() >= start + from_s);
            late.filter_map(|(sample, estimate)| Scored::of(sample, estimate))
                .collect::<Vec<_>>()
        })
        .collect();
    libm::sqrt(brier_score(&scored).expect("labels"))
}

/// Not kept: by 0.17 on the slippery floor, 0.1 on the NAO, 0.05 on ATLAS 7k.
#[test]
#[ignore = "full: a limit that is not kept"]
fn half_and_twice_the_motion_keep_rmse() {
    let Some(recordings) = recordings() else {
        return;
    };
    let mut outside = Outside::default();
    // Only without gravity are all readings due to motion.
    let removed = |set: &Set| {
        let mut files = recordings.iter().filter(|file| file.set == *set);
        files.all(|file| file.recording.gravity == Gravity::Removed)
    };
    for set in sets(recordings).into_iter().filter(removed) {
        let was = rmse_of(recordings, set, 0.0, Recording::clone);
        for factor in [0.5, 2.0] {
            let is = rmse_of(recordings, set, 0.0, |recording| {
                let mut scaled = recording.clone();
                for sample in &mut scaled.samples {
                    let imu = &mut sample.imu;
                    imu.specific_force = SpecificForce(imu.specific_force.0 * factor);
                    imu.angular_rate = AngularRate(imu.angular_rate.0 * factor);
                }
                scaled
            });
            outside.check(&format!("{} × {factor}", set.name()), was, is, SCALED);
        }
    }
    outside.assert_some();
}

/// Not kept: by 0.24 for ATLAS on the slippery floor.
#[test]
#[ignore = "full: a limit that is not kept"]
fn a_later_start_keeps_rmse_once_settled() {
    let Some(recordings) = recordings() else {
        return;
    };
    let mut outside = Outside::default();
    for set in sets(recordings) {
        let was = rmse_of(recordings, set, SETTLED, Recording::clone);
        for cut_s in [0.1, 0.3, 1.0, 2.5, 5.0] {
            let is = rmse_of(recordings, set, SETTLED, |recording| {
                starting_later(recording, cut_s)
            });
            outside.check(&format!("{} from {cut_s} s", set.name()), was, is, CUT);
        }
    }
    outside.assert_some();
}
