//! The complete firmware of the foot, on the simulated sensor in virtual time, with all cases of each sweep. `.ci/run` runs
//! them.

mod bench;
mod calibration;
mod communication;
mod correction;
mod faults;
mod storage;

/// The sweeps try one case in this many, so they try all.
const STRIDE: usize = 1;
