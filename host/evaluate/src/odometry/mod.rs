//! Positions of a shoe from its IMU with the zero-velocity measurements of each detector, compared with an
//! optical reference: the benefit of a contact estimate for a state estimator.
//!
//! | step | module |
//! |---|---|
//! | the twelve walks with their positions | [`walk`] |
//! | zero-velocity measurements with their standard deviation | [`detector`] |
//! | inertial navigation with these measurements: an error-state Kalman filter | [`filter`] |
//! | error of a track | [`error`] |
//! | the constants of `sigma_v`, chosen on one half and scored on the other | [`constants`] |
//! | the velocity of feet in units of `sigma_v` | [`calibration`] |
//!
//! The filter, its noise and the measure of error are those of B. Wagstaff, V. Peretroukhin and J. Kelly,
//! *Robust Data-Driven Zero-Velocity Detection for Foot-Mounted Inertial Navigation* (`PyShoe`), IEEE Sensors
//! Journal 20(2), 2020, whose recordings these are.

pub mod calibration;
pub mod constants;
pub mod detector;
pub mod error;
pub mod filter;
pub mod walk;

use std::path::Path;

pub use calibration::SigmaCalibration;
pub use constants::SplitHalf;
pub use detector::ZeroVelocity;

use crate::error::Error;
use error::position_error;
use filter::navigate;
use walk::Walk;

/// Figures of a detector on one walk.
#[derive(Clone, Debug, PartialEq)]
pub struct OnWalk {
    /// Error as in `PyShoe`, m: see [`position_error`].
    pub error_m: f64,
    /// Mean normalised innovation squared of its measurements, 3 if σ is correct; `None` without a measurement.
    pub nis: Option<f64>,
}

/// Figures of a detector on all walks.
#[derive(Clone, Debug, PartialEq)]
pub struct OfDetector {
    /// The detector.
    pub detector: ZeroVelocity,
    /// Mean error of the walks, m.
    pub mean_error_m: f64,
    /// Largest error of a walk, m.
    pub largest_error_m: f64,
    /// Mean NIS of the walks; `None` if a walk has no measurement.
    pub mean_nis: Option<f64>,
}

/// Figures of all detectors on all walks.
#[derive(Clone, Debug, PartialEq)]
pub struct Odometry {
    /// Detectors in the order of [`ZeroVelocity::ALL`].
    pub detectors: Vec<OfDetector>,
    /// Constants of `sigma_v` chosen on one half of the walks and scored on the other.
    pub halves: Vec<SplitHalf>,
    /// Velocity of feet in units of `sigma_v`, for each family.
    pub calibration: Vec<SigmaCalibration>,
}

impl Odometry {
    /// Evaluates every detector on the walks in the folder of datasets.
    ///
    /// # Errors
    /// A file is missing or invalid.
    pub fn run(datasets: &Path) -> Result<Self, Error> {
        let walks = Walk::all(datasets)?;
        Ok(Self {
            detectors: ZeroVelocity::ALL
                .into_iter()
                .map(|detector| OfDetector::new(detector, &walks))
                .collect(),
            halves: constants::split_halves(&walks),
            calibration: calibration::by_family(&walks, datasets)?,
        })
    }

    /// Figures of a detector.
    #[must_use]
    pub fn of(&self, detector: ZeroVelocity) -> Option<&OfDetector> {
        self.detectors.iter().find(|of| of.detector == detector)
    }
}

impl OfDetector {
    fn new(detector: ZeroVelocity, walks: &[Walk]) -> Self {
        let on_walk = |walk: &Walk| {
            let best = detector
                .candidates(walk)
                .into_iter()
                .map(|sigmas| scored(walk, &sigmas))
                .min_by(|a, b| a.error_m.total_cmp(&b.error_m));
            best.unwrap_or_else(|| scored(walk, &[]))
        };
        let walks: Vec<OnWalk> = walks.iter().map(on_walk).collect();
        let errors = || walks.iter().map(|walk| walk.error_m);
        let nis: Option<Vec<f64>> = walks.iter().map(|walk| walk.nis).collect();
        Self {
            detector,
            mean_error_m: mean(errors()),
            largest_error_m: errors().fold(0.0, f64::max),
            mean_nis: nis.map(|nis| mean(nis.into_iter())),
        }
    }
}

/// Mean of values; 0 if there is none.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Scores a walk with one standard deviation per sample; `None` is a sample without a measurement.
#[must_use]
pub fn scored(walk: &Walk, sigmas: &[Option<f64>]) -> OnWalk {
    let labelled = &walk.labelled;
    let period = 1.0 / f64::from(labelled.recording.sample_rate);
    let track = navigate(&labelled.readings, period, sigmas);
    OnWalk {
        error_m: position_error(&track.positions, &walk.positions),
        nis: track.nis,
    }
}
