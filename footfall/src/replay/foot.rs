//! One foot: its samples through the estimator, and all that is made of them.

use std::io;

use estimator_core::{Learnt, Params, ParamsError};
use recordings::input::Stored;
use recordings::plausible::{Check, Finding};
use recordings::replay::Replay;
use thiserror::Error;

use super::part::Part;
use super::span::Span;
use crate::plot::{self, Figure};
use crate::summary::{Summary, Tally};

/// What is made of a foot beside its summary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wanted {
    /// The part of the recording that it is made of.
    pub span: Span,
    /// Whether there is a table, and whether it names the foot.
    pub table: Table,
    /// Whether there is a picture.
    pub figure: bool,
}

/// The table of estimates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Table {
    /// There is none.
    #[default]
    None,
    /// It is of one foot.
    OneFoot,
    /// It is of several and names them.
    SeveralFeet,
}

/// What was made of a foot.
pub struct Replayed {
    /// What it comes to.
    pub summary: Summary,
    /// What is not plausible about it.
    pub findings: Vec<Finding>,
    /// Its rows of the table.
    pub table: Option<Part>,
    /// Its picture.
    pub figure: Option<Figure>,
    /// What has been learnt about it.
    pub learnt: Learnt,
}

/// Why a foot cannot be estimated.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// A parameter is out of its range.
    #[error("parameter {0}")]
    Params(#[from] ParamsError),
    /// Its samples or rows cannot be kept.
    #[error(
        "temporary files cannot be used in {}: {source}; the variable TMPDIR names another folder",
        std::env::temp_dir().display()
    )]
    Temporary {
        /// What the operating system says.
        #[from]
        source: io::Error,
    },
}

/// The name of a foot in tables and pictures: that of its file, and its own where it has one.
#[must_use]
pub fn name(stored: &Stored) -> String {
    let about = &stored.about;
    match &about.foot {
        Some(foot) => format!("{} {foot}", about.name),
        None => about.name.clone(),
    }
}

/// Estimates a foot sample by sample. `after_each` is called after each, such as to show progress.
///
/// # Errors
/// A parameter out of its range, or the temporary files cannot be used.
pub fn replay(
    stored: &mut Stored,
    params: &Params,
    wanted: &Wanted,
    mut after_each: impl FnMut(),
) -> Result<Replayed, ReplayError> {
    let name = name(stored);
    let about = stored.about.clone();
    let mut replay = Replay::new(about.sample_rate, about.gravity, params)?;
    let mut check = Check::new(about.sample_rate, about.gravity);
    let (from_s, to_s) = wanted.span.within(about.duration_us);
    let mut tally = Tally::new(&name, about.foot.as_deref(), about.sample_rate);
    let mut table = match wanted.table {
        Table::None => None,
        Table::OneFoot => Some(Part::new(None, about.start_us)),
        Table::SeveralFeet => Some(Part::new(Some(name.clone()), about.start_us)),
    };
    let mut figure = wanted.figure.then(|| {
        let span = plot::span(from_s, to_s - from_s, about.sample_rate);
        Figure::new(&name, about.start_us, &about.load_title, span)
    });
    for sample in stored.samples()? {
        let sample = sample?;
        if wanted.span.is_before(sample.imu.timestamp) {
            break;
        }
        let estimate = replay.update(&sample);
        check.add(&sample);
        check.add_estimate(&sample, &estimate);
        if wanted.span.contains(sample.imu.timestamp) {
            tally.add(&sample, &estimate);
            if let Some(table) = &mut table {
                table.add(&estimate)?;
            }
            if let Some(figure) = &mut figure {
                figure.add(&sample, &estimate);
            }
        }
        after_each();
    }
    Ok(Replayed {
        summary: tally.finish(),
        findings: check.findings(),
        table,
        figure,
        learnt: replay.finish(),
    })
}
