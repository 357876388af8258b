//! The labelled sets of the mean over sets, and the scores of parameters on them.
#![allow(dead_code)] // Each test file uses its share.

use estimator_core::Params;
use evaluate::labelled::Labelled;
use evaluate::sets::{Set, files};
use recordings::replay::replay;
use samples::recording::{Label, Recording};
use scoring::metrics::brier_score;
use scoring::scored::Scored;

use host_tests::datasets::recorded;

/// The recordings of [`Set::AVERAGED`] with their sets, in order; `None` if one is absent.
///
/// # Panics
/// If a recording cannot be read.
#[must_use]
pub fn averaged() -> Option<Vec<(Set, Recording)>> {
    let recordings = of_sets(&Set::AVERAGED)?.into_iter();
    Some(recordings.map(|file| (file.set, file.recording)).collect())
}

/// The recordings of some sets, in order; `None` if one of any set is absent.
///
/// # Panics
/// If a recording cannot be read.
#[must_use]
pub fn of_sets(sets: &[Set]) -> Option<Vec<Labelled>> {
    let paths: Option<Vec<_>> = files().iter().map(|file| recorded(file.path)).collect();
    let paths = paths?;
    let datasets = paths.first()?.parent()?.parent()?;
    let sets = sets.iter().copied();
    Some(Labelled::of_sets(sets, datasets).expect("readable recordings"))
}

/// RMSE of P over the labelled samples of a recording.
///
/// # Panics
/// If the parameters are invalid, or there is no label.
#[must_use]
pub fn rmse(recording: &Recording, params: &Params) -> f64 {
    pooled([recording], params)
}

/// RMSE of P by set, in the order of [`Set::AVERAGED`].
///
/// # Panics
/// As [`rmse`].
#[must_use]
pub fn rmse_by_set(recordings: &[(Set, Recording)], params: &Params) -> [f64; 7] {
    Set::AVERAGED.map(|set| {
        let of_set = recordings.iter().filter(|(of, _)| *of == set);
        pooled(of_set.map(|(_, recording)| recording), params)
    })
}

/// Share of the stable samples of the last half of a recording with P > 0.5.
///
/// # Panics
/// If the parameters are invalid.
#[must_use]
pub fn stances_found(recording: &Recording, params: &Params) -> f64 {
    let estimates = replay(recording, params).expect("valid parameters");
    let half = recording.samples.len() / 2;
    let pairs = recording.samples.iter().zip(&estimates).skip(half);
    let stable: Vec<bool> = pairs
        .filter(|(sample, _)| sample.label == Some(Label::Stable))
        .map(|(_, estimate)| estimate.probabilities.stable > 0.5)
        .collect();
    stable.iter().filter(|found| **found).count() as f64 / stable.len() as f64
}

fn pooled<'a>(recordings: impl IntoIterator<Item = &'a Recording>, params: &Params) -> f64 {
    let scored: Vec<Scored> = recordings
        .into_iter()
        .flat_map(|recording| {
            let estimates = replay(recording, params).expect("valid parameters");
            Scored::collect(&recording.samples, &estimates)
        })
        .collect();
    libm::sqrt(brier_score(&scored).expect("labels"))
}
