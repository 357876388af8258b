//! Picture of a foot, drawn during the estimation, with a progress bar.

use analysis::replay::foot::{self, Observer};
use analysis::replay::span::Span;
use estimator_core::ContactEstimate;
use indicatif::ProgressBar;
use recordings::events::Event;
use recordings::input::Stored;
use recordings::recording::RecordedSample;

use crate::plot::page::PageFoot;
use crate::plot::{self, Figure};
use crate::targets::Drawing;

/// Picture of a foot.
pub enum Picture {
    /// A figure of its own.
    Figure(Figure),
    /// Its part of a page.
    Page(PageFoot),
}

impl Picture {
    /// Creates the picture for the part `span` of a foot, without samples.
    #[must_use]
    pub fn new(drawing: Drawing, stored: &Stored, span: Span) -> Self {
        let name = foot::name(stored);
        let about = &stored.about;
        let (from_s, to_s) = span.within(about.duration_us);
        let span = plot::span(from_s, to_s - from_s, about.sample_rate);
        match drawing {
            Drawing::Svg | Drawing::Png => {
                Self::Figure(Figure::new(&name, about.start_us, &about.load_title, span))
            }
            Drawing::Page => Self::Page(PageFoot::new(&name, about, span)),
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
    pub events: Option<Vec<Event>>,
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

    fn add_event(&mut self, event: &Event) {
        if let Some(events) = &mut self.events {
            events.push(*event);
        }
        if let Some(Picture::Page(page)) = &mut self.picture {
            page.add_event(event);
        }
    }
}
