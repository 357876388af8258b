//! Handling of requirements that the machine does not meet. `FOOTFALL_REQUIRE_EVERYTHING` in the environment decides
//! whether a test fails that cannot check anything: `1`, as the gate sets it, requires tools and recordings, `tools` only
//! tools, where the recordings of others cannot be fetched. Without it, or with `0`, the test reports that and passes.

use std::env;
use std::io::{self, Write};

/// Reports that a `missing` tool prevents a test from checking anything.
///
/// # Panics
/// If tools are required.
pub fn unmet(missing: &str) {
    report(missing, &["1", "tools"]);
}

/// Reports that a `missing` recording prevents a test from checking anything.
///
/// # Panics
/// If recordings are required.
pub fn no_recording(missing: &str) {
    report(missing, &["1"]);
}

fn report(missing: &str, required_by: &[&str]) {
    let value = env::var("FOOTFALL_REQUIRE_EVERYTHING").unwrap_or_default();
    assert!(!required_by.contains(&value.as_str()), "{missing}");
    // Bypasses the test harness, which captures the output of `eprintln!` in a passing test.
    let _ = writeln!(io::stderr(), "not checked: {missing}");
}
