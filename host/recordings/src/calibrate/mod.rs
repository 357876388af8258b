//! Calibration of one robot and one sensor from recordings without labels.
//!
//! | result | from | module |
//! |---|---|---|
//! | stillness and motion of a foot: a warm start | a walk | [`learnt`] |
//! | accelerometer bias and scale, gyroscope bias | rests in different orientations | [`sensor`] |
//! | mounting of the sensor in the foot | the same walk, where the foot stood still | [`mounting`](crate::mounting) |
//! | configuration file with these values | | [`robot_file`] |

pub mod learnt;
pub mod robot_file;
pub mod sensor;

use thiserror::Error;

/// Error of a calibration without result.
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
    /// The rests do not determine bias and scale of the accelerometer.
    #[error("{0}")]
    Rests(#[from] sensor::RestsError),
}
