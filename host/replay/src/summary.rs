//! Summary of a replay, as text or as JSON: figures of the estimates, findings about the file, parameters of the estimate.

use std::collections::BTreeMap;
use std::fmt;

use estimator_core::any::AnyParams;
use estimator_core::half_widths::WindowLength;
use estimator_core::parameter::{Parameter, SAMPLE_RATE};
use estimator_core::params::GyroTiming;
use estimator_core::{ContactEstimate, Flag, Gravity, Learnt, Phase, Timestamp};
use serde::Serialize;

use crate::scoring::{Latency, Metrics, RunningMetrics, Scored};
use config::Preset;
use config::{GRAVITIES, LEARNINGS, METHODS, word_of};
use options::Correction;
use options::format::Format;
use options::hint::{InWords, Notice, Vocabulary};
use plausible::Finding;
use samples::mounting::{MountingReport, axes_text};
use samples::number::shown;
use samples::space::components;
use samples::{RecordedSample, Recording};
use stored::Repairs;

#[cfg(test)]
use serde_json::json;

/// The figures of one replay. `Display` is the summary for the terminal.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// The recording's name, followed by the name of the foot if it has one.
    pub recording: String,
    /// The foot, where the recording names it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub foot: Option<String>,
    /// Number of samples, each with its estimate.
    pub samples: usize,
    /// Time from the first sample to the last, s.
    pub duration_s: f64,
    /// Sample rate, Hz.
    pub sample_rate_hz: f32,
    /// Share of the samples in each state, by [`Phase::name`], in [0, 1].
    pub state_shares: BTreeMap<&'static str, f64>,
    /// Number of samples with each flag, by [`Flag::name`]. Flags that were never set are absent.
    pub flag_counts: BTreeMap<&'static str, usize>,
    /// Figures against the labels, if the recording has labels.
    pub metrics: Option<Metrics>,
    /// Report about the file that was read; absent without a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input: Option<InputReport>,
    /// Parameters and correction of the estimate; absent without a file, and where recorded contacts are the estimates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimation: Option<Estimation>,
}

/// Report about a file that was read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InputReport {
    /// The file, as it was named.
    pub file: String,
    /// How it is laid out, by [`Format::name`].
    pub format: &'static str,
    /// One sentence on each thing that was left out or reinterpreted.
    pub notices: Vec<String>,
    /// Rows left out because all six axes are blank in them.
    pub blank_rows: usize,
    /// Rows left out because their times do not advance.
    pub dropped_rows: usize,
    /// Rows that got another time.
    pub retimed_rows: usize,
    /// Implausible properties of the samples.
    pub findings: Vec<FindingReport>,
}

/// One thing that is not plausible.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FindingReport {
    /// Name of the finding; docs/reference/formats.md lists all.
    pub name: &'static str,
    /// The sentence for people.
    pub message: String,
}

impl InputReport {
    /// Reports the notices, repairs and findings of a file, in the words of a program.
    #[must_use]
    pub fn new(
        file: &str,
        format: Format,
        notices: &[Notice],
        repairs: Repairs,
        findings: &[Finding],
        words: &dyn Vocabulary,
    ) -> Self {
        let report = |finding: &Finding| FindingReport {
            name: finding.name(),
            message: finding.in_words(words),
        };
        Self {
            file: file.to_owned(),
            format: format.name(),
            notices: notices.iter().map(|notice| notice.in_words(words)).collect(),
            blank_rows: repairs.blank_rows,
            dropped_rows: repairs.dropped_rows,
            retimed_rows: repairs.retimed_rows,
            findings: findings.iter().map(report).collect(),
        }
    }
}

/// The figures of all recordings and feet of one replay.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summaries {
    /// One for each foot of each recording.
    pub recordings: Vec<Summary>,
}

impl fmt::Display for Summaries {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (k, summary) in self.recordings.iter().enumerate() {
            if k > 0 {
                writeln!(f)?;
            }
            summary.fmt(f)?;
        }
        Ok(())
    }
}

/// A report. In JSON it includes the remarks on the files that were read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WithInputs<R> {
    /// The report.
    #[serde(flatten)]
    pub report: R,
    /// The mounting, if the sensor's axes are not the axes of the foot.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting: Option<MountingReport>,
    /// Thresholds that the load crosses; `None` if it crosses the thresholds in use.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load: Option<LoadThresholds>,
    /// Reports on the inputs, by the name of the file.
    pub inputs: BTreeMap<String, InputReport>,
}

/// Thresholds of a load, in its unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoadThresholds {
    /// Load from which the foot counts as loaded.
    pub on_threshold: f32,
    /// Load below which it counts as unloaded.
    pub off_threshold: f32,
}

