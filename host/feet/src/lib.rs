//! Lines to feet: reception, decoding, the state of each foot, and requests. Sources have the same syntax in every
//! command.
//!
//! Several sources are the lines of one robot. They become one [`Feed`], whose events one [`Session`] takes. The path of a
//! frame from its line to the contact of a foot:
//!
//! | step | module |
//! |---|---|
//! | a source is named: `uart:/dev/ttyACM0`, `can:can0`, `file:can.log` | [`source`] |
//! | a source opens a line, which receives frames and bytes | [`link`] |
//! | all lines of a robot become one sequence of events, and broken lines are reopened | [`feed`] |
//! | the session passes arrivals to the decoder, and the decoder's messages to the feet that sent them | [`session`] |
//! | the decoder makes a contact of the frames of a sample | [`decode::live`], for each kind of line [`decode`] |
//! | a foot keeps what it sent last, with rate and jitter of its contacts | [`live_foot`] |
//! | the foot's clock is converted to the receiver's clock | [`foot_clock`] |
//!
//! Beside this path:
//!
//! | item | module |
//! |---|---|
//! | an IMU whose samples arrive one by one and are estimated here; their times | [`live_imu`]; `sample_times` |
//! | feet on USB | [`usb`] |
//! | requests to one foot over its line | [`foot`] |
//! | remedies for what feet report, and for errors, which each program expresses in its own words | [`remedy`] |

pub mod decode;
pub mod feed;
pub mod foot;
pub mod foot_clock;
pub mod link;
pub mod live_foot;
pub mod live_imu;
pub mod remedy;
mod sample_times;
pub mod session;
pub mod source;
pub mod usb;

pub use feed::Feed;
pub use link::{Arrival, LineSource, Link, LinkError, Sending};
pub use live_foot::{LiveFoot, NewestSecond};
pub use live_imu::{LiveImu, LiveSample};
pub use remedy::FootHint;
pub use session::{Session, Update};
pub use source::{Playback, Source};
