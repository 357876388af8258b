//! `footfall monitor`: feet that stream, as they are now.
//!
//! | what | file |
//! |---|---|
//! | a foot: its newest contact, its rate, its faults | [`foot`] |
//! | all feet, and what has happened | [`robot`] |
//! | what comes, taken in until something is to be shown | [`listen`] |
//! | on a terminal: the picture, and the keys | `screen`, `terminal` |
//! | recorded beside the picture | [`recorder`] |
//! | as lines of text or JSON, elsewhere | [`lines`] |

pub mod foot;
pub mod lines;
pub mod listen;
pub mod recorder;
pub mod robot;
#[cfg(feature = "screen")]
pub mod screen;
#[cfg(feature = "screen")]
pub mod terminal;

pub use robot::Robot;
