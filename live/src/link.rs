//! A line to feet.
//!
//! | line | file |
//! |---|---|
//! | a serial port | [`serial`] |
//! | an adapter that speaks slcan over a serial port | [`slcan`] |
//! | an interface of `SocketCAN` | `can` |
//! | a log or a recording that is played | [`file`](mod@file) |
//! | simulated feet | [`demo`] |
//! | how fast the last two go | [`pace`] |

#[cfg(target_os = "linux")]
mod can;
pub mod demo;
pub mod file;
pub mod pace;
pub mod serial;
pub mod slcan;

use std::io;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use decode::Row;
use decode::live::Listener;
use estimator_core::Timestamp;
use thiserror::Error;
use wire::CanFrame;

use crate::source::Source;
use pace::Speed;

/// Something that has arrived.
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
    /// An estimate that was made here, of a recording of an IMU.
    Estimate(Box<Row>),
    /// A line of what is played that means nothing, or a frame that is none of ours, counted.
    Unreadable(String),
}

impl Arrival {
    /// Hands it to a listener, as received at `at`; returns the text of what could not be read.
    pub fn hand_to(self, listener: &mut Listener, at: Timestamp) -> Option<String> {
        match self {
            Self::Frame { interface, frame } => listener.frame(&interface, &frame, at),
            Self::Bytes { port, bytes } => listener.bytes(&port, &bytes, at),
            Self::Estimate(row) => listener.row(row, at),
            Self::Unreadable(text) => return Some(text),
        }
        None
    }
}

/// Something to be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Sending {
    /// A frame, to the CAN bus.
    Frame(CanFrame),
    /// Bytes, to the serial line of this name; to all where it is `None`.
    Bytes {
        /// The port.
        port: Option<Arc<str>>,
        /// The bytes.
        bytes: Vec<u8>,
    },
}

/// Why a line cannot be used.
#[derive(Debug, Error)]
pub enum LinkError {
    /// The device is not there or cannot be used.
    #[error("{device}: {source}")]
    Device {
        /// Its name.
        device: String,
        /// What the operating system says.
        source: io::Error,
    },
    /// An adapter does not answer as one.
    #[error("{device} does not answer as an slcan adapter does: {what}")]
    Adapter {
        /// Its name.
        device: String,
        /// What it did.
        what: &'static str,
    },
    /// What is played cannot be read.
    #[error("{0}")]
    File(String),
    /// It has ended.
    #[error("{0} has ended")]
    Ended(String),
    /// What was to be sent cannot go there.
    #[error("{device} takes {takes} alone")]
    WrongKind {
        /// Its name.
        device: String,
        /// What it takes.
        takes: &'static str,
    },
    /// Nothing can be sent to what is played.
    #[error("{0} is a file: nothing can be sent to it")]
    ReadOnly(String),
    /// This machine has no such lines.
    #[error("can:{0}: SocketCAN is a part of Linux; an adapter that speaks slcan works everywhere")]
    NoSocketCan(String),
}

impl LinkError {
    /// Whether it may be gone after a while: a device that is plugged in again.
    #[must_use]
    pub fn may_pass(&self) -> bool {
        matches!(self, Self::Device { .. } | Self::Adapter { .. })
    }

    fn device(device: &str) -> impl FnOnce(io::Error) -> Self + use<> {
        let device = device.to_owned();
        |source| Self::Device { device, source }
    }
}

/// What has arrived, and when by the clock of the receiver, or by that of what is played.
pub type Arrived = (Timestamp, Arrival);

/// A line to feet.
pub trait Link {
    /// What arrives next, within `longest`; `None` where nothing does.
    ///
    /// # Errors
    /// The line has broken or ended.
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError>;

    /// Sends something.
    ///
    /// # Errors
    /// The line has broken, or takes no such thing.
    fn send(&mut self, sending: &Sending) -> Result<(), LinkError>;
}

/// Opens a line; what is played goes at its own speed unless the source says another.
///
/// # Errors
/// The device or file cannot be used.
pub fn open(source: &Source) -> Result<Box<dyn Link>, LinkError> {
    Ok(match source {
        Source::Uart { port, baud } => Box::new(serial::SerialLine::open(port, *baud)?),
        Source::Slcan { port, kbit } => Box::new(slcan::Adapter::open(port, *kbit)?),
        #[cfg(target_os = "linux")]
        Source::Can { interface } => Box::new(can::Interface::open(interface)?),
        #[cfg(not(target_os = "linux"))]
        Source::Can { interface } => return Err(LinkError::NoSocketCan(interface.clone())),
        Source::File { path, speed } => file::open(path, speed.unwrap_or(Speed::REAL))?,
        Source::Demo(demo) => Box::new(demo::SimulatedFeet::new(demo)),
    })
}

/// The time now, µs since 1970.
#[must_use]
pub fn now() -> Timestamp {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    let micros = since.unwrap_or_default().as_micros();
    Timestamp::from_micros(u64::try_from(micros).unwrap_or(u64::MAX))
}
