//! `footfall monitor`: current state of streaming feet.
//!
//! | content | file |
//! |---|---|
//! | state of all feet, from a [`Session`](feet::Session), and events | [`robot`] |
//! | output as lines of text or JSON | [`lines`] |

pub mod lines;
pub mod robot;

pub use robot::MonitorState;
