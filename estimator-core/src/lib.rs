//! Stable-contact probability of a robot's foot, from the IMU on it alone.
//!
//! ```
//! use estimator_core::{
//!     AngularRate, ContactEstimator, Gravity, ImuSample, Params, SpecificForce, Stream, Timestamp, Validity, Vec3,
//! };
//!
//! // An accelerometer measures gravity, too, so that it reads 9.81 m/s² upwards at rest.
//! let stream = Stream::new(1000.0, Gravity::Included)?; // Hz
//! let mut estimator = ContactEstimator::new(&Params::DEFAULT.validate()?, stream);
//! for tick in 0..400 {
//!     let sample = ImuSample {
//!         timestamp: Timestamp::from_micros(tick * 1000),
//!         specific_force: SpecificForce(Vec3::new(0.0, 0.0, 9.81)), // m/s²
//!         angular_rate: AngularRate(Vec3::new(0.0, 0.0, 0.0)),      // rad/s
//!         validity: Validity::Valid,
//!     };
//!     let estimate = estimator.update(&sample, None);
//!     // Once the foot has rested for a third of a second:
//!     assert!(tick < 390 || estimate.probabilities.stable > 0.98);
//! }
//! # Ok::<(), estimator_core::ParamsError>(())
//! ```
//!
//! # What firmware needs
//!
//! | item | use |
//! |---|---|
//! | [`Stream`], with [`Gravity`] | how often samples come, and whether they contain gravity |
//! | [`Params`], with [`Learning`] | what you choose; all of it has defaults |
//! | [`Params::validate`], [`ParamsError`] | check them, and get a [`Config`] |
//! | [`ContactEstimator`] | one for each foot, in less than 1 KiB |
//! | [`ImuSample`], with [`Timestamp`], [`SpecificForce`], [`AngularRate`], [`Validity`], [`Saturation`], [`Vec3`]; [`Load`] | what goes in |
//! | [`ContactEstimate`], with [`Probabilities`], [`PerAxis`] by [`Axis`], [`Decision`], [`Phase`], [`Flags`], [`Flag`], [`VelocitySigma`], [`Quaternion`], [`LinearAcceleration`] | what comes out |
//! | [`Learnt`], [`LearntError`] | store what the foot has learnt, for a warm start |
//!
//! The modules have the rest:
//!
//! | module | content |
//! |---|---|
//! | [`params`] | the parts of [`Params`] |
//! | [`half_widths`] | the paper's estimator, with its presets |
//! | [`any`] | either estimator, for a program whose user chooses |
//! | [`parameter`] | table of all parameters with names, units, ranges and defaults, for a program that edits them |
//! | [`correction`], [`mounting`] | before the estimator: accelerometer correction, and rotation from the sensor's axes to the foot's |
//! | [`clock`], [`gravity`] | before the estimator: a bridge over timestamps that jump, and a check that gravity was removed |
//! | [`velocity`] | zero-velocity measurement for a state estimator |
//!
//! | feature | effect |
//! |---|---|
//! | none, the default | all of the above; no dependency |
//! | `defmt` | samples, estimates and errors can be logged by `defmt` |
//! | `small-stack` | creating an estimator takes some 800 bytes less of the stack, and a few instructions more |
//! | `self-check` | a program for another machine can compare its bits with those of this one |
//!
//! No feature changes a result. The oldest Rust that compiles the library is 1.88.
//!
//! Later versions may add variants to errors, which are `#[non_exhaustive]`, and fields to samples, parameters and
//! estimates. The structs are exhaustive, since firmware, decoders and tests build them. End yours with
//! `..Params::DEFAULT` or `..Default::default()`, so that a new field changes nothing for you. [`Flag`] is exhaustive,
//! too: a match without a wildcard fails to compile at a new reason for doubt, for which you need an action.
//!
//! # How it works
//!
//! No allocation, no `unsafe`, no panic on any input. All arithmetic is f32 addition,
//! multiplication, division and square root, never fused, and integers. So the results have the
//! same bits on every machine that follows IEEE 754.
//!
//! [`ContactEstimator::update`] is the whole estimator. Its steps are these files of the source, in this order:
//!
//! | step | file |
//! |---|---|
//! | six numbers in SI units, with their time and quality | `sample.rs` |
//! | the whole estimator behind one `update` | `contact.rs` |
//! | before stillness and after it: time, gravity, decision | `pipeline.rs` |
//! | offset of the accelerometer, learnt in stances | `offset.rs` |
//! | orientation, for the removal of gravity | `attitude.rs` |
//! | rest detection: how still the IMU is, for the three steps that ask | `rest.rs` |
//! | gyroscope bias, learnt at rest | `gyro_bias.rs` |
//! | probability of stillness, with limits learnt from the foot | `self_calibrating.rs` |
//! | rolling: a foot that turns about a point on the ground | `roll.rs` |
//! | debounced decision, and the phase if the load is known | `phase.rs` |
//! | standard deviation of a zero-velocity measurement | `velocity.rs` |
//! | what comes out: probabilities, decision, and the reasons to doubt them | `estimate.rs`, `flags.rs` |
//!
//! [`half_widths`] has the same steps, with the paper's density (`kde.rs`) in place of the learnt limits.
//!
//! The steps use these files:
//!
//! | file | content |
//! |---|---|
//! | `params.rs`, `parameter.rs`, `range.rs` | parameters, and their ranges |
//! | `config.rs`, `stream.rs` | checked parameters, and facts about the samples |
//! | `constants.rs`, `learnt.rs` | constants of the self-calibrating estimate, and its state to be stored |
//! | `vector.rs`, `math.rs` | vectors, quaternions and functions with the same bits on every machine |
//!
//! The method is that of Maravgakis, Argiropoulos, Piperakis and Trahanias, *Probabilistic
//! Contact State Estimation for Legged Robots using Inertial Information*, ICRA 2023
//! (arXiv:2303.00538), made causal.

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

