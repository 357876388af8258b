//! Messages on standard error: errors, warnings, and details with `--verbose`.
//!
//! Each message is one line written at once, so that messages of several threads do not mix. On a terminal it
//! begins with `error:` or `warning:`, in colour unless `NO_COLOR` is set; elsewhere with `footfall:`. With
//! `CLICOLOR_FORCE` any standard error counts as a terminal. If standard error is closed, the command continues.

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicU8, Ordering};

use anstream::{AutoStream, ColorChoice};
use anstyle::{AnsiColor, Style};

/// Amount of output on standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verbosity {
    /// Errors only.
    Quiet,
    /// Errors and warnings.
    #[default]
    Normal,
    /// Errors, warnings and details.
    Verbose,
}

static VERBOSITY: AtomicU8 = AtomicU8::new(Verbosity::Normal as u8);

/// Sets the verbosity for all further messages.
pub fn set_verbosity(verbosity: Verbosity) {
    VERBOSITY.store(verbosity as u8, Ordering::Relaxed);
}

/// Prints the error that ended a command.
pub fn error(message: impl Display) {
    print(Kind::Error, &message);
}

/// Prints a warning about omitted, reinterpreted or suspicious data.
pub fn warn(message: impl Display) {
    if is_shown(Verbosity::Normal) {
        print(Kind::Warning, &message);
    }
}

/// Prints a detail, shown with `--verbose` only.
pub fn detail(message: impl Display) {
    if is_shown(Verbosity::Verbose) {
        print(Kind::Detail, &message);
    }
}

/// Prints a report unchanged on standard error, for use when standard output holds a result.
pub fn aside(report: impl Display) {
    if is_shown(Verbosity::Normal) {
        let line = format!("{report}\n");
        let _ = io::stderr().lock().write_all(line.as_bytes());
    }
}

/// Returns whether messages are shown that need at least this verbosity.
fn is_shown(from: Verbosity) -> bool {
    VERBOSITY.load(Ordering::Relaxed) >= from as u8
}

#[derive(Clone, Copy)]
enum Kind {
    Error,
    Warning,
    Detail,
}

impl Kind {
    /// Returns the prefix of a line on a terminal, and its style.
    const fn label(self) -> (&'static str, Style) {
        match self {
            Self::Error => ("error:", AnsiColor::Red.on_default().bold()),
            Self::Warning => ("warning:", AnsiColor::Yellow.on_default().bold()),
            Self::Detail => ("note:", AnsiColor::Cyan.on_default()),
        }
    }
}

/// Appearance of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Look {
    Plain,
    Terminal,
    Coloured,
}

fn print(kind: Kind, message: &dyn Display) {
    let stderr = io::stderr();
    let look = match AutoStream::choice(&stderr) {
        ColorChoice::Never if stderr.is_terminal() => Look::Terminal,
        ColorChoice::Never => Look::Plain,
        _ => Look::Coloured,
    };
    let line = line(kind, look, message);
    let _ = stderr.lock().write_all(line.as_bytes());
}

fn line(kind: Kind, look: Look, message: &dyn Display) -> String {
    let (label, style) = kind.label();
    match look {
        Look::Plain => format!("footfall: {message}\n"),
        Look::Terminal => format!("{label} {message}\n"),
        Look::Coloured => format!("{style}{label}{style:#} {message}\n"),
    }
}
