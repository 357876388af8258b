//! JSON output of the commands. Each object names its layout under `schema`, except objects keyed by setting, and lists.
//!
//! The number at the end of the name is increased when a field is removed or changes its meaning; adding a field is
//! compatible. `docs/formats.md` describes the objects.

use recordings::analysis::calibrate::learnt::LearntFoot;
use recordings::analysis::calibrate::sensor::SensorCalibration;
use recordings::analysis::summary::{Summaries, WithInputs};
use serde::Serialize;

/// A report that can be printed as JSON.
pub trait Described: Serialize {
    /// Name of its layout.
    const SCHEMA: &'static str;
}

impl Described for Summaries {
    const SCHEMA: &'static str = "urn:footfall:replay:1";
}

impl Described for WithInputs<LearntFoot> {
    const SCHEMA: &'static str = "urn:footfall:calibrate:1";
}

impl Described for WithInputs<SensorCalibration> {
    const SCHEMA: &'static str = "urn:footfall:calibrate-rests:1";
}

impl Described for feet::decode::Report {
    const SCHEMA: &'static str = "urn:footfall:decode:1";
}

/// An object as it is printed.
#[derive(Debug, Serialize)]
pub struct Document<'a, R> {
    schema: &'static str,
    /// The version of the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    version: Option<&'static str>,
    #[serde(flatten)]
    report: &'a R,
}

impl<'a, R: Described> Document<'a, R> {
    /// Wraps a report for printing.
    pub const fn of(report: &'a R) -> Self {
        Self { schema: R::SCHEMA, version: Some(env!("CARGO_PKG_VERSION")), report }
    }

    /// Wraps the state of a foot for printing: without the version of the program, which would stand in every line, or
    /// beside that of a foot.
    pub const fn line(report: &'a R) -> Self {
        Self { version: None, ..Self::of(report) }
    }
}
