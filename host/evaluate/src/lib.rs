//! Comparison of the estimator with published methods on all recordings with labels: a research program, which
//! is not part of the product.
//!
//! | step | module |
//! |---|---|
//! | the command line | [`command`] |
//! | the sets of recordings with labels, and their families | [`sets`] |
//! | the recordings, read or simulated | [`labelled`] |
//! | a recording at another sample rate | [`resample`] |
//! | which recordings may teach which | [`teaching`] |
//! | the methods | [`method`] |
//! | constants chosen without a family | [`left_out`] |
//! | trailing windows, for detectors | [`window`] |
//! | detectors that others published | [`peers`] |
//! | fuzzy c-means | [`fuzzy`] |
//! | the authors' own script | [`authors`] |
//! | figures of a method on one recording and on several, by [`scoring`] | [`score`] |
//! | the default preset at several sample rates | [`rates`] |
//! | every method on every recording | [`evaluation`] |
//! | positions of a shoe with each detector's zero-velocity measurements | [`odometry`] |
//! | the results as tables and pictures | [`report`] |

pub mod authors;
pub mod command;
mod error;
pub mod evaluation;
pub mod fuzzy;
pub mod labelled;
pub mod left_out;
pub mod method;
pub mod odometry;
pub mod peers;
pub mod rates;
pub mod report;
pub mod resample;
pub mod score;
pub mod sets;
pub mod teaching;
#[cfg(test)]
mod testing;
pub mod window;

pub use error::Error;
pub use evaluation::Evaluation;
pub use odometry::Odometry;
