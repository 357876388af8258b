//! Requests to one foot over its line.
//!
//! | item | file |
//! |---|---|
//! | objects by name: `decision.threshold`, with type, range and unit; values as text, such as `50ms` | [`name`] |
//! | requests and responses over CAN (SDO) and the serial line; reset; search by serial number | [`client`] |
//! | requests as errors name them, and these errors | [`request`] |
//! | bytes of any length, such as a program | `download` |
//! | sets of settings, written all or none; position of a board | [`settings`] |
//! | scan of a line for feet | [`scan`] |
//! | calibration that the foot has learnt, and its storage | [`calibration`] |
//! | self-test of the sensor | [`self_test`] |
//! | acceptance of a board by a person | [`accept`] |
//! | update of the program | [`update`] |

pub mod accept;
pub mod calibration;
pub mod client;
mod download;
pub mod name;
pub mod request;
pub mod scan;
pub mod self_test;
pub mod settings;
pub mod update;

pub use client::Client;
pub use name::Named;
pub use request::RequestError;
