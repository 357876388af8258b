//! Range of the column `t`, and hints for times whose unit seems wrong.

/// Limit of times around zero, s, so that microseconds are exact: up to here an f64 holds a decimal number to half
/// a microsecond. Seconds since 1970 reach it in 2096.
pub(super) const MAX_TIME_S: f64 = 4.0e9;

/// Hint for times that are plausible only as milliseconds.
pub const MILLISECONDS_HINT: &str =
    "; column t looks like milliseconds, but is read in s: --time-unit ms";

/// Hint for times that are plausible only as microseconds.
pub const MICROSECONDS_HINT: &str =
    "; column t looks like microseconds, but is read in s: --time-unit us";

/// Hint for times that are too close for samples.
pub const BATCHES_HINT: &str = "; rows that arrive in batches are spaced by --times rate";
