//! Rows of any source in order, on one clock, and their storage.
//!
//! | step | file |
//! |---|---|
//! | order, clock and rate of rows as they are read | `rows`, `times`, `rate` |
//! | samples and contacts in temporary files | `stored`, [`contacts`] |

pub mod contacts;
pub(super) mod rate;
pub(super) mod rows;
pub(super) mod stored;
mod times;
