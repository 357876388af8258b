//! Data of a figure, collected sample by sample.
//!
//! Millions of samples are reduced to a few hundred pixel columns without losing peaks: each column keeps its first,
//! lowest, highest and last value in order of arrival. A line through them covers the same pixels as a line through all
//! values.

use std::ops::Range;

use estimator_core::{ContactEstimate, Decision, Load, Phase};
use replay::events::{ContactEvent, EventKind};
use samples::{Label, RecordedSample};

/// Collects the series of one foot; memory depends on the width of the figure only.
pub struct Collector {
    width: Width,
    load: Polyline,
    /// Tangential, vertical and total.
    probabilities: [Polyline; 3],
    phases: IntervalCollector<Phase>,
    decisions: IntervalCollector<Decision>,
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
    /// Decisions over time.
    pub(super) decisions: Vec<(Range<f64>, Decision)>,
    /// Labels over time; `None` without labels.
    pub(super) labels: Option<Vec<(Range<f64>, Option<Label>)>>,
}

/// A row of a picture: a line over time.
pub(super) struct Line<'a> {
    pub(super) kind: LineKind,
    pub(super) name: &'a str,
    pub(super) trace: &'a Trace,
    /// Lowest and highest value.
    pub(super) range: Range<f64>,
}

/// Quantity of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LineKind {
    Load,
    Tangential,
    Vertical,
    Total,
}

impl Series {
    /// Returns the lines of a foot, from the top down.
    pub(super) fn lines<'a>(&'a self, load_title: &'a str) -> Vec<Line<'a>> {
        let load = self.load.iter().map(|(trace, range)| Line {
            kind: LineKind::Load,
            name: load_title,
            trace,
            range: range.clone(),
        });
        let shown = [
            (LineKind::Tangential, "P tangential"),
            (LineKind::Vertical, "P vertical"),
            (LineKind::Total, "P stable"),
        ];
        let shown = shown.into_iter().zip(&self.probabilities);
        let shown = shown.map(|((kind, name), trace)| Line { kind, name, trace, range: 0.0..1.0 });
        load.chain(shown).collect()
    }

    /// Returns the names of the rows below the lines, from the top down. They have no values, but blocks and marks.
    pub(super) fn tracks(&self) -> Vec<&'static str> {
        let label = self.labels.as_ref().map(|_| LABEL_TRACK);
        [Some(DECISION_TRACK), label, Some(EVENT_TRACK)].into_iter().flatten().collect()
    }
}

/// Name of the row with the decision.
pub(super) const DECISION_TRACK: &str = "decision";

/// Name of the row with the labels.
pub(super) const LABEL_TRACK: &str = "label";

/// Name of the row with slips, touch-downs and lift-offs.
pub(super) const EVENT_TRACK: &str = "events";

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
            decisions: IntervalCollector::new(width.clone()),
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
        self.decisions.add(time, estimate.decision);
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
            decisions: self.decisions.finish(),
            labels: self.is_labelled.then(|| self.labels.finish()),
        }
    }
}

/// Slips, touch-downs and lift-offs of a figure: at most one of each in a pixel column.
pub(super) struct EventCollector {
    width: Width,
    /// Slips that overlap or are in one column are one block.
    pub(super) slips: Vec<Range<f64>>,
    /// Times of touch-downs, s.
    pub(super) touch_downs: Vec<f64>,
    /// Times of lift-offs, s.
    pub(super) lift_offs: Vec<f64>,
}

impl EventCollector {
    pub(super) const fn new(width: Width) -> Self {
        Self { width, slips: Vec::new(), touch_downs: Vec::new(), lift_offs: Vec::new() }
    }

    /// Adds the next event, if the figure shows its kind.
    pub(super) fn add(&mut self, event: &ContactEvent) {
        let seconds = |micros: u64| micros as f64 / 1.0e6;
        let time = seconds(event.time.as_micros());
        let marks = match event.kind {
            EventKind::SlipStart => {
                let end = event.duration_us.map_or(self.width.span.end, |us| time + seconds(us));
                let column =
                    (self.width.span.end - self.width.span.start) / f64::from(self.width.columns);
                match self.slips.last_mut() {
                    Some(last) if time < last.end + column => last.end = last.end.max(end),
                    _ => self.slips.push(time..end),
                }
                return;
            }
            EventKind::TouchDown => &mut self.touch_downs,
            EventKind::LiftOff => &mut self.lift_offs,
            _ => return,
        };
        let column_of = |time: f64| self.width.column_of(time);
        if marks.last().is_none_or(|last| column_of(*last) != column_of(time)) {
            marks.push(time);
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
