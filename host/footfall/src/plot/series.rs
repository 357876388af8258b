//! Data of a figure, collected sample by sample.
//!
//! Millions of samples are reduced to a few hundred pixel columns without losing peaks: each column keeps its first,
//! lowest, highest and last value in order of arrival. A line through them covers the same pixels as a line through all
//! values.

use std::ops::Range;

use estimator_core::{ContactEstimate, Load, Phase};
use recordings::samples::{Label, RecordedSample};

/// Collects the series of one foot; memory depends on the width of the figure only.
pub struct Collector {
    width: Width,
    load: Polyline,
    /// Tangential, vertical and total.
    probabilities: [Polyline; 3],
    phases: IntervalCollector<Phase>,
    labels: IntervalCollector<Option<Label>>,
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
            phases: IntervalCollector::new(shades),
            labels: IntervalCollector::new(width.clone()),
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
            phases: if self.has_state || self.load_range.is_some() {
                self.phases.finish()
            } else {
                Vec::new()
            },
            load: self.load_range.map(|range| (load, range)),
            probabilities: self.probabilities.map(Polyline::finish),
            labels: self.is_labelled.then(|| self.labels.finish()),
        }
    }
}

/// A line as (time in s, value), split where values are missing.
pub(super) type Trace = Vec<Vec<(f64, f64)>>;

/// Time range of a picture, s, and its number of pixel columns.
#[derive(Clone, Debug, PartialEq)]
pub struct Width {
    /// Time from the left end to the right.
    pub span: Range<f64>,
    /// Number of pixel columns.
    pub columns: u32,
}

/// Points of a line, from values in order of time.
pub(super) struct Polyline {
    width: Width,
    pieces: Trace,
    piece: Vec<(f64, f64)>,
    bucket: Option<Bucket>,
}

impl Polyline {
    pub(super) const fn new(width: Width) -> Self {
        Self { width, pieces: Vec::new(), piece: Vec::new(), bucket: None }
    }

    /// Appends a value. A missing value ends the current piece.
    pub(super) fn add(&mut self, time: f64, value: Option<f64>) {
        let column = self.width.column_of(time);
        let is_full = |bucket: &mut Bucket| value.is_none() || bucket.column != column;
        if let Some(full) = self.bucket.take_if(is_full) {
            full.append_to(&mut self.piece);
        }
        match value {
            Some(value) => match &mut self.bucket {
                Some(bucket) => bucket.add((time, value)),
                None => self.bucket = Some(Bucket::new(column, (time, value))),
            },
            None if self.piece.is_empty() => {}
            None => self.pieces.push(std::mem::take(&mut self.piece)),
        }
    }

    pub(super) fn finish(mut self) -> Trace {
        if let Some(full) = self.bucket {
            full.append_to(&mut self.piece);
        }
        if !self.piece.is_empty() {
            self.pieces.push(self.piece);
        }
        self.pieces
    }
}

/// Intervals of constant value, rounded to whole columns. Each column takes the value of most of its samples, so
/// areas are true and no interval is narrower than a column. A column without samples repeats the previous one.
pub(super) struct IntervalCollector<T> {
    width: Width,
    winners: Vec<(u32, T)>,
    votes: Vec<(T, usize)>,
    column: u32,
}

impl<T: Copy + PartialEq> IntervalCollector<T> {
    pub(super) const fn new(width: Width) -> Self {
        Self { width, winners: Vec::new(), votes: Vec::new(), column: 0 }
    }

    /// Appends a value.
    pub(super) fn add(&mut self, time: f64, value: T) {
        let column = self.width.column_of(time);
        if column != self.column {
            self.close();
            self.column = column;
        }
        match self.votes.iter_mut().find(|(voted, _)| *voted == value) {
            Some((_, count)) => *count += 1,
            None => self.votes.push((value, 1)),
        }
    }

    /// Closes the current column.
    fn close(&mut self) {
        let winner = self.votes.drain(..).max_by_key(|(_, count)| *count);
        let last = self.winners.last().map(|(_, value)| *value);
        if let Some((winner, _)) = winner
            && last != Some(winner)
        {
            self.winners.push((self.column, winner));
        }
    }

