//! What a test does where something it needs is not on the machine.

use std::env;
use std::io::{self, Write};

/// Says that `missing` keeps a test from checking anything.
///
/// # Panics
/// With `FOOTFALL_REQUIRE_EVERYTHING=1` in the environment, as `.ci/run` sets it: nothing may be left
/// unchecked.
pub fn unmet(missing: &str) {
    let required = env::var_os("FOOTFALL_REQUIRE_EVERYTHING").is_some_and(|value| value == "1");
    assert!(!required, "{missing}");
    // Past the test harness, which keeps what `eprintln!` says in a test that passes to itself.
    let _ = writeln!(io::stderr(), "not checked: {missing}");
}
