//! Data of a figure, collected sample by sample.

use std::ops::Range;

use estimator_core::{ContactEstimate, Load, Phase};
use recordings::samples::recording::{Label, RecordedSample};

use super::decimate::{Polyline, Stretching, Trace, Width};

/// Collects the series of one foot; memory depends on the width of the figure only.
pub struct Collector {
    width: Width,
    load: Polyline,
    /// Tangential, vertical and total.
    probabilities: [Polyline; 3],
    phases: Stretching<Phase>,
    labels: Stretching<Option<Label>>,
    load_range: Option<Range<f64>>,
    has_state: bool,
    is_labelled: bool,
}

/// The series of one foot.
pub(super) struct Series {
    pub(super) span: Range<f64>,
    /// Load with its minimum and maximum; `None` if unknown.
    pub(super) load: Option<(Trace, Range<f64>)>,
    /// Tangential, vertical and total.
    pub(super) probabilities: [Trace; 3],
    /// State seen by the estimator; empty without any load, when the state is always unknown.
    pub(super) phases: Vec<(Range<f64>, Phase)>,
    /// Labels over time; `None` without labels.
    pub(super) labels: Option<Vec<(Range<f64>, Option<Label>)>>,
}

impl Collector {
    /// Creates a collector for a figure of this width; `shade` is the width of a shading column, in pixel columns.
    #[must_use]
    pub fn new(width: Width, shade: u32) -> Self {
        let line = || Polyline::new(width.clone());
        let shades = Width { columns: width.columns / shade, ..width.clone() };
        Self {
            load: line(),
            probabilities: [line(), line(), line()],
            phases: Stretching::new(shades),
            labels: Stretching::new(width.clone()),
            load_range: None,
            has_state: false,
            is_labelled: false,
            width,
        }
    }

    /// Adds a sample with its estimate.
    pub fn add(&mut self, sample: &RecordedSample, estimate: &ContactEstimate) {
        let time = sample.time_s();
        let load = sample.load.map(|Load(load)| f64::from(load));
        let load = load.filter(|load| load.is_finite());
        if let Some(load) = load {
            let range = self.load_range.get_or_insert(load..load);
            *range = range.start.min(load)..range.end.max(load);
        }
        self.load.add(time, load);
        let p = estimate.probabilities;
        let values = [p.tangential, p.vertical, p.stable];
        for (line, value) in self.probabilities.iter_mut().zip(values) {
            line.add(time, Some(value.into()));
        }
        self.phases.add(time, estimate.phase);
        self.has_state |= estimate.phase != Phase::Unknown;
        self.labels.add(time, sample.label);
        self.is_labelled |= sample.label.is_some();
    }

    pub(super) fn finish(self) -> Series {
        let load = self.load.finish();
        Series {
            span: self.width.span,
            phases: match self.has_state || self.load_range.is_some() {
                true => self.phases.finish(),
                false => Vec::new(),
            },
            load: self.load_range.map(|range| (load, range)),
            probabilities: self.probabilities.map(Polyline::finish),
            labels: self.is_labelled.then(|| self.labels.finish()),
        }
    }
}
