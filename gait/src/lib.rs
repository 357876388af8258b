//! A walking foot where there is no recording: its true motion, and what its IMU measures.
//!
//! The path from intention to sample, one module a step:
//!
//! | step | module |
//! |---|---|
//! | which steps, on which ground | [`plan`]; a grid of slips, [`slips`] |
//! | one step in numbers | [`step`] |
//! | what the foot does in it | [`Activity`] |
//! | the true motion at any moment, in closed form | [`track`] |
//! | whether the foot is in stable contact, from its own velocity | [`label`] |
//! | the specimen of the sensor, and what acts on it | [`sensor`] |
//! | the robot around it: other feet, SYNCs, reports of load | [`control`] |
//! | its registers, read at 1 kHz as the foot reads them: a recording | [`record`](mod@record) |
//!
//! The sensor itself is [`lsm6dsox::sim`], register for register.
//!
//! The truth is kinematic: motion, load and slips are prescribed as smooth functions of time, not
//! the outcome of a simulation of bodies. So velocity, acceleration and label are exact, and what
//! an estimator is measured against is no other estimator. It says nothing about how often a real
//! robot slips, and a score reached here is no score on a robot.
//!
//! The same plan, sensor and seed give the same bits on every machine: f64 arithmetic, square
//! roots, and `libm` for everything else.

mod activity;
pub mod control;
mod jet;
pub mod label;
pub mod plan;
mod random;
pub mod record;
mod segment;
pub mod sensor;
mod shape;
pub mod slips;
pub mod step;
mod stride;
pub mod track;
mod turn;

pub use activity::Activity;
pub use plan::{GaitName, Ground, Plan, Rests, Robot};
pub use record::{Simulation, Walked, Walking, record, simulate};
pub use sensor::{SensorParams, Temperature};
pub use track::{FootState, Track};
