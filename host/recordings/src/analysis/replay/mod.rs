//! Replay of recordings through the estimator: each sample is read, estimated, written and discarded.
//!
//! | step | file |
//! |---|---|
//! | one foot: its samples, their estimates and the results | [`estimate`] |
//! | rows of a foot, buffered until those of the preceding feet are written | [`part`] |
//! | table of estimates of a foot, as text or Parquet | [`estimates`] |
//! | several recordings in parallel | [`jobs`] |
//! | selected part of a recording | [`span`] |

pub mod estimate;
pub mod estimates;
pub mod jobs;
pub mod part;
pub mod span;
