//! Walks without end: one plan after the other.

use estimator_core::Timestamp;

use crate::plan::{GaitName, Ground, Plan};
use crate::record::{TICK_US, Walked, Walking};
use crate::sensor::SensorParams;
use crate::track::{Activity, FootState, Track};

/// Duration of a plan, s.
const PLAN_S: f64 = 1800.0;

/// Plans of a walk, each with other steps.
#[derive(Clone, Debug)]
struct Plans {
    seed: u64,
    /// Number of plans so far.
    count: u64,
    phase_s: f64,
}

impl Plans {
    const fn new(seed: u64, phase_s: f64) -> Self {
        Self { seed, count: 0, phase_s }
    }

    /// Returns the next plan, made from its duration in s and its seed.
    fn next(&mut self, make: impl FnOnce(f64, u64) -> Plan) -> Plan {
        let seed = self.seed.wrapping_add(self.count << 32);
        self.count += 1;
        let mut plan = make(PLAN_S, seed);
        plan.standing += self.phase_s;
        plan
    }
}

/// Motion of a foot in a gait, until another gait is selected. A plan ends where the foot stands, and the next begins
/// there.
#[derive(Clone, Debug)]
pub struct EndlessGait {
    gait: GaitName,
    /// Gait that begins when the foot next stands.
    next: Option<GaitName>,
    plans: Plans,
    track: Track,
    began_s: f64,
}

impl EndlessGait {
    /// Creates a foot that begins a gait at time 0, delayed by `phase_s` against other feet. Each seed gives
    /// different steps.
    #[must_use]
    pub fn new(gait: GaitName, seed: u64, phase_s: f64) -> Self {
        let mut plans = Plans::new(seed, phase_s);
        Self { gait, next: None, track: track(gait, &mut plans), plans, began_s: 0.0 }
    }

    /// Changes the gait when the foot next stands. The foot then first stands for two seconds.
    pub const fn change(&mut self, gait: GaitName) {
        self.next = Some(gait);
    }

    /// State of the foot at a time, s. Times must not decrease.
    pub fn at(&mut self, time_s: f64) -> FootState {
        let state = self.track.at(time_s - self.began_s);
        let is_over = time_s - self.began_s >= PLAN_S;
        if (is_over || self.next.is_some()) && state.activity == Activity::Standing {
            self.gait = self.next.take().unwrap_or(self.gait);
            self.track = track(self.gait, &mut self.plans);
            self.began_s = time_s;
            return self.track.at(0.0);
        }
        state
    }
}

fn track(gait: GaitName, plans: &mut Plans) -> Track {
    let plan = plans.next(|seconds, seed| Plan::steady(gait, Ground::Hard, seconds, seed));
    Track::new(&plan)
}

/// Readings of the sensor on a foot that walks rounds of the demo's walk.
pub struct EndlessRounds {
    plans: Plans,
    walking: Walking,
    ticks_left: u64,
    /// Start of the current plan, µs.
    begun_us: u64,
    ticks: u64,
}

impl EndlessRounds {
    /// Creates a foot that begins at time 0, delayed by `phase_s` against other feet. Each seed gives different
    /// steps and another specimen of the sensor.
    #[must_use]
    pub fn new(seed: u64, phase_s: f64) -> Self {
        let mut plans = Plans::new(seed, phase_s);
        let (walking, ticks_left) = walking(&mut plans);
        Self { plans, walking, ticks_left, begun_us: 0, ticks: 0 }
    }

    /// Returns the readings of the next millisecond.
    pub fn tick(&mut self) -> Walked {
        if self.ticks_left == 0 {
            (self.walking, self.ticks_left) = walking(&mut self.plans);
            self.begun_us = self.ticks * TICK_US;
        }
        self.ticks_left -= 1;
        self.ticks += 1;
        let mut walked = self.walking.tick();
        let time = walked.imu.timestamp.as_micros() + self.begun_us;
        walked.imu.timestamp = Timestamp::from_micros(time);
        walked
    }
}

/// Returns the next plan with the specimen of the sensor, and its duration in ticks.
fn walking(plans: &mut Plans) -> (Walking, u64) {
    let plan = plans.next(Plan::rounds);
    let ticks = (plan.duration * 1.0e6) as u64 / TICK_US;
    let walking = Walking::new(&plan, &SensorParams::LSM6DSOX, plans.seed);
    (walking, ticks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gait_begins_where_the_foot_stands_and_walks_endlessly() {
        let mut walk = EndlessGait::new(GaitName::Walk, 1, 0.225);
        let swings = |walk: &mut EndlessGait, from_s: f64, to_s: f64| {
            let mut last = Activity::Standing;
            let mut count = 0;
            for ms in (from_s * 1e3) as u64..(to_s * 1e3) as u64 {
                let now = walk.at(ms as f64 * 1e-3).activity;
                count += u32::from(now == Activity::Swinging && last != now);
                last = now;
            }
            count
        };
        let walked = swings(&mut walk, 0.0, 12.0);
        assert!((9..=12).contains(&walked), "{walked}");
        walk.change(GaitName::Trot);
        let trotted = swings(&mut walk, 12.0, 24.0);
        assert!((15..=20).contains(&trotted), "{trotted}");
        walk.change(GaitName::Stand);
        swings(&mut walk, 24.0, 25.0);
        assert_eq!(swings(&mut walk, 25.0, 30.0), 0);
        walk.change(GaitName::Run);
        let far = PLAN_S + 100.0;
        swings(&mut walk, far, far + 1.0);
        assert!(swings(&mut walk, far + 1.0, far + 11.0) > 15);
    }

    #[test]
    fn a_change_of_gait_does_not_move_the_foot() {
        let mut walk = EndlessGait::new(GaitName::Walk, 1, 0.0);
        let mut last = walk.at(0.0);
        for ms in 1..9_000 {
            if ms == 5_300 {
                walk.change(GaitName::Run);
            }
            let now = walk.at(f64::from(ms) * 1e-3);
            let up = |state: &FootState| state.position.to_array()[2];
            assert!((up(&now) - up(&last)).abs() < 5e-3, "{ms} ms");
            last = now;
        }
    }
}
