//! Cost of the estimator and of its parts on a simulated walk.
//!
//! Without arguments it prints a table of throughputs, each of the fastest of several passes. With `--once NAME` it runs one
//! pass of this case, for `laboratory/measurements/tests/instructions.rs`, which has valgrind count the instructions of
//! [`pass`] alone.

mod walk;

use std::hint::black_box;
use std::time::{Duration, Instant};

use estimator_core::half_widths::{HalfWidthParams, WindowLength};
use estimator_core::internals::erf;
use estimator_core::{ContactEstimator, Params, Stream};

/// Time for which the passes of a case are repeated.
const MEASURED: Duration = Duration::from_secs(2);

/// Name of the case, number of samples in one pass, and the function that runs a pass.
struct Case(&'static str, usize, Box<dyn FnMut()>);

/// The kernel density estimate alone, with the paper's parameters.
fn kde(name: &'static str, window: u32) -> Case {
    let motion = walk::motion();
    let paper = HalfWidthParams { window: WindowLength::Samples(window), ..HalfWidthParams::PAPER };
    let config = paper.validate::<4096>(&Params::DEFAULT, Stream::KILOHERTZ).expect("a preset");
    let mut density = config.density();
    let pass = move || {
        for &(acceleration, rate) in &motion {
            black_box(density.push(acceleration, rate));
        }
    };
    Case(name, walk::SAMPLES, Box::new(pass))
}

/// The attitude filter alone.
fn filter() -> Case {
    let samples = walk::samples();
    let config = Params::DEFAULT.validate().expect("a preset");
    let pass = move || {
        let mut filter = config.attitude_filter(Stream::KILOHERTZ);
        for sample in &samples {
            filter.update(black_box(sample));
        }
        black_box(filter.orientation());
    };
    Case("filter/step", walk::SAMPLES, Box::new(pass))
}

/// The whole estimator with the default preset.
fn pipeline() -> Case {
    let samples = walk::samples();
    let config = Params::DEFAULT.validate().expect("a preset");
    let pass = move || {
        let mut estimator = ContactEstimator::new(&config, Stream::KILOHERTZ);
        for sample in &samples {
            black_box(estimator.update(sample, None));
        }
    };
    Case("pipeline/default", walk::SAMPLES, Box::new(pass))
}

/// An error function.
fn error_function(name: &'static str, function: fn(f32) -> f32) -> Case {
    const ARGUMENTS: usize = 4000;
    let arguments: Vec<f32> = (0..ARGUMENTS).map(|i| i as f32 * 1.0e-3).collect();
    let pass = move || {
        black_box(arguments.iter().map(|&x| function(black_box(x))).sum::<f32>());
    };
    Case(name, ARGUMENTS, Box::new(pass))
}

/// Not inlined, so that valgrind counts its instructions without the instructions of the preparation.
#[inline(never)]
fn pass(run: &mut dyn FnMut()) {
    run();
}

fn main() {
    let cases = [
        // The cost must not grow with the window.
        kde("kde/paper_50", 50),
        kde("kde/paper_250", 250),
        kde("kde/paper_4000", 4000),
        filter(),
        pipeline(),
        error_function("erf/table", erf),
        error_function("erf/libm", libm::erff),
    ];
    let arguments: Vec<String> = std::env::args().collect();
    let once = arguments.iter().position(|argument| argument == "--once");
    let once = once.map(|at| arguments.get(at + 1).expect("the name of a case"));
    for Case(name, samples, mut run) in cases {
        if let Some(wanted) = once {
            if wanted == name {
                pass(&mut run);
            }
            continue;
        }
        let (end, mut fastest) = (Instant::now() + MEASURED, Duration::MAX);
        while Instant::now() < end {
            let begin = Instant::now();
            pass(&mut run);
            fastest = fastest.min(begin.elapsed());
        }
        let rate = samples as f64 / fastest.as_secs_f64() / 1.0e6;
        println!("{name:18} {rate:8.2} million samples/s");
    }
}
