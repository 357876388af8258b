//! What is said on standard error: errors, warnings, and with `--verbose` what was recognised.
//!
//! Each message is one line that is written at once, so that those of several threads do not mix. On a
//! terminal it begins with `error:` or `warning:`, in colour unless `NO_COLOR` is set; elsewhere with
//! `footfall:`. `CLICOLOR_FORCE` makes any standard error a terminal. Where it is closed, the command
//! goes on.

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicU8, Ordering};

use anstream::{AutoStream, ColorChoice};
use anstyle::{AnsiColor, Style};

/// How much is said.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors only.
    Quiet,
    /// Errors and warnings.
    #[default]
    Normal,
    /// What was recognised, too.
    Verbose,
}

static VERBOSITY: AtomicU8 = AtomicU8::new(Verbosity::Normal as u8);

/// Sets how much is said from now on.
pub fn set_verbosity(verbosity: Verbosity) {
    VERBOSITY.store(verbosity as u8, Ordering::Relaxed);
}

/// Whether what was recognised is said.
#[must_use]
pub fn is_verbose() -> bool {
    is_said(Verbosity::Verbose)
}

/// Says why a command has failed.
pub fn error(message: impl Display) {
    say(Kind::Error, &message);
}

/// Says what was left out, reinterpreted or looks wrong.
pub fn warn(message: impl Display) {
    if is_said(Verbosity::Normal) {
        say(Kind::Warning, &message);
    }
}

/// Says what was recognised, which hardly anyone wants to know.
pub fn detail(message: impl Display) {
    if is_verbose() {
        say(Kind::Detail, &message);
    }
}

/// Writes a report to standard error as it is, where standard output has something else.
pub fn aside(report: impl Display) {
    if is_said(Verbosity::Normal) {
        let _ = io::stderr()
            .lock()
            .write_all(format!("{report}\n").as_bytes());
    }
}

fn is_said(from: Verbosity) -> bool {
    VERBOSITY.load(Ordering::Relaxed) >= from as u8
}

#[derive(Clone, Copy)]
enum Kind {
    Error,
    Warning,
    Detail,
}

impl Kind {
    /// What a line begins with on a terminal, and how that looks.
    const fn label(self) -> (&'static str, Style) {
        match self {
            Self::Error => ("error:", AnsiColor::Red.on_default().bold()),
            Self::Warning => ("warning:", AnsiColor::Yellow.on_default().bold()),
            Self::Detail => ("note:", AnsiColor::Cyan.on_default()),
        }
    }
}

/// What a line looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Look {
    Plain,
    Terminal,
    Coloured,
}

fn say(kind: Kind, message: &dyn Display) {
    let stderr = io::stderr();
    let look = match AutoStream::choice(&stderr) {
        ColorChoice::Never if stderr.is_terminal() => Look::Terminal,
        ColorChoice::Never => Look::Plain,
        _ => Look::Coloured,
    };
    let _ = stderr
        .lock()
        .write_all(line(kind, look, message).as_bytes());
}

fn line(kind: Kind, look: Look, message: &dyn Display) -> String {
    let (label, style) = kind.label();
    match look {
        Look::Plain => format!("footfall: {message}\n"),
        Look::Terminal => format!("{label} {message}\n"),
        Look::Coloured => format!("{style}{label}{style:#} {message}\n"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_names_the_program_where_no_person_reads_it_and_else_what_it_is() {
        assert_eq!(
            line(Kind::Warning, Look::Plain, &"x.csv: no time"),
            "footfall: x.csv: no time\n"
        );
        assert_eq!(
            line(Kind::Error, Look::Terminal, &"no file"),
            "error: no file\n"
        );
        assert_eq!(
            line(Kind::Error, Look::Coloured, &"no file"),
            "\u{1b}[1m\u{1b}[31merror:\u{1b}[0m no file\n"
        );
    }
}
