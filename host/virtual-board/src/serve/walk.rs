//! Endless walk of a foot: a gait until another is selected.

use gait::{Activity, FootState, GaitName, Ground, Plan, Track};

/// Duration of a plan, s, after which the foot stands for a while and begins the next plan.
const PLAN_S: f64 = 1800.0;

/// An endless walk.
#[derive(Clone, Debug)]
pub struct Walk {
    gait: GaitName,
    /// Gait that begins when the foot next stands.
    next: Option<GaitName>,
    seed: u64,
    rounds: u64,
    phase_s: f64,
    track: Track,
    began_s: f64,
}

impl Walk {
    /// Creates a foot that begins a gait at time 0, delayed by `phase_s` against other feet. Each seed gives
    /// different steps.
    #[must_use]
    pub fn new(gait: GaitName, seed: u64, phase_s: f64) -> Self {
        Self {
            gait,
            next: None,
            seed,
            rounds: 0,
            phase_s,
            track: track(gait, seed, phase_s),
            began_s: 0.0,
        }
    }

    /// Changes the gait when the foot next stands: it stands for two seconds first.
    pub const fn change(&mut self, gait: GaitName) {
        self.next = Some(gait);
    }

    /// State of the foot at a time, s. Times must not decrease.
    pub fn at(&mut self, time_s: f64) -> FootState {
        let state = self.track.at(time_s - self.began_s);
        let is_over = time_s - self.began_s >= PLAN_S;
        if (is_over || self.next.is_some()) && state.activity == Activity::Standing {
            self.gait = self.next.take().unwrap_or(self.gait);
            self.rounds += 1;
            let seed = self.seed.wrapping_add(self.rounds << 32);
            self.track = track(self.gait, seed, self.phase_s);
            self.began_s = time_s;
            return self.track.at(0.0);
        }
        state
    }
}

fn track(gait: GaitName, seed: u64, phase_s: f64) -> Track {
    let mut plan = Plan::steady(gait, Ground::Hard, PLAN_S, seed);
    plan.standing += phase_s;
    Track::new(&plan)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gait_begins_where_the_foot_stands_and_walks_endlessly() {
        let mut walk = Walk::new(GaitName::Walk, 1, 0.225);
        let swings = |walk: &mut Walk, from_s: f64, to_s: f64| {
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
        let mut walk = Walk::new(GaitName::Walk, 1, 0.0);
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
