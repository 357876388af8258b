//! Calibration of one robot and one sensor from recordings without labels.
//!
//! | result | from | module |
//! |---|---|---|
//! | stillness and motion of a foot: a warm start | a walk | [`learnt`] |
//! | vector from the ground to the IMU, which `sigma_v` and the detection of rolling use | the stances of the same walk | [`lever`] |
//! | accelerometer bias and scale, gyroscope bias | rests in different orientations | [`sensor`] |
//! | mounting of the sensor in the foot | the same walk, where the foot stood still | [`mounting`](samples::mounting) |
//! | configuration file with these values | | [`robot_file`] |

pub mod learnt;
pub mod lever;
pub mod robot_file;
pub mod sensor;

use std::fmt::{self, Formatter};

use options::display_in_plain_words;
use options::hint::{Hint, InWords, Vocabulary};

/// Error of a calibration without result.
#[derive(Clone, Debug, PartialEq)]
pub enum CalibrationError {
    /// Too little stance or swing.
    Unsettled(learnt::Unsettled),
    /// Stance and swing do not differ.
    Alike,
    /// The method has nothing to learn.
    HalfWidths,
    /// The rests do not determine bias and scale of the accelerometer.
    Rests(sensor::RestsError),
}

impl std::error::Error for CalibrationError {}

impl From<sensor::RestsError> for CalibrationError {
    fn from(error: sensor::RestsError) -> Self {
        Self::Rests(error)
    }
}

display_in_plain_words!(CalibrationError);

impl InWords for CalibrationError {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsettled(unsettled) => unsettled.write_in(words, f),
            Self::Alike => {
                f.write_str("the foot moves as much at rest as in motion: ")?;
                Hint::UnitsAndGravity.write_in(words, f)?;
                f.write_str(", and whether it walks")
            }
            Self::HalfWidths => {
                f.write_str(
                    "method = \"half_widths\" learns nothing: half-widths are set by hand; ",
                )?;
                Hint::SelfCalibrating.write_in(words, f)
            }
            Self::Rests(error) => write!(f, "{error}"),
        }
    }
}
