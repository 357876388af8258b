//! Every ordered pair of faults, at once and 12 ms apart: by default a few of them, with
//! `FOOTFALL_PAIRS=1` in the environment all, and the README says what came of them; with another
//! number one in so many.

mod common;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use common::{is_built_here, product};
use host_tests::committed::assert_block;
use virtual_board::scenario::pairs::{self, Pair};

/// By default one in so many: prime, so that all kinds come.
const STRIDE: usize = 97;

/// Runs pairs on all cores: the names of those with objections, and these.
fn run(elf: &[u8], pairs: &[Pair]) -> Vec<(String, Vec<String>)> {
    let next = AtomicUsize::new(0);
    let wrong = Mutex::new(Vec::new());
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(pair) = pairs.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let objections = match pair.run(elf) {
                        Ok(outcome) => outcome.objections,
                        Err(problem) => vec![problem.to_string()],
                    };
                    if !objections.is_empty() {
                        let mut wrong = wrong.lock().expect("no thread panicked");
                        wrong.push((pair.name(), objections));
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
fn two_faults_at_once_or_shortly_after_each_other_are_survived() {
    let Some(elf) = product() else { return };
    let stride = std::env::var("FOOTFALL_PAIRS").ok();
    let stride = stride.and_then(|value| value.parse().ok());
    let stride = stride.unwrap_or(STRIDE).max(1);
    let all: Vec<Pair> = pairs::all().collect();
    let chosen: Vec<Pair> = all.iter().copied().step_by(stride).collect();
    let wrong = run(&elf, &chosen);
    println!("{} of {} pairs", chosen.len(), all.len());
    assert!(wrong.is_empty(), "{} pairs: {wrong:#?}", wrong.len());
    if stride == 1 && is_built_here() {
        let text = format!(
            "All {} ordered pairs of faults, at once and 12 ms apart: no frame said \"stable\" without data, and all was well afterwards.\n",
            all.len()
        );
        assert_block("virtual-board/README.md", "pairs", &text);
    }
}
