//! Throughput of the estimator and of its parts, in samples per second, on a simulated walk.

// The harness' macros make public items without documentation.
#![allow(missing_docs)]

mod walk;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use estimator_core::{
    AttitudeFilter, ContactEstimator, DensityEstimator, Params, WindowLength, erf,
};

/// The kernel density estimate alone, with the paper's parameters, at windows of many lengths:
/// the cost must not grow with the window.
fn kde(c: &mut Criterion) {
    let motion = walk::motion();
    let mut group = c.benchmark_group("kde");
    group.throughput(Throughput::Elements(motion.len() as u64));
    for window in [50, 10, 250, 4000] {
        let params = Params {
            window: WindowLength::Samples(window),
            ..Params::PAPER
        };
        let config = params.validate::<4096>().expect("a preset");
        group.bench_function(format!("paper_{window}"), |b| {
            let mut density = DensityEstimator::new(&config);
            b.iter(|| {
                for &(acceleration, rate) in &motion {
                    black_box(density.push(acceleration, rate));
                }
            });
        });
    }
}

/// Throughput of the attitude filter alone.
fn filter(c: &mut Criterion) {
    let samples = walk::samples();
    let mut group = c.benchmark_group("filter");
    group.throughput(Throughput::Elements(samples.len() as u64));
    let config = Params::DEFAULT.validate::<256>().expect("a preset");
    group.bench_function("step", |b| {
        b.iter(|| {
            let mut filter = AttitudeFilter::new(&config);
            for sample in &samples {
                filter.update(sample);
                black_box(filter.orientation());
            }
        });
    });
}

/// Throughput of the whole estimator with the default preset.
fn pipeline(c: &mut Criterion) {
    let samples = walk::samples();
    let mut group = c.benchmark_group("pipeline");
    group.throughput(Throughput::Elements(samples.len() as u64));
    let config = Params::DEFAULT.validate::<256>().expect("a preset");
    group.bench_function("default", |b| {
        b.iter(|| {
            let mut estimator = ContactEstimator::new(&config);
            for sample in &samples {
                black_box(estimator.update(sample, None));
            }
        });
    });
}

/// The table-based error function compared with `libm::erff`.
fn error_function(c: &mut Criterion) {
    let arguments: Vec<f32> = (0..4000).map(|i| i as f32 * 1.0e-3).collect();
    let mut group = c.benchmark_group("erf");
    group.throughput(Throughput::Elements(arguments.len() as u64));
    group.bench_function("table", |b| b.iter(|| sum_over(&arguments, erf::erf)));
    group.bench_function("libm", |b| b.iter(|| sum_over(&arguments, libm::erff)));
}

fn sum_over(arguments: &[f32], function: impl Fn(f32) -> f32) -> f32 {
    arguments.iter().map(|&x| function(black_box(x))).sum()
}

criterion_group!(benches, kde, filter, pipeline, error_function);
criterion_main!(benches);
