//! The complete firmware of the foot, on the simulated sensor in virtual time, with all cases of each sweep. `.ci/run` runs
//! them.

mod bench;
mod calibration;
mod communication;
mod correction;
mod faults;
mod storage;

/// Every how many of the cases of a sweep is tried.
const STRIDE: usize = 1;
