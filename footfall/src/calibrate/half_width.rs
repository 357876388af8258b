//! Half-widths from recordings of a foot that walks on good ground.
//!
//! The rule is [`estimator_core::calibration`]'s, the one that runs on the foot: the same samples
//! give the same bits. Here it may look at more than one recording, and what it found is shown.

use std::fmt;

use estimator_core::calibration::{MARGIN, QUIET, SHORTEST, STEPS, SWING};
use estimator_core::{
    Axis, Calibrator, ContactEstimate, Flag, Params, ParamsError, PerAxis, Phase,
};
use serde::Serialize;

use super::CalibrationError;
use crate::recording::Recording;
use crate::replay::replay;

/// Steps collected from one recording after another.
pub struct HalfWidthCalibration {
    params: Params,
    calibrator: Calibrator,
    mid_stance: Vec<[f32; 6]>,
    recordings: Vec<RecordingSteps>,
    seen: Seen,
}

/// How many usable steps a recording has.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordingSteps {
    /// Its name.
    pub recording: String,
    /// Usable steps.
    pub steps: u16,
}

/// A walking foot is quiet for more than one sample in so many, and far more are usable.
const LEAST_QUIET: usize = 10;

/// What samples were like, for whoever wonders why there are no steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Seen {
    samples: usize,
    unusable: usize,
    quiet: usize,
    swing: bool,
    load: bool,
    loaded: bool,
}

impl HalfWidthCalibration {
    /// A calibration that has seen nothing yet. Of `params` it needs what an estimator needs but
    /// the half-widths, which the result is compared with.
    #[must_use]
    pub fn new(params: &Params) -> Self {
        Self {
            params: *params,
            calibrator: Calibrator::new(params),
            mid_stance: Vec::new(),
            recordings: Vec::new(),
            seen: Seen::default(),
        }
    }

    /// Takes in a recording.
    ///
    /// # Errors
    /// A parameter out of its range.
    pub fn add(&mut self, recording: &Recording) -> Result<(), ParamsError> {
        let estimates = replay(recording, &self.params)?;
        let before = self.calibrator.steps();
        self.calibrator.continue_at(recording.sample_rate);
        for (sample, estimate) in recording.samples.iter().zip(&estimates) {
            self.seen.note(estimate);
            self.seen.load |= sample.load.is_some();
            let taken = self.calibrator.update(estimate);
            self.mid_stance.extend(taken.map(PerAxis::to_array));
        }
        self.recordings.push(RecordingSteps {
            recording: recording.name.clone(),
            steps: self.calibrator.steps() - before,
        });
        Ok(())
    }

    /// What follows from the steps so far.
    ///
    /// # Errors
    /// There are too few.
    pub fn finish(self) -> Result<HalfWidths, CalibrationError> {
        let Ok(half_width) = self.calibrator.propose() else {
            return Err(CalibrationError::TooFewSteps(TooFew {
                hint: self.seen.hint(&self.params),
                recordings: self.recordings,
            }));
        };
        let spread = self.calibrator.spread().to_array();
        let axes = Axis::ALL.into_iter().enumerate().map(|(k, axis)| {
            let half_width = half_width.to_array()[k];
            let within = self.mid_stance.iter().filter(|m| m[k].abs() <= half_width);
            AxisReport {
                axis: axis.name(),
                spread: spread[k],
                bandwidth: self.params.bandwidth.to_array()[k],
                half_width,
                preset_half_width: self.params.half_width.to_array()[k],
                share_within: within.count() as f64 / self.mid_stance.len().max(1) as f64,
            }
        });
        Ok(HalfWidths {
            steps: self.calibrator.steps(),
            axes: axes.collect(),
            recordings: self.recordings,
            mid_stance: self.mid_stance,
            half_width,
        })
    }
}

