//! Interfaces for other programs, on the output of the demo's foot: the decoder in C, `wire/c`, and the example of
//! a consumer in Rust, `wire/examples/listen.rs`.

#[allow(dead_code, reason = "the tests of `wire` compare frames")]
#[path = "../../wire/tests/c/compare.rs"]
mod compare;
#[allow(dead_code, reason = "its `main` calls what is called here")]
#[path = "../../wire/examples/listen.rs"]
mod listen;

use compare::{Language, Program, Sanitizers, committed, readme_program};
use gait::plan::DEMO_SEED;
use gait::{Plan, SensorParams, simulate};
use simulated_robot::walk::{Transmission, walk};

fn demo() -> Transmission {
    let simulation = simulate(&Plan::demo(DEMO_SEED), &SensorParams::LSM6DSOX, DEMO_SEED);
    walk(&simulation).expect("the default settings")
}

/// Checks lines of P and phase against the estimates of the foot; `foot` is the prefix of a line.
fn assert_estimates(printed: &str, foot: &str, sent: &Transmission) {
    assert_eq!(printed.lines().count(), sent.estimates.len());
    for (line, estimate) in printed.lines().zip(&sent.estimates) {
        let (p, phase) = line
            .strip_prefix(foot)
            .and_then(|line| line.split_once(' '))
            .expect("foot, P and phase");
        assert_eq!(phase, estimate.phase.name(), "{line}");
        let error = p.parse::<f32>().expect("a number") - estimate.probabilities.stable;
        assert!(error.abs() < 1.0e-4, "{line} is {error} off");
    }
}

#[test]
fn the_rust_example_prints_the_estimates_of_the_foot() {
    let sent = demo();
    let others = "nonsense\n(1.0) can0 191#R\n(1.0) can0 191#FF\n(1.0) can0 11#00\n";
    let mut printed = Vec::new();
    listen::print((sent.can_log() + others).as_bytes(), &mut printed).expect("memory");
    let printed = String::from_utf8(printed).expect("text");
    assert_estimates(&printed, "FL ", &sent);
}

#[test]
fn the_c_program_of_the_readme_prints_the_estimates() {
    let sent = demo();
    let program = Program::build_of(
        "readme",
        &committed(),
        &readme_program(),
        Language::C11,
        Sanitizers::Off,
    );
    let printed = program.expect("it compiles").print("bin", &sent.uart);
    assert_estimates(&printed.expect("it ends well"), "", &sent);
}
