//! Stable-contact probability of a robot's foot, from the IMU on it alone.
//!
//! # What firmware needs
//!
//! | item | use |
//! |---|---|
//! | [`Params`], with [`DecisionParams`], [`LoadParams`], [`VelocityParams`], [`Gravity`], [`Learning`] | set the sample rate; the rest has defaults |
//! | [`Params::validate`], [`ParamsError`] | check them, and get a [`Config`] |
//! | [`ContactEstimator`] | one for each foot, in less than 1 KiB |
//! | [`ImuSample`], with [`Timestamp`], [`SpecificForce`], [`AngularRate`], [`Validity`], [`Saturation`], [`Vec3`]; [`Load`] | what goes in |
//! | [`ContactEstimate`], with [`Probabilities`], [`PerAxis`], [`Decision`], [`Phase`], [`Flags`], [`Flag`], [`VelocitySigma`], [`Quaternion`], [`LinearAcceleration`] | what comes out |
//! | [`Learnt`], [`LearntError`] | store what the foot has learnt, for a warm start |
//! | [`Mounting`], [`AccelerometerCorrection`] | before the estimator, if the sensor needs them |
//!
//! The paper's method, [`Method::HalfWidths`], needs room for its window: [`Params::validate_for`].
//!
//! | feature | effect |
//! |---|---|
//! | none, the default | all of the above |
//! | `defmt` | samples, estimates and errors can be logged by `defmt` |
//! | `self-check` | a program for another machine can compare its bits with those of this one |
//!
//! No feature changes a result. The oldest Rust that compiles the library is 1.88.
//!
//! # How it works
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
//! | [`vector`] | vectors and quaternions, by functions with the same bits on every machine |
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
//! let mut estimator = ContactEstimator::new(&params.validate()?);
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
#[doc(hidden)] // For the benchmark alone.
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
pub use learnt::{Learning, Learnt, LearntError};
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
