//! Threshold and Schmitt trigger on the vertical ground reaction force.
//!
//! Both use the force as a share of the robot's weight, so that a threshold applies to other robots as well.
//! The trigger's levels, loaded from 10 % on and until below 5 %, are common in the field (S. Kuindersma et
//! al., *Optimization-based locomotion planning, estimation, and control design for the Atlas humanoid robot*,
//! Autonomous Robots 40, 2016, use such a trigger).

use crate::labelled::GroundReaction;

/// Share of the weight from which the foot is loaded.
pub const ON: f64 = 0.10;

/// Share of the weight below which the foot is no longer loaded.
pub const OFF: f64 = 0.05;

/// Vertical force at each sample, as a share of the robot's weight.
#[must_use]
pub fn load_shares(ground_reaction: &GroundReaction) -> Vec<f64> {
    let share = |[_, _, fz, ..]: &[f64; 6]| fz / ground_reaction.weight;
    ground_reaction.wrenches.iter().map(share).collect()
}

/// State of the trigger at each sample: 1 if loaded, else 0.
#[must_use]
pub fn schmitt_trigger(load_shares: &[f64]) -> Vec<f64> {
    let mut loaded = false;
    let of_sample = |share: &f64| {
        loaded = *share >= if loaded { OFF } else { ON };
        f64::from(u8::from(loaded))
    };
    load_shares.iter().map(of_sample).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trigger_keeps_its_state_between_the_levels() {
        let shares = [0.0, 0.07, 0.1, 0.07, 0.05, 0.049, 0.07];
        assert_eq!(
            schmitt_trigger(&shares),
            [0.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0]
        );
    }

    #[test]
    fn load_share_is_the_vertical_force_over_the_weight() {
        let ground_reaction = GroundReaction {
            wrenches: vec![[7.0, 8.0, 50.0, 9.0, 9.0, 9.0]],
            weight: 200.0,
        };
        assert_eq!(load_shares(&ground_reaction), [0.25]);
    }
}
