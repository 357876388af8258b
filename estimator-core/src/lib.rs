//! Stable-contact probability of a robot's foot, from the IMU on it alone.
//!
//! A reader follows [`ContactEstimator::update`] through these modules, in this order:
//!
//! | step | module |
//! |---|---|
//! | six numbers in SI units, with their time and quality | [`sample`] |
//! | the whole estimator behind one `update`: time, gravity, stillness, decision | [`contact`] |
//! | orientation, for the removal of gravity | [`attitude`] |
//! | rest detection: how still the IMU is, for the three steps that ask | [`rest`] |
//! | gyroscope bias, learnt at rest | [`gyro_bias`] |
//! | probability of stillness, with limits learnt from the foot | [`self_calibrating`] |
//! | or, with configured half-widths, the paper's | [`kde`] |
//! | rolling: a foot that turns about a point on the ground | [`roll`] |
//! | debounced decision, and the phase if the load is known | [`phase`] |
//! | standard deviation of a zero-velocity measurement | [`velocity`] |
//!
//! These modules serve them:
//!
//! | module | content |
//! |---|---|
//! | [`correction`], [`mounting`] | before the estimator: accelerometer correction, and rotation from the sensor's axes to the foot's |
//! | [`params`], [`parameter`], [`config`] | parameters, their ranges, and the derived configuration |
//! | [`constants`], [`learnt`] | constants of the self-calibrating estimate, and its state to be stored |
//! | [`probability`], [`flag`] | results: probability per axis, tangential, vertical and in total; reasons to doubt them |
//! | [`math`], [`vector`] | functions, vectors and quaternions with the same bits on every machine |
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

pub mod attitude;
pub mod axis;
pub mod config;
pub mod constants;
pub mod contact;
pub mod correction;
pub mod flag;
pub mod gyro_bias;
pub mod kde;
pub mod learnt;
pub mod math;
pub mod mounting;
pub mod parameter;
pub mod params;
pub mod phase;
pub mod probability;
pub mod range;
pub mod rest;
pub mod roll;
pub mod sample;
pub mod self_calibrating;
#[cfg(any(test, feature = "self-check"))]
pub mod self_check;
pub mod units;
pub mod vector;
pub mod velocity;

pub use attitude::{AttitudeFilter, AttitudeParams, GyroTiming};
pub use axis::{Axis, PerAxis};
pub use config::Config;
pub use constants::Constants;
pub use contact::{ContactEstimate, ContactEstimator};
pub use correction::AccelerometerCorrection;
pub use flag::{Flag, Flags};
pub use kde::DensityEstimator;
pub use learnt::{Learning, Learnt};
pub use mounting::{Mounting, MountingError, MountingParams, SensorAxis};
pub use parameter::Parameter;
pub use params::{DecisionParams, Gravity, LoadParams, Method, Params, WindowLength};
pub use phase::{Decision, Load, Phase};
pub use probability::Probabilities;
pub use range::{ParamsError, Row};
pub use rest::RestParams;
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
