//! JSON Schemas (draft 2020-12) of the commands' JSON output, one per kind of object.
//!
//! Each object names its schema under `schema`, except objects keyed by setting, and lists. The number at the end
//! of the name is increased when a field is removed or changes its meaning; adding a field is compatible.
//! `docs/schemas` keeps the schemas as files.

use analysis::calibrate::learnt::LearntFoot;
use analysis::calibrate::sensor::SensorCalibration;
use analysis::summary::{Summaries, WithInputs};
use clap::ValueEnum;
use schemars::JsonSchema;
use serde::Serialize;

/// The kinds of objects that are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SchemaKind {
    /// Of `footfall replay --json`
    Replay,
    /// Of `footfall batch --json`
    Batch,
    /// Of `footfall calibrate --json`
    Calibrate,
    /// Of `footfall calibrate --json` of a bag with several feet
    CalibrateFeet,
    /// Of `footfall calibrate --rests --json`
    CalibrateRests,
    /// Of `footfall decode --json`
    Decode,
    /// Of `footfall attitude --json`
    Attitude,
    /// Of the lines of `footfall monitor --json` that show a foot
    Monitor,
    /// Of the lines of `footfall monitor --json` that show an event
    MonitorEvent,
    /// Of `footfall foot SOURCE scan --json`, which does not name its schema
    FootScan,
    /// Of `footfall foot SOURCE info --json`
    FootInfo,
    /// Of `footfall foot SOURCE get --json`, which does not name its schema
    FootGet,
    /// Of `set`, `diff` and `import` of `footfall foot SOURCE --json`, which do not name it
    FootChanges,
    /// Of `footfall foot SOURCE update --json`, which does not name its schema
    FootUpdate,
    /// Of `footfall accept --json`
    Accept,
}

impl SchemaKind {
    /// Returns the name used by `footfall schema`, which is part of the id.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.id().split(':').nth(2).unwrap_or_default()
    }

    /// Returns the id of the schema, with its version number.
    #[must_use]
    pub const fn id(self) -> &'static str {
        match self {
            Self::Replay => "urn:footfall:replay:1",
            Self::Batch => "urn:footfall:batch:1",
            Self::Calibrate => "urn:footfall:calibrate:1",
            Self::CalibrateFeet => "urn:footfall:calibrate-feet:1",
            Self::CalibrateRests => "urn:footfall:calibrate-rests:1",
            Self::Decode => "urn:footfall:decode:1",
            Self::Attitude => "urn:footfall:attitude:1",
            Self::Monitor => "urn:footfall:monitor:1",
            Self::MonitorEvent => "urn:footfall:monitor-event:1",
            Self::FootScan => "urn:footfall:foot-scan:1",
            Self::FootInfo => "urn:footfall:foot-info:1",
            Self::FootGet => "urn:footfall:foot-get:1",
            Self::FootChanges => "urn:footfall:foot-changes:1",
            Self::FootUpdate => "urn:footfall:foot-update:1",
            Self::Accept => "urn:footfall:accept:1",
        }
    }
}

/// A report that can be printed as JSON.
pub trait Described: Serialize + JsonSchema {
    /// Kind of the report.
    const KIND: SchemaKind;
}

impl Described for Summaries {
    const KIND: SchemaKind = SchemaKind::Replay;
}

impl Described for WithInputs<LearntFoot> {
    const KIND: SchemaKind = SchemaKind::Calibrate;
}

impl Described for WithInputs<SensorCalibration> {
    const KIND: SchemaKind = SchemaKind::CalibrateRests;
}

impl Described for decode::Report {
    const KIND: SchemaKind = SchemaKind::Decode;
}

/// An object as it is printed.
#[derive(Debug, JsonSchema, Serialize)]
pub struct Document<'a, R> {
    /// Identifier of the schema that describes this object.
    schema: &'static str,
    /// The version of the program.
    version: &'static str,
    #[serde(flatten)]
    report: &'a R,
}

impl<'a, R: Described> Document<'a, R> {
    /// Wraps a report for printing.
    pub const fn of(report: &'a R) -> Self {
        Self {
            schema: R::KIND.id(),
            version: env!("CARGO_PKG_VERSION"),
            report,
        }
    }
}

/// An object about feet as it is printed: without the version of the program, which would stand in
/// every line, or beside that of a foot.
#[derive(Debug, JsonSchema, Serialize)]
pub struct DescribedLine<'a, R> {
    /// Identifier of the schema that describes this object.
    schema: &'static str,
    #[serde(flatten)]
    line: &'a R,
}

impl<'a, R: Described> DescribedLine<'a, R> {
    /// Wraps the state of a foot for printing.
    pub const fn of(line: &'a R) -> Self {
        Self {
            schema: R::KIND.id(),
            line,
        }
    }
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::*;
    use crate::attitude::AttitudeReport;

    #[test]
    fn kind_names_match_the_option_and_the_schema() {
        for &kind in SchemaKind::value_variants() {
            let value = kind.to_possible_value().expect("none is hidden");
            assert_eq!(value.get_name(), kind.name());
            assert_eq!(kind.id(), format!("urn:footfall:{}:1", kind.name()));
        }
    }

    #[test]
    fn non_finite_number_is_null() {
        let report = AttitudeReport {
            recordings: Vec::new(),
            mean_rms_deg: f64::NAN,
            worst_rms_deg: f64::INFINITY,
            mean_p95_deg: -0.0,
        };
        let text = serde_json::to_string(&Document::of(&report)).expect("JSON");
        let json: Value = serde_json::from_str(&text).expect("valid JSON");
        assert!(json["mean_rms_deg"].is_null() && json["worst_rms_deg"].is_null());
        assert_eq!(json["schema"], "urn:footfall:attitude:1");
    }
}
