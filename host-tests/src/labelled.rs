//! The labelled sets of the mean over sets, and the scores of parameters on them.

use estimator_core::any::AnyParams;
use replay::scoring::{Scored, brier_score};
use samples::Recording;
use samples::estimate::estimates_of;

use crate::sets::{Labelled, Set};

/// The recordings of [`Set::AVERAGED`] with their sets, in order; `None` if one is absent.
///
/// # Panics
/// If a recording cannot be read.
#[must_use]
pub fn averaged() -> Option<Vec<Labelled>> {
    of_sets(&Set::AVERAGED)
}

/// The recordings of some sets, in order; `None` if one is absent.
///
/// # Panics
/// If a recording cannot be read.
#[must_use]
pub fn of_sets(sets: &[Set]) -> Option<Vec<Labelled>> {
    let of_each: Option<Vec<_>> = sets.iter().map(|set| set.read()).collect();
    Some(of_each?.concat())
}

/// RMSE of P over the labelled samples of a recording.
///
/// # Panics
/// If the parameters are invalid, or there is no label.
#[must_use]
pub fn rmse(recording: &Recording, params: &AnyParams) -> f64 {
    pooled([recording], params)
}

/// RMSE of P over the labelled samples of a recording from sample number `first` on.
///
/// # Panics
/// As [`rmse`].
#[must_use]
pub fn rmse_from(first: usize, recording: &Recording, params: &AnyParams) -> f64 {
    let estimates = estimates_of(recording, params).expect("valid parameters");
    let scored = Scored::collect(&recording.samples[first..], &estimates[first..]);
    libm::sqrt(brier_score(&scored).expect("labels"))
}

/// RMSE of P over the labelled samples of all recordings together.
///
/// # Panics
/// As [`rmse`].
#[must_use]
pub fn pooled<'a>(recordings: impl IntoIterator<Item = &'a Recording>, params: &AnyParams) -> f64 {
    let scored: Vec<Scored> = recordings
        .into_iter()
        .flat_map(|recording| {
            let estimates = estimates_of(recording, params).expect("valid parameters");
            Scored::collect(&recording.samples, &estimates)
        })
        .collect();
    libm::sqrt(brier_score(&scored).expect("labels"))
}
