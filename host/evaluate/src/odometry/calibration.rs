//! Velocity of feet in units of `sigma_v`, for each set.

use std::path::Path;

use estimator_core::{ContactEstimate, Params};
use recordings::replay::replay;
use samples::recording::Label;

use super::walk::Walk;
use crate::error::Error;
use crate::labelled::Labelled;
use crate::sets::{RecordingSource, Set};

/// Maximum `sigma_v` at which a foot is considered standing, m/s.
pub const SMALL: f32 = 0.03;

/// Agreement of `sigma_v` with the velocity of the feet of a set.
#[derive(Clone, Debug, PartialEq)]
pub struct SigmaCalibration {
    /// The set.
    pub set: Set,
    /// Mean of v²/σ² over all reliable samples, 3 if σ is correct; `None` if the velocity is unknown.
    pub mean_square: Option<f64>,
    /// Share of the samples with σ of at most [`SMALL`].
    pub small_share: f64,
    /// Share of those samples with the label "stable".
    pub stable_where_small: f64,
}

/// Estimate with the truth of its sample.
struct Sample {
    estimate: ContactEstimate,
    label: Option<Label>,
    /// True speed, m/s.
    speed: Option<f64>,
}

/// Computes the calibration of all sets.
///
/// # Errors
/// A recording is missing or invalid.
pub fn by_family(walks: &[Walk], datasets: &Path) -> Result<Vec<SigmaCalibration>, Error> {
    Set::ALL
        .into_iter()
        .map(|set| Ok(SigmaCalibration::of(set, &samples(set, walks, datasets)?)))
        .collect()
}

fn samples(set: Set, walks: &[Walk], datasets: &Path) -> Result<Vec<Sample>, Error> {
    let mut all = Vec::new();
    if set == Set::Shoe {
        for walk in walks {
            let speeds = walk.speeds.iter().copied().map(Some);
            add(&walk.labelled, &walk.estimates, speeds, &mut all);
        }
        return Ok(all);
    }
    let speeds: Vec<Option<f64>> = set.sources().into_iter().flat_map(speeds_of).collect();
    let mut speeds = speeds.into_iter().chain(std::iter::repeat(None));
    for file in Labelled::of_sets([set], datasets)? {
        let estimates = replay(&file.recording, &Params::DEFAULT)?;
        add(&file, &estimates, &mut speeds, &mut all);
    }
    Ok(all)
}

/// True speeds of a simulated foot, m/s; empty for a file.
fn speeds_of(source: RecordingSource) -> Vec<Option<f64>> {
    match source {
        RecordingSource::File(_) => Vec::new(),
        RecordingSource::Simulated { plan, sensor, seed } => gait::simulate(&plan, &sensor, seed)
            .truth
            .iter()
            .map(|state| Some(state.velocity.length()))
            .collect(),
    }
}

fn add(
    file: &Labelled,
    estimates: &[ContactEstimate],
    speeds: impl Iterator<Item = Option<f64>>,
    to: &mut Vec<Sample>,
) {
    let samples = file.recording.samples.iter().zip(estimates).zip(speeds);
    to.extend(samples.map(|((sample, estimate), speed)| Sample {
        estimate: *estimate,
        label: sample.label,
        speed,
    }));
}

impl SigmaCalibration {
    fn of(set: Set, samples: &[Sample]) -> Self {
        let known = || samples.iter().filter(|of| !of.estimate.flags.are_doubt());
        let squares: Vec<f64> = known()
            .filter_map(|of| {
                let ratio = of.speed? / f64::from(of.estimate.velocity_sigma.0);
                Some(ratio * ratio)
            })
            .collect();
        let small: Vec<&Sample> = known()
            .filter(|of| of.estimate.velocity_sigma.0 <= SMALL)
            .collect();
        let stable = small.iter().filter(|of| of.label == Some(Label::Stable));
        let share = |part: usize, whole: usize| part as f64 / whole.max(1) as f64;
        Self {
            set,
            mean_square: (!squares.is_empty())
                .then(|| squares.iter().sum::<f64>() / squares.len() as f64),
            small_share: share(small.len(), samples.len()),
            stable_where_small: share(stable.count(), small.len()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{Flag, Flags, VelocitySigma};

    fn sample(speed: f64, sigma: f32, label: Label) -> Sample {
        Sample {
            estimate: ContactEstimate {
                velocity_sigma: VelocitySigma(sigma),
                ..ContactEstimate::default()
            },
            label: Some(label),
            speed: Some(speed),
        }
    }

    #[test]
    fn velocity_is_scaled_by_sigma() {
        let mut doubtful = sample(9.0, 100.0, Label::NotStable);
        doubtful.estimate.flags = Flags::NONE.with(Flag::Saturated);
        let samples = [
            sample(0.04, 0.02, Label::Stable),
            sample(0.02, 0.02, Label::NotStable),
            sample(1.0, 1.0, Label::NotStable),
            doubtful,
        ];
        let calibration = SigmaCalibration::of(Set::Walk, &samples);
        let mean_square = calibration.mean_square.expect("speeds");
        assert!((mean_square - 2.0).abs() < 1.0e-5, "{mean_square}");
        assert_eq!(calibration.small_share, 0.5);
        assert_eq!(calibration.stable_where_small, 0.5);
    }
}
