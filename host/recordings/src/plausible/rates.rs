//! Angular rates that are too large for their unit.

use crate::samples::recording::RecordedSample;

use super::Finding;
use super::histogram::Histogram;

/// Range of the gyroscopes on robots, 2000 °/s, in rad/s.
pub const LARGEST_RATE: f32 = 34.9;

/// Collects the magnitudes of rates.
#[derive(Default)]
pub(super) struct RateCheck(Histogram);

impl RateCheck {
    pub(super) fn add(&mut self, sample: &RecordedSample) {
        let rate = sample.imu.angular_rate.0;
        let largest = rate.x.abs().max(rate.y.abs()).max(rate.z.abs());
        if largest.is_finite() {
            self.0.add(largest);
        }
    }

    /// Finding about the unit.
    pub(super) fn finding(&self) -> Option<Finding> {
        let percentile = self.0.quantile(0.99)?;
        (percentile > LARGEST_RATE).then_some(Finding::RateInDegrees { percentile })
    }
}
