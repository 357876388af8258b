//! Samples of a foot and files by their first bytes, for all crates that read, make or judge samples.
//!
//! | content | module |
//! |---|---|
//! | a recording: samples with their load and label | [`recording`] |
//! | vectors and rotations in f64, for true orientations | [`space`] |
//! | names of validities in files | [`validity`] |
//! | codes of phases | [`phase`] |
//! | gzip and zstd | [`compressed`] |
//! | kinds of files by their first bytes | [`magic`] |
//! | names of these kinds, and advice for those that are not read | [`foreign`] |
//! | enums whose variants have names | [`mod@named`] |

pub mod compressed;
pub mod foreign;
pub mod magic;
pub mod named;
pub mod phase;
pub mod recording;
pub mod space;
pub mod validity;
