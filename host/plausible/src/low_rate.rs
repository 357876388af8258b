//! Sample rates at which a window has few samples.

use crate::finding::Finding;
use crate::limits::LOWEST_RATE;

/// Tolerance of a measured rate below [`LOWEST_RATE`], as a fraction.
const TOLERANCE: f32 = 0.01;

/// Finding about a sample rate, Hz.
pub(crate) fn low_rate(rate: f32) -> Option<Finding> {
    (rate < LOWEST_RATE * (1.0 - TOLERANCE)).then_some(Finding::LowRate { rate })
}

#[cfg(test)]
mod tests {

    use samples::Recording;

    use crate::fixtures::{found, walk};

    #[test]
    fn rate_below_the_slowest_recordings_is_found() {
        let slower = |rate: f32| Recording { sample_rate: rate, ..walk() };
        assert_eq!(found(&slower(50.0)), ["low_rate"]);
        assert_eq!(found(&slower(99.5)), [""; 0]);
    }
}
