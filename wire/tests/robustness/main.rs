//! A short, reproducible run of the fuzz targets in `fuzz/`: their corpus, damaged pieces of
//! it, and bytes from a generator.

mod targets;

use std::fs;
use std::path::Path;

use rand::rngs::SmallRng;
use rand::{RngExt, SeedableRng};
use targets::{TARGETS, Target};

fn corpus(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/robustness/corpus").join(name);
    let mut files: Vec<_> = fs::read_dir(folder)
        .expect("there is a corpus")
        .map(|entry| entry.expect("readable").path())
        .collect();
    files.sort();
    assert!(!files.is_empty(), "{name} has a corpus");
    files.into_iter().map(|file| fs::read(file).expect("readable")).collect()
}

fn run((name, target): Target) {
    let corpus = corpus(name);
    for input in &corpus {
        target(input);
    }
    let mut random = SmallRng::seed_from_u64(0x5EED);
    for round in 0..20_000 {
        let input: Vec<u8> = if round % 2 == 0 {
            // Some inputs of the corpus, one after the other, a few bytes changed or cut off.
            let mut input: Vec<u8> = (0..=random.random_range(0..4))
                .flat_map(|_| corpus[random.random_range(0..corpus.len())].clone())
                .collect();
            for _ in 0..random.random_range(0..4) {
                let index = random.random_range(0..input.len());
                input[index] = random.random();
            }
            input.truncate(input.len() - random.random_range(0..3).min(input.len()));
            input
        } else {
            (0..random.random_range(0..200)).map(|_| random.random()).collect()
        };
        target(&input);
    }
}

#[test]
fn frames_of_any_bytes_keep_their_invariants() {
    run(TARGETS[0]);
}

#[test]
fn a_node_takes_any_frames() {
    run(TARGETS[1]);
}

#[test]
fn settings_from_any_bytes_are_valid() {
    run(TARGETS[2]);
}

#[test]
fn a_uart_stream_of_any_bytes_is_decoded() {
    run(TARGETS[3]);
}
