//! The portable part of what runs on the foot.
//!
//! Today that is [`imu`], where the sensor's samples become the estimator's, and [`self_check`]:
//! a stimulus and a digest that tell whether the estimator has the same bits on the target as on
//! the host. Everything here compiles for both.

#![cfg_attr(target_os = "none", no_std)]
#![forbid(unsafe_code)]

pub mod imu;
pub mod self_check;
