//! `footfall completions`: shell completions.

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::Arguments;
use crate::error::Error;
use crate::report::print_text;

const NAME: &str = "footfall";

/// Arguments of `footfall completions`.
#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// The shell
    #[arg(value_enum)]
    pub shell: Shell,
}

impl CompletionsArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Arguments::command(), NAME, &mut script);
        print_text(&String::from_utf8_lossy(&script)).map_err(Error::Print)
    }
}
