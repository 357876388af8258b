//! States of a Unitree robot whose forces of the feet are those of the estimates, for programs that compare them with a
//! threshold.

use crate::ros::compat::{FEET, RIGHT_FIRST, STANDS};
use estimator_core::Load;
use recordings::input::bag::{Channel, Replacement};

/// Names of the forces, in Unitree's order.
const FORCES: [&str; 4] = ["foot_force[0]", "foot_force[1]", "foot_force[2]", "foot_force[3]"];

/// Source of the states, and unit of their forces.
#[derive(Clone, Debug, PartialEq)]
pub struct LowStates {
    /// Topic of the robot's states.
    pub topic: String,
    /// Factor of the loads; `None` for decisions, [`STANDS`] or 0.
    pub scale: Option<f64>,
}

/// Newest forces, and the fields that they replace.
pub(super) struct LowState {
    of: LowStates,
    /// Forces in the order of [`FEET`].
    forces: [f64; FEET.len()],
    /// Fields of the messages of the newest channel.
    replacement: Option<(Channel, Replacement)>,
    /// Whether a message was replaced.
    pub(super) is_found: bool,
}

impl LowState {
    pub(super) fn new(of: &LowStates) -> Self {
        Self { of: of.clone(), forces: [0.0; FEET.len()], replacement: None, is_found: false }
    }

    /// Sets the force of a foot in the order of [`FEET`]; an unknown load is 0.
    pub(super) fn set(&mut self, place: usize, stands: bool, load: Option<Load>) {
        self.forces[place] = match self.of.scale {
            Some(scale) => load.map_or(0.0, |load| scale * f64::from(load.0)),
            None if stands => f64::from(STANDS),
            None => 0.0,
        };
    }

    /// Returns a message with the newest forces; `None` for a message of another topic.
    ///
    /// # Errors
    /// Half a sentence: the message has no forces of four feet.
    pub(super) fn replaced(
        &mut self,
        channel: &Channel,
        message: &[u8],
    ) -> Result<Option<Vec<u8>>, String> {
        if channel.topic != self.of.topic {
            return Ok(None);
        }
        self.is_found = true;
        let replacement = match &mut self.replacement {
            Some((of, replacement)) if of == channel => replacement,
            other => {
                let new = Replacement::of(channel, &FORCES)?;
                &mut other.insert((channel.clone(), new)).1
            }
        };
        let forces = RIGHT_FIRST.map(|foot| self.forces[foot]);
        replacement.replaced(message, &forces).map(Some)
    }
}
