//! `footfall schema`: prints the JSON Schemas of the other commands' output.

use analysis::calibrate::learnt::LearntFoot;
use analysis::calibrate::sensor::SensorCalibration;
use analysis::summary::{Summaries, WithInputs};
use clap::Args;
use schemars::generate::SchemaSettings;
use schemars::transform::{RecursiveTransform, Transform};
use schemars::{JsonSchema, Schema};
use serde_json::{Value, json};

use super::accept::AcceptReport;
#[cfg(feature = "parquet")]
use super::batch::BatchReport;
use super::calibrate::FeetReport;
use super::foot::{FootChanges, FootInfo, FootScan, FootUpdates, FootValues};
use crate::attitude::AttitudeReport;
use crate::error::Error;
#[cfg(not(feature = "parquet"))]
use crate::feature::Feature;
use crate::feature::NotBuilt;
use crate::monitor::lines::FootLine;
use crate::monitor::robot::MonitorEvent;
use crate::report::print_text;
use crate::schema::{DescribedLine, Document, SchemaKind};

/// Arguments of `footfall schema`.
#[derive(Debug, Args)]
pub struct SchemaArguments {
    /// Whose JSON is described
    #[arg(value_enum)]
    pub kind: SchemaKind,
}

impl SchemaArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        print_text(&self.kind.text()?).map_err(Error::Print)
    }
}

impl SchemaKind {
    /// Returns the schema as text with a final newline.
    ///
    /// # Errors
    /// The command is not built.
    pub fn text(self) -> Result<String, NotBuilt> {
        let schema = match self {
            Self::Replay => self.schema::<Document<'_, Summaries>>(),
            #[cfg(not(feature = "parquet"))]
            Self::Batch => {
                return Err(Feature::Parquet.missing_for("the schema of footfall batch"));
            }
            #[cfg(feature = "parquet")]
            Self::Batch => self.schema::<Document<'_, BatchReport>>(),
            Self::Calibrate => self.schema::<Document<'_, WithInputs<LearntFoot>>>(),
            Self::CalibrateFeet => self.schema::<Document<'_, FeetReport>>(),
            Self::CalibrateRests => self.schema::<Document<'_, WithInputs<SensorCalibration>>>(),
            Self::Decode => self.schema::<Document<'_, decode::Report>>(),
            Self::Attitude => self.schema::<Document<'_, AttitudeReport>>(),
            Self::Monitor => self.schema::<DescribedLine<'_, FootLine<'_>>>(),
            Self::MonitorEvent => self.schema::<DescribedLine<'_, MonitorEvent>>(),
            Self::FootScan => self.schema::<FootScan>(),
            Self::FootInfo => self.schema::<DescribedLine<'_, FootInfo>>(),
            Self::FootGet => self.schema::<FootValues>(),
            Self::FootChanges => self.schema::<FootChanges>(),
            Self::FootUpdate => self.schema::<FootUpdates>(),
            Self::Accept => self.schema::<DescribedLine<'_, AcceptReport>>(),
        };
        Ok(format!("{:#}\n", schema.as_value()))
    }

    /// Returns the schema of a `T` as printed.
    fn schema<T: JsonSchema>(self) -> Schema {
        let settings = SchemaSettings::draft2020_12().for_serialize();
        let mut schema = settings.into_generator().into_root_schema_for::<T>();
        RecursiveTransform(for_readers_of_json).transform(&mut schema);
        let title = format!("JSON of footfall: {}", self.name());
        schema.insert("$id".to_owned(), json!(self.id()));
        schema.insert("title".to_owned(), json!(title));
        if let Some(id) = schema.pointer_mut("/properties/schema") {
            id["const"] = json!(self.id());
        }
        schema
    }
}

/// Removes details for readers of the code: links, and the restriction that a type read from a file accepts no
/// unknown fields.
fn for_readers_of_json(schema: &mut Schema) {
    if let Some(Value::String(text)) = schema.get_mut("description") {
        *text = text.replace("[`", "").replace("`]", "").replace('`', "");
    }
    if schema.get("additionalProperties") == Some(&Value::Bool(false)) {
        schema.remove("additionalProperties");
    }
}
