//! Updates on a simulated flash.

mod attacks;
mod download;
mod flash;
mod histories;
mod power_cut;
