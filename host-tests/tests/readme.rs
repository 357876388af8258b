//! The README's picture and the figures that no other test makes.

use firmware::imu::default_params;
use footfall::plot;
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams, record};
use host_tests::committed::{assert_current, assert_readme_block, workspace};
use recordings::recording::Recording;
use recordings::replay::replay;
use scoring::metrics::{Latency, Metrics};
use scoring::scored::Scored;

fn demo_recording() -> Recording {
    record(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED)
}

#[test]
fn the_picture_is_what_the_demo_draws() {
    let recording = demo_recording();
    let estimates = replay(&recording, &default_params()).expect("the preset");
    let svg = plot::svg(&recording, &estimates).expect("a picture");
    assert_current(&workspace().join("docs/demo.svg"), &svg);
}

#[test]
fn the_demos_figures_are_what_the_demo_prints() {
    let recording = demo_recording();
    let estimates = replay(&recording, &default_params()).expect("the preset");
    let metrics = Metrics::of(&Scored::collect(&recording.samples, &estimates)).expect("labels");
    let latency = |latency: &Latency| {
        let median_ms = latency.median_s.expect("transitions") * 1e3;
        format!("{median_ms:.0} ms (median of {})", latency.followed)
    };
    let table = format!(
        "| RMSE | ROC-AUC | F1 at 0.5 | rest to P > 0.5 | motion to P ≤ 0.5 |\n\
         |---|---|---|---|---|\n\
         | {:.3} | {:.3} | {:.3} | {} | {} |\n",
        metrics.rmse,
        metrics.roc_auc.expect("both labels"),
        metrics.f1_at_0_5.expect("both labels"),
        latency(&metrics.latency_on),
        latency(&metrics.latency_off),
    );
    assert_readme_block("demo", &table);
}
