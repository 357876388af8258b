//! The bytes on the wire, in one program: rules of CANopen, generated files, the decoder in C, damaged bytes.

mod bus_load;
#[path = "c/main.rs"]
mod c;
mod commands;
#[path = "files.rs"]
mod files;
#[path = "node/main.rs"]
mod node;
#[path = "robustness/main.rs"]
mod robustness;
