//! What belongs to one robot and one sensor, found in recordings without labels.
//!
//! | what | from | module |
//! |---|---|---|
//! | stillness and motion of a foot: a warm start | a walk | [`learnt`] |
//! | how the sensor lies in the foot | the same walk, where the foot stood still | [`mounting`] |
//! | accelerometer bias and scale, gyroscope bias | rests in different orientations | [`rests`], [`sensor`] |
//! | the configuration file that keeps them | | [`robot_file`] |

pub mod learnt;
pub mod mounting;
pub mod rests;
pub mod robot_file;
pub mod sensor;

use thiserror::Error;

/// Why a calibration has no result.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum CalibrationError {
    /// Too little stance or swing.
    #[error("{0}")]
    Unsettled(learnt::Unsettled),
    /// Stance and swing do not differ.
    #[error(
        "the foot moves as much at rest as in motion: see whether units and --gravity are right, and whether it walks"
    )]
    Alike,
    /// The method has nothing to learn.
    #[error(
        "method = \"half_widths\" learns nothing: half-widths are set by hand; leave out --preset paper, or set method = \"self_calibrating\" in the configuration"
    )]
    HalfWidths,
    /// Rests from which bias and scale of the accelerometer do not follow.
    #[error("{0}")]
    Rests(#[from] sensor::RestsError),
}
