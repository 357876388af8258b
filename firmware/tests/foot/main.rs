//! The complete firmware of the foot, on the simulated sensor in virtual time: its output on CAN and UART.

mod bench;
mod calibration;
mod communication;
mod correction;
mod faults;
mod storage;
