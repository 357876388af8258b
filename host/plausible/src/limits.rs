//! Limits of the checks that findings name.

use estimator_core::params::STANDARD_GRAVITY;

/// Value of |a| at rest from which it cannot be gravity, whatever the motion of a foot at its quietest, m/s².
pub const LARGEST_REST: f32 = 3.0 * STANDARD_GRAVITY;

/// Lowest rate of the recordings with which the estimator was chosen, Hz.
pub const LOWEST_RATE: f32 = 100.0;

/// Range of the gyroscopes on robots, 2000 °/s, in rad/s.
pub const LARGEST_RATE: f32 = 34.9;
