//! Angular rates beyond the range of gyroscopes: they are in another unit.

use samples::RecordedSample;

use crate::finding::Finding;
use crate::limits::LARGEST_RATE;
use crate::sensor_axes::AxesCheck;

/// Value of 1 °/s and of one revolution per minute, rad/s.
const DEGREE: f64 = std::f64::consts::PI / 180.0;
const REVOLUTION: f64 = std::f64::consts::PI / 30.0;

/// Ratio of the errors of swings from which revolutions per minute fit better than °/s.
const BETTER: f64 = 1.5;

/// Collects the magnitudes of rates, and the errors of swings in other units.
pub(crate) struct RateCheck {
    sizes: Histogram,
    degrees: AxesCheck,
    revolutions: AxesCheck,
}

impl RateCheck {
    pub(crate) fn new(sample_rate: f32) -> Self {
        Self {
            sizes: Histogram::default(),
            degrees: AxesCheck::of_unit(sample_rate, DEGREE),
            revolutions: AxesCheck::of_unit(sample_rate, REVOLUTION),
        }
    }

    pub(crate) fn add(&mut self, sample: &RecordedSample) {
        let rate = sample.imu.angular_rate.0;
        let largest = rate.x.abs().max(rate.y.abs()).max(rate.z.abs());
        if largest.is_finite() {
            self.sizes.add(largest);
        }
        self.degrees.add(sample);
        self.revolutions.add(sample);
    }

    /// Finding about the unit.
    pub(crate) fn finding(&self) -> Option<Finding> {
        let percentile = self.sizes.quantile(0.99)?;
        let errors = self.degrees.error().zip(self.revolutions.error());
        let are_revolutions =
            errors.is_some_and(|(degrees, revolutions)| degrees > BETTER * revolutions);
        (percentile > LARGEST_RATE).then_some(if are_revolutions {
            Finding::RateInRevolutions { percentile }
        } else {
            Finding::RateInDegrees { percentile }
        })
    }
}

/// Low bits of an f32 that are dropped; the rest resolves sizes to 0.2 %.
const DROPPED_BITS: u32 = 14;

/// Sizes in bins of at most 0.2 % of their size.
struct Histogram {
    counts: Vec<u64>,
    total: u64,
}

impl Default for Histogram {
    fn default() -> Self {
        Self { counts: vec![0; 1 << (31 - DROPPED_BITS)], total: 0 }
    }
}

impl Histogram {
    /// Counts a size, which must not be negative.
    fn add(&mut self, size: f32) {
        let bin = (size.abs().to_bits() >> DROPPED_BITS) as usize;
        if let Some(count) = self.counts.get_mut(bin) {
            *count += 1;
            self.total += 1;
        }
    }

    /// Size below which a `share` of the values lies, in [0, 1], to the resolution of a bin; `None` if empty.
    fn quantile(&self, share: f64) -> Option<f32> {
        let wanted = ((self.total as f64 * share) as u64).min(self.total.checked_sub(1)?);
        let mut before = 0;
        let bin = self.counts.iter().position(|count| {
            before += count;
            before > wanted
        })?;
        Some(f32::from_bits((bin as u32) << DROPPED_BITS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use estimator_core::Vec3;

    use crate::fixtures::{found, pitching, walk};

    #[test]
    fn quantile_is_right_to_its_bin() {
        let mut histogram = Histogram::default();
        assert_eq!(histogram.quantile(0.5), None);
        for k in 1..=1000_u16 {
            histogram.add(f32::from(k));
        }
        for (share, exact) in [(0.0, 1.0), (0.5, 501.0), (0.99, 991.0), (1.0, 1000.0)] {
            let found = histogram.quantile(share).unwrap();
            assert!(found <= exact && found > 0.998 * exact, "{share}: {found}");
        }
    }

    #[test]
    fn unit_of_the_rates_is_the_one_that_fits_the_swings() {
        for (per_radian, name) in [(57.295_78, "rate_in_degrees"), (9.549_297, "rate_in_rpm")] {
            let mut recording = pitching();
            for sample in &mut recording.samples {
                sample.imu.angular_rate.0 = sample.imu.angular_rate.0 * per_radian;
            }
            assert_eq!(found(&recording), [name]);
        }
    }

    #[test]
    fn rates_in_degrees_are_found() {
        let mut recording = walk();
        for sample in &mut recording.samples {
            let rate = &mut sample.imu.angular_rate.0;
            *rate = Vec3::new(rate.x.to_degrees(), rate.y.to_degrees(), rate.z.to_degrees());
        }
        assert_eq!(found(&recording), ["rate_in_degrees"]);
    }
}
