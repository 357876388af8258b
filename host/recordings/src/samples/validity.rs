//! Names of validities, in files that are read and written.

use estimator_core::{Saturation, Validity};

/// Values of the column `validity`.
pub const VALIDITIES: [(&str, Validity); 6] = [
    ("valid", Validity::Valid),
    ("accelerometer_saturated", Validity::Saturated(Saturation::Accelerometer)),
    ("gyroscope_saturated", Validity::Saturated(Saturation::Gyroscope)),
    ("both_saturated", Validity::Saturated(Saturation::Both)),
    ("stale", Validity::Stale),
    ("invalid", Validity::Invalid),
];

/// Name of a validity.
#[must_use]
pub fn name_of(validity: Validity) -> &'static str {
    let known = VALIDITIES.iter().find(|(_, known)| *known == validity);
    known.map_or(VALIDITIES[0].0, |(name, _)| name)
}

/// Validity with this name.
#[must_use]
pub fn of_name(name: &str) -> Option<Validity> {
    let known = VALIDITIES.iter().find(|(known, _)| *known == name);
    known.map(|(_, validity)| *validity)
}
