//! The picture of the demo's walk.

use config::default_params;
use footfall::plot;
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams, record};
use host_tests::committed::{assert_current, workspace};
use samples::estimate::estimates_of;

#[test]
fn the_picture_is_that_of_the_demo() {
    let recording = record(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED);
    let estimates = estimates_of(&recording, &default_params()).expect("the preset");
    let svg = plot::svg(&recording, &estimates).expect("a picture");
    assert_current(&workspace().join("docs/pictures/demo.svg"), &svg);
}
