//! Updates on a simulated flash.

mod download;
mod flash;
mod power_cut;
