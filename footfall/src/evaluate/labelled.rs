//! The five recordings with labels, and which file each one's peers learn from.
//!
//! Two relations between files keep the scores honest. What wants labels, a peer's threshold, comes
//! from [`Source::tuned_on`], which is always another file. What wants none, half-widths and
//! cluster means, comes from [`Source::learnt_on`]: another file of the same robot, or the file
//! itself where the robot has no other.

use std::path::Path;

use super::window::Motion;
use crate::error::Error;
use crate::input::pce::{LabelScheme, Wrench, read_with_wrench};
use crate::metrics::Scored;
use crate::recording::{Label, Recording};

/// The share of samples that lie below the robot's weight: in single support, when a foot bears
/// all of it, the load passes the weight at every bounce. Read off the load, with no label.
const WEIGHT_QUANTILE: f64 = 0.95;

/// A recording with labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Source {
    /// The file, in the folder of datasets.
    pub path: &'static str,
    /// What its labels mean.
    pub labels: LabelScheme,
    /// Place in [`SOURCES`] of the file whose labels tune a peer that is scored on this one.
    pub tuned_on: usize,
    /// Place in [`SOURCES`] of the file that is looked at without its labels.
    pub learnt_on: usize,
}

/// All of them. The two with contact classes are of different robots and tune each other: they
/// share rate and labels, which the ATLAS of the others does not.
pub const SOURCES: [Source; 5] = [
    Source {
        path: "pce/ATLAS_01ground.csv",
        labels: LabelScheme::StableOrNot,
        tuned_on: 1,
        learnt_on: 1,
    },
    Source {
        path: "pce/ATLAS_01ground_3steps.csv",
        labels: LabelScheme::StableOrNot,
        tuned_on: 0,
        learnt_on: 0,
    },
    Source {
        path: "pce/ATLAS_01ground_003slip.csv",
        labels: LabelScheme::StableOrNot,
        tuned_on: 0,
        learnt_on: 0,
    },
    Source {
        path: "lcd/ATLAS_7k_04ground.csv",
        labels: LabelScheme::ContactClass,
        tuned_on: 4,
        learnt_on: 3,
    },
    Source {
        path: "lcd/NAO_05ground.csv",
        labels: LabelScheme::ContactClass,
        tuned_on: 3,
        learnt_on: 4,
    },
];

impl Source {
    /// Where the recording can be had.
    #[must_use]
    pub const fn origin(&self) -> &'static str {
        match self.labels {
            LabelScheme::StableOrNot => {
                "github.com/MichaelMarav/ProbabilisticContactEstimation, offline/data"
            }
            LabelScheme::ContactClass => "github.com/mrsp/lcd",
        }
    }
}

/// Which files are wanted in the folder of datasets, under where they can be had.
#[must_use]
pub fn wanted() -> String {
    let mut text = "All of these are needed:".to_owned();
    for of_one_origin in SOURCES.chunk_by(|one, next| one.origin() == next.origin()) {
        let origin = of_one_origin.first().map_or("", Source::origin);
        text = text + "\n  from " + origin;
        for source in of_one_origin {
            text = text + "\n    " + source.path;
        }
    }
    text
}

/// A recording with labels, read.
#[derive(Clone, Debug)]
pub struct Labelled {
    /// Samples, all of them with a label.
    pub recording: Recording,
    /// The wrench at each sample.
    pub wrenches: Vec<Wrench>,
    /// The motion at each sample.
    pub motions: Vec<Motion>,
    /// The robot's weight, N, as its load tells.
    pub weight: f64,
}

impl Labelled {
    /// Reads one of [`SOURCES`] in the folder of datasets.
    ///
    /// # Errors
    /// The file is absent, or what is wrong with it.
    pub fn read(datasets: &Path, source: &Source) -> Result<Self, Error> {
        let path = datasets.join(source.path);
        if !path.exists() {
            return Err(Error::NoDataset {
                file: path.display().to_string(),
                origin: source.origin(),
            });
        }
        let (recording, wrenches) = read_with_wrench(&path, source.labels)?;
        Ok(Self::new(recording, wrenches))
    }

    /// A recording with labels and the wrench at each of its samples.
    pub(super) fn new(recording: Recording, wrenches: Vec<Wrench>) -> Self {
        let motion = |sample: &crate::recording::RecordedSample| {
            let (a, w) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
            [a.x, a.y, a.z, w.x, w.y, w.z].map(f64::from)
        };
        Self {
            motions: recording.samples.iter().map(motion).collect(),
            weight: weight(&wrenches),
            recording,
            wrenches,
        }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.recording.name
    }

    /// The samples in a duration, s.
    #[must_use]
    pub fn samples_in(&self, seconds: f64) -> usize {
        let samples = (seconds * f64::from(self.recording.sample_rate)).round() as usize;
        samples.max(1)
    }

    /// The labels in order, one per sample.
    pub fn labels(&self) -> impl Iterator<Item = Label> {
        self.recording.samples.iter().filter_map(|s| s.label)
    }

    /// Puts the truth beside one value per sample. Values may be fewer than samples: the last
    /// samples then go unscored.
    #[must_use]
    pub fn scored(&self, values: &[f64]) -> Vec<Scored> {
        let samples = self.recording.samples.iter().zip(values);
        samples
            .filter_map(|(sample, value)| {
                Some(Scored {
                    time: sample.imu.timestamp,
                    probability: *value,
                    label: sample.label?,
                })
            })
            .collect()
    }
}

fn weight(wrenches: &[Wrench]) -> f64 {
    let mut loads: Vec<f64> = wrenches.iter().map(|[_, _, fz, ..]| *fz).collect();
    loads.sort_by(f64::total_cmp);
    let place = (WEIGHT_QUANTILE * loads.len() as f64) as usize;
    loads.get(place).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_threshold_comes_from_the_file_that_is_scored() {
        for (place, source) in SOURCES.iter().enumerate() {
            assert_ne!(source.tuned_on, place, "{}", source.path);
            // Rates and labels are shared, so a threshold means the same.
            assert_eq!(SOURCES[source.tuned_on].labels, source.labels);
            assert_eq!(SOURCES[source.learnt_on].labels, source.labels);
        }
    }

    #[test]
    fn the_weight_is_what_a_foot_bears_alone_and_not_the_impact() {
        let loads = [
            vec![0.0; 400],
            vec![800.0; 500],
            vec![1600.0; 95],
            vec![3000.0; 5],
        ]
        .concat();
        let wrenches: Vec<_> = loads
            .iter()
            .map(|fz| [0.0, 0.0, *fz, 0.0, 0.0, 0.0])
            .collect();
        assert_eq!(weight(&wrenches), 1600.0);
        assert_eq!(weight(&[]), 0.0);
    }
}
