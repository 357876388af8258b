//! Cost of a sample, in instructions of the host, compared with its budget in both directions: an unintended gain
//! needs an explanation as much as a loss does.

use std::env;
use std::path::{Path, PathBuf};
use std::process::Command;

use host_tests::committed::workspace;
use host_tests::requirements::unmet;
use serde_json::Value;

/// Instructions per sample, on average over a walk of 5000 samples, x86-64 without extensions.
const BUDGETS: [(&str, f64); 4] = [
    ("kde/paper_50", 416.3),
    ("kde/paper_250", 416.3),
    ("filter/step", 918.0),
    ("pipeline/default", 2472.9),
];
const TOLERANCE: f64 = 0.03;
const SAMPLES: f64 = 5000.0;

#[test]
fn the_cost_of_a_sample_matches_its_budget() {
    let Some(runner) = runner() else {
        return;
    };
    let counts = count_instructions(&runner);
    assert_eq!(counts.len(), BUDGETS.len(), "{counts:?}");
    for (name, budget) in BUDGETS {
        let (_, count) = counts
            .iter()
            .find(|(counted, _)| counted == name)
            .unwrap_or_else(|| panic!("{name} was not counted: {counts:?}"));
        let ratio = count / budget;
        assert!(
            (1.0 - TOLERANCE..=1.0 + TOLERANCE).contains(&ratio),
            "{name} costs {count:.1} instructions per sample; the budget is {budget}"
        );
    }
}

#[test]
fn a_window_five_times_as_long_has_the_same_cost() {
    let budget = |name| BUDGETS.iter().find(|(n, _)| *n == name).map(|(_, b)| *b);
    let [short, long] = ["kde/paper_50", "kde/paper_250"].map(|n| budget(n).expect("a budget"));
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
