//! What a test does where something it needs is not on the machine.

use std::env;

/// Says that `missing` keeps a test from checking anything.
///
/// # Panics
/// With `FOOTFALL_REQUIRE_EVERYTHING=1` in the environment, as in CI: there nothing may be left
/// unchecked.
pub fn unmet(missing: &str) {
    let required = env::var_os("FOOTFALL_REQUIRE_EVERYTHING").is_some_and(|value| value == "1");
    assert!(!required, "{missing}");
    eprintln!("not checked: {missing}");
}
