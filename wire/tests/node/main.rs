//! The node as seen by a master, over frames; the SDO client and the PDO packing of `canopen-rs`
//! are the peers.

mod faults;
mod learnt;
mod lss;
mod master;
mod objects;
mod process_data;
mod states;
