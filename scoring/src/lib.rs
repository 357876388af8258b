//! How good a contact probability is, and an orientation; for this estimator and for the methods of
//! others.
//!
//! | step | module |
//! |---|---|
//! | a probability beside the truth | [`scored`] |
//! | figures of merit | [`metrics`], [`reliability`]; of a long recording [`running`]; of an orientation, [`inclination`] |
//! | the figures of a method on one recording and on several | [`score`] |
//! | the sets of recordings with labels, and their families | [`sets`] |
//! | the recordings, read or simulated | [`labelled`] |
//! | which recordings may teach which | [`teaching`] |
//! | the methods | [`method`] |
//! | constants chosen without a family | [`left_out`] |
//! | trailing windows, for detectors | [`window`] |
//! | detectors that others published | [`peers`] |
//! | fuzzy c-means | [`fuzzy`] |
//! | the authors' own script | [`authors`] |
//! | a recording at another sample rate | [`resample`] |
//! | the default preset at several sample rates | [`rates`] |
//! | every method on every recording | [`evaluation`] |
//! | positions of a shoe with each detector's zero-velocity measurements | [`odometry`] |

pub mod authors;
mod error;
pub mod evaluation;
pub mod fuzzy;
pub mod inclination;
pub mod labelled;
pub mod left_out;
pub mod method;
pub mod metrics;
pub mod odometry;
pub mod peers;
pub mod rates;
pub mod reliability;
pub mod resample;
pub mod running;
pub mod score;
pub mod scored;
pub mod sets;
pub mod teaching;
#[cfg(test)]
mod testing;
pub mod window;

pub use error::Error;
pub use evaluation::Evaluation;
pub use odometry::Odometry;
