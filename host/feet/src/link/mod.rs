//! Lines to feet. A [`LineSource`] opens a [`Link`], which receives [`Arrival`]s and sends requests.
//!
//! | line | file |
//! |---|---|
//! | interface of `SocketCAN` | `can` |
//! | serial line of a foot, and adapter that speaks slcan | [`serial`] |
//! | serial port of both, or the line of a board in lock step | `port` |
//! | playback of a log or a recording | [`file`](mod@file) |
//! | clock of a line, and pace of a playback | [`clock`] |
//! | line of several feet that are asked in turn | `shared` |

#[cfg(target_os = "linux")]
mod can;
pub mod clock;
pub mod file;
mod port;
pub mod serial;
mod shared;

use std::fmt;
use std::io;
use std::sync::Arc;
use std::time::Duration;

use estimator_core::Timestamp;
use options::hint::{InWords, Notice, Vocabulary};
use plausible::Finding;
use thiserror::Error;
use wire::CanFrame;

use crate::decode::ContactRow;
use crate::remedy::FootHint;
use crate::source::{Source, Speed};
pub use clock::LineClock;
pub use file::RecordingError;
use serial::{SerialLine, SlcanAdapter};
pub(crate) use shared::SharedLine;

/// Source of a line, which can be opened more than once. Its text is as on the command line.
pub trait LineSource: fmt::Display + Send {
    /// Opens the line. A recording is played at its original speed unless the source has another.
    ///
    /// # Errors
    /// The device or file cannot be used.
    fn open(&self) -> Result<Box<dyn Link>, LinkError>;

    /// Opens the line for requests and their responses.
    ///
    /// # Errors
    /// The device or file cannot be used.
    fn open_for_requests(&self) -> Result<Box<dyn Link>, LinkError> {
        self.open()
    }

    /// Opens the line; a playback is as fast as it is read.
    ///
    /// # Errors
    /// The device or file cannot be used.
    fn open_unpaced(&self) -> Result<Box<dyn Link>, LinkError> {
        self.open()
    }

    /// Returns the speed of a playback, whose data wait for their reader; `None` for a device, whose data are lost
    /// unless they are read.
    fn speed(&self) -> Option<Speed> {
        None
    }

    /// Returns whether the line is in lock step: its time passes only while its reader waits.
    fn is_in_lock_step(&self) -> bool {
        false
    }
}

impl LineSource for Source {
    fn open(&self) -> Result<Box<dyn Link>, LinkError> {
        Ok(match self {
            Self::Uart { port, baud } => Box::new(SerialLine::open(port, *baud)?),
            Self::Slcan { port, kbit } => Box::new(SlcanAdapter::open(port, *kbit)?),
            #[cfg(target_os = "linux")]
            Self::Can { interface } => Box::new(can::Interface::open(interface)?),
            #[cfg(not(target_os = "linux"))]
            Self::Can { interface } => return Err(LinkError::NoSocketCan(interface.clone())),
            Self::File { path, speed, playback } => {
                file::open(path, speed.unwrap_or(Speed::REAL), playback)?
            }
        })
    }

    fn open_unpaced(&self) -> Result<Box<dyn Link>, LinkError> {
        match self {
            Self::File { path, playback, .. } => file::open(path, Speed::Max, playback),
            _ => self.open(),
        }
    }

    fn speed(&self) -> Option<Speed> {
        match self {
            Self::File { speed, .. } => Some(speed.unwrap_or(Speed::REAL)),
            _ => None,
        }
    }

    fn is_in_lock_step(&self) -> bool {
        match self {
            #[cfg(unix)]
            Self::Uart { port, .. } | Self::Slcan { port, .. } => port::is_in_lock_step(port),
            _ => false,
        }
    }
}

/// Open line to feet.
pub trait Link {
    /// Returns the next data, or `None` if there is none within `longest`.
    ///
    /// # Errors
    /// The line has broken or ended.
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError>;

