//! Tests of settings. The default bandwidths match the sensor's noise, and no setting that another node of the bus can
//! write to a walking foot hides its swings.

use config::default_params;
use estimator_core::any::{AnyParams, Method};
use estimator_core::half_widths::HalfWidthParams;
use estimator_core::parameter::Parameter;
use estimator_core::{Axis, Decision, PerAxis};
use feet::foot::Named;
use gait::{Activity, GaitName, Ground, Plan, SensorParams, simulate};
use host_tests::committed::assert_block;
use lsm6dsox::Config;
use samples::estimate::estimates_of;
use wire::Address;
use wire::dictionary::index;

/// The bandwidths are in the estimator and the noise is in the driver, and neither crate knows the other.
#[test]
fn the_default_bandwidths_match_the_sensor_noise() {
    let noise = Config::FRESH_KILOHERTZ.noise();
    let force = noise.specific_force.expect("a known cut-off");
    let rate = noise.angular_rate.expect("a known cut-off");
    let expected = [force, force, force, rate, rate, rate];
    let defaults = HalfWidthParams::DEFAULT.bandwidth.to_array();
    for ((axis, default), noise) in Axis::ALL.into_iter().zip(defaults).zip(expected) {
        let off = (default / noise - 1.0).abs();
        assert!(off < 0.01, "{}: {default} for {noise}", axis.name());
    }
    assert_eq!(default_params().half_widths.bandwidth.to_array(), expected);
}

/// Share of the swings of walks with these settings in which a decision is "not stable".
fn swings_seen(params: &AnyParams) -> f64 {
    let (mut seen, mut all) = (0, 0);
    for (gait, seed) in [(GaitName::Walk, 1), (GaitName::Trot, 2), (GaitName::Run, 3)] {
        let plan = Plan::steady(gait, Ground::Hard, 20.0, seed);
        let simulation = simulate(&plan, &SensorParams::LSM6DSOX_WARMING, seed);
        let estimates = estimates_of(&simulation.recording, params).expect("within the limits");
        let swings = |index: &usize| simulation.truth[*index].activity == Activity::Swinging;
        let indices: Vec<usize> = (0..estimates.len()).collect();
        for swing in indices.chunk_by(|a, b| swings(a) == swings(b)) {
            if swings(&swing[0]) {
                all += 1;
                let falls = |index: &usize| estimates[*index].decision == Decision::NotStable;
                seen += u32::from(swing.iter().any(falls));
            }
        }
    }
    f64::from(seen) / f64::from(all)
}

#[test]
fn settings_at_their_limits_leave_swings_that_are_not_stable() {
    let most = |parameter: Parameter| parameter.row().most;
    let default = default_params();
    let half_width = PerAxis::by_sensor(most(Parameter::HalfWidthAx), most(Parameter::HalfWidthWx));
    let half_widths = AnyParams {
        method: Method::HalfWidths,
        half_widths: HalfWidthParams { half_width, ..default.half_widths },
        ..default
    };
    let mut delayed = default;
    delayed.params.decision.off_delay = most(Parameter::DecisionOffDelay);
    for (name, params, least) in [
        ("default", default, 1.0),
        ("half-widths", half_widths, 0.95),
        ("off delay", delayed, 0.95),
    ] {
        let seen = swings_seen(&params);
        assert!(seen >= least, "{name}: {seen}");
    }
}

/// Table of settings.
fn table(settings: &[Named]) -> String {
    let mut table =
        "| name | object | values | default | meaning |\n|---|---|---|---|---|\n".to_owned();
    for setting in settings {
        let (name, range, Address { index, subindex }) =
            (setting.name(), setting.range(), setting.address);
        let default = format!("{} {}", setting.text(setting.default(None)), setting.unit());
        let (default, meaning) = (default.trim_end(), setting.meaning().replace('|', "\\|"));
        table +=
            &format!("| `{name}` | 0x{index:04X}:{subindex} | {range} | {default} | {meaning} |\n");
    }
    table
}

#[test]
fn the_document_lists_every_setting_of_a_foot() {
    let block_of = |setting: &Named| match setting.address.index {
        index::WINDOW | index::BANDWIDTH | index::HALF_WIDTH => "half-widths",
        index::DECISION | index::LOAD_INPUT | index::VELOCITY => "decision",
        index::ATTITUDE_FILTER.. => "estimate",
        _ => "lines",
    };
    for (block, count) in
        [("decision", None), ("lines", None), ("estimate", None), ("half-widths", Some(13))]
    {
        let part: Vec<Named> =
            Named::settings().filter(|setting| block_of(setting) == block).collect();
        assert!(count.is_none_or(|count| part.len() == count), "{block}: {}", part.len());
        assert_block("docs/reference/settings.md", block, &table(&part));
    }
}
