//! Pictures of the documents. `cargo xtask pictures` draws them again.

use std::ops::Range;

use config::default_params;
use estimator_core::{ContactEstimate, Flag, Validity};
use footfall::plot::RecordingPlot;
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams, record};
use host_tests::committed::{assert_current, workspace};
use host_tests::drawing::{Panel, board_on_the_foot, flags, way_of_a_sample};
use host_tests::sets::Set;
use replay::events::Events;
use samples::estimate::estimates_of;

/// Interval between two points of a curve, samples.
const EVERY: usize = 5;

fn assert_picture(name: &str, svg: &str) {
    assert_current(&workspace().join("docs/pictures").join(name), svg);
}

fn seconds(estimate: &ContactEstimate) -> f64 {
    estimate.timestamp.as_micros() as f64 * 1e-6
}

/// Part of the estimates from `span.0` to `span.1`, s, with the times of these flags.
fn panel<'a>(
    title: &'a str,
    span: (f64, f64),
    shown: &[Flag],
    estimates: &[ContactEstimate],
) -> Panel<'a> {
    let within = |estimate: &&ContactEstimate| (span.0..=span.1).contains(&seconds(estimate));
    let part: Vec<&ContactEstimate> = estimates.iter().filter(within).collect();
    let points = part.iter().step_by(EVERY);
    let probability =
        points.map(|estimate| (seconds(estimate), f64::from(estimate.probabilities.stable)));
    let times_of = |flag: Flag| {
        let runs = part.chunk_by(|a, b| a.flags.contains(flag) == b.flags.contains(flag));
        let runs = runs.filter(|run| run[0].flags.contains(flag));
        runs.map(|run| (seconds(run[0]), seconds(run[run.len() - 1]))).collect()
    };
    let flags = shown.iter().map(|flag| (flag.name(), times_of(*flag)));
    Panel { title, span, probability: probability.collect(), flags: flags.collect() }
}

#[test]
fn picture_shows_each_flag_of_an_estimate() {
    let mut recording = record(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED);
    recording.samples.retain_mut(|sample| {
        let t = sample.imu.timestamp.as_micros() as f64 * 1e-6;
        if (10.80..10.84).contains(&t) {
            sample.imu.validity = Validity::Stale;
        }
        if (11.60..11.66).contains(&t) {
            sample.imu.validity = Validity::Invalid;
        }
        !(12.70..12.76).contains(&t)
    });
    let estimates = estimates_of(&recording, &default_params()).expect("the preset");
    let start = [Flag::WindowNotFull, Flag::AttitudeNotInitialised, Flag::Unproven, Flag::Settling];
    let faults = [Flag::Saturated, Flag::Stale, Flag::InvalidSample, Flag::TimeGap];
    let panels = [
        panel("The first steps", (0.0, 4.0), &start, &estimates),
        panel("A walk with faults", (10.0, 14.0), &faults, &estimates),
    ];
    let shown = panels.iter().flat_map(|panel| &panel.flags);
    assert_eq!(shown.filter(|(_, times)| !times.is_empty()).count(), Flag::ALL.len());
    assert_picture("flags.svg", &flags(&panels));
}

#[test]
fn picture_shows_the_way_of_a_sample() {
    assert_picture("sample.svg", &way_of_a_sample());
}

#[test]
fn picture_shows_the_board_on_the_foot() {
    assert_picture("mounting.svg", &board_on_the_foot());
}

/// The README's picture: the first steps of a real robot, with the force that the estimate does not use.
#[test]
fn picture_shows_the_first_steps_of_a_go1() {
    const SPAN_S: Range<f64> = 13.0..20.0;
    let Some(walks) = Set::Go1.read() else { return };
    let recording = &walks[0].recording;
    let estimates = estimates_of(recording, &default_params()).expect("the preset");
    let mut figure = RecordingPlot::new("A foot of a GO1", 0, &recording.load_title, SPAN_S);
    let mut events = Events::default();
    for (sample, estimate) in recording.samples.iter().zip(&estimates) {
        events.add(estimate);
        let new: Vec<_> = std::iter::from_fn(|| events.pop()).collect();
        if SPAN_S.contains(&sample.time_s()) {
            figure.add(sample, estimate);
            new.iter().for_each(|event| figure.add_event(event));
        }
    }
    assert_picture("go1.svg", &figure.svg().expect("a picture"));
}
