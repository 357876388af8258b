//! Simulated walking foot: its true motion, and the readings of its IMU.
//!
//! The modules, from the plan to the sample:
//!
//! | step | module |
//! |---|---|
//! | steps in numbers, and ground | [`plan`]; a grid of slips, [`slips`] |
//! | true motion and activity at any moment, in closed form | [`track`] |
//! | walks without end | [`EndlessGait`], [`EndlessRounds`] |
//! | four feet, the base above them and the joints between | [`quadruped`] |
//! | whether the foot is in stable contact, from its own velocity | [`label`] |
//! | specimen of the sensor, and its stimulus | [`sensor`] |
//! | robot around it: other feet, SYNCs, load reports | [`control`] |
//! | sensor registers, read at 1 kHz as the foot reads them: a recording | [`record`](mod@record) |
//!
//! The sensor itself is [`lsm6dsox::sim`], register for register.
//!
//! The truth is kinematic: motion, load and slips are prescribed as smooth functions of time, not simulated from
//! bodies and forces. Velocity, acceleration and label are therefore exact, and an estimator is not measured
//! against another estimator. The simulation does not show how often a real robot slips, and a score reached here
//! is not a score on a robot.
//!
//! The same plan, sensor and seed give the same bits on every machine: f64 arithmetic, square
//! roots, and `libm` for everything else.

pub mod control;
mod endless;
mod jet;
pub mod label;
pub mod plan;
pub mod quadruped;
mod random;
pub mod record;
pub mod sensor;
mod shape;
pub mod slips;
pub mod track;

pub use endless::{EndlessGait, EndlessRounds};
pub use plan::{GaitName, Ground, Plan, Rests, RobotParams};
pub use quadruped::Quadruped;
pub use record::{Simulation, Walked, Walking, record, simulate};
pub use sensor::{SensorParams, Temperature};
pub use track::{Activity, FootState, Track};
