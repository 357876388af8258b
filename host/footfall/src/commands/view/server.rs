//! Server of messages by topic over a WebSocket, using the Foxglove protocol, which `PlotJuggler` reads as well.
//!
//! Each client has its own queue, emptied by a server thread. If a client reads too slowly, its oldest messages are
//! dropped; reception from the feet and other clients are not affected.

use std::collections::HashMap;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs};
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::thread;
use std::time::Duration;

use feet::LinkError;
use feet::decode::KnownFeet;
use foxglove::{
    AppUrl, ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema,
    WebSocketServer, WebSocketServerHandle,
};

use crate::Source;
use crate::error::Error;
use crate::interruption::finish_when_interrupted;
use crate::messages::{aside, warn};
use crate::ros::message::Definition;
use crate::ros::{Bridge, Published};
use crate::source::text_of;
use crate::stream::{Sink, Stream, deadline, is_over, unless_ended};

/// Maximum number of messages queued per client: four seconds of four feet on serial lines.
const QUEUE: usize = 1 << 16;

/// Timeout for closing client connections at the end.
const CLOSING: Duration = Duration::from_secs(1);

/// Polling interval for the deadline after the source has ended.
const DEADLINE_CHECK: Duration = Duration::from_millis(50);

/// Serves the messages of the feet for some seconds, or until an interruption.
///
/// # Errors
/// The source cannot be opened, or the server cannot start.
pub fn serve(
    (sources, feet): (Vec<Source>, KnownFeet),
    (host, port): (&str, u16),
    bridge: Bridge,
    seconds: Option<f64>,
) -> Result<(), Error> {
    let text = text_of(&sources);
    let name = format!("footfall {text}");
    finish_when_interrupted();
    let mut stream = Stream::open(sources, feet, bridge)?;
    let end = deadline(stream.clock(), seconds);
    let mut server = Server::start(host, port, &name)?;
    let url = server.url();
    let app_url = server.app_url();
    let also = if server.address.ip().is_unspecified() {
        ", and at all other addresses of this machine"
    } else {
        ""
    };
    aside(format!(
        "serving {text} at {url}{also}\n\
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
        thread::sleep(DEADLINE_CHECK);
    }
    server.stop();
    ended
}

/// A running server.
pub struct Server {
    context: Arc<Context>,
    handle: WebSocketServerHandle,
    /// Address to which the server is bound. If it is unspecified, the server listens on all addresses of this machine.
    address: SocketAddr,
    channels: HashMap<Arc<str>, Arc<RawChannel>>,
}

impl Server {
    /// Starts the server. Port 0 selects a free port; `name` is the server name shown in viewers.
    ///
    /// # Errors
    /// The address cannot be used.
    pub fn start(host: &str, port: u16, name: &str) -> Result<Self, ViewError> {
        let context = Context::new();
        let address = address_of(host, port)?;
        // IPv6 addresses need brackets.
        let host = match address.ip() {
            IpAddr::V4(host) => host.to_string(),
            IpAddr::V6(host) => format!("[{host}]"),
        };
        let handle = WebSocketServer::new()
            .name(name)
            .bind(host, port)
            .message_backlog_size(QUEUE)
            .context(&context)
            .start_blocking()
            .map_err(|error| match error {
                FoxgloveError::Bind(source) if source.kind() == io::ErrorKind::AddrInUse => {
                    let (host, port) = (address.ip(), address.port());
                    ViewError::PortInUse { host, port }
                }
                error => {
                    let source = Box::new(error);
                    ViewError::Address { address, source }
                }
            })?;
        Ok(Self {
            address: SocketAddr::new(address.ip(), handle.port()),
            context,
            handle,
            channels: HashMap::new(),
        })
    }

    /// Returns the URL of the server for programs on this machine.
    #[must_use]
    pub fn url(&self) -> String {
        let host: IpAddr = match self.address.ip() {
            IpAddr::V4(Ipv4Addr::UNSPECIFIED) => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(Ipv6Addr::UNSPECIFIED) => Ipv6Addr::LOCALHOST.into(),
            one => one,
        };
        format!("ws://{}", SocketAddr::new(host, self.address.port()))
    }

    /// Returns the URL that opens the server in Foxglove in a browser.
    #[must_use]
    pub fn app_url(&self) -> String {
        AppUrl::new().with_websocket(self.url()).to_string()
    }

    /// Closes all client connections. Queued messages are discarded.
    pub fn stop(self) {
        let stopping = self.handle.stop();
        let (done, is_done) = channel();
        thread::spawn(move || {
            stopping.wait_blocking();
            // The receiver may have timed out.
            let _ = done.send(());
        });
        // A client that does not read must not delay the exit.
        let _ = is_done.recv_timeout(CLOSING);
    }

    /// Returns the channel of a topic, announcing it on first use.
    fn channel(&mut self, published: &Published) -> Result<&RawChannel, FoxgloveError> {
        let topic = &published.topic;
        if !self.channels.contains_key(topic) {
            let definition = Definition::of(&published.message);
            let text = definition.text().into_bytes();
            let channel = ChannelBuilder::new(topic.as_ref())
                .context(&self.context)
                .message_encoding("cdr")
                .schema(Schema::new(definition.name, "ros2msg", text))
                .build_raw()?;
            self.channels.insert(Arc::clone(topic), channel);
        }
        Ok(&self.channels[topic])
    }
}

impl Sink for Server {
    fn publish(&mut self, published: Published) -> Result<(), Error> {
        let channel = self.channel(&published);
        let channel = channel.map_err(|source| ViewError::Topic {
            topic: published.topic.to_string(),
            source: Box::new(source),
        })?;
        // Messages are encoded only if a client has subscribed.
        if channel.has_sinks() {
            let nanos = published.at.as_micros().saturating_mul(1000);
            let about = PartialMetadata::with_log_time(nanos);
            channel.log_with_meta(&published.message.cdr(), about);
        }
        Ok(())
    }
}

/// Resolves a host given as an address or a name. If a name has addresses of both kinds, IPv4 is preferred, as
/// viewers try it first.
fn address_of(host: &str, port: u16) -> Result<SocketAddr, ViewError> {
    let unknown = |source| ViewError::Host { host: host.to_owned(), source };
    let addresses: Vec<SocketAddr> = match host.parse::<IpAddr>() {
        Ok(host) => vec![SocketAddr::new(host, port)],
        Err(_) => (host, port).to_socket_addrs().map_err(unknown)?.collect(),
    };
    let of_ipv4 = addresses.iter().find(|address| address.is_ipv4());
    let address = of_ipv4.or(addresses.first()).copied();
    address.ok_or_else(|| unknown(io::ErrorKind::NotFound.into()))
}

/// Reason the server cannot serve.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The host has no address.
    #[error("--host {host}: {source}")]
    Host {
        /// Host as given.
        host: String,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The server cannot use this address.
    #[error("cannot listen on {address}: {source}")]
    Address {
        /// The address.
        address: SocketAddr,
        /// Error of the operating system.
        source: Box<FoxgloveError>,
    },
    /// The port is used by another program.
    #[error("port {port} of {host} is in use; --port 0 takes any free port")]
    PortInUse {
        /// The host.
        host: IpAddr,
        /// The port.
        port: u16,
    },
    /// The topic cannot be announced.
    #[error("{topic} cannot be announced: {source}")]
    Topic {
        /// The topic.
        topic: String,
        /// Error of the server.
        source: Box<FoxgloveError>,
    },
}
