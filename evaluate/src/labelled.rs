//! Recordings with labels, read or simulated.

use std::path::Path;

use estimator_core::Gravity;
use recordings::input::pce::{Wrench, read_with_wrench};
use recordings::input::{self, Format, Hints};
use recordings::recording::{Label, Recording};

use crate::error::Error;
use crate::sets::{File, Layout, Set, Source};
use crate::window::Reading;
use gait;
use scoring::scored::Scored;

/// The share of samples that lie below the robot's weight: in single support, when a foot bears
/// all of it, the load passes the weight at every bounce. Read off the load, with no label.
const WEIGHT_QUANTILE: f64 = 0.95;

/// Name of the file that says that the recordings beside it are without gravity.
pub const GRAVITY_REMOVED: &str = "gravity_removed";

/// A recording with labels.
#[derive(Clone, Debug)]
pub struct Labelled {
    /// The set it belongs to.
    pub set: Set,
    /// Samples; those without a label are not scored.
    pub recording: Recording,
    /// The six readings at each sample; their acceleration contains gravity where the recording does.
    pub readings: Vec<Reading>,
    /// Force and torque, where the foot has a sensor for them.
    pub ground_reaction: Option<GroundReaction>,
}

/// What a force/torque sensor in the ankle measured.
#[derive(Clone, Debug)]
pub struct GroundReaction {
    /// The wrench at each sample.
    pub wrenches: Vec<Wrench>,
    /// The robot's weight, N, by its load.
    pub weight: f64,
}

impl Labelled {
    /// The recordings of all sets, in their order; files are in the folder of datasets.
    ///
    /// # Errors
    /// A file is absent, or what is wrong with it.
    pub fn all(datasets: &Path) -> Result<Vec<Self>, Error> {
        Self::of_sets(Set::ALL, datasets)
    }

    /// The same of some sets.
    ///
    /// # Errors
    /// Those of [`Self::all`].
    pub fn of_sets(
        sets: impl IntoIterator<Item = Set>,
        datasets: &Path,
    ) -> Result<Vec<Self>, Error> {
        let sources = sets
            .into_iter()
            .flat_map(|set| set.sources().into_iter().map(move |source| (set, source)));
        sources
            .map(|(set, source)| match source {
                Source::File(file) => Self::read(set, &file, datasets),
                Source::Simulated { plan, sensor, seed } => {
                    Ok(Self::new(set, gait::record(&plan, &sensor, seed), None))
                }
            })
            .collect()
    }

    fn read(set: Set, file: &File, datasets: &Path) -> Result<Self, Error> {
        let path = datasets.join(file.path);
        if !path.exists() {
            return Err(Error::NoDataset {
                file: path.display().to_string(),
                origin: file.origin(),
            });
        }
        match file.layout {
            Layout::Robot(labels) => {
                let (recording, wrenches) = read_with_wrench(&path, labels)?;
                Ok(Self::new(set, recording, Some(wrenches)))
            }
            Layout::Walk => {
                let loaded = input::read(&path, Format::Csv, &Hints::default())?;
                Ok(Self::new(set, loaded.recording, None))
            }
            Layout::Foot { .. } => {
                let gravity = match path.with_file_name(GRAVITY_REMOVED).exists() {
                    true => Gravity::Removed,
                    false => Gravity::Included,
                };
                let hints = Hints {
                    gravity: Some(gravity),
                    ..Hints::default()
                };
                let loaded = input::read(&path, Format::Csv, &hints)?;
                Ok(Self::new(set, loaded.recording, None))
            }
        }
    }

    /// A recording with labels, and the wrench at each of its samples where there is one.
    pub(crate) fn new(set: Set, recording: Recording, wrenches: Option<Vec<Wrench>>) -> Self {
        let reading = |sample: &recordings::recording::RecordedSample| {
            let (a, w) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
            [a.x, a.y, a.z, w.x, w.y, w.z].map(f64::from)
        };
        Self {
            set,
            readings: recording.samples.iter().map(reading).collect(),
            ground_reaction: wrenches.map(|wrenches| GroundReaction {
                weight: weight(&wrenches),
                wrenches,
            }),
            recording,
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

    /// The labels in order, of the samples that have one.
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
    let index = (WEIGHT_QUANTILE * loads.len() as f64) as usize;
    loads.get(index).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

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
