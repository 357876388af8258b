//! Cost of a sample, in instructions of the host, compared with its budget.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use host_tests::committed::workspace;
use host_tests::requirements::unmet;
use serde_json::Value;

/// Most instructions per sample, on average over a walk of 5000 samples, x86-64 without extensions.
const BUDGETS: [(&str, f64); 4] = [
    ("kde/paper_50", 800.0),
    ("kde/paper_250", 800.0),
    ("filter/step", 2_000.0),
    ("pipeline/default", 5_000.0),
];
const SAMPLES: f64 = 5000.0;

#[test]
fn samples_keep_their_budgets_for_any_window() {
    let Some(runner) = runner() else {
        return;
    };
    let counts = count_instructions(&runner);
    assert_eq!(counts.len(), BUDGETS.len(), "{counts:?}");
    let count_of = |name: &str| {
        let count = counts.iter().find(|(counted, _)| counted == name);
        let (_, count) = count.unwrap_or_else(|| panic!("{name} was not counted: {counts:?}"));
        *count
    };
    for (name, budget) in BUDGETS {
        let count = count_of(name);
        assert!(
            count <= budget,
            "{name} costs {count:.1} instructions per sample; the budget is {budget}"
        );
    }
    let (short, long) = (count_of("kde/paper_50"), count_of("kde/paper_250"));
    assert!((long / short - 1.0).abs() < 0.01, "{short} and {long}");
}

/// Runs the bench. Returns each benchmark's name with its instructions per sample.
fn count_instructions(runner: &Path) -> Vec<(String, f64)> {
    let output = Command::new(env!("CARGO"))
        .args(["bench", "--package", "estimator-core"])
        .args(["--bench", "instructions", "--", "--output-format=json"])
        .env("GUNGRAUN_RUNNER", runner)
        // Its own directory: a build for release in the other one would keep it waiting for minutes.
        .env("CARGO_TARGET_DIR", workspace().join("target/benches"))
        .current_dir(workspace())
        .output()
        .expect("cargo starts");
    assert!(
        output.status.success(),
        "the bench failed: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    String::from_utf8_lossy(&output.stdout)
        .lines()
        .map(|line| {
            let run: Value = serde_json::from_str(line).expect("a line of JSON for each benchmark");
            let text = |key: &str| run[key].as_str().expect(key).to_owned();
            let metrics = &run["profiles"][0]["data"]["parts"][0]["metrics"];
            let instructions = metrics["Ir"]["values"]["new"].as_f64().expect("a count");
            let name = format!("{}/{}", text("function_name"), text("id"));
            (name, instructions / SAMPLES)
        })
        .collect()
}

/// The program that runs the bench under valgrind, or `None` if a requirement is missing.
fn runner() -> Option<PathBuf> {
    if Command::new("valgrind").arg("--version").output().is_err() {
        unmet("valgrind is not installed (Debian: apt-get install valgrind)");
        return None;
    }
    let installed = workspace().join("target/tools/bin/gungraun-runner");
    let runner = env::var_os("GUNGRAUN_RUNNER").map_or(installed, PathBuf::from);
    if runner.is_file() {
        return Some(runner);
    }
    unmet("gungraun-runner is not installed (.ci/install does it)");
    None
}
