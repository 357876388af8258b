//! The authors' ATLAS recordings with the paper's parameters: every sample against the oracle, and the published
//! figures.

use estimator_core::ContactEstimate;
use estimator_core::any::AnyParams;
use estimator_core::half_widths::HalfWidthParams;
use host_tests::datasets::recorded;
use host_tests::oracle::Oracle;
use options::{Format, InputOptions};
use replay::scoring::{Metrics, Scored};
use samples::Recording;
use samples::estimate::estimates_of;

/// Maximum difference of a probability from the formula in f64.
const PARITY: f64 = 5.0e-7;

/// The files with the RMSE over the whole file, from the formula in double precision.
const FILES: [(&str, f64); 3] = [
    ("pce/ATLAS_01ground.csv", 0.2493),
    ("pce/ATLAS_01ground_3steps.csv", 0.2566),
    ("pce/ATLAS_01ground_003slip.csv", 0.3472),
];
const RMSE_TOLERANCE: f64 = 0.0005;

/// Replays a file with the paper preset; `None` if the file is absent.
fn replayed(file: &str) -> Option<(Recording, Vec<ContactEstimate>)> {
    let path = recorded(file)?;
    let loaded = recordings::read(&path, Format::PceAtlas, &InputOptions::default())
        .expect("a readable file");
    let estimates = estimates_of(&loaded.recording, &AnyParams::PAPER).expect("a preset");
    Some((loaded.recording, estimates))
}

/// Largest difference from the formula in double precision, at any sample.
fn worst_parity(recording: &Recording, estimates: &[ContactEstimate]) -> f64 {
    let oracle = Oracle {
        bandwidth: HalfWidthParams::PAPER.bandwidth.to_array().map(f64::from),
        half_width: HalfWidthParams::PAPER.half_width.to_array().map(f64::from),
        window: 50,
    };
    let motion: Vec<[f64; 6]> = recording
        .samples
        .iter()
        .map(|sample| {
            let (a, w) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
            [a.x, a.y, a.z, w.x, w.y, w.z].map(f64::from)
        })
        .collect();
    assert_eq!(motion.len(), estimates.len());
    let errors = estimates.iter().enumerate().flat_map(|(k, estimate)| {
        let expected = oracle.probabilities(&motion[..=k]);
        let p = estimate.probabilities;
        [
            (p.stable, expected.stable),
            (p.tangential, expected.tangential),
            (p.vertical, expected.vertical),
        ]
        .map(|(actual, expected)| (f64::from(actual) - expected).abs())
    });
    errors.fold(0.0, f64::max)
}

fn metrics(recording: &Recording, estimates: &[ContactEstimate]) -> Metrics {
    Metrics::of(&Scored::collect(&recording.samples, estimates)).expect("labels")
}

#[test]
fn every_probability_matches_the_formula_in_double_precision() {
    for (file, _) in FILES {
        let Some((recording, estimates)) = replayed(file) else {
            continue;
        };
        let worst = worst_parity(&recording, &estimates);
        assert!(worst <= PARITY, "{file}: off by {worst:e}");
    }
}

#[test]
fn the_error_against_the_labels_matches_the_published_value() {
    for (file, rmse) in FILES {
        let Some((recording, estimates)) = replayed(file) else {
            continue;
        };
        let actual = metrics(&recording, &estimates).rmse;
        assert!((actual - rmse).abs() <= RMSE_TOLERANCE, "{file}: RMSE {actual} instead of {rmse}");
    }
}
