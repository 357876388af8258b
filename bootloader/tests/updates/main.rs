//! Updates on a simulated flash: a part of the sweeps. `thorough.rs` has all of each.

mod attacks;
mod download;
mod flash;
mod histories;
mod power_cut;

/// Every how many of the cases of a sweep is tried: a prime, so that all kinds occur.
const STRIDE: usize = 7;
