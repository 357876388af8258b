//! `footfall monitor`: current state of streaming feet.
//!
//! | content | file |
//! |---|---|
//! | state of a foot: newest contact, rate, faults | [`foot`] |
//! | state of all feet, and events | [`robot`] |
//! | reception until the next update | [`listen`] |
//! | display on a terminal, and keys | `screen`, `terminal`, `hang_up` |
//! | recording while the display runs | [`recorder`] |
//! | output as lines of text or JSON | [`lines`] |

pub mod foot;
#[cfg(feature = "screen")]
pub mod hang_up;
pub mod lines;
pub mod listen;
pub mod recorder;
pub mod robot;
#[cfg(feature = "screen")]
pub mod screen;
#[cfg(feature = "screen")]
pub mod terminal;

pub use robot::Robot;
