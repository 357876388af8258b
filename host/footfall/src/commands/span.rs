//! The span of recordings that `--from` and `--to` choose, in `replay` and `convert`.

use replay::Span;
use stored::Stored;

use crate::error::Worded;

/// Returns the span from `--from` to `--to`, s on the recording's clock.
///
/// # Errors
/// The span ends before it begins.
pub(crate) fn span(from: Option<f64>, to: Option<f64>) -> Result<Span, SpanError> {
    let span = Span::new(from, to);
    if span.is_empty() {
        let [from, to] = [from, to].map(Option::unwrap_or_default);
        return Err(SpanError::Empty { from, to });
    }
    Ok(span)
}

/// Checks that `--from` is not beyond the end of the longest foot of a file.
///
/// # Errors
/// `--from` is beyond that end.
pub(crate) fn check_begin(file: &str, from: Option<f64>, feet: &[Stored]) -> Result<(), SpanError> {
    let durations_s = feet.iter().map(|foot| foot.about.duration_s());
    let duration = durations_s.fold(0.0, f64::max);
    if let Some(from) = from
        && from > duration
    {
        return Err(SpanError::BeyondTheEnd { file: file.to_owned(), from, duration });
    }
    Ok(())
}

/// Reason a span chooses nothing.
#[derive(Debug, thiserror::Error)]
pub(crate) enum SpanError {
    /// The span ends before it begins; s.
    #[error("--to {to} is not after --from {from}")]
    Empty { from: f64, to: f64 },
    /// The span begins after the end of the recording.
    #[error("{file}: --from {from} is after its end; the recording lasts {duration:.3} s")]
    BeyondTheEnd {
        /// Recording as given.
        file: String,
        /// Begin of the span, s since the first sample.
        from: f64,
        /// Duration from the first to the last sample, s.
        duration: f64,
    },
    /// The span lies in a gap of the recordings.
    #[error("{0}: there is no sample from --from to --to")]
    NoSample(String),
}

impl Worded for SpanError {}
