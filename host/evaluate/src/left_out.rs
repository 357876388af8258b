//! Constants of self-calibration chosen without one family of recordings.
//!
//! Each set is chosen like the default's first constants, by the same but shorter search from the same start,
//! on the recordings of the other families only. Its figures on the family that was left out show how well the
//! choice generalises. The constants of the slide and of the evidence are the default's, which were chosen with
//! all recordings.

use estimator_core::StillnessParams;
use estimator_core::stillness::{GravityErrorParams, QuantityParams};

use crate::sets::Family;

/// Constants chosen without a family.
#[must_use]
pub const fn without(family: Family) -> StillnessParams {
    match family {
        Family::Atlas => WITHOUT_ATLAS,
        Family::Lcd => WITHOUT_LCD,
        Family::Shoe => WITHOUT_SHOE,
        Family::Simulated => WITHOUT_SIMULATED,
        // The search for the default did not use their recordings.
        Family::Robots => StillnessParams::DEFAULT,
    }
}

/// Constants of a quantity, in the order of their fields: one row of a table for each search.
const fn quantity(row: [f32; 8]) -> QuantityParams {
    let [
        floor,
        still,
        moving,
        width,
        edge,
        bandwidth,
        indifference,
        separation,
    ] = row;
    QuantityParams {
        floor,
        still,
        moving,
        width,
        edge,
        bandwidth,
        indifference,
        separation,
    }
}

/// Constants of the error of gravity, in the order of their fields.
const fn gravity_error([quiet, start, memory, forgetting, limit]: [f32; 5]) -> GravityErrorParams {
    GravityErrorParams {
        quiet,
        start,
        memory,
        forgetting,
        limit,
    }
}

const WITHOUT_ATLAS: StillnessParams = StillnessParams {
    acceleration: quantity([0.0362, 0.821, 10.6, 0.409, 5.2, 0.17, 0.0684, 0.105]),
    rate: quantity([0.0933, 0.143, 4.2, 0.169, 7.1, 1.26, 0.877, 2.19]),
    velocity: quantity([0.00566, 0.0958, 4.86, 0.232, 10.3, 0.235, 0.0256, 0.481]),
    window: 0.0143,
    leak: 0.00547,
    impact: 5.42,
    part_of_the_way: 0.849,
    least_width: 0.123,
    largest_width: 0.528,
    prior: 0.0637,
    memory: 20.0,
    stance: 0.247,
    motion: 1.43,
    relaxation: 4.93,
    gravity_error: gravity_error([0.887, 0.105, 2.06, 10.2, 0.449]),
    slide: StillnessParams::DEFAULT.slide,
    evidence: StillnessParams::DEFAULT.evidence,
};

const WITHOUT_LCD: StillnessParams = StillnessParams {
    acceleration: quantity([0.0228, 0.901, 10.1, 0.41, 8.54, 0.265, 0.028, 0.194]),
    rate: quantity([0.094, 0.144, 5.19, 0.171, 4.39, 1.75, 0.861, 2.5]),
    velocity: quantity([0.0054, 0.0426, 5.59, 0.345, 5.12, 0.231, 0.00697, 1.68]),
    window: 0.0142,
    leak: 0.00495,
    impact: 5.37,
    part_of_the_way: 0.758,
    least_width: 0.0673,
    largest_width: 0.41,
    prior: 0.0606,
    memory: 16.1,
    stance: 0.211,
    motion: 1.0,
    relaxation: 5.72,
    gravity_error: gravity_error([0.896, 0.214, 0.647, 14.8, 0.293]),
    slide: StillnessParams::DEFAULT.slide,
    evidence: StillnessParams::DEFAULT.evidence,
};

const WITHOUT_SHOE: StillnessParams = StillnessParams {
    acceleration: quantity([0.0327, 0.801, 12.3, 0.434, 4.56, 0.161, 0.0279, 0.155]),
    rate: quantity([0.0943, 0.113, 4.62, 0.166, 4.02, 1.74, 0.908, 2.69]),
    velocity: quantity([0.00554, 0.0931, 4.46, 0.228, 7.42, 0.258, 0.00195, 1.36]),
    window: 0.011,
    leak: 0.0074,
    impact: 7.92,
    part_of_the_way: 0.85,
    least_width: 0.234,
    largest_width: 0.543,
    prior: 0.0643,
    memory: 19.8,
    stance: 0.231,
    motion: 1.55,
    relaxation: 4.1,
    gravity_error: gravity_error([0.886, 0.159, 0.938, 6.55, 0.319]),
    slide: StillnessParams::DEFAULT.slide,
    evidence: StillnessParams::DEFAULT.evidence,
};

const WITHOUT_SIMULATED: StillnessParams = StillnessParams {
    acceleration: quantity([0.0262, 0.48, 17.4, 0.47, 5.76, 0.175, 0.0235, 0.131]),
    rate: quantity([0.098, 0.11, 3.33, 0.115, 5.83, 1.27, 0.918, 2.65]),
    velocity: quantity([0.0057, 0.0915, 4.48, 0.3, 8.2, 0.22, 0.00194, 1.13]),
    window: 0.0147,
    leak: 0.00418,
    impact: 6.95,
    part_of_the_way: 0.829,
    least_width: 0.135,
    largest_width: 0.712,
    prior: 0.0616,
    memory: 20.0,
    stance: 0.241,
    motion: 1.12,
    relaxation: 7.91,
    gravity_error: gravity_error([0.876, 0.0959, 1.31, 3.16, 0.277]),
    slide: StillnessParams::DEFAULT.slide,
    evidence: StillnessParams::DEFAULT.evidence,
};
