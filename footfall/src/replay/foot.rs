//! One foot: its samples through the estimator, and all that is made of them.

use std::io;

use estimator_core::{ContactEstimate, Learnt, Params, ParamsError};
use recordings::events::{Event, Events};
use recordings::input::Stored;
use recordings::plausible::{Check, Finding};
use recordings::recording::RecordedSample;
use recordings::replay::Replay;
use thiserror::Error;

use super::estimates::{Estimates, Layout};
use super::part::Part;
use super::span::Span;
use crate::plot::page::PageFoot;
use crate::plot::{self, Figure};
use crate::summary::{Summary, Tally};
use crate::targets::Drawing;

/// What is made of a foot beside its summary.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wanted {
    /// The part of the recording that it is made of.
    pub span: Span,
    /// Whether there is a table, and whether it names the foot.
    pub table: Table,
    /// How the table is laid out.
    pub layout: Layout,
    /// The same of the table of events.
    pub events: Table,
    /// The picture, where there is one.
    pub drawing: Option<Drawing>,
}

/// A table of estimates or events.
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

/// The picture of a foot.
pub enum Picture {
    /// One of its own.
    Figure(Figure),
    /// Its share of a page.
    Page(PageFoot),
}

impl Picture {
    fn add(&mut self, sample: &RecordedSample, estimate: &ContactEstimate) {
        match self {
            Self::Figure(figure) => figure.add(sample, estimate),
            Self::Page(page) => page.add(sample, estimate),
        }
    }
}

/// What was made of a foot.
pub struct Replayed {
    /// What it comes to.
    pub summary: Summary,
    /// What is not plausible about it.
    pub findings: Vec<Finding>,
    /// Its rows of the table.
    pub table: Option<Estimates>,
    /// Its events.
    pub events: Option<Part>,
    /// Its picture.
    pub picture: Option<Picture>,
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
    let part = |table| match table {
        Table::None => None,
        Table::OneFoot => Some(Part::new(None, about.start_us)),
        Table::SeveralFeet => Some(Part::new(Some(name.clone()), about.start_us)),
    };
    let mut table = match wanted.table {
        Table::None => None,
        Table::OneFoot => Some(Estimates::new(wanted.layout, None, about.start_us)?),
        Table::SeveralFeet => {
            let foot = Some(name.clone());
            Some(Estimates::new(wanted.layout, foot, about.start_us)?)
        }
    };
    let mut found = Found {
        span: wanted.span,
        table: part(wanted.events),
        picture: wanted.drawing.map(|drawing| {
            let span = plot::span(from_s, to_s - from_s, about.sample_rate);
            match drawing {
                Drawing::Svg | Drawing::Png => {
                    Picture::Figure(Figure::new(&name, about.start_us, &about.load_title, span))
                }
                Drawing::Page => Picture::Page(PageFoot::new(&name, &about, span)),
            }
        }),
    };
    let mut events = Events::default();
    for sample in stored.samples()? {
        let sample = sample?;
        if wanted.span.is_before(sample.imu.timestamp) {
            break;
        }
        let estimate = replay.update(&sample);
        check.add(&sample);
        check.add_estimate(&sample, &estimate);
        events.add(&estimate);
        while let Some(event) = events.pop() {
            found.add(&event)?;
        }
        if wanted.span.contains(sample.imu.timestamp) {
            tally.add(&sample, &estimate);
            if let Some(table) = &mut table {
                table.add(&estimate)?;
            }
            if let Some(picture) = &mut found.picture {
                picture.add(&sample, &estimate);
            }
        }
        after_each();
    }
    events.finish().try_for_each(|event| found.add(&event))?;
    Ok(Replayed {
        summary: tally.finish(),
        findings: check.findings(),
        table,
        events: found.table,
        picture: found.picture,
        learnt: replay.finish(),
    })
}

/// Where events go.
struct Found {
    span: Span,
    table: Option<Part>,
    picture: Option<Picture>,
}

impl Found {
    /// Takes in an event, if it is in the part that is asked for.
    fn add(&mut self, event: &Event) -> io::Result<()> {
        if !self.span.contains(event.time) {
            return Ok(());
        }
        if let Some(Picture::Page(page)) = &mut self.picture {
            page.add_event(event);
        }
        match &mut self.table {
            Some(table) => table.add_event(event),
            None => Ok(()),
        }
    }
}
