//! One foot, asked and set over its line.
//!
//! | what | file |
//! |---|---|
//! | objects by name: `half_width.ax`, with type, range and unit | [`name`] |
//! | requests over CAN (SDO) and the serial line, one after the other, with their answers | [`client`] |
//! | many settings at once, all or none | [`settings`] |
//! | the feet on a line | [`scan`] |
//! | a reset, until the foot is back in the state before | [`restart`] |
//! | which foot a board is | [`position`] |
//! | what the foot has learnt while it walked, and keeping it | [`calibration`] |
//! | the sensor's self-test | [`self_test`] |
//! | the clocks of several feet on one another | [`sync`] |

pub mod calibration;
pub mod client;
pub mod name;
pub mod position;
pub mod restart;
pub mod scan;
pub mod self_test;
pub mod settings;
pub mod sync;

pub use client::{Client, RequestError};
pub use name::Named;
