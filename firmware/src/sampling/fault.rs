//! Faults of the sensor.

use lsm6dsox::SelfTest;
use wire::Fault;

/// Fault of the sensor, and the detail of its emergency.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorFault {
    /// The fault.
    pub fault: Fault,
    /// Detail, with the meaning given by [`Fault::detail`].
    pub detail: u32,
}

impl SensorFault {
    pub(super) const fn new(fault: Fault, detail: u32) -> Self {
        Self { fault, detail }
    }
}

/// Bit *i*: axis *i* failed.
pub(super) fn failed_axes(result: &SelfTest) -> u32 {
    let passed = result.accel_passed().into_iter().chain(result.gyro_passed());
    (0..).zip(passed).fold(0, |bits, (axis, passed)| bits | u32::from(!passed) << axis)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_axis_that_fails_the_self_test_sets_its_bit() {
        for axis in 0..6 {
            // Within ST's limits: 0.05 g to 1.7 g, 150 °/s to 700 °/s.
            let mut result = SelfTest { specific_force: [4.9; 3], angular_rate: [7.0; 3] };
            assert_eq!(failed_axes(&result), 0);
            match axis {
                0..3 => result.specific_force[axis] = 0.0,
                _ => result.angular_rate[axis - 3] = 0.0,
            }
            assert_eq!(failed_axes(&result), 1 << axis);
        }
    }
}
