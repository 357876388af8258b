//! True motion of a foot at any moment, in closed form.
//!
//! A plan becomes a sequence of segments: a stance, the peel, the swing, the next stance. In each, three positions
//! and three angles are a base path plus a few terms. Nothing is integrated, and any moment takes one binary
//! search and a few formulas.
//!
//! Position and velocity are continuous everywhere. So is the acceleration, except at the instants of
//! [`Track::impacts`], where a moving foot meets the ground and a spring takes over.
//!
//! Deliberate simplifications:
//! - The foot has a flat sole on an ankle: in a good stance it does not turn with the leg. A ball
//!   foot fixed to the shank rolls over by a third of a radian in each stance and would want
//!   wider half-widths.
//! - The motion is prescribed, not caused: slips come from the plan rather than from a friction cone,
//!   and the load is a profile plus what the landing's deceleration adds.
//! - The position is that of the sensor; there is no lever between it and the sole.

use recordings::samples::space::{Rotation, Vector};

use crate::activity::Activity;
use crate::plan::Plan;
use crate::segment::{Kind, Segment};
use crate::stride::{standing_still, stride};
use crate::turn::from_roll_pitch_yaw;

/// True state of a foot at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootState {
    /// World frame, m; x forward, y to the left, z up.
    pub position: Vector,
    /// World frame, m/s.
    pub velocity: Vector,
    /// World frame, m/s².
    pub acceleration: Vector,
    /// Sensor → world.
    pub orientation: Rotation,
    /// Sensor frame, rad/s.
    pub angular_rate: Vector,
    /// Vertical load, N; never negative.
    pub load: f64,
    /// Activity of the foot.
    pub activity: Activity,
    /// Distance slid since touch-down, along the path, m. Ringing and sinking do not count.
    pub slip: f64,
}

/// True motion of a foot that follows a plan.
#[derive(Clone, Debug)]
pub struct Track {
    standing: Segment,
    /// Segments in order of time; the last never ends.
    strides: Vec<Segment>,
}

impl Track {
    /// Computes the segments of a plan.
    #[must_use]
    pub fn new(plan: &Plan) -> Self {
        let standing = standing_still(plan.standing, plan.steps.first());
        let mut strides: Vec<Segment> = Vec::with_capacity(3 * plan.steps.len());
        let mut time = plan.standing;
        for (index, step) in plan.steps.iter().enumerate() {
            let before = strides.last().unwrap_or(&standing);
            let segments = stride(before, time, step, plan.steps.get(index + 1));
            strides.extend(segments);
            time += step.duration();
        }
        Self { standing, strides }
    }

    /// Returns the state at time `t` in s from the beginning; before it, as at the beginning.
    #[must_use]
    pub fn at(&self, t: f64) -> FootState {
        let begun = self.strides.partition_point(|segment| segment.start <= t);
        let segment = self.strides[..begun].last().unwrap_or(&self.standing);
        let [x, y, z, roll, pitch, yaw] = segment.pose(t);
        let (orientation, angular_rate) = from_roll_pitch_yaw([roll, pitch, yaw]);
        FootState {
            position: Vector::new(x.value, y.value, z.value),
            velocity: Vector::new(x.rate, y.rate, z.rate),
            acceleration: Vector::new(x.acceleration, y.acceleration, z.acceleration),
            orientation,
            angular_rate,
            load: segment.load(t, z.acceleration),
            activity: segment.activity(t),
            slip: segment.slip(t),
        }
    }

