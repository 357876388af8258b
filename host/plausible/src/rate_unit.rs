//! Angular rates beyond the range of gyroscopes: they are in another unit.
//!
//! A unit fits if it puts the largest rates within the range of gyroscopes, and the quietest ones near the rates of a
//! foot that stands. Often °/s and revolutions per minute both fit. Then gravity distinguishes them, because in a swing it
//! turns by as much as the foot. If no swing is clear enough, neither unit is advised.

use samples::RecordedSample;

use crate::finding::Finding;
use crate::limits::LARGEST_RATE;
use crate::sensor_axes::AxesCheck;

/// Value of 1 °/s, of one revolution per minute and of a thousandth of 1 °/s, rad/s.
const DEGREE: f64 = std::f64::consts::PI / 180.0;
const REVOLUTION: f64 = std::f64::consts::PI / 30.0;
const MILLIDEGREE: f64 = DEGREE / 1000.0;

/// Ratio of the errors of swings from which the unit with the smaller error is right.
const BETTER: f64 = 1.5;

/// Largest rate in the quietest tenth of the samples, rad/s.
const QUIETEST: f64 = 0.5;

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
        let quietest = f64::from(self.sizes.quantile(0.1)?);
        if percentile <= LARGEST_RATE {
            return None;
        }
        let fits = |unit: f64| {
            f64::from(percentile) * unit <= f64::from(LARGEST_RATE) && quietest * unit <= QUIETEST
        };
        let swings = || {
            let (degrees, revolutions) = self.degrees.error().zip(self.revolutions.error())?;
            if degrees > BETTER * revolutions {
                Some(Finding::RateInRevolutions { percentile })
            } else {
                (revolutions > BETTER * degrees).then_some(Finding::RateInDegrees { percentile })
            }
        };
        Some(match (fits(DEGREE), fits(REVOLUTION)) {
            (true, true) => swings().unwrap_or(Finding::RateInDegreesOrRevolutions { percentile }),
            (true, false) => Finding::RateInDegrees { percentile },
            (false, true) => Finding::RateInRevolutions { percentile },
            (false, false) if fits(MILLIDEGREE) => Finding::RateInMilliDegrees { percentile },
            (false, false) => Finding::RateInOtherUnit { percentile },
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

    use crate::check;
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
        for (per_radian, name) in [
            (57.295_78, "rate_in_degrees"),
            (9.549_297, "rate_in_rpm"),
            (57_295.78, "rate_in_millidegrees"),
            (1.0e7, "rate_in_other_unit"),
        ] {
            let mut recording = pitching();
            for sample in &mut recording.samples {
                sample.imu.angular_rate.0 = sample.imu.angular_rate.0 * per_radian;
            }
            assert_eq!(found(&recording), [name]);
        }
    }

    #[test]
    fn no_unit_is_advised_where_two_fit() {
        // The forces stay as at rest, so no swing shows how far the foot turned.
        let mut recording = walk();
        for (k, sample) in (0..).zip(&mut recording.samples) {
            let swings = k % 200 >= 100;
            let rate = if swings { 100.0 * libm::sinf(0.3 * k as f32) } else { 0.01 };
            sample.imu.angular_rate.0.y = rate;
            sample.imu.specific_force.0.x = rate.abs();
        }
        let findings = check(&recording);
        assert_eq!(findings[0].name(), "rate_in_degrees_or_rpm", "{findings:?}");
        assert!(findings[0].to_string().ends_with(": units dps or units rpm"), "{}", findings[0]);
    }

    #[test]
    fn noise_of_a_standing_foot_is_not_taken_for_degrees() {
        let mut recording = walk();
        for (k, sample) in (0..).zip(&mut recording.samples) {
            sample.imu.specific_force.0 = Vec3::new(0.0, 0.0, 9.81);
            sample.imu.angular_rate.0 =
                Vec3::new(120.0 + (k % 7) as f32, -40.0 - (k % 3) as f32, (k % 5) as f32);
        }
        assert_eq!(found(&recording), ["rate_in_millidegrees"]);
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
