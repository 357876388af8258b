//! Cost of a sample, in instructions of the host, compared with its budget and with the stored result.

use std::path::PathBuf;
use std::process::Command;

use host_tests::committed::workspace;
use host_tests::requirements::unmet;
use results::{Measurement, rounded};
use serde_json::Value;

/// Case of the bench, the part of the estimate, and the most instructions per sample, on average over a walk of 5000
/// samples, x86-64 without extensions.
const BUDGETS: [(&str, &str, f64); 4] = [
    ("kde/paper_50", "density estimate of preset `paper`, window of 50 samples", 500.0),
    ("kde/paper_250", "the same, 250 samples", 500.0),
    ("filter/step", "attitude filter", 1_200.0),
    ("pipeline/default", "the whole estimate, default preset", 4_500.0),
];
const SAMPLES: f64 = 5000.0;

#[test]
#[ignore = "full: valgrind"]
fn samples_keep_their_budgets_for_any_window() {
    let Some(counts) = count_instructions() else {
        return;
    };
    let mut result = Measurement::new(
        "instructions",
        "Instructions of an x86-64 without extensions for a sample, on average over a walk of 5000 samples, counted by valgrind.",
    )
    .measured_by("cargo test -p measurements instructions:: -- --ignored")
    .tolerance("instructions_per_sample", 0.01);
    for ((name, part, budget), count) in BUDGETS.into_iter().zip(&counts) {
        assert!(
            *count <= budget,
            "{name} costs {count:.1} instructions per sample; the budget is {budget}"
        );
        result.row([
            ("case", name.into()),
            ("part", part.into()),
            ("instructions_per_sample", rounded(*count, 0).into()),
            ("budget", budget.into()),
        ]);
    }
    let [short, long, ..] = counts[..] else {
        panic!("{counts:?}");
    };
    assert!((long / short - 1.0).abs() < 0.01, "{short} and {long}");
    result.assert_current();
}

/// Runs each case of the bench under valgrind. Returns its instructions per sample.
fn count_instructions() -> Option<Vec<f64>> {
    if Command::new("valgrind").arg("--version").output().is_err() {
        unmet("valgrind is not installed (Debian: apt-get install valgrind)");
        return None;
    }
    let bench = bench();
    let count = |(name, ..): (&str, &str, f64)| {
        // Only what `pass` of the bench calls.
        let output = Command::new("valgrind")
            .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
            .arg("--toggle-collect=estimator::pass*")
            .arg(&bench)
            .args(["--once", name])
            .output()
            .expect("valgrind starts");
        let report = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{report}");
        let counted = report.lines().find_map(|line| line.split_once("Collected : "));
        let counted: f64 =
            counted.and_then(|(_, n)| n.parse().ok()).unwrap_or_else(|| panic!("{report}"));
        counted / SAMPLES
    };
    Some(BUDGETS.map(count).to_vec())
}

/// Builds the bench and returns its path.
fn bench() -> PathBuf {
    let output = Command::new(env!("CARGO"))
        .args(["bench", "--locked", "--package", "footfall-estimator"])
        .args(["--bench", "estimator", "--no-run", "--message-format=json"])
        // The bench has a target folder of its own. In the usual one it would wait for minutes for another build.
        .env("CARGO_TARGET_DIR", workspace().join("target/benches"))
        .current_dir(workspace())
        .output()
        .expect("cargo starts");
    let messages = String::from_utf8_lossy(&output.stdout);
    let built = messages.lines().find_map(|line| {
        let message: Value = serde_json::from_str(line).ok()?;
        Some(PathBuf::from(message["executable"].as_str()?))
    });
    built.unwrap_or_else(|| panic!("{}", String::from_utf8_lossy(&output.stderr)))
}