impl<R: fmt::Display> fmt::Display for WithInputs<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.report.fmt(f)?;
        if let Some(mounting) = &self.mounting {
            write!(f, "\n{mounting}")?;
        }
        match &self.load {
            Some(LoadThresholds { on_threshold, off_threshold }) => {
                write!(f, "\nload: on_threshold {on_threshold}, off_threshold {off_threshold}")
            }
            None => Ok(()),
        }
    }
}

/// Counts the figures of a [`Summary`], sample by sample.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// The summary so far, without shares and metrics.
    summary: Summary,
    first: Option<Timestamp>,
    /// In the order of [`Phase::ALL`].
    states: [usize; Phase::ALL.len()],
    /// Metrics of the samples with a label.
    metrics: RunningMetrics,
}

impl Tally {
    /// Creates a tally for a recording at this sample rate.
    #[must_use]
    pub fn new(recording: &str, foot: Option<&str>, sample_rate_hz: f32) -> Self {
        let summary = Summary {
            recording: recording.to_owned(),
            foot: foot.map(str::to_owned),
            sample_rate_hz,
            ..Summary::default()
        };
        Self { summary, ..Self::default() }
    }

    /// Counts a sample with its estimate.
    pub fn add(&mut self, sample: &RecordedSample, estimate: &ContactEstimate) {
        let now = sample.imu.timestamp;
        let summary = &mut self.summary;
        summary.samples += 1;
        let duration_us = now.micros_since(*self.first.get_or_insert(now));
        summary.duration_s = duration_us.unwrap_or(0) as f64 / 1.0e6;
        for (count, phase) in self.states.iter_mut().zip(Phase::ALL) {
            *count += usize::from(estimate.phase == phase);
        }
        for flag in Flag::ALL {
            if estimate.flags.contains(flag) {
                *summary.flag_counts.entry(flag.name()).or_default() += 1;
            }
        }
        if let Some(scored) = Scored::of(sample, estimate) {
            self.metrics.add(&scored);
        }
    }

    /// Returns the summary.
    #[must_use]
    pub fn finish(self) -> Summary {
        let samples = self.summary.samples.max(1) as f64;
        let counts = Phase::ALL.into_iter().zip(self.states);
        let shares = counts.map(|(phase, count)| (phase.name(), count as f64 / samples));
        Summary { state_shares: shares.collect(), metrics: self.metrics.finish(), ..self.summary }
    }
}

impl Summary {
    /// Sums up a recording and its estimates, one per sample.
    #[must_use]
    pub fn of(recording: &Recording, estimates: &[ContactEstimate]) -> Self {
        let mut tally = Tally::new(&recording.name, None, recording.sample_rate);
        for (sample, estimate) in recording.samples.iter().zip(estimates) {
            tally.add(sample, estimate);
        }
        tally.finish()
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} samples, {:.3} s at {} Hz",
            self.recording, self.samples, self.duration_s, self.sample_rate_hz
        )?;
        let shares: Vec<_> = Phase::ALL
            .iter()
            .filter_map(|phase| self.state_shares.get_key_value(phase.name()))
            .filter(|(_, share)| **share > 0.0)
            .map(|(name, share)| format!("{name} {:.1} %", 100.0 * share))
            .collect();
        write!(f, "state    {}", shares.join(", "))?;
        if !self.flag_counts.is_empty() {
            let counts: Vec<_> =
                self.flag_counts.iter().map(|(name, count)| format!("{name} {count}")).collect();
            write!(f, "\nflags    {}", counts.join(", "))?;
        }
        if let Some(metrics) = &self.metrics {
            write!(f, "\n{}", metrics_text(metrics))?;
        }
        Ok(())
    }
}

/// Formats the figures against the labels, in three lines.
fn metrics_text(metrics: &Metrics) -> String {
    let or_none = |value: Option<f64>, decimals: usize| match value {
        Some(value) => format!("{value:.decimals$}"),
        None => "none".to_owned(),
    };
    format!(
        "labels   RMSE {:.4}, Brier score {:.4}, ROC-AUC {}, F1 at 0.5 {}\n\
         latency  to stable: {}; to not stable: {}\n\
         meaning  calibration error {:.3}",
        metrics.rmse,
        metrics.brier_score,
        or_none(metrics.roc_auc, 3),
        or_none(metrics.f1_at_0_5, 3),
        latency_text(&metrics.latency_on),
        latency_text(&metrics.latency_off),
        metrics.calibration_error
    )
}

fn latency_text(latency: &Latency) -> String {
    let (followed, missed) = (latency.followed, latency.missed);
    match (latency.median_s, missed) {
        (Some(median), _) => {
            let milliseconds = 1.0e3 * median;
            format!("{milliseconds:.1} ms (median of {followed}, {missed} missed)")
        }
        (None, 0) => "no transition".to_owned(),
        (None, _) => format!("never answered ({missed} missed)"),
    }
}

