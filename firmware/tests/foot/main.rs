//! The complete firmware of the foot, on the simulated sensor in virtual time: its output on CAN and UART. A part of the sweeps;
//! `thorough.rs` has all of each.

mod bench;
mod calibration;
mod communication;
mod correction;
mod faults;
mod storage;

/// The sweeps try one case in this many. It is a prime, so that cases of all kinds occur.
const STRIDE: usize = 7;
