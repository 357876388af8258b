//! Recordings with labels, read or simulated.

use std::path::Path;

use estimator_core::Gravity;
use recordings::input::published::simulated::{Wrench, read_with_wrench};
use recordings::input::{self, Format, Hints};
use samples::recording::{Label, Recording};

use crate::error::Error;
use crate::sets::{File, FileLayout, RecordingSource, Set};
use crate::window::Reading;
use gait;
use scoring::scored::Scored;

/// Quantile of the load that is taken as the robot's weight: in single support, a foot bears all of it, and
/// the load exceeds the weight at every bounce. It is computed without labels.
const WEIGHT_QUANTILE: f64 = 0.95;

/// Name of the file that marks the recordings in its folder as free of gravity.
pub const GRAVITY_REMOVED: &str = "gravity_removed";

/// Recording with labels.
#[derive(Clone, Debug)]
pub struct Labelled {
    /// Set that the recording belongs to.
    pub set: Set,
    /// Samples; those without a label are not scored.
    pub recording: Recording,
    /// The six readings of each sample; the acceleration contains gravity if that of the recording does.
    pub readings: Vec<Reading>,
    /// Force and torque, if the foot has a sensor for them.
    pub ground_reaction: Option<GroundReaction>,
}

/// Measurements of a force/torque sensor in the ankle.
#[derive(Clone, Debug)]
pub struct GroundReaction {
    /// Wrench at each sample.
    pub wrenches: Vec<Wrench>,
    /// Weight of the robot, N, estimated from the load.
    pub weight: f64,
}

impl Labelled {
    /// Reads the recordings of sets, in their order, from the folder of datasets.
    ///
    /// # Errors
    /// A file is missing or invalid.
    pub fn of_sets(
        sets: impl IntoIterator<Item = Set>,
        datasets: &Path,
    ) -> Result<Vec<Self>, Error> {
        let sources = sets
            .into_iter()
            .flat_map(|set| set.sources().into_iter().map(move |source| (set, source)));
        sources
            .map(|(set, source)| match source {
                RecordingSource::File(file) => Self::read(set, &file, datasets),
                RecordingSource::Simulated { plan, sensor, seed } => {
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
                origin: file.layout.origin(),
            });
        }
        let gravity = match file.layout {
            FileLayout::Robot(labels) => {
                let (recording, wrenches) = read_with_wrench(&path, labels)?;
                return Ok(Self::new(set, recording, Some(wrenches)));
            }
            FileLayout::Walk => None,
            FileLayout::Foot { .. } => match path.with_file_name(GRAVITY_REMOVED).exists() {
                true => Some(Gravity::Removed),
                false => Some(Gravity::Included),
            },
        };
        let hints = Hints {
            gravity,
            ..Hints::default()
        };
        let loaded = input::read(&path, Format::Csv, &hints)?;
        Ok(Self::new(set, loaded.recording, None))
    }

    /// Creates a recording with labels, and with the wrench of each sample if available.
    pub(crate) fn new(set: Set, recording: Recording, wrenches: Option<Vec<Wrench>>) -> Self {
        let reading = |sample: &samples::recording::RecordedSample| {
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

    /// Name of the recording.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.recording.name
    }

    /// Number of samples in a duration, s.
    #[must_use]
    pub fn samples_in(&self, seconds: f64) -> usize {
        let samples = (seconds * f64::from(self.recording.sample_rate)).round() as usize;
        samples.max(1)
    }

    /// Labels of the samples that have one, in order.
    pub fn labels(&self) -> impl Iterator<Item = Label> {
        self.recording.samples.iter().filter_map(|s| s.label)
    }

    /// Pairs one value per sample with its label. If there are fewer values than samples, the last samples are
    /// not scored.
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
    fn weight_is_the_single_support_load_without_impacts() {
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