/// How one foot was estimated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimation {
    /// Preset that the parameters started from, by [`Preset::name`].
    pub preset: &'static str,
    /// Parameters in force.
    pub parameters: ParametersReport,
    /// Correction of the recording's readings before the estimate.
    pub correction: CorrectionReport,
    /// Values the estimator had learnt at the end, with any method.
    pub learnt: LearntValues,
}

/// The parameters of the estimator.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParametersReport {
    /// Whether the accelerations contain gravity.
    pub gravity: &'static str,
    /// Where the limits of stillness come from.
    pub method: &'static str,
    /// With `self_calibrating`: whether the foot continues to learn.
    pub learning: &'static str,
    /// With `half_widths`: length of the estimate's window.
    pub window: WindowReport,
    /// Time within the period of a sample that the gyroscope's rate belongs to.
    pub gyro_timing: GyroTimingReport,
    /// With `self_calibrating`: the learnt values at the start; `null` for a cold start.
    pub learnt_before: Option<LearntValues>,
    /// The numbers, by their names in the estimator's table of limits.
    pub numbers: BTreeMap<&'static str, f32>,
}

/// A window's length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum WindowReport {
    /// A duration, s.
    DurationS(f32),
    /// A count of samples.
    Samples(u32),
}

/// When the gyroscope measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GyroTimingReport {
    /// The mean over the time since the sample before.
    PeriodMean,
    /// Time by which the gyroscope's rate is earlier than the accelerometer's sample, s.
    DelayS(f32),
}

/// Correction of the readings of the sensor; x, y, z of its frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CorrectionReport {
    /// Bias subtracted from accelerations, m/s².
    pub accelerometer_bias_m_s2: [f32; 3],
    /// Factors of the accelerations after that.
    pub accelerometer_scale: [f32; 3],
    /// Bias subtracted from angular rates, rad/s.
    pub gyroscope_bias_rad_s: [f32; 3],
    /// Mounting by which they were turned afterwards, as [`axes_text`] writes it.
    pub axes: String,
}

impl ParametersReport {
    /// Reports the parameters with which a recording was estimated, and the rate of its samples, Hz.
    #[must_use]
    pub fn of(params: &AnyParams, sample_rate: f32, gravity: Gravity) -> Self {
        let numbers = Parameter::ALL.into_iter().map(|number| (number.name(), number.get(params)));
        Self {
            gravity: word_of(&GRAVITIES, gravity),
            method: word_of(&METHODS, params.method),
            learning: word_of(&LEARNINGS, params.params.learning),
            window: match params.half_widths.window {
                WindowLength::Duration(seconds) => WindowReport::DurationS(seconds),
                WindowLength::Samples(samples) => WindowReport::Samples(samples),
            },
            gyro_timing: match params.params.attitude.gyro_timing {
                GyroTiming::PeriodMean => GyroTimingReport::PeriodMean,
                GyroTiming::Delay(seconds) => GyroTimingReport::DelayS(seconds),
            },
            learnt_before: params.params.learnt.map(LearntValues::from),
            numbers: numbers.chain([(SAMPLE_RATE.name, sample_rate)]).collect(),
        }
    }
}

impl From<&Correction> for CorrectionReport {
    fn from(correction: &Correction) -> Self {
        let [bias, scale, gyroscope] = [
            correction.accelerometer.bias,
            correction.accelerometer.scale,
            correction.gyroscope_bias,
        ]
        .map(components);
        Self {
            accelerometer_bias_m_s2: bias,
            accelerometer_scale: scale,
            gyroscope_bias_rad_s: gyroscope,
            axes: axes_text(&correction.mounting),
        }
    }
}

/// Returns the differences from the preset for recordings of a format, as `name = value`, in one line; empty if
/// there are none. The recording's own rate and gravity are ignored.
#[must_use]
pub fn differences(params: &AnyParams, preset: Preset, format: Format) -> String {
    let before = preset.params(format);
    let [now, then] = [params, &before]
        .map(|params| ParametersReport::of(params, SAMPLE_RATE.default, Gravity::Included));
    let mut all = Vec::new();
    for (name, value) in &now.numbers {
        let was = then.numbers.get(name);
        if was != Some(value) {
            let was = was.copied().unwrap_or_default();
            all.push(format!("{name} = {} ({})", shown(*value), shown(was)));
        }
    }
    for (name, now, then) in
        [("method", now.method, then.method), ("learning", now.learning, then.learning)]
    {
        if now != then {
            all.push(format!("{name} = {now} ({then})"));
        }
    }
    if now.window != then.window {
        all.push(format!("window = \"{}\"", config::window_text(params.half_widths.window)));
    }
    if now.gyro_timing != then.gyro_timing {
        let timing = config::gyro_timing_text(params.params.attitude.gyro_timing);
        all.push(format!("attitude.gyro_timing = \"{timing}\""));
    }
    if now.learnt_before != then.learnt_before {
        all.push("learnt is set".to_owned());
    }
    all.join(", ")
}

