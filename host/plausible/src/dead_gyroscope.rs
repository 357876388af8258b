//! A gyroscope whose readings stay the same while the foot moves.

use estimator_core::{Timestamp, Vec3};
use samples::RecordedSample;

use crate::finding::Finding;

/// Time with the same readings from which the gyroscope counts as dead, s. A working gyroscope has noise. The readings of a
/// gyroscope that is simulated without noise stay the same only while the readings of the accelerometer do.
const LONGEST_S: f64 = 1.0;

/// Change of the acceleration from which the foot moves, m/s².
const MOVES: f32 = 0.5;

/// Looks for the longest time with the same angular rate in which the foot moves.
#[derive(Default)]
pub(crate) struct DeadCheck {
    run: Option<Run>,
    longest_s: f64,
}

/// Samples with the same angular rate.
struct Run {
    rate: Vec3,
    since: Timestamp,
    /// Acceleration of the first sample.
    force: Vec3,
    moves: bool,
}

impl DeadCheck {
    pub(crate) fn add(&mut self, sample: &RecordedSample) {
        let now = sample.imu.timestamp;
        let (force, rate) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
        match &mut self.run {
            Some(run) if run.rate == rate => {
                run.moves |= (force - run.force).length() > MOVES;
                if run.moves {
                    let micros = now.micros_since(run.since).unwrap_or(0);
                    self.longest_s = self.longest_s.max(micros as f64 / 1.0e6);
                }
            }
            run => {
                *run = Some(Run { rate, since: now, force, moves: false });
            }
        }
    }

    /// Finding about the gyroscope.
    pub(crate) fn finding(&self) -> Option<Finding> {
        let longest_s = self.longest_s;
        (longest_s >= LONGEST_S).then_some(Finding::DeadGyroscope { longest_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::fixtures::{found, walk};

    #[test]
    fn gyroscope_that_stops_is_dead_unless_the_foot_rests() {
        let mut recording = walk();
        // From the middle of a swing on.
        for sample in &mut recording.samples[950..1200] {
            sample.imu.angular_rate.0 = Vec3::ZERO;
        }
        assert_eq!(found(&recording), ["dead_gyroscope"]);
        for sample in &mut recording.samples {
            sample.imu.specific_force.0 = Vec3::new(0.0, 0.0, 9.81);
            sample.imu.angular_rate.0 = Vec3::ZERO;
        }
        assert!(!found(&recording).contains(&"dead_gyroscope"));
    }
}
