//! Options that commands share.
//!
//! | options | file |
//! |---|---|
//! | reading of recordings, parameters | [`recording`] |
//! | copy of a bag | [`copied`] |
//! | feet on lines: where they stream from, their nodes and names | [`listen`], [`feet`] |
//! | playback of a file | [`played`] |
//! | messages of ROS 2 | [`published`] |

pub mod copied;
pub mod feet;
pub mod listen;
pub mod played;
pub mod published;
pub mod recording;
