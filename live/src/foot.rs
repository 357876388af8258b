//! One foot, asked and set over its line.
//!
//! | what | file |
//! |---|---|
//! | objects by name: `half_width.ax`, with type, range and unit | [`name`] |
//! | requests over CAN (SDO) and the serial line, one after the other, with their answers | [`client`] |
//! | many settings at once, all or none | [`settings`] |

pub mod client;
pub mod name;
pub mod settings;

pub use client::{Client, RequestError};
pub use name::Named;
