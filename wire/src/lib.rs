//! The bytes that footfall sends and receives on CAN and UART. The crate performs no input or output: frames go in,
//! frames and events come out.
//!
//! | content | module |
//! |---|---|
//! | every object that can be read or set, with type, range and meaning | [`dictionary`] |
//! | the values of the settings, which are kept over power-off | [`settings`] |
//! | CAN: the process data of a foot, one file per frame | [`pdo`] |
//! | CAN: read and write objects | [`sdo`] |
//! | CAN: write objects of any length | [`domain`] |
//! | CAN: a CANopen device that uses all of these | [`node`] |
//! | faults and their emergency codes | [`fault`] |
//! | stage and counters of the board | [`board`] |
//! | numbers that tell whether a board works, and their text | [`diagnosis`] |
//! | UART: frames, and a decoder that recovers after any garbage | [`uart`] |
//! | UART: CAN frames as text, the bootloader's protocol | [`slcan`] |
//!
//! # Glossary
//!
//! | word | property of | meaning | sent in |
//! |---|---|---|---|
//! | [`Validity`](estimator_core::Validity) | one sample | whether its numbers can be used: valid, saturated, stale or invalid | [`uart::RawMessage`] |
//! | [`Flag`](estimator_core::Flag) | one estimate | a reason to doubt it, from its samples: a gap, saturation, up not yet known, … | TPDO7, [`uart::ContactMessage`] |
//! | [`Fault`] | the board | a defect, from when it is raised until it is cleared; faults of the sensor void the estimate | emergency messages, object 0x2111 |
//! | [`Status`](pdo::Status) | one frame | a byte beside the probability: phase, decision, and how flags and faults affect both | TPDO1 |
//!
//! No allocation, no `unsafe`, no panic on any bytes. Integers are little-endian everywhere.
//!
//! ```
//! use estimator_core::ContactEstimate;
//! use wire::pdo::Contact;
//!
//! let estimate = ContactEstimate::default();
//! let bytes = Contact::new(&estimate, 7, wire::fault::Faults::NONE).encode();
//! assert_eq!(Contact::decode(&bytes).sequence, 7);
//! ```

#![no_std]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(
        clippy::indexing_slicing,
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::unreachable
    )
)]

#[cfg(test)]
extern crate std;

pub mod abort;
mod address;
pub mod board;
mod bytes;
pub mod diagnosis;
pub mod dictionary;
pub mod domain;
pub mod fault;
pub mod foot;
pub mod frame;
pub mod node;
pub mod pdo;
pub mod sdo;
pub mod settings;
pub mod slcan;
pub mod uart;
pub mod value;

pub use abort::AbortCode;
pub use board::{Counter, Counters, Stage};
pub use diagnosis::Diagnosis;
pub use dictionary::Address;
pub use fault::{Emergency, Fault, Faults};
pub use foot::{Foot, NodeId};
pub use frame::CanFrame;
pub use node::{BootCause, Event, Node, Outcome};
pub use pdo::Pdo;
pub use settings::Settings;
pub use value::{DataType, Value};
