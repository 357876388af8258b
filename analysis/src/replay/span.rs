//! `--from` and `--to`: the part of a recording that is asked for.

use estimator_core::Timestamp;

/// A stretch of a recording, counted from its first sample. The estimator sees what comes before
/// it all the same: an estimate depends on the past.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    from_us: u64,
    to_us: u64,
}

impl Default for Span {
    fn default() -> Self {
        Self {
            from_us: 0,
            to_us: u64::MAX,
        }
    }
}

impl Span {
    /// From and to in s; the whole recording where one is `None`.
    #[must_use]
    pub fn new(from_s: Option<f64>, to_s: Option<f64>) -> Self {
        let whole = Self::default();
        // Casts saturate.
        let micros = |seconds: f64| (seconds * 1.0e6).round() as u64;
        Self {
            from_us: from_s.map_or(whole.from_us, micros),
            to_us: to_s.map_or(whole.to_us, micros),
        }
    }

    /// Whether it is over before it begins.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.from_us >= self.to_us
    }

    /// Whether a sample of this time is in it: from its start on, up to but not including its end.
    #[must_use]
    pub const fn contains(self, time: Timestamp) -> bool {
        self.from_us <= time.as_micros() && time.as_micros() < self.to_us
    }

    /// Whether a sample of this time comes after it.
    #[must_use]
    pub const fn is_before(self, time: Timestamp) -> bool {
        self.to_us <= time.as_micros()
    }

    /// What is in it of a recording of this duration, as the first and the last time, s.
    #[must_use]
    pub fn within(self, duration_us: u64) -> (f64, f64) {
        let seconds = |micros: u64| micros.min(duration_us) as f64 / 1.0e6;
        (seconds(self.from_us), seconds(self.to_us))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_span_holds_its_start_and_not_its_end() {
        let span = Span::new(Some(0.5), Some(1.0));
        let holds = |micros| span.contains(Timestamp::from_micros(micros));
        assert_eq!(
            [499_999, 500_000, 999_999, 1_000_000].map(holds),
            [false, true, true, false]
        );
        assert!(span.is_before(Timestamp::from_micros(1_000_000)));
        assert_eq!(span.within(800_000), (0.5, 0.8));
        assert!(Span::new(Some(2.0), Some(2.0)).is_empty());
        assert!(Span::default().contains(Timestamp::from_micros(0)));
    }
}
