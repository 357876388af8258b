//! Many recordings, one after the other or on many machines, into tables of Parquet.
//!
//! [`estimate_recording`] does all the work on one recording: a program calls it for each of a tree on the
//! threads of one machine, a cluster on its machines. The bytes of its files depend on the recording, its
//! identity, the settings and the version alone.
//!
//! | step | file |
//! |---|---|
//! | the recordings of a tree; what their paths say | [`sources`], [`pattern`] |
//! | what a recording is called, and where its files go | [`identity`] |
//! | what it is estimated with | [`settings`] |
//! | whether a file is the one it was | [`fingerprint`] |
//! | one recording: its samples and events as tables, then what it comes to | [`recording`] |
//! | the row that says what it comes to | [`row`] |
//! | what is in the folder of results | `index` |
//! | all recordings: what is up to date, and the rest on all cores | [`run`] |

pub mod fingerprint;
pub mod identity;
mod index;
pub mod pattern;
pub mod recording;
pub mod row;
pub mod run;
pub mod settings;
pub mod sources;
mod tables;

pub use identity::Identity;
pub use recording::{BatchError, Progress, estimate_recording, estimate_recording_watched};
pub use row::{Row, Status};
pub use settings::{FeetWanted, Plausibility, Settings};
