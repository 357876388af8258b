//! The authors' recordings of a real GO1, gravity and all: does the filter keep upright on a
//! foot, and does the probability tell grease from ground?

use estimator_core::{ContactEstimate, Load, Params};
use footfall::input::{self, Format, Hints};
use footfall::recording::RecordedSample;
use footfall::replay::replay;
use host_tests::committed::assert_readme_block;
use host_tests::datasets::recorded;

/// Shorter contacts are bounces, s.
const SHORTEST_STANCE: f64 = 0.25;

/// The peak of P in each stance, in order of time, with the paper's half-widths and 50 rows.
///
/// A stance begins where the load passes 150 and ends where it falls below 90, in the raw units
/// of the robot's pressure sensor. Each recording starts on a foot that already stands: that is
/// no step and is left out.
fn stance_peaks(file: &str) -> Option<Vec<f32>> {
    let path = recorded(file)?;
    let loaded = input::read(&path, Format::PceGo1, &Hints::default()).expect("a readable file");
    let samples = &loaded.recording.samples;
    let estimates = replay(&loaded.recording, &Params::PAPER_GO1).expect("a preset");
    Some(
        stances(samples)
            .into_iter()
            .map(|stance| peak(&estimates[stance]))
            .collect(),
    )
}

fn peak(estimates: &[ContactEstimate]) -> f32 {
    let probabilities = estimates.iter().map(|e| e.probabilities.stable);
    probabilities.fold(0.0, f32::max)
}

/// The ranges of samples in which the foot is loaded, from touch-down to lift-off.
fn stances(samples: &[RecordedSample]) -> Vec<std::ops::Range<usize>> {
    let mut stances = Vec::new();
    let mut start = None;
    let mut loaded = true;
    for (k, sample) in samples.iter().enumerate() {
        let Some(Load(load)) = sample.load else {
            continue;
        };
        if !loaded && load >= 150.0 {
            (loaded, start) = (true, Some(k));
        } else if loaded && load < 90.0 {
            loaded = false;
            stances.extend(start.take().map(|start| start..k));
        }
    }
    stances.extend(start.map(|start| start..samples.len()));
    stances.retain(|stance| {
        samples[stance.end - 1].time_s() - samples[stance.start].time_s() > SHORTEST_STANCE
    });
    stances
}

#[test]
fn greased_stances_stay_improbable_and_those_after_the_grease_do_not() {
    let Some(peaks) = stance_peaks("pce/GO1_slippery_surface.csv") else {
        return;
    };
    let (greased, good) = peaks.split_at(3);
    assert!(greased.iter().all(|p| *p < 0.6), "{peaks:?}");
    assert!(
        good.len() == 8 && good.iter().all(|p| *p > 0.8),
        "{peaks:?}"
    );
}

#[test]
fn every_stance_on_a_mattress_is_probable() {
    let Some(peaks) = stance_peaks("pce/GO1_matress.csv") else {
        return;
    };
    assert!(
        peaks.len() == 6 && peaks.iter().all(|p| *p > 0.9),
        "{peaks:?}"
    );
}

#[test]
fn every_stance_on_normal_ground_is_probable() {
    let Some(peaks) = stance_peaks("pce/GO1_normal_surface.csv") else {
        return;
    };
    assert!(
        peaks.len() == 10 && peaks.iter().all(|p| *p > 0.9),
        "{peaks:?}"
    );
}

#[test]
fn the_readme_states_every_peak() {
    let mut table = String::from("| recording | peak of P, step by step |\n|---|---|\n");
    for (name, file) in [
        (
            "three greased steps, then none",
            "pce/GO1_slippery_surface.csv",
        ),
        ("mattress", "pce/GO1_matress.csv"),
        ("normal ground", "pce/GO1_normal_surface.csv"),
    ] {
        let Some(peaks) = stance_peaks(file) else {
            return;
        };
        let peaks: Vec<String> = peaks.iter().map(|peak| format!("{peak:.2}")).collect();
        table += &format!("| {name} | {} |\n", peaks.join(" · "));
    }
    assert_readme_block("go1", &table);
}
