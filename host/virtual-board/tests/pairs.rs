//! Every ordered pair of faults, at once and 12 ms apart. `FOOTFALL_PAIRS` in the environment chooses some of them:
//! those that it names, separated by commas, or with a number N one in N.

mod common;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use common::digest::assert_block_of;
use common::product;
use virtual_board::emulator::wiring::Wiring;
use virtual_board::product::scenario::pairs::{self, Pair};

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
#[ignore = "full: 4900 pairs of faults, an hour"]
fn the_board_survives_two_simultaneous_or_close_faults() {
    let Some(elf) = product() else { return };
    let wish = std::env::var("FOOTFALL_PAIRS").unwrap_or_else(|_| "1".to_owned());
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
    if chosen.len() == all.len() {
        let text = format!(
            "All {} ordered pairs of faults, at once and 12 ms apart: no frame said \"stable\" on invalid data, and the board recovered.\n",
            all.len()
        );
        assert_block_of(&[Wiring::reference().program], "pairs", &text);
    }
}