    /// Sends data.
    ///
    /// # Errors
    /// The line has broken, or does not accept this kind of data.
    fn send(&mut self, sending: &Sending) -> Result<(), LinkError>;

    /// Lets the time of boards in lock step pass while another line of this program waits, until this one is used again.
    /// Other lines do nothing.
    ///
    /// # Errors
    /// The line has broken.
    fn park(&mut self) -> Result<(), LinkError> {
        Ok(())
    }

    /// Returns the clock on which timeouts of the line are measured: the clock of this machine, unless the line is in
    /// lock step.
    fn clock(&self) -> LineClock {
        LineClock::default()
    }

    /// Returns the line as the serial line of a foot, if it is one, because such a line must be switched between
    /// program and bootloader.
    fn as_serial_line(&mut self) -> Option<&mut SerialLine> {
        None
    }
}

/// Received data with its time on the clock of the receiver, or of the recording.
pub type Arrived = (Timestamp, Arrival);

/// Received data.
#[derive(Clone, Debug, PartialEq)]
pub enum Arrival {
    /// A frame of a CAN bus.
    Frame {
        /// The interface that received it.
        interface: Arc<str>,
        /// The frame.
        frame: CanFrame,
    },
    /// Bytes of a serial line.
    Bytes {
        /// The port that received them.
        port: Arc<str>,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// An estimate computed here from a recording of an IMU.
    Estimate(Box<ContactRow>),
    /// Unreadable line of a log or of an slcan adapter.
    Unreadable(String),
    /// Remark about a recording that is played. A [`Feed`](crate::Feed) returns it as
    /// [`FeedEvent::Remark`](crate::feed::FeedEvent::Remark).
    Remark(Remark),
}

/// Remark about a recording of an IMU that is played, or about samples that arrive.
#[derive(Clone, Debug, PartialEq)]
pub enum Remark {
    /// How the recording was read.
    Read(Notice),
    /// The accelerations of this foot have no gravity.
    NoGravity(Arc<str>),
    /// A property of this foot's samples is implausible, such as the unit of its accelerations.
    Implausible(Arc<str>, Finding),
    /// The samples of this foot come at this rate, Hz.
    Rate(Arc<str>, f32),
    /// The samples of this foot come at another rate than before, Hz.
    OtherRate(Arc<str>, f32),
    /// The stamps of this foot jitter, and are smoothed.
    Smoothed(Arc<str>),
    /// Samples of this foot came out of order, or without a stamp.
    OutOfOrder(Arc<str>),
    /// The clock of the stamps of this foot was set back.
    SetBack(Arc<str>),
    /// A fact about a line, for people to read.
    Detail(String),
    /// A problem of a line, for people to read.
    Problem(String),
}

options::display_in_plain_words!(Remark);

impl InWords for Remark {
    fn write_in(&self, words: &dyn Vocabulary, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Read(notice) => notice.write_in(words, f),
            Self::NoGravity(foot) => write!(
                f,
                "{foot}: gravity was removed from its accelerations, so that messages of an IMU are computed, with \
                 gravity by the estimated orientation"
            ),
            Self::Implausible(foot, finding) => {
                write!(f, "{foot}: ")?;
                finding.write_in(words, f)
            }
            Self::Rate(foot, rate) => write!(f, "{foot}: {rate} Hz"),
            Self::OtherRate(foot, rate) => write!(
                f,
                "{foot}: samples now come at {rate:.0} Hz: its estimate begins again, with what it has learnt"
            ),
            Self::Smoothed(foot) => write!(
                f,
                "{foot}: the stamps of its samples jitter, as where a computer reads the sensor, and are smoothed; gaps are \
                 kept"
            ),
            Self::OutOfOrder(foot) => write!(
                f,
                "{foot}: a sample was left out, because its stamp is not after that of the sample before, or is missing; \
                 further ones are left out without a message"
            ),
            Self::SetBack(foot) => write!(
                f,
                "{foot}: the clock of its stamps was set back: its estimate begins again, with what it has learnt"
            ),
            Self::Detail(text) | Self::Problem(text) => f.write_str(text),
        }
    }
}

