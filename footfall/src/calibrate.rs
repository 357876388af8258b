//! What belongs to one robot and one sensor, measured from recordings without labels.
//!
//! | what | from | module |
//! |---|---|---|
//! | half-widths | a few steps on good ground | [`half_width`] |
//! | accelerometer bias and scale, gyroscope bias | rests in different orientations | [`rests`], [`sensor`] |
//! | the configuration file that keeps them | | [`robot_file`] |

pub mod half_width;
pub mod rests;
pub mod robot_file;
pub mod sensor;

use thiserror::Error;

/// Why recordings do not tell what they should.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum CalibrationError {
    /// Too few usable steps.
    #[error("{0}")]
    TooFewSteps(half_width::TooFew),
    /// Rests do not tell the accelerometer's bias and scale.
    #[error("{0}")]
    Rests(#[from] sensor::RestsError),
}
