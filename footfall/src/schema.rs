//! What the JSON of a command is described by: a JSON Schema (draft 2020-12) for each kind of object.
//!
//! Each object names its schema under `schema`. The number at its end grows where a field is removed or
//! changes its meaning; that a field is added changes nothing for those who do not know it.
//! `docs/schemas` keeps the schemas as files.

use analysis::calibrate::learnt::LearntFoot;
use analysis::calibrate::sensor::SensorCalibration;
use analysis::summary::{Summaries, WithInputs};
use clap::ValueEnum;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema};
use serde::Serialize;
use serde_json::{Value, json};

use crate::attitude::AttitudeReport;
use crate::commands::batch::BatchReport;
use scoring::Evaluation;

/// The kinds of objects that are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// Of `footfall replay --json`
    Replay,
    /// Of `footfall batch --json`
    Batch,
    /// Of `footfall calibrate --json`
    Calibrate,
    /// Of `footfall calibrate --rests --json`
    CalibrateRests,
    /// Of `footfall decode --json`
    Decode,
    /// Of `footfall attitude --json`
    Attitude,
    /// Of `footfall evaluate --json`
    Evaluate,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 7] = [
        Self::Replay,
        Self::Batch,
        Self::Calibrate,
        Self::CalibrateRests,
        Self::Decode,
        Self::Attitude,
        Self::Evaluate,
    ];

    /// Its name, as `footfall schema` takes it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Replay => "replay",
            Self::Batch => "batch",
            Self::Calibrate => "calibrate",
            Self::CalibrateRests => "calibrate-rests",
            Self::Decode => "decode",
            Self::Attitude => "attitude",
            Self::Evaluate => "evaluate",
        }
    }

    /// What its schema is called, with its number.
    #[must_use]
    pub const fn id(self) -> &'static str {
        match self {
            Self::Replay => "urn:footfall:replay:1",
            Self::Batch => "urn:footfall:batch:1",
            Self::Calibrate => "urn:footfall:calibrate:1",
            Self::CalibrateRests => "urn:footfall:calibrate-rests:1",
            Self::Decode => "urn:footfall:decode:1",
            Self::Attitude => "urn:footfall:attitude:1",
            Self::Evaluate => "urn:footfall:evaluate:1",
        }
    }

    /// Its schema as text that ends its last line.
    #[must_use]
    pub fn text(self) -> String {
        let schema = match self {
            Self::Replay => schema::<Summaries>(),
            Self::Batch => schema::<BatchReport>(),
            Self::Calibrate => schema::<WithInputs<LearntFoot>>(),
            Self::CalibrateRests => schema::<WithInputs<SensorCalibration>>(),
            Self::Decode => schema::<decode::Report>(),
            Self::Attitude => schema::<AttitudeReport>(),
            Self::Evaluate => schema::<Evaluation>(),
        };
        format!("{:#}\n", schema.as_value())
    }
}

/// What can be printed as JSON.
pub trait Described: Serialize + JsonSchema {
    /// What it is.
    const KIND: Kind;
}

impl Described for Summaries {
    const KIND: Kind = Kind::Replay;
}

impl Described for BatchReport {
    const KIND: Kind = Kind::Batch;
}

impl Described for WithInputs<LearntFoot> {
    const KIND: Kind = Kind::Calibrate;
}

impl Described for WithInputs<SensorCalibration> {
    const KIND: Kind = Kind::CalibrateRests;
}

impl Described for decode::Report {
    const KIND: Kind = Kind::Decode;
}

impl Described for AttitudeReport {
    const KIND: Kind = Kind::Attitude;
}

impl Described for Evaluation {
    const KIND: Kind = Kind::Evaluate;
}

/// An object as it is printed.
#[derive(Debug, JsonSchema, Serialize)]
pub struct Document<'a, R> {
    /// What describes this object.
    schema: &'static str,
    /// The version of the program.
    version: &'static str,
    #[serde(flatten)]
    report: &'a R,
}

impl<'a, R: Described> Document<'a, R> {
    /// Of what was found.
    pub const fn of(report: &'a R) -> Self {
        Self {
            schema: R::KIND.id(),
            version: env!("CARGO_PKG_VERSION"),
            report,
        }
    }
}

fn schema<R: Described>() -> Schema {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let mut schema = settings
        .into_generator()
        .into_root_schema_for::<Document<'_, R>>();
    RecursiveTransform(for_readers_of_json).transform(&mut schema);
    let kind = R::KIND;
    schema.insert("$id".to_owned(), json!(kind.id()));
    schema.insert(
        "title".to_owned(),
        json!(format!("JSON of footfall: {}", kind.name())),
    );
    if let Some(id) = schema.pointer_mut("/properties/schema") {
        id["const"] = json!(kind.id());
    }
    schema
}

/// Takes out what is for readers of the code: links, and that a type, where a file is read, takes no
/// unknown fields.
fn for_readers_of_json(schema: &mut Schema) {
    if let Some(Value::String(text)) = schema.get_mut("description") {
        *text = text.replace("[`", "").replace("`]", "").replace('`', "");
    }
    if schema.get("additionalProperties") == Some(&Value::Bool(false)) {
        schema.remove("additionalProperties");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_kinds_are_those_of_the_option_and_of_the_schema() {
        for kind in Kind::ALL {
            let value = kind.to_possible_value().expect("none is hidden");
            assert_eq!(value.get_name(), kind.name());
            assert_eq!(kind.id(), format!("urn:footfall:{}:1", kind.name()));
        }
        assert_eq!(Kind::ALL, Kind::value_variants());
    }

    #[test]
    fn a_number_that_is_not_finite_is_null() {
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
