//! RMSE of the default preset on each set of labelled recordings, at its own rate.

use crate::labelled::{of_sets, pooled};
use estimator_core::Params;
use host_tests::sets::Set;

/// Limit of the mean over [`Set::AVERAGED`].
const MEAN: f64 = 0.296;

/// Limit of each set, within .002 of what is measured.
const LIMITS: [(Set, f64); 12] = [
    (Set::Ground, 0.265),
    (Set::ThreeSteps, 0.287),
    (Set::Slip, 0.452),
    (Set::Atlas7k, 0.289),
    (Set::Nao, 0.248),
    (Set::Shoe, 0.295),
    (Set::Demo, 0.234),
    (Set::Atlas500, 0.351),
    (Set::Talos, 0.173),
    (Set::RealNao, 0.246),
    (Set::Go1, 0.222),
    (Set::PushedNao, 0.277),
];

#[test]
fn the_default_preset_keeps_its_rmse_on_each_set() {
    let mut sum = 0.0;
    let mut outside = Vec::new();
    for (set, limit) in LIMITS {
        let Some(files) = of_sets(&[set]) else { return };
        let rmse = pooled(files.iter().map(|file| &file.recording), &Params::DEFAULT);
        println!("{}: {rmse:.4}", set.name());
        if rmse > limit {
            outside.push(format!("{}: {rmse:.4} > {limit}", set.name()));
        }
        if Set::AVERAGED.contains(&set) {
            sum += rmse;
        }
    }
    assert!(outside.is_empty(), "{outside:#?}");
    let mean = sum / Set::AVERAGED.len() as f64;
    assert!(mean <= MEAN, "{mean}");
}
