//! `footfall config`: prints a configuration file with every key, or checks one.

use std::path::PathBuf;

use clap::Args;
use config::{Preset, Resolved, example};
use options::Format;

use super::options::{preset_parser, read_config};
use crate::error::Error;
use crate::report::print_text;

/// Examples of `footfall config`.
pub const EXAMPLES: &str = "\
Examples:
  footfall config > robot.toml
  footfall config --check robot.toml";

/// Arguments of `footfall config`.
#[derive(Debug, Args)]
pub struct ConfigArguments {
    /// Check that a file is valid with the preset, and report each error with its place
    #[arg(long, value_name = "FILE.toml")]
    check: Option<PathBuf>,
    /// Parameters to start from
    #[arg(long, value_parser = preset_parser(), default_value = Preset::default().name())]
    pub preset: Preset,
}

/// First lines of a file with every key.
const HEAD: &str = "\
# A configuration of footfall, for --config, with the values of --preset PRESET.
# All keys may be left out. Remove the # before the keys that you change.
# `footfall config --check FILE` checks the values.
";

impl ConfigArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let text = if let Some(path) = &self.check {
            let resolved = Resolved { preset: self.preset, ..read_config(path)? };
            resolved.check(Format::Csv)?;
            format!("{}: ok\n", path.display())
        } else {
            HEAD.replace("PRESET", self.preset.name()) + &example(self.preset)
        };
        print_text(&text).map_err(Error::Print)
    }
}
