//! Angular rates that are too large or too small for their unit.

use samples::recording::RecordedSample;

use super::Finding;
use super::histogram::Histogram;
use crate::input::RateUnit;

/// Range of the gyroscopes on robots, 2000 °/s, in rad/s.
pub const LARGEST_RATE: f32 = 34.9;

/// Rate that a walking foot exceeds in one sample in a hundred, 20 °/s, in rad/s. Of recordings of feet, shoes and
/// hands the slowest has 1.3 rad/s; a robot's trunk may have less, but not in °/s.
pub const SMALLEST_RATE: f32 = 0.35;

/// Excess of the 99th percentile of |a| over its median from which a foot moves, m/s².
const MOVES: f32 = 5.0;

/// Collects the magnitudes of rates.
pub(super) struct RateCheck {
    rates: Histogram,
    /// Values of |a|, if rates were read as °/s.
    forces: Option<Histogram>,
}

impl RateCheck {
    /// Starts with rates read in this unit.
    pub(super) fn new(unit: RateUnit) -> Self {
        let in_degrees = unit != RateUnit::RadiansPerSecond;
        Self {
            rates: Histogram::default(),
            forces: in_degrees.then(Histogram::default),
        }
    }

    pub(super) fn add(&mut self, sample: &RecordedSample) {
        let rate = sample.imu.angular_rate.0;
        let largest = rate.x.abs().max(rate.y.abs()).max(rate.z.abs());
        if largest.is_finite() {
            self.rates.add(largest);
        }
        let force = sample.imu.specific_force.0.length();
        if let Some(forces) = &mut self.forces
            && force.is_finite()
        {
            forces.add(force);
        }
    }

    /// Finding about the unit.
    pub(super) fn finding(&self) -> Option<Finding> {
        let percentile = self.rates.quantile(0.99)?;
        if percentile > LARGEST_RATE {
            return Some(Finding::RateInDegrees { percentile });
        }
        let forces = self.forces.as_ref()?;
        let moves = forces.quantile(0.99)? - forces.quantile(0.5)? > MOVES;
        (moves && percentile < SMALLEST_RATE).then_some(Finding::RateNotInDegrees { percentile })
    }
}
