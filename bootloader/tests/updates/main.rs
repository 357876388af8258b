//! Updates on a simulated flash.

mod attacks;
mod download;
mod flash;
mod power_cut;
