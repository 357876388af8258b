//! Feet that stream: where their bytes come from, in one spelling for every command.
//!
//! | what | module |
//! |---|---|
//! | how a source is written: `uart:/dev/ttyACM0`, `can:can0`, `demo:feet=4` | [`source`] |
//! | a line to feet: what arrives and what is sent, and what goes wrong | [`link`] |
//! | the lines: a serial port, an slcan adapter, a CAN interface, a file that is played | [`link`]'s files |
//! | a robot whose feet are simulated, and run the board's own program | [`robot`] |
//! | a line that is read by a thread of its own, and opened again when it breaks | [`feed`] |
//! | one foot, asked and set over its line | [`foot`] |
//! | the foot's clock on that of the receiver | [`clock`] |
//! | its rate and jitter, and whether one board alone sends them | [`newest_second`] |
//!
//! What the bytes mean, [`decode::live`] knows.

pub mod clock;
pub mod feed;
pub mod foot;
pub mod link;
pub mod newest_second;
pub mod robot;
pub mod source;

pub use feed::Feed;
pub use link::{Arrival, Link, LinkError, Sending};
pub use newest_second::NewestSecond;
pub use source::Source;