/// Values of a foot's [`Learnt`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LearntValues {
    /// Mean of the logarithm of the acceleration in stances, ln(m/s²).
    pub still: f32,
    /// Mean of the logarithm of the acceleration in swings, ln(m/s²).
    pub moving: f32,
    /// Logarithm of the speed that accelerations along the ground add up to in stances, ln(m/s).
    pub speed: f32,
    /// Stillness that was learnt from, s.
    pub still_seconds: f32,
    /// Motion that was learnt from, s.
    pub moving_seconds: f32,
}

impl From<Learnt> for LearntValues {
    fn from(of: Learnt) -> Self {
        let Learnt { still, moving, speed, still_seconds, moving_seconds } = of;
        Self { still, moving, speed, still_seconds, moving_seconds }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::{Flags, Gravity, ImuSample, Probabilities};

    use samples::Label;

    fn summary(labels: [Option<Label>; 4]) -> Summary {
        let phases = [Phase::Swing, Phase::Stance, Phase::Stance, Phase::Slip];
        let samples = (0..)
            .zip(labels)
            .map(|(k, label)| RecordedSample {
                imu: ImuSample {
                    timestamp: Timestamp::from_micros(k * 100_000),
                    ..ImuSample::default()
                },
                load: None,
                label,
            })
            .collect();
        let recording = Recording {
            name: "walk".to_owned(),
            sample_rate: 10.0,
            gravity: Gravity::Removed,
            load_title: String::new(),
            samples,
        };
        let estimates = phases.map(|phase| ContactEstimate {
            phase,
            flags: match phase {
                Phase::Slip => Flags::NONE.with(Flag::Saturated),
                _ => Flags::NONE,
            },
            probabilities: Probabilities {
                stable: if phase == Phase::Stance { 1.0 } else { 0.0 },
                ..Probabilities::default()
            },
            ..ContactEstimate::default()
        });
        Summary::of(&recording, &estimates)
    }

    #[test]
    fn text_omits_absent_figures() {
        assert_eq!(
            summary([None; 4]).to_string(),
            "walk: 4 samples, 0.300 s at 10 Hz\n\
         state    stance 50.0 %, slip 25.0 %, swing 25.0 %\n\
         flags    saturated 1"
        );
    }

    #[test]
    fn text_with_labels_shows_the_metrics() {
        use Label::{NotStable, Stable};
        let text = summary([NotStable, Stable, Stable, NotStable].map(Some)).to_string();
        assert!(
            text.ends_with(
                "labels   RMSE 0.0000, Brier score 0.0000, ROC-AUC 1.000, F1 at 0.5 1.000\n\
             latency  to stable: 0.0 ms (median of 1, 0 missed); \
             to not stable: no transition\n\
             meaning  calibration error 0.000"
            ),
            "{text}"
        );
    }

    #[test]
    fn json_holds_the_same_figures() {
        let json = serde_json::to_value(summary([None; 4])).unwrap();
        assert_eq!(json["samples"], 4);
        assert_eq!(json["state_shares"]["stance"], 0.5);
        assert_eq!(json["flag_counts"]["saturated"], 1);
        assert!(json["metrics"].is_null());
    }

    #[test]
    fn every_number_is_reported_with_its_value() {
        let report = ParametersReport::of(&AnyParams::PAPER_GO1, 250.0, Gravity::Included);
        let json = serde_json::to_value(report).unwrap();
        assert_eq!(json["numbers"]["sample_rate_hz"], 250.0);
        for number in Parameter::ALL {
            let value = json["numbers"][number.name()].as_f64().expect("a number");
            assert_eq!(value as f32, number.get(&AnyParams::PAPER_GO1));
        }
        assert_eq!(json["window"], json!({ "samples": 50 }));
        assert_eq!(json["gyro_timing"], "period_mean");
        assert_eq!(json["method"], "half_widths");
    }

    #[test]
    fn differences_from_the_preset_name_both_values() {
        let mut params = Preset::Default.params(Format::Csv);
        assert_eq!(differences(&params, Preset::Default, Format::Csv), "");
        params.params.decision.threshold = 0.6;
        params.params.attitude.gyro_timing = GyroTiming::Delay(0.0015);
        assert_eq!(
            differences(&params, Preset::Default, Format::Csv),
            "decision.threshold = 0.6 (0.5), attitude.gyro_timing = \"1.5ms\""
        );
    }
}
