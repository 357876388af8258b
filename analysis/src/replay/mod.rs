//! Recordings through the estimator: each sample is read, estimated and written, and then forgotten.
//!
//! | step | file |
//! |---|---|
//! | one foot: its samples, their estimates, and all that is made of them | [`foot`] |
//! | its rows of the table, until those of the feet before it are written | [`part`] |
//! | its table of estimates, as text or Parquet | [`estimates`] |
//! | several recordings at once | [`jobs`] |
//! | the part of it that is asked for | [`span`] |

pub mod estimates;
pub mod foot;
pub mod jobs;
pub mod part;
pub mod span;
