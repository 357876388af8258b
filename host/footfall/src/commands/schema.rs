//! `footfall schema`: prints the JSON Schemas of the other commands' output.

use clap::Args;

use crate::error::Error;
use crate::report::print_text;
use crate::schema::Kind;

/// Arguments of `footfall schema`.
#[derive(Debug, Args)]
pub struct SchemaArguments {
    /// Whose JSON is described
    #[arg(value_enum)]
    pub kind: Kind,
}

impl SchemaArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        print_text(&self.kind.text()?).map_err(Error::Print)
    }
}
