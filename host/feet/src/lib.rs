//! Lines to feet: reception, decoding, the state of each foot, and requests. Sources have the same syntax in every
//! command.
//!
//! | item | module |
//! |---|---|
//! | syntax of a source: `uart:/dev/ttyACM0`, `can:can0`, `file:can.log` | [`source`] |
//! | line to feet: received and sent data, and errors | [`link`] |
//! | kinds of lines: serial port, slcan adapter, CAN interface, playback of a file | [`link`]'s files |
//! | feet on USB | [`usb`] |
//! | line that is read by its own thread and reopened when it breaks | [`feed`] |
//! | state of all feet of a source, with the changes to show, record or publish | [`session`] |
//! | state of one foot | [`live_foot`] |
//! | requests to one foot over its line | [`foot`] |
//! | conversion of the foot's clock to that of the receiver | [`foot_clock`] |
//! | remedies of errors, which each program expresses in its own words | [`hint`] |
//! | rate and jitter of the contacts, and detection of several boards with one id | [`newest_second`] |
//! | rows of a table from frames and messages, in logs and live | [`decode`] |

pub mod decode;
pub mod feed;
pub mod foot;
pub mod foot_clock;
pub mod hint;
pub mod link;
pub mod live_foot;
pub mod newest_second;
pub mod session;
pub mod source;
pub mod usb;

pub use feed::Feed;
pub use hint::FootHint;
pub use link::{Arrival, LineSource, Link, LinkError, Sending};
pub use live_foot::LiveFoot;
pub use newest_second::NewestSecond;
pub use session::{Session, Update};
pub use source::{Playback, Source};
