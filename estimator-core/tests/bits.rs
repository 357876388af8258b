//! Tests of the foot's self-check, run beside those of the checked code: one of them pins the
//! estimator's bits.

#[path = "../../firmware/src/self_check.rs"]
mod self_check;
