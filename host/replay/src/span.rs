//! Part of a recording.

use estimator_core::Timestamp;

/// Time span of a recording, relative to its first sample. The estimator also processes the samples before the span,
/// because an estimate depends on the past.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    from_us: u64,
    to_us: u64,
}

impl Default for Span {
    fn default() -> Self {
        Self { from_us: 0, to_us: u64::MAX }
    }
}

impl Span {
    /// Creates a span from start and end in s; `None` extends it to that end of the recording.
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

    /// Returns whether the span contains no time.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.from_us >= self.to_us
    }

    /// Returns whether a time is in the span, including its start and excluding its end.
    #[must_use]
    pub const fn contains(self, time: Timestamp) -> bool {
        self.from_us <= time.as_micros() && time.as_micros() < self.to_us
    }

    /// Returns whether a time is after the span.
    #[must_use]
    pub const fn is_before(self, time: Timestamp) -> bool {
        self.to_us <= time.as_micros()
    }

    /// Returns the first and last time of the span in a recording of this duration, s.
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
    fn span_includes_its_start_and_excludes_its_end() {
        let span = Span::new(Some(0.5), Some(1.0));
        let holds = |micros| span.contains(Timestamp::from_micros(micros));
        assert_eq!([499_999, 500_000, 999_999, 1_000_000].map(holds), [false, true, true, false]);
        assert!(span.is_before(Timestamp::from_micros(1_000_000)));
        assert_eq!(span.within(800_000), (0.5, 0.8));
        assert!(Span::new(Some(2.0), Some(2.0)).is_empty());
        assert!(Span::default().contains(Timestamp::from_micros(0)));
    }
}
