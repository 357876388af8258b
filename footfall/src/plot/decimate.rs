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

/// The stretches of time in which something stays the same, to whole columns: a column shows what
/// most of its samples are, so that areas are true and nothing is narrower than a column. A column
/// without samples shows what the one before does.
pub(super) fn stretches<T: Copy + PartialEq>(
    values: impl Iterator<Item = (f64, T)>,
    span: &Range<f64>,
    columns: u32,
) -> Vec<(Range<f64>, T)> {
    let mut winners: Vec<(u32, T)> = Vec::new();
    let mut votes: Vec<(T, usize)> = Vec::new();
    let mut current = 0;
    let mut close = |column: u32, votes: &mut Vec<(T, usize)>| {
        if let Some((winner, _)) = votes.drain(..).max_by_key(|(_, count)| *count) {
            winners.push((column, winner));
        }
    };
    for (time, value) in values {
        let column = column_of(time, span, columns);
        if column != current {
            close(current, &mut votes);
            current = column;
        }
        match votes.iter_mut().find(|(candidate, _)| *candidate == value) {
            Some((_, count)) => *count += 1,
            None => votes.push((value, 1)),
        }
    }
    close(current, &mut votes);

    let width = (span.end - span.start) / f64::from(columns);
    let time_of = |column: u32| span.start + f64::from(column) * width;
    let runs: Vec<_> = winners
        .chunk_by(|a, b| a.1 == b.1)
        .map(|run| run[0])
        .collect();
    let ends = runs
        .iter()
        .skip(1)
        .map(|(start, _)| *start)
        .chain([columns]);
    runs.iter()
        .zip(ends)
        .map(|((start, value), end)| (time_of(*start)..time_of(end), *value))
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
    fn a_column_shows_what_most_of_its_samples_are() {
        let values = ["a", "a", "a", "a", "b", "a", "b", "a", "b", "b", "b", "b"];
        let timed = (0..).map(f64::from).zip(values);
        // Columns of three samples: aaa, aba, bab, bbb.
        assert_eq!(
            stretches(timed, &(0.0..12.0), 4),
            [(0.0..6.0, "a"), (6.0..12.0, "b")]
        );
    }

    #[test]
    fn a_column_without_samples_shows_what_the_one_before_does() {
        let timed = [(0.0, 'a'), (5.0, 'b'), (9.0, 'c')];
        assert_eq!(
            stretches(timed.into_iter(), &(0.0..10.0), 10),
            [(0.0..5.0, 'a'), (5.0..9.0, 'b'), (9.0..10.0, 'c')]
        );
    }
}
