//! Updates on a simulated flash, with all cases of each sweep. `.ci/run` runs them.

mod attacks;
mod download;
mod flash;
mod histories;
mod power_cut;

/// Every how many of the cases of a sweep is tried.
const STRIDE: usize = 1;
