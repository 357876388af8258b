//! The server: messages by topic over a WebSocket, in the protocol of Foxglove.
//!
//! Each client has a queue of its own, which a thread of the server empties. Where a client takes less than is
//! sent, its oldest messages are dropped: the feet are heard all the same, and so are other clients.

use std::collections::HashMap;
use std::io;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, ToSocketAddrs};
use std::sync::mpsc::channel;
use std::sync::{Arc, Once};
use std::thread;
use std::time::Duration;

use foxglove::{
    AppUrl, ChannelBuilder, Context, FoxgloveError, PartialMetadata, RawChannel, Schema,
    WebSocketServer, WebSocketServerHandle,
};
use ros::Published;
use ros::definition::Definition;

use super::{ViewError, slow};
use crate::error::Error;
use crate::stream::Sink;

/// Messages that wait for a client at most: four seconds of four feet on serial lines.
const QUEUE: usize = 1 << 16;

/// How long clients are waited for at the end.
const GOODBYE: Duration = Duration::from_secs(1);

/// At how many addresses of this machine a server is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// At one.
    OneAddress,
    /// At all: other machines can connect.
    AllAddresses,
}

/// The address of a host that is written as one, or by name. Where a name has addresses of both kinds, that of
/// IPv4 is taken: viewers try it first.
fn address_of(host: &str, port: u16) -> Result<SocketAddr, ViewError> {
    let unknown = |source| ViewError::Host {
        host: host.to_owned(),
        source,
    };
    let addresses: Vec<SocketAddr> = match host.parse::<IpAddr>() {
        Ok(host) => vec![SocketAddr::new(host, port)],
        Err(_) => (host, port).to_socket_addrs().map_err(unknown)?.collect(),
    };
    let of_ipv4 = addresses.iter().find(|address| address.is_ipv4());
    let address = of_ipv4.or(addresses.first()).copied();
    address.ok_or_else(|| unknown(io::ErrorKind::NotFound.into()))
}

/// A server that runs.
pub struct Server {
    context: Arc<Context>,
    handle: WebSocketServerHandle,
    address: SocketAddr,
    channels: HashMap<Arc<str>, Arc<RawChannel>>,
}

impl Server {
    /// Starts it. Port 0 is one that is free; `name` is what the server is called in viewers.
    ///
    /// # Errors
    /// The address cannot be used.
    pub fn start(host: &str, port: u16, name: &str) -> Result<Self, ViewError> {
        static NOTICED: Once = Once::new();
        NOTICED.call_once(slow::notice);
        let context = Context::new();
        let address = address_of(host, port)?;
        // Addresses of IPv6 stand in brackets.
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
            .map_err(|error| ViewError::of_bind(address, error))?;
        Ok(Self {
            address: SocketAddr::new(address.ip(), handle.port()),
            context,
            handle,
            channels: HashMap::new(),
        })
    }

    /// At how many addresses of this machine it is.
    #[must_use]
    pub const fn reach(&self) -> Reach {
        if self.address.ip().is_unspecified() {
            Reach::AllAddresses
        } else {
            Reach::OneAddress
        }
    }

    /// Where it is, for programs on this machine.
    #[must_use]
    pub fn url(&self) -> String {
        let host: IpAddr = match self.address.ip() {
            IpAddr::V4(Ipv4Addr::UNSPECIFIED) => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(Ipv6Addr::UNSPECIFIED) => Ipv6Addr::LOCALHOST.into(),
            one => one,
        };
        format!("ws://{}", SocketAddr::new(host, self.address.port()))
    }

    /// What a browser opens to see it in Foxglove.
    #[must_use]
    pub fn app_url(&self) -> String {
        AppUrl::new().with_websocket(self.url()).to_string()
    }

    /// Says goodbye to the clients. What waits for them is not sent.
    pub fn stop(self) {
        let stopping = self.handle.stop();
        let (done, is_done) = channel();
        thread::spawn(move || {
            stopping.wait_blocking();
            // The receiver may have given up.
            let _ = done.send(());
        });
        // A client that does not read must not delay the end.
        let _ = is_done.recv_timeout(GOODBYE);
    }

    /// The channel of a topic, announced where it is new.
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
        let channel = self
            .channel(&published)
            .map_err(|source| ViewError::Topic {
                topic: published.topic.as_ref().to_owned(),
                source: Box::new(source),
            })?;
        // Without a subscriber there is nothing to encode.
        if channel.has_sinks() {
            let nanos = published.at.as_micros().saturating_mul(1000);
            let about = PartialMetadata::with_log_time(nanos);
            channel.log_with_meta(&published.message.cdr(), about);
        }
        Ok(())
    }

    fn idle(&mut self) -> Result<(), Error> {
        Ok(())
    }
}