    /// Returns the instants of touch-down in s, where the acceleration jumps, in order of time.
    pub fn impacts(&self) -> impl Iterator<Item = f64> {
        let stances = self.strides.iter().filter(|s| matches!(s.kind, Kind::Stance { .. }));
        stances.map(|segment| segment.start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{GaitName, Ground};

    /// Wide enough for rounding, short enough for the fastest ring: errors stay below 1e-5 of
    /// the quantity's peak.
    const HALF_STEP: f64 = 2e-6;

    /// Returns moments of a motion, every 0.37 ms, without an impact within the difference quotient.
    fn moments(plan: &Plan, motion: &Track) -> Vec<f64> {
        let impacts: Vec<f64> = motion.impacts().collect();
        (1..)
            .map(|k| f64::from(k) * 3.7e-4)
            .take_while(|t| *t < plan.duration)
            .filter(|t| impacts.iter().all(|impact| (impact - t).abs() > 2.0 * HALF_STEP))
            .collect()
    }

    fn plans() -> Vec<Plan> {
        let steady = |gait, ground| Plan::steady(gait, ground, 8.0, 5);
        vec![
            Plan::demo(1),
            steady(GaitName::Trot, Ground::Hard),
            steady(GaitName::Run, Ground::Greased),
            steady(GaitName::Trot, Ground::Soft),
        ]
    }

    #[test]
    fn velocity_and_acceleration_are_the_derivatives_of_position() {
        for plan in plans() {
            let motion = Track::new(&plan);
            for t in moments(&plan, &motion) {
                let (a, b) = (motion.at(t - HALF_STEP), motion.at(t + HALF_STEP));
                let now = motion.at(t);
                let slope = |from: Vector, to: Vector| (to - from) * (0.5 / HALF_STEP);
                let velocity_error = slope(a.position, b.position) - now.velocity;
                let acceleration_error = slope(a.velocity, b.velocity) - now.acceleration;
                assert!(velocity_error.length() < 1e-5, "{t}: {velocity_error:?}");
                assert!(acceleration_error.length() < 1e-2, "{t}: {acceleration_error:?}");
            }
        }
    }

    #[test]
    fn angular_rate_matches_the_change_of_orientation() {
        for plan in plans() {
            let motion = Track::new(&plan);
            for t in moments(&plan, &motion) {
                let (a, b) = (motion.at(t - HALF_STEP), motion.at(t + HALF_STEP));
                let now = motion.at(t);
                assert!(
                    (now.orientation.w.powi(2) + now.orientation.v.length().powi(2) - 1.0).abs()
                        < 1e-12
                );
                for axis in [Vector::new(1.0, 0.0, 0.0), Vector::new(0.0, 0.6, 0.8)] {
                    let moved = b.orientation.to_world(axis) - a.orientation.to_world(axis);
                    // d/dt (R u) = R (ω × u).
                    let omega = now.angular_rate;
                    let turning = Vector::new(
                        omega.y * axis.z - omega.z * axis.y,
                        omega.z * axis.x - omega.x * axis.z,
                        omega.x * axis.y - omega.y * axis.x,
                    );
                    let error = moved * (0.5 / HALF_STEP) - now.orientation.to_world(turning);
                    assert!(error.length() < 1e-5, "{t}: {error:?}");
                }
            }
        }
    }

    #[test]
    fn only_the_acceleration_jumps_at_impacts() {
        let motion = Track::new(&Plan::demo(1));
        assert_eq!(motion.impacts().count(), 12);
        for impact in motion.impacts() {
            let (before, after) = (motion.at(impact - 1e-9), motion.at(impact + 1e-9));
            assert!((after.position - before.position).length() < 1e-8);
            assert!((after.velocity - before.velocity).length() < 1e-6);
            assert!((after.angular_rate - before.angular_rate).length() < 1e-5);
            assert!((after.acceleration - before.acceleration).length() > 5.0);
            assert_eq!(before.activity, Activity::Swinging);
            assert_eq!(after.activity, Activity::Landing);
        }
    }

    #[test]
    fn swing_is_6_to_9_cm_high_and_pitches_by_30_degrees() {
        let plan = Plan::steady(GaitName::Walk, Ground::Hard, 12.0, 2);
        let motion = Track::new(&plan);
        let states: Vec<FootState> =
            (0..12_000).map(|ms| motion.at(f64::from(ms) * 1e-3)).collect();
        let highest = states.iter().map(|s| s.position.z).fold(0.0, f64::max);
        assert!((0.06..0.09).contains(&highest), "{highest}");
        let lowest = states.iter().map(|s| s.position.z).fold(0.0, f64::min);
        assert!(lowest > -0.004, "{lowest}");
        // World height of the sensor's x axis: positive where the toes are up.
        let toes = states.iter().map(|s| s.orientation.to_world(Vector::new(1.0, 0.0, 0.0)).z);
        let up = toes.clone().fold(0.0, f64::max);
        let down = toes.fold(0.0, f64::min);
        let sine = 0.35..0.65;
        assert!(sine.contains(&up), "{up}");
        assert!(sine.contains(&-down), "{down}");
    }

    #[test]
    fn hard_landings_pass_eight_g_and_soft_ones_stay_below_five() {
        let peak = |ground| {
            let plan = Plan::steady(GaitName::Walk, ground, 30.0, 2);
            let motion = Track::new(&plan);
            let landing = |impact: f64| {
                let after = (0..500).map(|k| impact + f64::from(k) * 1e-4);
                let peaks = after.map(|t| motion.at(t).acceleration.length() / 9.81);
                peaks.fold(0.0, f64::max)
            };
            motion.impacts().map(landing).collect::<Vec<f64>>()
        };
        assert!(peak(Ground::Hard).iter().all(|g| (8.0..30.0).contains(g)));
        assert!(peak(Ground::Soft).iter().all(|g| (1.0..5.0).contains(g)));
    }

    #[test]
    fn slides_go_as_far_as_planned_under_load() {
        let plan = Plan::demo(1);
        let motion = Track::new(&plan);
        let impacts: Vec<f64> = motion.impacts().collect();
        for (step, impact) in plan.steps.iter().zip(impacts) {
            let end = motion.at(impact + step.standing() - 1e-6);
            let planned: f64 = step.slips.iter().map(|slip| slip.distance).sum();
            assert!((end.slip - planned).abs() < 1e-6);
            for slip in &step.slips {
                let middle = motion.at(impact + slip.onset + 0.5 * slip.duration);
                assert_eq!(middle.activity, Activity::Slipping);
                assert!(middle.velocity.length() > 0.1);
                assert!(middle.load > 20.0);
            }
        }
    }

    #[test]
    fn swinging_foot_has_neither_load_nor_slip() {
        let plan = Plan::steady(GaitName::Trot, Ground::Greased, 8.0, 2);
        let motion = Track::new(&plan);
        let states = moments(&plan, &motion).into_iter().map(|t| motion.at(t));
        let in_the_air: Vec<FootState> =
            states.filter(|state| state.activity == Activity::Swinging).collect();
        assert!(in_the_air.len() > 1000);
        for state in in_the_air {
            assert_eq!((state.load, state.slip), (0.0, 0.0));
        }
    }

    #[test]
    fn the_foot_stands_before_the_beginning_and_after_the_end() {
        let plan = Plan::demo(1);
        let motion = Track::new(&plan);
        for t in [-5.0, 0.0, 1.9, plan.duration, 1e6] {
            let state = motion.at(t);
            assert_eq!(state.activity, Activity::Standing);
            assert_eq!(state.velocity.length(), 0.0, "{t}");
            assert!(state.load > 20.0);
        }
    }
}
