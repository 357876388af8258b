//! Updates on a simulated flash, with all cases of each sweep. `.ci/run` runs them.

mod attacks;
mod download;
mod flash;
mod histories;
mod power_cut;

/// The sweeps try one case in this many, so they try all.
const STRIDE: usize = 1;
