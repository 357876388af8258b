//! `footfall completions` and `footfall man`: shell completions and manual pages.

use std::io;
use std::path::{Path, PathBuf};

use clap::{Args, Command, CommandFactory};
use clap_complete::Shell;
use clap_mangen::Man;

use super::Arguments;
use crate::error::Error;
use crate::files::{create_directory, write_file};
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

/// Arguments of `footfall man`.
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Write footfall.1 and a page for each command, such as footfall-replay.1, into this folder, which is
    /// made where it does not exist; else the page of footfall is printed
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
}

impl ManArguments {
    pub(super) fn run(&self) -> Result<(), Error> {
        let mut all = Arguments::command().name(NAME);
        all.build();
        let Some(directory) = &self.out else {
            let page = page(all).map_err(Error::Print)?;
            return print_text(&page).map_err(Error::Print);
        };
        create_directory(directory)?;
        let commands = all.get_subcommands().cloned();
        let commands: Vec<_> = commands
            .filter(|command| command.get_name() != "help")
            .collect();
        let mut all = [vec![all], commands].concat().into_iter();
        all.try_for_each(|command| write_page(directory, command))
    }
}

fn write_page(directory: &Path, command: Command) -> Result<(), Error> {
    let name = command.get_display_name().unwrap_or(NAME);
    let path = directory.join(format!("{name}.1"));
    write_file(&path, |to| to.write_all(page(command)?.as_bytes()))?;
    Ok(())
}

fn page(command: Command) -> io::Result<String> {
    let mut page = Vec::new();
    Man::new(command).render(&mut page)?;
    Ok(String::from_utf8_lossy(&page).into_owned())
}