impl Seen {
    fn note(&mut self, estimate: &ContactEstimate) {
        let motion = (
            estimate.linear_acceleration.0.length(),
            estimate.angular_rate.0.length(),
        );
        self.samples += 1;
        let unusable = [Flag::InvalidSample, Flag::Stale, Flag::Saturated];
        if unusable.iter().any(|flag| estimate.flags.contains(*flag)) {
            self.unusable += 1;
        }
        if motion.0 <= QUIET.0 && motion.1 <= QUIET.1 && !estimate.flags.are_doubt() {
            self.quiet += 1;
        }
        self.swing |= motion.0 > SWING.0 || motion.1 > SWING.1;
        self.loaded |= matches!(estimate.phase, Phase::Stance | Phase::Slip);
    }

    fn hint(self, params: &Params) -> String {
        if self.samples - self.unusable < self.samples / LEAST_QUIET {
            format!(
                "{} of {} samples are invalid, stale or saturated",
                self.unusable, self.samples
            )
        } else if self.load && !self.loaded {
            format!(
                "the load never passes load.on_threshold, {}, so the foot seems to swing all the time",
                params.load.on_threshold
            )
        } else if self.quiet < self.samples / LEAST_QUIET {
            "hardly a sample is as quiet as that: see whether units and --gravity are right"
                .to_owned()
        } else if !self.swing {
            "the foot never swung: record it walking".to_owned()
        } else {
            "record more of them, on ground on which the foot does not slip".to_owned()
        }
    }
}

/// There were too few usable steps.
#[derive(Clone, Debug, PartialEq)]
pub struct TooFew {
    /// What each recording had.
    pub recordings: Vec<RecordingSteps>,
    /// What may be the matter.
    hint: String,
}

impl fmt::Display for TooFew {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let found: u16 = self.recordings.iter().map(|r| r.steps).sum();
        let each: Vec<String> = self
            .recordings
            .iter()
            .map(|r| format!("{} {}", r.recording, r.steps))
            .collect();
        write!(
            f,
            "{found} usable steps ({}) where {STEPS} are needed; a usable step is {:.0} ms below \
             {} m/s² and {} rad/s after a swing above {} m/s² or {} rad/s; {}",
            each.join(", "),
            1e3 * (SHORTEST + 2.0 * MARGIN),
            QUIET.0,
            QUIET.1,
            SWING.0,
            SWING.1,
            self.hint
        )
    }
}

/// Half-widths and what they follow from. `Display` is the report for the terminal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HalfWidths {
    /// Usable steps.
    pub steps: u16,
    /// One per recording.
    pub recordings: Vec<RecordingSteps>,
    /// One per axis.
    pub axes: Vec<AxisReport>,
    /// The samples of mid-stance, six axes each in the order of [`Axis::ALL`], m/s² and rad/s.
    #[serde(skip)]
    pub mid_stance: Vec<[f32; 6]>,
    /// δ per axis, m/s² and rad/s.
    #[serde(skip)]
    pub half_width: PerAxis<f32>,
}

/// One axis; m/s² or rad/s.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisReport {
    /// Its name.
    pub axis: &'static str,
    /// Robust standard deviation σ of mid-stance.
    pub spread: f32,
    /// Kernel standard deviation h.
    pub bandwidth: f32,
    /// δ that follows.
    pub half_width: f32,
    /// δ as it was before.
    pub preset_half_width: f32,
    /// Share of the mid-stance samples within ±δ, in [0, 1].
    pub share_within: f64,
}

impl fmt::Display for HalfWidths {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let each: Vec<String> = self
            .recordings
            .iter()
            .map(|r| format!("{} {}", r.recording, r.steps))
            .collect();
        writeln!(
            f,
            "{} usable steps ({}), {} samples of mid-stance",
            self.steps,
            each.join(", "),
            self.mid_stance.len()
        )?;
        write!(
            f,
            "axis   spread σ  bandwidth h  half-width δ  was      ratio  within ±δ"
        )?;
        for axis in &self.axes {
            write!(
                f,
                "\n{:4} {:10.5} {:12.5} {:13.5}  {:<7.5} {:6.2} {:9.2} %",
                axis.axis,
                axis.spread,
                axis.bandwidth,
                axis.half_width,
                axis.preset_half_width,
                axis.half_width / axis.preset_half_width,
                100.0 * axis.share_within,
            )?;
        }
        Ok(())
    }
}
