//! A single axis whose readings stay the same while the other axes of its sensor move.

use estimator_core::{Axis, Timestamp};
use samples::RecordedSample;
use samples::space::components;

use crate::finding::Finding;

/// Time with the same reading after which an axis is dead, s. No recording of a sound sensor has such a time in which
/// the others move (`host-tests/tests/findings.rs`).
const LONGEST_S: f64 = 1.0;

/// Range of another axis from which the sensor moves: accelerations, m/s², and rates, rad/s.
const MOVES_FORCE: f32 = 2.0;
const MOVES_RATE: f32 = 0.5;

/// Looks for the longest time in which an axis stays the same though the others move.
#[derive(Default)]
pub(crate) struct DeadAxisCheck {
    runs: [Option<Run>; 6],
    longest_s: [f64; 6],
}

/// Samples with the same reading of an axis.
struct Run {
    value: f32,
    since: Timestamp,
    /// Least and largest readings of the axes of the sensor.
    range: [(f32, f32); 3],
}

impl DeadAxisCheck {
    pub(crate) fn add(&mut self, sample: &RecordedSample) {
        let imu = &sample.imu;
        let sensors = [components(imu.specific_force.0), components(imu.angular_rate.0)];
        for (sensor, readings) in sensors.into_iter().enumerate() {
            let moves = [MOVES_FORCE, MOVES_RATE][sensor];
            for (axis, value) in readings.into_iter().enumerate() {
                let run = &mut self.runs[3 * sensor + axis];
                match run {
                    Some(run) if run.value == value => {
                        for ((least, most), reading) in run.range.iter_mut().zip(readings) {
                            (*least, *most) = (least.min(reading), most.max(reading));
                        }
                        if run.range.iter().any(|(least, most)| most - least > moves) {
                            let micros = imu.timestamp.micros_since(run.since).unwrap_or(0);
                            let longest_s = &mut self.longest_s[3 * sensor + axis];
                            *longest_s = longest_s.max(micros as f64 / 1.0e6);
                        }
                    }
                    run => {
                        let range = readings.map(|reading| (reading, reading));
                        *run = Some(Run { value, since: imu.timestamp, range });
                    }
                }
            }
        }
    }

    /// Findings about the axes.
    pub(crate) fn findings(&self) -> impl Iterator<Item = Finding> {
        let dead = Axis::ALL.into_iter().zip(self.longest_s);
        dead.filter(|(_, longest_s)| *longest_s >= LONGEST_S)
            .map(|(axis, longest_s)| Finding::DeadAxis { axis: axis.name(), longest_s })
    }
}

#[cfg(test)]
mod tests {
    use estimator_core::Vec3;

    use crate::check;
    use crate::finding::Finding;
    use crate::fixtures::{found, walk};

    #[test]
    fn axis_without_readings_is_dead() {
        /// Silences an axis of a force and a rate.
        type Kill = fn(&mut Vec3, &mut Vec3);
        let kill: [(Kill, &str); 4] = [
            (|_, w| w.y = 0.0, "wy"),
            (|_, w| w.z = 0.0, "wz"),
            (|a, _| a.x = 0.0, "ax"),
            (|a, _| a.z = 9.5, "az"),
        ];
        for (kill, dead) in kill {
            // Throughout, and from the middle on.
            for from in [0, 1000] {
                let mut recording = walk();
                for sample in &mut recording.samples {
                    let rate = &mut sample.imu.angular_rate.0;
                    (rate.x, rate.z) = (rate.x + 0.5 * rate.y, rate.z - 0.3 * rate.y);
                }
                for sample in &mut recording.samples[from..] {
                    let imu = &mut sample.imu;
                    kill(&mut imu.specific_force.0, &mut imu.angular_rate.0);
                }
                let findings = check(&recording);
                let is_dead = |finding: &Finding| matches!(finding, Finding::DeadAxis { axis, .. } if *axis == dead);
                assert!(findings.iter().any(is_dead), "{dead}, {from}: {findings:?}");
            }
        }
    }

    #[test]
    fn axis_that_stays_the_same_at_rest_is_not_dead() {
        let mut recording = walk();
        for sample in &mut recording.samples[..1000] {
            sample.imu.specific_force.0 = Vec3::new(0.0, 0.0, 9.81);
            sample.imu.angular_rate.0 = Vec3::new(0.0, 0.001, 0.0);
        }
        assert!(!found(&recording).contains(&"dead_axis"));
    }
}
