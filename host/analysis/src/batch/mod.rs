//! Batch estimation of recordings, in sequence or on many machines, into tables of Parquet.
//!
//! [`estimate_recording`] does all the work on one recording: a program calls it on the threads of one machine, a
//! cluster on its machines. The bytes of the files depend only on the recording, its identity, the settings and
//! the version.
//!
//! | step | file |
//! |---|---|
//! | recordings of a tree, and the fields in their paths | [`sources`], [`pattern`] |
//! | identity of a recording, and the path of its files | [`identity`] |
//! | settings of the estimation | [`settings`] |
//! | detection of changed files | [`fingerprint`] |
//! | one recording: its samples and events as tables, then its results | [`recording`] |
//! | row with the results of a foot | [`row`] |
//! | index of the results folder | `index` |
//! | lengths and times of recordings that were hashed | `notes` |
//! | all recordings: skips those up to date, estimates the rest on all cores | [`run`] |

pub mod fingerprint;
pub mod identity;
mod index;
mod notes;
pub mod pattern;
pub mod recording;
pub mod row;
pub mod run;
pub mod settings;
pub mod sources;
mod tables;

pub use identity::Identity;
pub use notes::Verify;
pub use recording::{BatchError, Progress, estimate_recording};
pub use row::{BatchRow, Status};
pub use settings::{BatchSettings, FeetWanted, Plausibility};
