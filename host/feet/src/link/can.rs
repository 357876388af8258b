//! Interface of `SocketCAN`, which must be up: `ip link set can0 up type can bitrate 1000000`.

use std::io;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use socketcan::{CanDataFrame, CanSocket, EmbeddedFrame, Id, Socket, StandardId};
use wire::CanFrame;

use super::{Arrival, Arrived, Link, LinkError, Sending, now};

/// Longest wait for room in the interface's queue.
const QUEUE: Duration = Duration::from_millis(200);

/// About the time that a frame takes at 1 Mbit/s.
const FRAME: Duration = Duration::from_micros(150);

/// Error number of Linux for a full queue of an interface, ENOBUFS.
const FULL: i32 = 105;

fn is_full(error: &io::Error) -> bool {
    error.raw_os_error() == Some(FULL) || error.kind() == io::ErrorKind::WouldBlock
}

/// Open interface.
pub(super) struct Interface {
    name: Arc<str>,
    /// Name in messages.
    device: String,
    socket: CanSocket,
}

impl Interface {
    pub(super) fn open(name: &str) -> Result<Self, LinkError> {
        let device = format!("can:{name}");
        let socket = CanSocket::open(name).map_err(LinkError::device(&device))?;
        Ok(Self { name: name.into(), device, socket })
    }
}

impl Link for Interface {
    fn receive(&mut self, longest: Duration) -> Result<Option<Arrived>, LinkError> {
        let end = Instant::now() + longest;
        loop {
            let left = end.saturating_duration_since(Instant::now());
            match self.socket.read_frame_timeout(left) {
                Ok(socketcan::CanFrame::Data(frame)) => {
                    // Feet send no frames with 29-bit identifiers.
                    if let Id::Standard(id) = frame.id()
                        && let Some(frame) = CanFrame::new(id.as_raw(), frame.data())
                    {
                        let interface = Arc::clone(&self.name);
                        return Ok(Some((now(), Arrival::Frame { interface, frame })));
                    }
                }
                Ok(_) => {}
                Err(error) => match error.kind() {
                    io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => return Ok(None),
                    io::ErrorKind::Interrupted => {}
                    _ => return Err(LinkError::device(&self.device)(error)),
                },
            }
            if left.is_zero() {
                return Ok(None);
            }
        }
    }

    fn send(&mut self, sending: &Sending) -> Result<(), LinkError> {
        let Sending::Frame(frame) = sending else {
            return Err(LinkError::wrong_kind(&self.device, "CAN frames"));
        };
        let id = StandardId::new(frame.id());
        let Some(frame) = id.and_then(|id| CanDataFrame::new(id, frame.data())) else {
            return Ok(());
        };
        let end = Instant::now() + QUEUE;
        loop {
            match self.socket.write_frame(&frame) {
                Err(error) if is_full(&error) && Instant::now() < end => thread::sleep(FRAME),
                written => return written.map_err(LinkError::device(&self.device)),
            }
        }
    }
}
