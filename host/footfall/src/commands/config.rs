//! `footfall config`: lists and checks settings of the configuration file.

use std::path::PathBuf;

use analysis::config::{Preset, Resolved, example, explain};
use clap::Args;
use recordings::input::Format;

use super::recording::{preset_parser, read_config};
use crate::error::Error;
use crate::report::print_text;

/// Arguments of `footfall config`: one of three.
#[derive(Debug, Args)]
pub struct ConfigArguments {
    #[command(flatten)]
    what: What,
    /// Where the parameters start from
    #[arg(long, value_parser = preset_parser(), default_value = Preset::default().name())]
    pub preset: Preset,
}

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
struct What {
    /// Print a file with every key: its meaning, unit, range, and the preset's value
    #[arg(long)]
    example: bool,
    /// Say whether a file can be used with the preset, or what is wrong with it and where
    #[arg(long, value_name = "FILE.toml")]
    check: Option<PathBuf>,
    /// Say what a key means, its unit, range and default, what uses it, and which object of a foot it is
    #[arg(long, value_name = "KEY")]
    explain: Option<String>,
}

impl ConfigArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let text = if let Some(path) = &self.what.check {
            let resolved = Resolved {
                preset: self.preset,
                ..read_config(path)?
            };
            resolved.check(Format::Csv)?;
            format!("{}: ok\n", path.display())
        } else if let Some(key) = &self.what.explain {
            explain(key).map_err(|hint| Error::UnknownKey {
                key: key.clone(),
                hint,
            })?
        } else {
            example(self.preset)
        };
        print_text(&text).map_err(Error::Print)
    }
}
