//! `footfall monitor`: current state of streaming feet.
//!
//! | content | file |
//! |---|---|
//! | state of all feet, from a [`Session`](feet::Session), and events | [`robot`] |
//! | curve of the probability of a foot | [`curve`] |
//! | display on a terminal, and keys | `screen`, `terminal`, `hang_up` |
//! | recording while the display runs | [`recorder`] |
//! | output as lines of text or JSON | [`lines`] |

pub mod curve;
#[cfg(feature = "screen")]
pub mod hang_up;
pub mod lines;
pub mod recorder;
pub mod robot;
#[cfg(feature = "screen")]
pub mod screen;
#[cfg(feature = "screen")]
pub mod terminal;

pub use robot::MonitorState;
