//! Summary of a replay, as text or as JSON.

use std::collections::BTreeMap;
use std::fmt;

use crate::input::{Format, Repairs};
use crate::plausible::Finding;
use crate::samples::recording::{RecordedSample, Recording};
use crate::scoring::metrics::{Latency, Metrics};
use crate::scoring::running::RunningMetrics;
use crate::scoring::scored::Scored;
use estimator_core::{ContactEstimate, Flag, Phase, Timestamp};
use serde::Serialize;

use crate::analysis::calibrate::mounting::MountingReport;
use crate::analysis::parameters::Estimation;

/// The figures of one replay. `Display` is the summary for the terminal.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// The recording's name, and the foot's where it has one.
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
    /// Samples on which each flag was raised, by [`Flag::name`]; flags that never were are absent.
    pub flag_counts: BTreeMap<&'static str, usize>,
    /// Figures against the labels, where there are any.
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
    /// Its name; docs/formats.md lists all.
    pub name: &'static str,
    /// The sentence for people.
    pub message: String,
}

impl InputReport {
    /// Reports the notices, repairs and findings of a file.
    #[must_use]
    pub fn new(
        file: &str,
        format: Format,
        notices: &[String],
        repairs: Repairs,
        findings: &[Finding],
    ) -> Self {
        let report = |finding: &Finding| FindingReport {
            name: finding.name(),
            message: finding.to_string(),
        };
        Self {
            file: file.to_owned(),
            format: format.name(),
            notices: notices.to_vec(),
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

/// A report, and in JSON what there is to say about the files that were read.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WithInputs<R> {
    /// The report.
    #[serde(flatten)]
    pub report: R,
    /// The mounting, where it is not that of the foot's own axes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mounting: Option<MountingReport>,
    /// By the name of the file.
    pub inputs: BTreeMap<String, InputReport>,
}

impl<R: fmt::Display> fmt::Display for WithInputs<R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.report.fmt(f)?;
        match &self.mounting {
            Some(mounting) => write!(f, "\n{mounting}"),
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

/// Reason why samples in slip outnumber the samples of a slipping foot.
const SLIP_NOTE: &str =
    "         (a landing counts as slip until still for up to window + on-delay)";

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
        if self.state_shares.get(Phase::Slip.name()) > Some(&0.0) {
            write!(f, "\n{SLIP_NOTE}")?;
        }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::recording::Label;
    use estimator_core::{Flags, Gravity, ImuSample, Probabilities};

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
             \x20        (a landing counts as slip until still for up to window + on-delay)\n\
             flags    saturated 1"
        );
    }

    #[test]
    fn text_without_slip_omits_the_slip_note() {
        let mut summary = summary([None; 4]);
        summary.state_shares.insert(Phase::Slip.name(), 0.0);
        assert!(!summary.to_string().contains("slip"));
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
}
