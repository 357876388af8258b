//! Pictures of replayed feet, for `footfall replay --plot`: one page of all feet, or a figure of each.

use std::path::{Path, PathBuf};

use estimator_core::ContactEstimate;
use replay::Span;
use replay::events::ContactEvent;
use samples::RecordedSample;
use stored::About;

use crate::files::{Drawing, Existing, OutputError, path_of_foot, unused_path, write_file};
use crate::plot::page::{self, PageFoot};
use crate::plot::{self, RecordingPlot};

/// Picture of a foot.
pub(super) enum Picture {
    /// A figure of its own.
    Figure(RecordingPlot),
    /// The foot's part of a page.
    Page(PageFoot),
}

impl Picture {
    /// Creates an empty picture of the time span `span` of a foot's recording.
    pub(super) fn new(drawing: Drawing, about: &About, span: Span) -> Self {
        let (from_s, to_s) = span.within(about.duration_us);
        let span = plot::span(from_s, to_s - from_s, about.sample_rate);
        let name = about.title();
        match drawing {
            Drawing::Page => Self::Page(PageFoot::new(&name, about, span)),
            Drawing::Svg => {
                Self::Figure(RecordingPlot::new(&name, about.start_us, &about.load_title, span))
            }
        }
    }

    /// Adds the next sample with its estimate.
    pub(super) fn add(&mut self, sample: &RecordedSample, estimate: &ContactEstimate) {
        match self {
            Self::Figure(figure) => figure.add(sample, estimate),
            Self::Page(page) => page.add(sample, estimate),
        }
    }

    /// Adds the next event.
    pub(super) fn add_event(&mut self, event: &ContactEvent) {
        match self {
            Self::Figure(figure) => figure.add_event(event),
            Self::Page(page) => page.add_event(event),
        }
    }
}

/// Returns the path of each picture of these feet. A page of all feet, and the figure of an only foot, have the
/// path `path`. Otherwise the name of each foot is added.
pub(super) fn paths(path: &Path, feet: &[&str]) -> Vec<PathBuf> {
    if feet.len() == 1 || Drawing::of(path) == Drawing::Page {
        return vec![path.to_owned()];
    }
    let mut paths = Vec::new();
    for foot in feet {
        let path = path_of_foot(path, foot);
        // Foot names may differ only in characters that file names cannot hold.
        paths.push(unused_path(path, &paths));
    }
    paths
}

/// Writes the page of all feet, or the figure of each, to these [`paths`].
pub(super) fn write(
    paths: &[PathBuf],
    existing: Existing,
    pictures: impl Iterator<Item = Picture>,
) -> Result<(), OutputError> {
    let mut page = Vec::new();
    let mut figures = Vec::new();
    for picture in pictures {
        match picture {
            Picture::Page(foot) => page.push(foot),
            Picture::Figure(figure) => figures.push(figure),
        }
    }
    for (path, figure) in paths.iter().zip(figures) {
        write_file(path, existing, |to| to.write_all(figure.svg()?.as_bytes()))?;
    }
    match paths {
        [path] if !page.is_empty() => write_file(path, existing, |to| page::write(page, to)),
        _ => Ok(()),
    }
}