pub mod any;
mod attitude;
pub mod clock;
mod config;
mod constants;
mod contact;
pub mod correction;
mod estimate;
mod flags;
pub mod gravity;
mod gyro_bias;
pub mod half_widths;
mod kde;
mod learnt;
mod math;
pub mod mounting;
mod offset;
pub mod parameter;
pub mod params;
mod phase;
mod pipeline;
mod range;
mod rest;
mod roll;
mod sample;
mod self_calibrating;
#[cfg(any(test, feature = "self-check"))]
pub mod self_check;
mod stream;
mod units;
mod vector;
pub mod velocity;

/// Parts of the estimator that benchmarks, checks and tools of this repository use. They may change in any version.
#[doc(hidden)]
pub mod internals {
    pub use crate::attitude::{Alignment, AttitudeFilter};
    pub use crate::kde::DensityEstimator;
    pub use crate::learnt::{AMPLITUDE, SETTLED_AFTER, SPEED};
    pub use crate::math::erf;
    pub use crate::rest::{LARGEST_SWAY, SENSOR_NOISE, SensorNoise};
}

pub use config::Config;
pub use contact::ContactEstimator;
pub use estimate::{Axis, ContactEstimate, PerAxis, Probabilities};
pub use flags::{Flag, Flags};
pub use learnt::{Learning, Learnt, LearntError};
pub use params::Params;
pub use phase::{Decision, Load, Phase};
pub use range::ParamsError;
pub use sample::{
    AngularRate, ImuSample, LinearAcceleration, Saturation, SpecificForce, Timestamp, Validity,
};
pub use stream::{Gravity, Stream};
pub use vector::{Quaternion, Vec3};
pub use velocity::VelocitySigma;

/// Compiles the README's example.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    #[test]
    fn first_page_names_every_item_and_module() {
        let source = include_str!("lib.rs");
        let page: Vec<&str> =
            source.lines().take_while(|line| !line.starts_with("#![no_std]")).collect();
        let page = page.join("\n");
        let items = source.split("\npub use ").skip(1).flat_map(|export| {
            let list = export.split(';').next().expect("a list");
            let (_, list) = list.split_once("::").expect("a path");
            list.trim_matches(['{', '}']).split(',').map(str::trim).filter(|item| !item.is_empty())
        });
        let modules = source.lines().filter_map(|line| line.strip_prefix("pub mod "));
        let modules = modules.map(|module| module.trim_end_matches([';', ' ', '{']));
        let modules = modules.filter(|module| *module != "internals" && *module != "self_check");
        let names: Vec<&str> = items.chain(modules).collect();
        assert!(names.contains(&"ContactEstimator") && names.contains(&"mounting"), "{names:?}");
        for name in names {
            assert!(page.contains(&std::format!("[`{name}`]")), "{name}");
        }
    }
}
