//! The tests of the foot's self-check, run beside those of what it checks: one of them pins the
//! estimator's bits.

#[path = "../../firmware/src/self_check.rs"]
mod self_check;
