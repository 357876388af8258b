//! A gyroscope bias that drifts while the foot walks costs no stances, although there is no rest in which it could
//! be learnt.

mod labelled;

use estimator_core::Params;
use gait::{GaitName, Ground, Plan, SensorParams, simulate};
use host_tests::changed::with_rate_drifts;
use labelled::stances_found;

/// Maximum share of the stable samples lost by the drift.
const LOST: f64 = 0.01;

#[test]
fn drift_of_the_gyroscope_in_a_walk_costs_no_stances() {
    for gait in [GaitName::Walk, GaitName::Trot, GaitName::Run] {
        let plan = Plan::steady(gait, Ground::Hard, 65.0, 11);
        let recording = simulate(&plan, &SensorParams::LSM6DSOX, 11).recording;
        let without = stances_found(&recording, &Params::DEFAULT);
        for (axis, drifting) in ["x", "y", "z"].iter().zip(with_rate_drifts(&recording)) {
            let with = stances_found(&drifting, &Params::DEFAULT);
            println!("{gait} {axis}: {without:.3} → {with:.3}");
            assert!(with > without - LOST, "{gait} {axis}: {without} → {with}");
        }
    }
}
