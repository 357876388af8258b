//! The range of the column `t`, and what to suggest where its unit looks wrong.

/// Times must lie within this of zero, s, so that microseconds are exact: up to here an f64 holds
/// a decimal number to half a microsecond. Seconds since 1970 reach it in 2096.
pub(super) const MAX_TIME_S: f64 = 4.0e9;

/// Ends an error where times make sense as milliseconds only.
pub const MILLISECONDS_HINT: &str =
    "; column t looks like milliseconds, but is read in s: --time-unit ms";

/// Ends an error where times make sense as microseconds only.
pub const MICROSECONDS_HINT: &str =
    "; column t looks like microseconds, but is read in s: --time-unit us";

/// Ends an error where times are closer than samples can be.
pub const BATCHES_HINT: &str = "; rows that arrive in batches are spaced by --times rate";
