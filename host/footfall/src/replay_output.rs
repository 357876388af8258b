//! Picture of a foot, drawn during the estimation, with a progress bar; files of events and pictures; foot of a bag
//! that is copied.

use std::path::{Path, PathBuf};

use estimator_core::{ContactEstimate, Params};
use indicatif::ProgressBar;
use recordings::analysis::replay::estimate::{self, Observer, Replayed};
use recordings::analysis::replay::span::Span;
use recordings::events::{ContactEvent, HEADER};
use recordings::input::Stored;
use recordings::samples::recording::RecordedSample;

use crate::files::{OutputError, write_file};
use crate::plot::page::{self, PageFoot};
use crate::plot::{self, RecordingPlot};
use crate::targets::{self, Drawing};

/// Picture of a foot.
pub enum Picture {
    /// A figure of its own.
    Figure(RecordingPlot),
    /// Its part of a page.
    Page(PageFoot),
}

impl Picture {
    /// Creates the picture for the part `span` of a foot, without samples.
    #[must_use]
    pub fn new(drawing: Drawing, stored: &Stored, span: Span) -> Self {
        let name = estimate::name(stored);
        let about = &stored.about;
        let (from_s, to_s) = span.within(about.duration_us);
        let span = plot::span(from_s, to_s - from_s, about.sample_rate);
        match drawing {
            Drawing::Page => Self::Page(PageFoot::new(&name, about, span)),
            Drawing::Svg => {
                let (start_us, load) = (about.start_us, &about.load_title);
                Self::Figure(RecordingPlot::new(&name, start_us, load, span))
            }
        }
    }
}

/// Observer of a foot for the progress bar and its picture.
pub struct Watched {
    /// Progress bar.
    pub bar: ProgressBar,
    /// Picture of the foot, if drawn.
    pub picture: Option<Picture>,
    /// Events of the foot, if kept.
    pub events: Option<Vec<ContactEvent>>,
}

impl Observer for Watched {
    fn estimated(&mut self) {
        self.bar.inc(1);
    }

    fn add(&mut self, sample: &RecordedSample, estimate: &ContactEstimate) {
        match &mut self.picture {
            Some(Picture::Figure(figure)) => figure.add(sample, estimate),
            Some(Picture::Page(page)) => page.add(sample, estimate),
            None => {}
        }
    }

    fn add_event(&mut self, event: &ContactEvent) {
        if let Some(events) = &mut self.events {
            events.push(*event);
        }
        if let Some(Picture::Page(page)) = &mut self.picture {
            page.add_event(event);
        }
    }
}

/// A foot whose contacts go into a copy of its bag.
pub struct CopiedFoot {
    /// Name of the foot, in the topics of its contacts.
    pub name: String,
    /// Its place in messages of all feet, if its names have one.
    pub place: Option<usize>,
    /// Its samples.
    pub stored: Stored,
    /// Parameters of its estimate.
    pub params: Params,
    /// Part of the recording whose contacts are written.
    pub span: Span,
    /// Events in that part.
    pub events: Vec<ContactEvent>,
}

/// A foot with its estimates.
pub struct ReplayedFoot {
    /// Results of the foot.
    pub foot: Replayed,
    /// Picture of the foot, if drawn.
    pub picture: Option<Picture>,
}

/// Writes the events and the pictures of all feet, which tables name where there are `several`, and returns the paths.
///
/// # Errors
/// A file cannot be written.
pub fn write_shown(
    events: Option<&Path>,
    pictures: Option<&Path>,
    feet: &mut [ReplayedFoot],
    several: bool,
) -> Result<Vec<PathBuf>, OutputError> {
    let mut written = Vec::new();
    if let Some(path) = events {
        write_file(path, |to| {
            let foot = if several { "foot," } else { "" };
            writeln!(to, "{foot}{HEADER}")?;
            let mut parts = feet.iter_mut().filter_map(|foot| foot.foot.events.as_mut());
            parts.try_for_each(|part| part.write(to))
        })?;
        written.push(path.to_owned());
    }
    if let Some(path) = pictures {
        written.extend(write_pictures(path, feet)?);
    }
    Ok(written)
}

/// Writes the page of all feet or the figure of each, and returns the paths.
fn write_pictures(path: &Path, feet: &mut [ReplayedFoot]) -> Result<Vec<PathBuf>, OutputError> {
    let one = feet.len() == 1;
    let mut page = Vec::new();
    let mut written = Vec::new();
    for ReplayedFoot { foot, picture } in feet {
        match picture.take() {
            None => {}
            Some(Picture::Page(foot)) => page.push(foot),
            Some(Picture::Figure(figure)) => {
                let path = match one {
                    true => path.to_owned(),
                    false => targets::with_foot(path, &foot.summary.recording),
                };
                // Foot names may differ only in characters that file names cannot hold.
                let path = targets::unlike(path, &written);
                write_file(&path, |to| to.write_all(figure.svg()?.as_bytes()))?;
                written.push(path);
            }
        }
    }
    if !page.is_empty() {
        write_file(path, |to| page::write(page, to))?;
        written.push(path.to_owned());
    }
    Ok(written)
}
