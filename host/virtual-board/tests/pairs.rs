//! Every ordered pair of faults, at once and 12 ms apart. By default a few of them run; with `FOOTFALL_PAIRS=1` in
//! the environment all, and the README gets the result; with another number N one in N; with names separated by
//! commas only these.

mod common;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use common::{is_built_here, product};
use host_tests::committed::assert_block;
use virtual_board::product::scenario::pairs::{self, Pair};

/// By default one pair in this many runs: a prime, so that all kinds occur.
const STRIDE: usize = 97;

/// Runs pairs on all cores. Returns the names of those with violations, and the violations.
fn run(elf: &[u8], pairs: &[Pair]) -> Vec<(String, Vec<String>)> {
    let next = AtomicUsize::new(0);
    let wrong = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(pair) = pairs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let violations = match pair.run(elf) {
                        Ok(outcome) => outcome.violations,
                        Err(problem) => vec![problem.to_string()],
                    };
                    if !violations.is_empty() {
                        let mut wrong = wrong.lock().expect("no thread panicked");
                        wrong.push((pair.name(), violations));
                    }
                }
            });
        }
    });
    let mut wrong = wrong.into_inner().expect("no thread panicked");
    wrong.sort();
    wrong
}

#[test]
fn the_board_survives_two_simultaneous_or_close_faults() {
    let Some(elf) = product() else { return };
    let wish = std::env::var("FOOTFALL_PAIRS").unwrap_or_else(|_| STRIDE.to_string());
    let all: Vec<Pair> = pairs::all().collect();
    let is_named = |pair: &Pair| wish.split(',').any(|name| name == pair.name());
    let chosen: Vec<Pair> = match wish.parse::<usize>() {
        Ok(stride) => all.iter().copied().step_by(stride.max(1)).collect(),
        Err(_) => all.iter().copied().filter(is_named).collect(),
    };
    assert!(!chosen.is_empty(), "no pair is called {wish}");
    let wrong = run(&elf, &chosen);
    println!("{} of {} pairs", chosen.len(), all.len());
    assert!(wrong.is_empty(), "{} pairs: {wrong:#?}", wrong.len());
    if chosen.len() == all.len() && is_built_here() {
        let text = format!(
            "All {} ordered pairs of faults, at once and 12 ms apart: no frame said \"stable\" on invalid data, and the board recovered.\n",
            all.len()
        );
        assert_block("host/virtual-board/README.md", "pairs", &text);
    }
}
