//! Updates on a simulated flash: a part of the sweeps. `thorough.rs` has all of each.

mod attacks;
mod download;
mod flash;
mod histories;
mod power_cut;

/// The sweeps try one case in this many. It is a prime, so that cases of all kinds occur.
const STRIDE: usize = 7;
