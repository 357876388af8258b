//! Angular rates in the columns of the accelerometer, and accelerations in the columns of the gyroscope.

use estimator_core::Gravity;
use samples::RecordedSample;

use crate::finding::Finding;
use crate::gravity::NO_GRAVITY;
use crate::rest::{Rest, RestSearch, has_gravity};

/// Looks for gravity among the angular rates.
pub(crate) struct ExchangeCheck(RestSearch);

impl ExchangeCheck {
    pub(crate) fn new(sample_rate: f32) -> Self {
        Self(RestSearch::new(sample_rate))
    }

    pub(crate) fn add(&mut self, sample: &RecordedSample) {
        self.0.add(&with_exchanged_sensors(sample));
    }

    /// Finding about the columns, by the reading of the accelerometer at rest.
    pub(crate) fn finding(&self, rest: &Rest, gravity: Gravity) -> Option<Finding> {
        let exchanged = self.0.rest()?;
        let is_exchanged = gravity == Gravity::Included
            && rest.size < NO_GRAVITY
            && exchanged.is_steady
            && has_gravity(&exchanged);
        is_exchanged.then_some(Finding::ExchangedSensors { at_rest: exchanged.size })
    }
}

fn with_exchanged_sensors(sample: &RecordedSample) -> RecordedSample {
    let mut sample = *sample;
    let imu = &mut sample.imu;
    (imu.specific_force.0, imu.angular_rate.0) = (imu.angular_rate.0, imu.specific_force.0);
    sample
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::check;
    use crate::fixtures::{found, pitching};

    #[test]
    fn exchanged_sensors_are_found_with_their_mapping() {
        let mut recording = pitching();
        for sample in &mut recording.samples {
            *sample = with_exchanged_sensors(sample);
        }
        assert_eq!(found(&recording), ["exchanged_sensors"]);
        let said = check(&recording)[0].to_string();
        assert!(
            said.ends_with("were exchanged: map ax=wx,ay=wy,az=wz,wx=ax,wy=ay,wz=az"),
            "{said}"
        );
    }
}