/// Data to send.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sending {
    /// A frame, to the CAN bus.
    Frame(CanFrame),
    /// Bytes, to the serial line with this name, or to all lines if `port` is `None`.
    Bytes {
        /// The port.
        port: Option<Arc<str>>,
        /// The bytes.
        bytes: Vec<u8>,
    },
}

/// Timeout of one receive in a loop: the longest delay until a pending request or another condition is noticed.
pub(crate) const LISTEN: Duration = Duration::from_millis(5);

/// Current time on the clock of this machine, µs since 1970.
#[must_use]
pub fn now() -> Timestamp {
    LineClock::default().stamp()
}

/// Error of a line.
#[derive(Debug, Error)]
pub enum LinkError {
    /// The device is missing or cannot be used.
    #[error("{device}: {source}")]
    Device {
        /// Name of the device.
        device: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The device does not respond as an slcan adapter.
    #[error("{device} does not respond like an slcan adapter: {what}")]
    Adapter {
        /// Name of the device.
        device: String,
        /// Description of the failure.
        what: &'static str,
    },
    /// The file cannot be read.
    #[error("{file}: {source}")]
    File {
        /// Name of the file.
        file: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The log of CAN frames has no times, by which it could be played.
    #[error("{0} has frames without times: log with candump -l")]
    NoTimes(String),
    /// The recording of an IMU cannot be used.
    #[error(transparent)]
    Recording(Box<RecordingError>),
    /// Options about the estimate of a recording are given for contacts of feet.
    #[error("{0} has contacts that feet sent, which nothing is estimated for")]
    NotEstimated(String),
    /// The playback has ended.
    #[error("{0} has ended")]
    Ended(String),
    /// The line does not accept this kind of data.
    #[error("{device} takes only {takes}")]
    WrongKind {
        /// Name of the device.
        device: String,
        /// Kind of data that it accepts.
        takes: &'static str,
    },
    /// A file does not accept data.
    #[error("{0} is a file: nothing can be sent to it")]
    ReadOnly(String),
    /// A source outside this crate cannot be used.
    #[error(transparent)]
    Other(Box<dyn std::error::Error + Send + Sync>),
    /// `SocketCAN` is unavailable on this system.
    #[error(
        "can:{0}: SocketCAN is available only on Linux; an slcan adapter works on every system"
    )]
    NoSocketCan(String),
}

impl From<RecordingError> for LinkError {
    fn from(error: RecordingError) -> Self {
        Self::Recording(Box::new(error))
    }
}

impl LinkError {
    /// Returns whether the error may be temporary, as for a device that is unplugged.
    #[must_use]
    pub fn may_pass(&self) -> bool {
        matches!(self, Self::Device { .. } | Self::Adapter { .. })
    }

    /// Returns the name of the device that is missing or cannot be used, if the error is about one.
    #[must_use]
    pub fn device_name(&self) -> Option<&str> {
        match self {
            Self::Device { device, .. } | Self::Adapter { device, .. } => Some(device),
            _ => None,
        }
    }

    /// Returns the remedy, if it depends on the program.
    #[must_use]
    pub const fn hint(&self) -> Option<FootHint> {
        match self {
            Self::NotEstimated(_) => Some(FootHint::OmitEstimateOptions),
            _ => None,
        }
    }

    /// Error of data that a line does not accept.
    pub fn wrong_kind(device: impl Into<String>, takes: &'static str) -> Self {
        let device = device.into();
        Self::WrongKind { device, takes }
    }

    fn device(device: &str) -> impl FnOnce(io::Error) -> Self + use<> {
        let device = device.to_owned();
        |source| Self::Device { device, source }
    }
}
