//! Millions of samples on a few hundred pixel columns, without losing a peak.
//!
//! A column keeps its first, lowest, highest and last value in the order in which they came:
//! a line through them covers the same pixels as a line through all of them.

use std::ops::Range;

/// A line, in pieces where values are missing: (time in s, value).
pub(super) type Trace = Vec<Vec<(f64, f64)>>;

/// The points that a line over `columns` pixel columns needs, from values in order of time.
/// A missing value ends a piece.
pub(super) fn polylines(
    values: impl Iterator<Item = (f64, Option<f64>)>,
    span: &Range<f64>,
    columns: u32,
) -> Trace {
    let mut pieces = Trace::new();
    let mut piece = Vec::new();
    let mut bucket: Option<Bucket> = None;
    for (time, value) in values {
        let column = column_of(time, span, columns);
        if let Some(full) = bucket.take_if(|b| value.is_none() || b.column != column) {
            full.append_to(&mut piece);
        }
        match value {
            Some(value) => match &mut bucket {
                Some(bucket) => bucket.add((time, value)),
                None => bucket = Some(Bucket::new(column, (time, value))),
            },
            None if piece.is_empty() => {}
            None => pieces.push(std::mem::take(&mut piece)),
        }
    }
    if let Some(full) = bucket {
        full.append_to(&mut piece);
    }
    if !piece.is_empty() {
        pieces.push(piece);
    }
    pieces
}

/// The stretches of time in which something holds, to whole pixel columns: a column counts where
/// it holds for any of its samples.
pub(super) fn stretches(
    values: impl Iterator<Item = (f64, bool)>,
    span: &Range<f64>,
    columns: u32,
) -> Vec<Range<f64>> {
    let mut found: Vec<Range<u32>> = Vec::new();
    for (time, _) in values.filter(|(_, holds)| *holds) {
        let column = column_of(time, span, columns);
        match found.last_mut() {
            Some(last) if column <= last.end => last.end = last.end.max(column + 1),
            _ => found.push(column..column + 1),
        }
    }
    let width = (span.end - span.start) / f64::from(columns);
    let time_of = |column: u32| span.start + f64::from(column) * width;
    found
        .into_iter()
        .map(|run| time_of(run.start)..time_of(run.end))
        .collect()
}

fn column_of(time: f64, span: &Range<f64>, columns: u32) -> u32 {
    let along = (time - span.start) / (span.end - span.start);
    ((along * f64::from(columns)) as u32).min(columns - 1)
}

/// What is kept of one pixel column.
struct Bucket {
    column: u32,
    first: (f64, f64),
    lowest: (f64, f64),
    highest: (f64, f64),
    last: (f64, f64),
}

impl Bucket {
    fn new(column: u32, point: (f64, f64)) -> Self {
        Self {
            column,
            first: point,
            lowest: point,
            highest: point,
            last: point,
        }
    }

    fn add(&mut self, point: (f64, f64)) {
        if point.1 < self.lowest.1 {
            self.lowest = point;
        }
        if point.1 > self.highest.1 {
            self.highest = point;
        }
        self.last = point;
    }

    fn append_to(self, piece: &mut Vec<(f64, f64)>) {
        let mut kept = [self.first, self.lowest, self.highest, self.last];
        kept.sort_by(|a, b| a.0.total_cmp(&b.0));
        for point in kept {
            if piece.last() != Some(&point) {
                piece.push(point);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_of_one_sample_among_a_million_survives() {
        let values =
            (0..1_000_000).map(|k| (f64::from(k), Some(f64::from(u8::from(k == 777_777)))));
        let trace = polylines(values, &(0.0..1e6), 100);
        assert_eq!(trace.len(), 1);
        assert!(trace[0].len() <= 400);
        assert!(trace[0].contains(&(777_777.0, 1.0)));
    }

    #[test]
    fn few_samples_are_kept_as_they_are() {
        let points = [(0.0, 3.0), (1.0, 1.0), (2.0, 2.0)];
        let values = points.into_iter().map(|(t, v)| (t, Some(v)));
        assert_eq!(polylines(values, &(0.0..2.0), 100), [points]);
    }

    #[test]
    fn a_missing_value_breaks_the_line() {
        let values = [Some(1.0), None, None, Some(2.0), Some(3.0)];
        let timed = (0..).map(f64::from).zip(values);
        assert_eq!(
            polylines(timed, &(0.0..4.0), 100),
            [vec![(0.0, 1.0)], vec![(3.0, 2.0), (4.0, 3.0)]]
        );
    }

    #[test]
    fn a_stretch_covers_every_column_with_a_sample_in_it() {
        let holds = [false, true, true, false, false, true];
        let timed = (0..).map(f64::from).zip(holds);
        assert_eq!(stretches(timed, &(0.0..6.0), 6), [1.0..3.0, 5.0..6.0]);
    }
}
