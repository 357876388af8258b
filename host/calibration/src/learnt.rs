//! Amplitudes of stillness and motion, learnt from recordings of a walking foot: a warm start.
//!
//! The estimator is the same as on the foot, and the same samples give the same learnt bits. Recordings are processed
//! in sequence, and the learnt values are reported.

use std::fmt;

use estimator_core::any::{AnyParams, Method};
use estimator_core::internals::SETTLED_AFTER;
use estimator_core::parameter::Parameter;
use estimator_core::{ContactEstimate, Flag, Learning, Learnt, Params, ParamsError};
use serde::{Serialize, Serializer};

use crate::CalibrationError;
use crate::lever::{Lever, LeverCalibration, LeverError};
use options::display_in_plain_words;
use options::hint::{Hint, InWords, Vocabulary};
use samples::Recording;
use samples::estimate::estimates_and_learnt;

/// Least share of usable samples; below it, unusable samples are reported as the cause.
const LEAST_USABLE: f64 = 0.1;

/// Least ratio of the amplitudes in motion and in stillness. With a smaller one no landing counts as evidence.
const LEAST_FACTOR: f32 = 4.5;

/// Calibration that learns from a sequence of recordings.
pub struct LearntCalibration {
    params: Params,
    learnt: Option<Learnt>,
    lever: LeverCalibration,
    recordings: Vec<LearntFrom>,
    samples: usize,
    unusable: usize,
}

/// A recording that was learnt from.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LearntFrom {
    /// Name of the recording.
    pub recording: String,
    /// From its first sample to its last, s.
    pub duration_s: f64,
}

impl LearntCalibration {
    /// Starts from the learnt values in `params`, or cold.
    ///
    /// # Errors
    /// The method of `params` does not learn.
    pub fn new(params: &AnyParams) -> Result<Self, CalibrationError> {
        if params.method == Method::HalfWidths {
            return Err(CalibrationError::HalfWidths);
        }
        Ok(Self {
            params: Params { learning: Learning::On, ..params.params },
            learnt: params.params.learnt,
            lever: LeverCalibration::default(),
            recordings: Vec::new(),
            samples: 0,
            unusable: 0,
        })
    }

    /// Learns from a recording, with a callback after each sample, such as for progress.
    ///
    /// # Errors
    /// A parameter is out of range.
    pub fn add(
        &mut self,
        recording: &Recording,
        after_each: impl FnMut(),
    ) -> Result<(), ParamsError> {
        let params = Params { learnt: self.learnt, ..self.params };
        let (estimates, learnt) = estimates_and_learnt(recording, &params.into(), after_each)?;
        self.learnt = Some(learnt);
        self.lever.add(recording, &estimates);
        self.samples += estimates.len();
        self.unusable += estimates.iter().filter(|e| !is_usable(e)).count();
        self.recordings.push(LearntFrom {
            recording: recording.name.clone(),
            duration_s: recording.duration_s(),
        });
        Ok(())
    }

    /// Returns the learnt values.
    ///
    /// # Errors
    /// Too little stance or swing was observed, or the two do not differ.
    pub fn finish(self) -> Result<LearntFoot, CalibrationError> {
        let learnt = self.learnt.unwrap_or_default();
        if !learnt.is_settled() {
            return Err(CalibrationError::Unsettled(Unsettled {
                still_seconds: learnt.still_seconds,
                moving_seconds: learnt.moving_seconds,
                samples: self.samples,
                unusable: self.unusable,
            }));
        }
        let acceleration = Amplitudes {
            at_rest: libm::expf(learnt.still),
            edge: learnt.edge(&self.params.constants),
            in_motion: libm::expf(learnt.moving),
        };
        if acceleration.in_motion < LEAST_FACTOR * acceleration.at_rest {
            return Err(CalibrationError::Alike);
        }
        Ok(LearntFoot {
            acceleration,
            stance_s: learnt.still_seconds,
            swing_s: learnt.moving_seconds,
            settled: learnt.is_settled(),
            object: learnt.to_array(),
            object_version: Learnt::VERSION,
            object_crc: learnt.crc(),
            lever: self.lever.finish(),
            recordings: self.recordings,
            learnt,
        })
    }
}

/// Returns whether a sample was measured while the direction of up was known.
fn is_usable(estimate: &ContactEstimate) -> bool {
    let unusable =
        [Flag::InvalidSample, Flag::Stale, Flag::Saturated, Flag::AttitudeNotInitialised];
    !unusable.iter().any(|flag| estimate.flags.contains(*flag))
}

/// Error for too little observed stance or swing.
#[derive(Clone, Debug, PartialEq)]
pub struct Unsettled {
    /// Observed stance, s.
    pub still_seconds: f32,
    /// Observed swing, s.
    pub moving_seconds: f32,
    samples: usize,
    unusable: usize,
}