    pub(super) fn finish(mut self) -> Vec<(Range<f64>, T)> {
        self.close();
        let Width { span, columns } = &self.width;
        let width = (span.end - span.start) / f64::from(*columns);
        let time_of = |column: u32| span.start + f64::from(column) * width;
        let starts = self.winners.iter().skip(1).map(|(start, _)| *start);
        let ends = starts.chain([*columns]);
        let runs = self.winners.iter().zip(ends);
        runs.map(|((start, value), end)| (time_of(*start)..time_of(end), *value)).collect()
    }
}

impl Width {
    fn column_of(&self, time: f64) -> u32 {
        let along = (time - self.span.start) / (self.span.end - self.span.start);
        ((along * f64::from(self.columns)) as u32).min(self.columns - 1)
    }
}

/// Values kept for one pixel column.
struct Bucket {
    column: u32,
    /// First, lowest, highest and last.
    kept: [(f64, f64); 4],
}

impl Bucket {
    fn new(column: u32, point: (f64, f64)) -> Self {
        let kept = [point; 4];
        Self { column, kept }
    }

    fn add(&mut self, point: (f64, f64)) {
        let [_, lowest, highest, last] = &mut self.kept;
        if point.1 < lowest.1 {
            *lowest = point;
        }
        if point.1 > highest.1 {
            *highest = point;
        }
        *last = point;
    }

    fn append_to(mut self, piece: &mut Vec<(f64, f64)>) {
        self.kept.sort_by(|a, b| a.0.total_cmp(&b.0));
        for point in self.kept {
            if piece.last() != Some(&point) {
                piece.push(point);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polylines(
        values: impl Iterator<Item = (f64, Option<f64>)>,
        span: &Range<f64>,
        columns: u32,
    ) -> Trace {
        let span = span.clone();
        let mut line = Polyline::new(Width { span, columns });
        for (time, value) in values {
            line.add(time, value);
        }
        line.finish()
    }

    fn intervals<T: Copy + PartialEq>(
        values: impl Iterator<Item = (f64, T)>,
        span: &Range<f64>,
        columns: u32,
    ) -> Vec<(Range<f64>, T)> {
        let span = span.clone();
        let mut collector = IntervalCollector::new(Width { span, columns });
        for (time, value) in values {
            collector.add(time, value);
        }
        collector.finish()
    }

    #[test]
    fn single_sample_peak_survives_decimation() {
        let values =
            (0..1_000_000).map(|k| (f64::from(k), Some(f64::from(u8::from(k == 777_777)))));
        let trace = polylines(values, &(0.0..1e6), 100);
        assert_eq!(trace.len(), 1);
        assert!(trace[0].len() <= 400);
        assert!(trace[0].contains(&(777_777.0, 1.0)));
    }

    #[test]
    fn few_samples_are_kept_unchanged() {
        let points = [(0.0, 3.0), (1.0, 1.0), (2.0, 2.0)];
        let values = points.into_iter().map(|(t, v)| (t, Some(v)));
        assert_eq!(polylines(values, &(0.0..2.0), 100), [points]);
    }

    #[test]
    fn missing_value_breaks_the_line() {
        let values = [Some(1.0), None, None, Some(2.0), Some(3.0)];
        let timed = (0..).map(f64::from).zip(values);
        assert_eq!(
            polylines(timed, &(0.0..4.0), 100),
            [vec![(0.0, 1.0)], vec![(3.0, 2.0), (4.0, 3.0)]]
        );
    }

    #[test]
    fn column_takes_the_majority_value() {
        let values = ["a", "a", "a", "a", "b", "a", "b", "a", "b", "b", "b", "b"];
        let timed = (0..).map(f64::from).zip(values);
        // Columns of three samples: aaa, aba, bab, bbb.
        assert_eq!(intervals(timed, &(0.0..12.0), 4), [(0.0..6.0, "a"), (6.0..12.0, "b")]);
    }

    #[test]
    fn empty_column_repeats_the_previous_one() {
        let timed = [(0.0, 'a'), (5.0, 'b'), (9.0, 'c')];
        assert_eq!(
            intervals(timed.into_iter(), &(0.0..10.0), 10),
            [(0.0..5.0, 'a'), (5.0..9.0, 'b'), (9.0..10.0, 'c')]
        );
    }
}
