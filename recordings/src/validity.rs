//! The names of validities, in files that are read and written.

use estimator_core::{Saturation, Validity};

/// What can stand in the column `validity`.
pub const VALIDITIES: [(&str, Validity); 6] = [
    ("valid", Validity::Valid),
    (
        "accelerometer_saturated",
        Validity::Saturated(Saturation::Accelerometer),
    ),
    (
        "gyroscope_saturated",
        Validity::Saturated(Saturation::Gyroscope),
    ),
    ("both_saturated", Validity::Saturated(Saturation::Both)),
    ("stale", Validity::Stale),
    ("invalid", Validity::Invalid),
];
