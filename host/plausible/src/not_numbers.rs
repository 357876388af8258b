//! Samples whose axes are blank or no numbers.

use samples::RecordedSample;

use crate::finding::Finding;
use crate::rest::is_number;

/// Share of samples that may be non-numbers without a finding.
const MOST: f64 = 0.01;

/// Counts the samples with a blank or infinite axis.
#[derive(Default)]
pub(crate) struct NotNumbersCheck {
    samples: u64,
    of: u64,
}

impl NotNumbersCheck {
    pub(crate) fn add(&mut self, sample: &RecordedSample) {
        let vectors = [sample.imu.specific_force.0, sample.imu.angular_rate.0];
        self.samples += u64::from(!vectors.into_iter().all(is_number));
        self.of += 1;
    }

    pub(crate) fn finding(&self) -> Option<Finding> {
        let Self { samples, of } = *self;
        (samples as f64 > MOST * of as f64).then_some(Finding::NotNumbers { samples, of })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::check;
    use crate::fixtures::walk;

    #[test]
    fn non_numbers_are_found_from_one_percent_on() {
        let without = |one_in: usize, at: usize| {
            let mut recording = walk();
            for sample in recording.samples.iter_mut().skip(at).step_by(one_in) {
                sample.imu.angular_rate.0.y = f32::NAN;
            }
            check(&recording)
        };
        assert_eq!(without(150, 7), []);
        let half = Finding::NotNumbers { samples: 1000, of: 2000 };
        assert_eq!(without(2, 0), [half]);
    }
}
