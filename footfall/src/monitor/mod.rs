//! `footfall monitor`: feet that stream, as they are now.
//!
//! | what | file |
//! |---|---|
//! | a foot: its newest contact, its rate, its faults | [`foot`] |
//! | all feet, and what has happened | [`robot`] |
//! | on a terminal | [`screen`] |
//! | recorded beside the picture | [`recorder`] |
//! | as lines of text or JSON, elsewhere | [`lines`] |

pub mod foot;
pub mod lines;
pub mod recorder;
pub mod robot;
pub mod screen;

pub use robot::Robot;
