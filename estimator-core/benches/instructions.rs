//! Instructions per walk of 5000 samples, counted by valgrind: exact and repeatable, whatever
//! else the machine does.
//!
//! `host-tests/tests/instructions.rs` runs this and checks the counts against their budgets.

// The harness' macros make public items without documentation, and qualify paths without need.
#![allow(missing_docs, unused_qualifications)]

mod walk;

use std::hint::black_box;

use estimator_core::{
    AngularRate, AttitudeFilter, ContactEstimator, DensityEstimator, ImuSample, LinearAcceleration,
    Params, WindowLength,
};
use gungraun::prelude::*;

type Motion = Vec<(LinearAcceleration, AngularRate)>;

fn paper_density(window: u32) -> (DensityEstimator<256>, Motion) {
    let params = Params {
        window: WindowLength::Samples(window),
        ..Params::PAPER
    };
    let config = params.validate().expect("a preset");
    (DensityEstimator::new(&config), walk::motion())
}

fn default_filter() -> (AttitudeFilter, Vec<ImuSample>) {
    let config = Params::DEFAULT.validate::<256>().expect("a preset");
    (AttitudeFilter::new(&config), walk::samples())
}

fn default_estimator() -> (ContactEstimator<256>, Vec<ImuSample>) {
    let config = Params::DEFAULT.validate().expect("a preset");
    (ContactEstimator::new(&config), walk::samples())
}

// The input is returned, so that dropping it is not counted.

#[library_benchmark(setup = paper_density)]
#[bench::paper_50(50)]
#[bench::paper_250(250)]
fn kde((mut density, motion): (DensityEstimator<256>, Motion)) -> (DensityEstimator<256>, Motion) {
    for &(acceleration, rate) in &motion {
        black_box(density.push(acceleration, rate));
    }
    (density, motion)
}

#[library_benchmark(setup = default_filter)]
#[bench::step()]
fn filter(
    (mut filter, samples): (AttitudeFilter, Vec<ImuSample>),
) -> (AttitudeFilter, Vec<ImuSample>) {
    for sample in &samples {
        filter.update(black_box(sample));
    }
    (filter, samples)
}

#[library_benchmark(setup = default_estimator)]
#[bench::default()]
fn pipeline(
    (mut estimator, samples): (ContactEstimator<256>, Vec<ImuSample>),
) -> (ContactEstimator<256>, Vec<ImuSample>) {
    for sample in &samples {
        black_box(estimator.update(sample, None));
    }
    (estimator, samples)
}

library_benchmark_group!(name = estimator, benchmarks = [kde, filter, pipeline]);
main!(library_benchmark_groups = estimator);
