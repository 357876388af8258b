//! Report of inclination errors over several recordings.

use std::fmt::{self, Write};

use schemars::JsonSchema;
use scoring::inclination::InclinationScore;
use serde::Serialize;

use crate::schema::{Described, SchemaKind};

/// The scores of several recordings. `Display` is the report for the terminal.
#[derive(Clone, Debug, PartialEq, JsonSchema, Serialize)]
pub struct AttitudeReport {
    /// One per recording.
    pub recordings: Vec<InclinationScore>,
    /// Mean of the recordings' RMS errors, degrees.
    pub mean_rms_deg: f64,
    /// The largest of them, degrees.
    pub worst_rms_deg: f64,
    /// Mean of the recordings' 95 % errors, degrees.
    pub mean_p95_deg: f64,
}

impl AttitudeReport {
    /// Combines the scores of several recordings.
    #[must_use]
    pub fn of(recordings: Vec<InclinationScore>) -> Self {
        let mean = |value: fn(&InclinationScore) -> f64| {
            recordings.iter().map(value).sum::<f64>() / recordings.len().max(1) as f64
        };
        let all_rms_deg = recordings.iter().map(|score| score.rms_deg);
        Self {
            mean_rms_deg: mean(|score| score.rms_deg),
            mean_p95_deg: mean(|score| score.p95_deg),
            worst_rms_deg: all_rms_deg.fold(0.0, f64::max),
            recordings,
        }
    }

    /// Formats the report as a Markdown table.
    #[must_use]
    pub fn markdown(&self) -> String {
        let mut table =
            String::from("| recording | RMS inclination error | 95 % within |\n|---|---|---|\n");
        for (name, rms, p95) in self.rows() {
            // Writing to a string cannot fail.
            let _ = writeln!(table, "| {name} | {rms:.2}° | {p95:.2}° |");
        }
        table
    }

    fn rows(&self) -> impl Iterator<Item = (&str, f64, f64)> {
        let scores = self.recordings.iter();
        let each = scores.map(|of| (of.recording.as_str(), of.rms_deg, of.p95_deg));
        each.chain([("mean", self.mean_rms_deg, self.mean_p95_deg)])
    }
}

impl Described for AttitudeReport {
    const KIND: SchemaKind = SchemaKind::Attitude;
}

impl fmt::Display for AttitudeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let width = self.rows().map(|(name, ..)| name.chars().count()).max();
        let width = width.unwrap_or(0);
        f.write_str("inclination error in degrees: RMS, and what 95 % do not exceed")?;
        for (name, rms, p95) in self.rows() {
            write!(f, "\n{name:width$}  {rms:6.3}  {p95:6.3}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_weights_recordings_equally() {
        let score = |rms_deg: f64, scored_samples: usize| InclinationScore {
            recording: format!("of {scored_samples}"),
            scored_samples,
            rms_deg,
            p95_deg: 2.0 * rms_deg,
        };
        let report = AttitudeReport::of(vec![score(1.0, 10), score(3.0, 1000)]);
        assert_eq!(
            (
                report.mean_rms_deg,
                report.worst_rms_deg,
                report.mean_p95_deg
            ),
            (2.0, 3.0, 4.0)
        );
        assert_eq!(
            report.markdown(),
            "| recording | RMS inclination error | 95 % within |\n|---|---|---|\n\
             | of 10 | 1.00° | 2.00° |\n| of 1000 | 3.00° | 6.00° |\n| mean | 2.00° | 4.00° |\n"
        );
    }
}
