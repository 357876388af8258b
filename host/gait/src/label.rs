//! Labels of stable contact, from the foot's own true velocity, not from forces.

use samples::Label;

use crate::track::FootState;

/// Speed above which a foot slips, m/s. Over a stance of 0.3 s it is 1.5 mm, about what a rubber sole gives under
/// load. It is a hundredth of a walking speed of 0.5 m/s, the resulting error of a leg odometry that assumes a
/// fixed foot.
pub const SPEED_LIMIT: f64 = 5e-3;

/// Angular rate above which a foot rocks, rad/s. On a lever of 25 mm, the radius of a GO1's foot, it moves the
/// sensor at half of [`SPEED_LIMIT`].
pub const RATE_LIMIT: f64 = 0.1;

/// Load below which a foot is about to lift off or has only just touched, N: a twelfth of a GO1's weight of 118 N.
pub const LOAD_LIMIT: f64 = 10.0;

/// Shortest rest, s; anything shorter is the turning point of a vibration. It is more than a quarter of the period
/// of the slowest ringing after a hard landing (28 Hz).
pub const SHORTEST_REST: f64 = 0.01;

impl FootState {
    /// Returns whether the foot bears load and neither moves nor turns at this moment.
    #[must_use]
    pub fn is_at_rest_under_load(&self) -> bool {
        self.load >= LOAD_LIMIT
            && self.velocity.length() < SPEED_LIMIT
            && self.angular_rate.length() < RATE_LIMIT
    }
}

/// Returns the label of every sample of a motion: stable if it belongs to a rest under load of at least
/// [`SHORTEST_REST`]. `period` is the time between samples in s.
pub(crate) fn labels(truth: &[FootState], period: f64) -> Vec<Label> {
    truth
        .chunk_by(|a, b| a.is_at_rest_under_load() == b.is_at_rest_under_load())
        .flat_map(|run| {
            let long = run.len() as f64 * period >= SHORTEST_REST;
            let label = if long && run[0].is_at_rest_under_load() {
                Label::Stable
            } else {
                Label::NotStable
            };
            std::iter::repeat_n(label, run.len())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Plan;
    use crate::track::{Activity, Track};
    use samples::space::Vector;

    fn standing() -> FootState {
        Track::new(&Plan::demo(1)).at(0.5)
    }

    #[test]
    fn only_a_loaded_foot_at_rest_is_stable() {
        assert!(standing().is_at_rest_under_load());
        let unloaded = FootState { load: 5.0, ..standing() };
        let sliding = FootState { velocity: Vector::new(0.0, -0.006, 0.0), ..standing() };
        let rocking = FootState { angular_rate: Vector::new(0.0, 0.12, 0.0), ..standing() };
        for state in [unloaded, sliding, rocking] {
            assert!(!state.is_at_rest_under_load(), "{state:?}");
        }
    }

    #[test]
    fn turning_point_of_a_vibration_is_not_rest() {
        let moving = FootState { velocity: Vector::new(0.1, 0.0, 0.0), ..standing() };
        let truth = [vec![moving; 5], vec![standing(); 9], vec![moving; 5], vec![standing(); 10]];
        let labels = labels(&truth.concat(), 1e-3);
        assert!(labels[..19].iter().all(|label| *label == Label::NotStable));
        assert!(labels[19..].iter().all(|label| *label == Label::Stable));
    }

    #[test]
    fn demo_is_stable_in_stance_but_not_in_slip_or_swing() {
        let plan = Plan::demo(1);
        let motion = Track::new(&plan);
        let truth: Vec<FootState> = (0..)
            .map(|ms| f64::from(ms) * 1e-3)
            .take_while(|t| *t < plan.duration)
            .map(|t| motion.at(t))
            .collect();
        let labels = labels(&truth, 1e-3);
        let stable: Vec<&FootState> = truth
            .iter()
            .zip(&labels)
            .filter(|(_, label)| **label == Label::Stable)
            .map(|(state, _)| state)
            .collect();
        assert!(stable.iter().all(|s| s.velocity.length() < SPEED_LIMIT && s.load >= LOAD_LIMIT));
        assert!(stable.iter().all(|s| s.activity != Activity::Swinging));
        let share = stable.len() as f64 / truth.len() as f64;
        assert!((0.4..0.7).contains(&share), "{share}");
        // Samples both slipping and stable are the first and last moments of a slide.
        let slipping = |s: &&FootState| s.activity == Activity::Slipping;
        let all = truth.iter().filter(slipping).count();
        let stable = stable.into_iter().filter(|s| slipping(s)).count();
        assert!(all > 500 && stable < all / 8, "{stable} of {all}");
    }
}
