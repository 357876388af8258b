//! Stable-contact probability of a robot's foot, from the IMU on it alone.
//!
//! The path of a sample, one module a step:
//!
//! | step | module |
//! |---|---|
//! | parameters, their ranges, and the derived configuration | [`params`], [`parameter`], [`config`] |
//! | six numbers in SI units, with their time and quality | [`sample`] |
//! | before the estimator: accelerometer correction, and rotation from the sensor's axes to the foot's | [`correction`], [`mounting`] |
//! | orientation, for the removal of gravity, and gyro bias | [`attitude`] |
//! | probability of stillness, with limits learnt from the foot | [`adaptive`], with [`erf`](mod@erf) and [`logarithm`] |
//! | or, with configured half-widths, the paper's | [`kde`] |
//! | probability per axis, tangential, vertical and in total | [`probability`] |
//! | standard deviation of a zero-velocity measurement | [`velocity`] |
//! | debounced decision, and the phase if the load is known | [`phase`] |
//! | one of the two models of stillness, by the configured method | `model` |
//! | the whole estimator behind one `update` | [`contact`] |
//!
//! The method is that of Maravgakis, Argiropoulos, Piperakis and Trahanias, *Probabilistic
//! Contact State Estimation for Legged Robots using Inertial Information*, ICRA 2023
//! (arXiv:2303.00538), made causal.
//!
//! No allocation, no `unsafe`, no panic on any input. All arithmetic is f32 addition,
//! multiplication, division and square root, never fused, and integers: the results have the
//! same bits on every machine that follows IEEE 754.
//!
//! ```
//! use estimator_core::{ContactEstimator, Gravity, ImuSample, Params, Timestamp};
//!
//! let params = Params { gravity: Gravity::Removed, ..Params::DEFAULT };
//! let mut estimator = ContactEstimator::new(&params.validate::<256>()?);
//! for tick in 0..400 {
//!     let sample = ImuSample { timestamp: Timestamp::from_micros(tick * 1000), ..Default::default() };
//!     let estimate = estimator.update(&sample, None);
//!     // Once the foot has rested for a fifth of a second:
//!     assert!(tick < 390 || estimate.probabilities.stable > 0.98);
//! }
//! # Ok::<(), estimator_core::ParamsError>(())
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

pub mod adaptive;
pub mod attitude;
pub mod axis;
pub mod config;
pub mod contact;
pub mod correction;
pub mod erf;
pub mod flag;
pub mod kde;
pub mod logarithm;
mod model;
pub mod mounting;
mod order;
pub mod parameter;
pub mod params;
pub mod phase;
pub mod probability;
pub mod range;
pub mod root;
pub mod sample;
mod step;
pub mod units;
pub mod vector;
pub mod velocity;

pub use adaptive::{Constants, Learning, Learnt};
pub use attitude::rest::RestParams;
pub use attitude::{AttitudeFilter, AttitudeParams, GyroTiming};
pub use axis::{Axis, PerAxis};
pub use config::Config;
pub use contact::{ContactEstimate, ContactEstimator};
pub use correction::AccelerometerCorrection;
pub use flag::{Flag, Flags};
pub use kde::density::DensityEstimator;
pub use mounting::{Mounting, MountingError, MountingParams, SensorAxis};
pub use parameter::Parameter;
pub use params::{DecisionParams, Gravity, LoadParams, Method, Params, WindowLength};
pub use phase::{Decision, Load, Phase};
pub use probability::Probabilities;
pub use range::{ParamsError, Row};
pub use sample::{
    AngularRate, ImuSample, LinearAcceleration, Saturation, SpecificForce, Timestamp, Validity,
};
pub use units::Unit;
pub use vector::{Quaternion, Vec3};
pub use velocity::{VelocityCoefficients, VelocityParams, VelocitySigma};

/// Compiles the README's example.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