impl Unsettled {
    /// Writes the remedy for the cause.
    fn advise(&self, words: &dyn Vocabulary, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let usable = self.samples - self.unusable;
        if (usable as f64) < LEAST_USABLE * self.samples as f64 {
            return write!(
                f,
                "{} of {} samples are invalid, stale, saturated, or from before up was known",
                self.unusable, self.samples
            );
        }
        let nearly_none = 0.1 * SETTLED_AFTER;
        if self.moving_seconds < nearly_none {
            f.write_str("the foot never swung: record it walking")
        } else if self.still_seconds < nearly_none {
            f.write_str("the foot was never still: ")?;
            Hint::UnitsAndGravity.write_in(words, f)
        } else {
            f.write_str("record more steps")
        }
    }
}

impl InWords for Unsettled {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:.1} s of stance and {:.1} s of swing were seen; {SETTLED_AFTER} s of each is needed: ",
            rounded_down(self.still_seconds),
            rounded_down(self.moving_seconds)
        )?;
        self.advise(words, f)
    }
}

display_in_plain_words!(Unsettled);

/// Rounds down to a tenth, so that an insufficient duration does not look sufficient.
fn rounded_down(seconds: f32) -> f32 {
    libm::floorf(10.0 * seconds) / 10.0
}

/// Learnt values of a foot. `Display` is the report for the terminal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LearntFoot {
    /// Recordings in the order of learning.
    pub recordings: Vec<LearntFrom>,
    /// Amplitudes of the acceleration without gravity, m/s².
    pub acceleration: Amplitudes,
    /// Stance that the classes rest on, s.
    pub stance_s: f32,
    /// Swing that the classes rest on, s.
    pub swing_s: f32,
    /// Whether that is enough of stance and of swing.
    pub settled: bool,
    /// The values of the foot's object 0x2018, in the order of its sub-indices from 1.
    pub object: [f32; Learnt::NUMBERS],
    /// Version of these values: its sub-index 6.
    pub object_version: u32,
    /// CRC of version and values: its sub-index 7.
    pub object_crc: u32,
    /// Vector from the ground to the IMU, whose length is `velocity.lever_m`; null if the walk does not determine it.
    #[serde(serialize_with = "if_found")]
    pub lever: Result<Lever, LeverError>,
    /// Samples and steps from which the values were learnt.
    #[serde(skip)]
    pub learnt: Learnt,
}

/// Amplitudes of the acceleration, m/s².
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Amplitudes {
    /// Typical of a foot at rest.
    pub at_rest: f32,
    /// Where stillness ends.
    pub edge: f32,
    /// Typical of a foot in motion.
    pub in_motion: f32,
}

fn if_found<S: Serializer>(lever: &Result<Lever, LeverError>, to: S) -> Result<S::Ok, S::Error> {
    lever.as_ref().ok().serialize(to)
}

impl fmt::Display for LearntFoot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds: Vec<String> = self
            .recordings
            .iter()
            .map(|from| format!("{} {:.1} s", from.recording, from.duration_s))
            .collect();
        writeln!(f, "learnt from {}", seconds.join(", "))?;
        writeln!(
            f,
            "learnt from {:.1} s of stance and {:.1} s of swing: {}",
            self.stance_s,
            self.swing_s,
            if self.settled { "settled" } else { "not settled" }
        )?;
        let Amplitudes { at_rest, edge, in_motion } = self.acceleration;
        writeln!(
            f,
            "acceleration at rest {at_rest:.3}, edge of stillness {edge:.3}, in motion {in_motion:.2} m/s²"
        )?;
        match &self.lever {
            Ok(lever) => writeln!(f, "{lever}")?,
            Err(error) => writeln!(f, "lever not found: {error}")?,
        }
        f.write_str("if the foot has a footfall board: set")?;
        for (row, value) in Learnt::ROWS.iter().zip(self.object) {
            write!(f, " {}={value}", row.name)?;
        }
        write!(f, " learnt.version={} learnt.crc={}", self.object_version, self.object_crc)?;
        match &self.lever {
            Ok(lever) => write!(f, " {}={}", Parameter::VelocityLever.name(), lever.lever_m),
            Err(_) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unsettled(still_seconds: f32, moving_seconds: f32, unusable: usize) -> String {
        let unsettled = Unsettled { still_seconds, moving_seconds, samples: 1000, unusable };
        unsettled.to_string()
    }

    #[test]
    fn unsettled_error_names_the_remedy() {
        assert_eq!(
            unsettled(0.44, 0.99, 3),
            "0.4 s of stance and 0.9 s of swing were seen; 0.5 s of each is needed: record more steps"
        );
        assert!(unsettled(3.0, 0.0, 0).ends_with("the foot never swung: record it walking"));
        assert!(unsettled(0.0, 3.0, 0).ends_with("check the units and gravity"));
        assert!(unsettled(0.0, 0.0, 990).contains("990 of 1000 samples are invalid"));
    }

    #[test]
    fn the_papers_method_has_nothing_to_learn() {
        let refused = LearntCalibration::new(&AnyParams::PAPER).err();
        assert_eq!(refused, Some(CalibrationError::HalfWidths));
    }
}
