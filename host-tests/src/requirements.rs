//! Requirements that the machine does not meet. If a test cannot check anything, `FOOTFALL_REQUIRE_EVERYTHING` in the
//! environment decides whether it fails. `1`, which the gate sets, requires tools and recordings. `tools` requires
//! only tools, for machines that cannot fetch third-party recordings. Without the variable, or with `0`, the test
//! reports the missing requirement and passes.

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
