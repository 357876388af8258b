//! Serving of streaming feet until the deadline.

use std::thread;
use std::time::Duration;

use crate::ros::Bridge;
use feet::decode::Feet;
use feet::{LinkError, Source};

use super::server::Server;
use crate::error::Error;
use crate::files::finish_when_interrupted;
use crate::messages::{aside, warn};
use crate::stream::{Stream, deadline, is_over, unless_ended};

/// Polling interval for the deadline after the source has ended.
const LOOK: Duration = Duration::from_millis(50);

/// Serves the messages of the feet for some seconds, or until an interruption.
///
/// # Errors
/// The source cannot be opened, or the server cannot start.
pub fn serve(
    source: &Source,
    (host, port): (&str, u16),
    (feet, bridge): (Feet, Bridge),
    seconds: Option<f64>,
) -> Result<(), Error> {
    let name = format!("footfall {source}");
    finish_when_interrupted();
    let mut stream = Stream::open(source.clone(), feet, bridge)?;
    let end = deadline(stream.clock(), seconds);
    let mut server = Server::start(host, port, &name)?;
    let url = server.url();
    let app_url = server.app_url();
    let also = match server.address.ip().is_unspecified() {
        true => ", and at all other addresses of this machine",
        false => "",
    };
    aside(format!(
        "serving {source} at {url}{also}\n\
         Foxglove: {app_url}\n\
         PlotJuggler: Streaming, Foxglove Bridge, {url}"
    ));
    let ended = stream.run(end, &mut server);
    stream.report();
    if let Ok(Some(error @ LinkError::Ended(_))) = &ended {
        warn(format!("{error}; viewers stay connected until Ctrl-C"));
    }
    let ended = ended.and_then(unless_ended);
    // Played messages may still be queued for viewers, which show them while connected.
    while ended.is_ok() && !is_over(stream.clock(), end) {
        thread::sleep(LOOK);
    }
    server.stop();
    ended
}
