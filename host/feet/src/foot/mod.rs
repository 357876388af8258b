//! Requests to one foot over its line.
//!
//! | item | file |
//! |---|---|
//! | objects by name: `decision.threshold`, with type, range and unit | [`name`] |
//! | values as text, such as `50ms` | `notation` |
//! | requests and responses over CAN (SDO) and the serial line | [`client`] |
//! | sets of settings, written all or none | [`settings`] |
//! | scan of a line for feet | [`scan`] |
//! | search for feet by serial number | [`serial_number`] |
//! | reset and return to the previous state | [`restart`] |
//! | position of a board | [`position`] |
//! | calibration that the foot has learnt, and its storage | [`calibration`] |
//! | self-test of the sensor | [`self_test`] |
//! | acceptance of a board by a person | [`accept`] |
//! | update of the program | [`update`] |

pub mod accept;
pub mod calibration;
pub mod client;
pub mod name;
mod notation;
pub mod position;
pub mod restart;
pub mod scan;
pub mod self_test;
pub mod serial_number;
pub mod settings;
pub mod update;

pub use client::{Client, RequestError};
pub use name::Named;
