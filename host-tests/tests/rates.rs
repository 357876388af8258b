//! The estimate at sample rates other than the rate of the recording.
//!
//! A set that was recorded below 390 Hz is judged alike at all rates from 390 Hz on. Compared with its own rate the estimate
//! may change by more, because the slide test counts less and less below 250 Hz. ATLAS gets worse at lower rates than its
//! own, because its forces alternate from sample to sample, and decimation turns these into a push.

use std::sync::{LazyLock, OnceLock};

use estimator_core::any::AnyParams;
use host_tests::labelled::{of_sets, pooled};
use host_tests::resample::resample;
use host_tests::sets::{Labelled, Set};
use samples::Recording;

/// Sample rates that all sets are judged at, Hz; 1000 Hz is the product's.
const HIGH_RATES: [f32; 4] = [390.0, 500.0, 1000.0, 1660.0];

/// Limit of the change of an interpolated set's RMSE between rates from 390 to 1660 Hz.
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
        (set, pooled(&files, &AnyParams::DEFAULT))
    };
    sets(recordings).into_iter().map(of_set).collect()
}

/// Returns whether a recording is interpolated, as it was recorded at a lower rate.
fn is_interpolated(recordings: &[Labelled], set: Set, hz: f32) -> bool {
    let file = recordings.iter().find(|file| file.set == set);
    file.is_some_and(|file| file.recording.sample_rate < hz)
}

#[test]
fn interpolated_sets_agree_from_390_to_1660_hz() {
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

#[test]
fn decimation_to_250_hz_keeps_rmse_on_atlas() {
    let Some(recordings) = of_sets(&Set::ATLAS) else {
        return;
    };
    let mut outside = Outside::default();
    let native = rmse_at(&recordings, None);
    for hz in [500.0, 250.0] {
        let decimated = rmse_at(&recordings, Some(hz));
        for ((set, was), (_, is)) in native.iter().zip(&decimated) {
            let name = format!("{} at {hz} Hz", set.name());
            outside.check(&name, *was, *is, DECIMATED);
        }
    }
    outside.assert_none();
}
