//! A recording that was read from a file: rows on one clock and in order, or repaired until they are, in a temporary file.
//!
//! | step | module |
//! |---|---|
//! | an opened file: a text or a container | [`container`] |
//! | rows, as a reader of a format appends them, and the result: [`Stored`] | [`recording`] |
//! | samples in memory while they are few, in a temporary file beyond that | [`spool`] |
//! | the rate of the rows; whether their times jitter; smooth times, in a file and live | [`rate`]; `jitter`; [`smooth`], [`live`] |
//! | recorded contacts as the estimates | [`contacts`] |
//! | errors, with their position; errors in messages of bags | [`error`]; [`bag_problem`] |
//! | dates with times | [`iso8601`] |

pub mod bag_problem;
pub mod contacts;
pub mod container;
pub mod error;
pub mod iso8601;
mod jitter;
mod list;
pub mod live;
pub mod rate;
pub mod recording;
pub mod smooth;
pub mod spool;

pub use recording::{
    About, Loaded, OLDEST_LOAD_US, RecordedEstimate, Refused, Repairs, Rows, SampleClock, Stored,
    StreamedSample,
};
