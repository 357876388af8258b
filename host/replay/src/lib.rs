//! Replay of recordings: the samples of a foot through the estimator, into tables, events, scores and a summary.
//!
//! | step | module |
//! |---|---|
//! | a stored recording through the estimator | [`fn@replay`], several in parallel by [`jobs`] |
//! | tables of estimates and events | [`EstimateTable`], [`CsvRows`] |
//! | touch-downs, lift-offs and slips among the estimates | [`events`] |
//! | accuracy of probabilities and orientations | [`scoring`] |
//! | summary of a replay, with the parameters of its estimate | [`summary`] |

pub mod events;
mod foot;
pub mod jobs;
pub mod scoring;
mod span;
pub mod summary;
mod table;

pub use foot::{
    Observer, ReplayError, Replayed, RequestedResults, check_samples, findings_beside_contacts,
    replay,
};
pub use span::Span;
pub use table::{CsvRows, EstimateTable, Layout, write_tables};
