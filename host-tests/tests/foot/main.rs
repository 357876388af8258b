//! The complete firmware of the foot, on the simulated sensor in virtual time: its output on CAN and UART.
//!
//! These scenarios are here and not in the firmware's own package, because cargo builds a package's binaries for
//! its integration tests, and the firmware's are for its chip only.

mod bench;
mod calibration;
mod communication;
mod correction;
mod faults;
mod storage;
