//! Server of messages by topic over a WebSocket, using the Foxglove protocol, which `PlotJuggler` reads as well.
//!
//! Browsers let the pages of any website connect to a WebSocket of this machine, and with `--host` other machines can
//! connect, too. So the server accepts only pages of Foxglove and of this machine, ends a handshake that takes too long,
//! and limits the number of clients and the memory of each. Programs other than browsers send no origin.
//!
//! Each client has its own queue, emptied by its own thread. If a client reads too slowly, its oldest messages are
//! dropped; reception from the feet and other clients are not affected.
//!
//! Source of the protocol: <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>.

use std::collections::{HashMap, VecDeque};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{
    IpAddr, Ipv4Addr, Ipv6Addr, Shutdown, SocketAddr, TcpListener, TcpStream, ToSocketAddrs,
};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use feet::LinkError;
use feet::decode::KnownFeet;
use serde::Deserialize;
use serde_json::json;
use tungstenite::handshake::server::{ErrorResponse, Request, Response};
use tungstenite::http::{HeaderMap, HeaderValue, StatusCode};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket};

use crate::Source;
use crate::error::{Error, Worded};
use crate::interruption::finish_when_interrupted;
use crate::messages::{aside, warn};
use crate::ros::message::Definition;
use crate::ros::{Bridge, Published};
use crate::source::text_of;
use crate::stream::{Sink, Stream, deadline, is_over, unless_ended};

/// Maximum number of clients, including clients that are connecting.
const MOST_CLIENTS: usize = 16;

/// Maximum size of the messages queued for a client, bytes: two seconds of four feet on serial lines.
const QUEUE_BYTES: usize = 4 << 20;

/// Timeout of the handshake of a client.
const HANDSHAKE: Duration = Duration::from_secs(5);

/// Timeout for a client that takes no bytes at all.
const STALLED: Duration = Duration::from_secs(30);

/// Longest wait for a request of a client, and so the longest delay of its messages.
const LISTEN: Duration = Duration::from_millis(5);

/// Longest request of a client, bytes: a subscription to thousands of topics.
const LONGEST_REQUEST: usize = 1 << 18;

/// Timeout for closing client connections at the end.
const CLOSING: Duration = Duration::from_secs(1);

/// Polling interval for the deadline after the source has ended.
const DEADLINE_CHECK: Duration = Duration::from_millis(50);

/// Names of the protocol.
const PROTOCOLS: [&str; 2] = ["foxglove.sdk.v1", "foxglove.websocket.v1"];

/// Kind of a binary message with data.
const MESSAGE_DATA: u8 = 1;

/// Serves the messages of the feet for some seconds, or until an interruption. Pages of `origins` may connect, too.
///
/// # Errors
/// The source cannot be opened, or the server cannot start.
pub fn serve(
    (sources, feet): (Vec<Source>, KnownFeet),
    (host, port): (&str, u16),
    origins: Vec<String>,
    bridge: Bridge,
    seconds: Option<f64>,
) -> Result<(), Error> {
    let text = text_of(&sources);
    let name = format!("footfall {text}");
    finish_when_interrupted();
    let mut stream = Stream::open(sources, feet, bridge)?;
    let end = deadline(stream.clock(), seconds);
    let mut server = Server::start(host, port, &name, origins)?;
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
    shared: Arc<Shared>,
    /// Address to which the server is bound. If it is unspecified, the server listens on all addresses of this machine.
    address: SocketAddr,
    /// Channel numbers of the topics.
    channels: HashMap<Arc<str>, u32>,
}

/// State that the threads of all clients share.
struct Shared {
    /// First message to a client.
    info: String,
    /// Origins of pages that may connect, beside the origins of Foxglove and of this machine.
    origins: Vec<String>,
    /// Announcements of all channels so far.
    announced: Mutex<Vec<Arc<str>>>,
    clients: Mutex<Vec<Arc<Client>>>,
    /// Number of connections.
    connections: AtomicUsize,
    is_over: AtomicBool,
    /// Warnings that were printed.
    reported: Mutex<Vec<String>>,
}

/// A connected client.
#[derive(Default)]
struct Client {
    /// Numbers of its subscriptions, by channel.
    subscriptions: Mutex<HashMap<u32, u32>>,
    queue: Mutex<Queue>,
}

#[derive(Default)]
struct Queue {
    waiting: VecDeque<Outgoing>,
    bytes: usize,
}

/// Message that waits for a client.
enum Outgoing {
    Announcement(Arc<str>),
    Data { channel: u32, log_ns: u64, content: Arc<[u8]> },
}

impl Outgoing {
    fn bytes(&self) -> usize {
        match self {
            Self::Announcement(text) => text.len(),
            Self::Data { content, .. } => content.len() + size_of::<Self>(),
        }
    }
}

/// Returns the content of a mutex, whose users do not panic while they hold it.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Client {
    /// Queues a message. If the queue is full, the oldest messages with data are dropped.
    fn push(&self, outgoing: Outgoing) {
        let mut queue = locked(&self.queue);
        queue.bytes += outgoing.bytes();
        queue.waiting.push_back(outgoing);
        while queue.bytes > QUEUE_BYTES {
            let is_data = |outgoing: &Outgoing| matches!(outgoing, Outgoing::Data { .. });
            let Some(oldest) = queue.waiting.iter().position(is_data) else { break };
            if let Some(dropped) = queue.waiting.remove(oldest) {
                queue.bytes -= dropped.bytes();
            }
        }
    }

    fn pop(&self) -> Option<Outgoing> {
        let mut queue = locked(&self.queue);
        let outgoing = queue.waiting.pop_front()?;
        queue.bytes -= outgoing.bytes();
        Some(outgoing)
    }
}

impl Server {
    /// Starts the server. Port 0 selects a free port; `name` is the server name shown in viewers. Pages of `origins` may
    /// connect, too.
    ///
    /// # Errors
    /// The address cannot be used.
    pub fn start(
        host: &str,
        port: u16,
        name: &str,
        origins: Vec<String>,
    ) -> Result<Self, ViewError> {
        let address = address_of(host, port)?;
        let listener = TcpListener::bind(address).map_err(|source| match source.kind() {
            ErrorKind::AddrInUse => ViewError::PortInUse { host: address.ip(), port },
            _ => ViewError::Address { address, source },
        })?;
        let bound = listener.local_addr();
        let address = bound.map_err(|source| ViewError::Address { address, source })?;
        let session = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let info = json!({
            "op": "serverInfo",
            "name": name,
            "capabilities": [],
            "supportedEncodings": [],
            "metadata": {},
            "sessionId": session.as_millis().to_string(),
        });
        let shared = Arc::new(Shared {
            info: info.to_string(),
            origins,
            announced: Mutex::default(),
            clients: Mutex::default(),
            connections: AtomicUsize::new(0),
            is_over: AtomicBool::new(false),
            reported: Mutex::default(),
        });
        let own = Arc::clone(&shared);
        // The thread ends with the program.
        thread::spawn(move || accept(&listener, &own));
        Ok(Self { shared, address, channels: HashMap::new() })
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
        let url = self.url().replace(':', "%3A").replace('/', "%2F");
        let url = url.replace('[', "%5B").replace(']', "%5D");
        format!("https://app.foxglove.dev?ds=foxglove-websocket&ds.url={url}")
    }

    /// Closes all client connections. Queued messages are discarded.
    pub fn stop(self) {
        self.shared.is_over.store(true, Ordering::Relaxed);
        let end = Instant::now() + CLOSING;
        // A client that does not read must not delay the exit.
        while self.shared.connections.load(Ordering::Relaxed) > 0 && Instant::now() < end {
            thread::sleep(LISTEN);
        }
    }

    /// Returns the number of a topic, announcing it on first use.
    fn channel(&mut self, published: &Published) -> u32 {
        let topic = &published.topic;
        if let Some(channel) = self.channels.get(topic) {
            return *channel;
        }
        let channel = u32::try_from(self.channels.len() + 1).unwrap_or(u32::MAX);
        self.channels.insert(Arc::clone(topic), channel);
        let definition = Definition::of(&published.message);
        let announcement = json!({
            "op": "advertise",
            "channels": [{
                "id": channel,
                "topic": &**topic,
                "encoding": "cdr",
                "schemaName": definition.name,
                "schema": definition.text(),
                "schemaEncoding": "ros2msg",
            }],
        });
        let announcement: Arc<str> = announcement.to_string().into();
        // A client that connects meanwhile gets the announcement once, because the lists are locked in the order of
        // `serve_client`.
        let mut announced = locked(&self.shared.announced);
        announced.push(Arc::clone(&announcement));
        for client in locked(&self.shared.clients).iter() {
            client.push(Outgoing::Announcement(Arc::clone(&announcement)));
        }
        channel
    }
}

impl Sink for Server {
    fn publish(&mut self, published: Published) -> Result<(), Error> {
        let channel = self.channel(&published);
        let log_ns = published.at.as_micros().saturating_mul(1000);
        // Messages are encoded only if a client has subscribed.
        let mut content: Option<Arc<[u8]>> = None;
        for client in locked(&self.shared.clients).iter() {
            if !locked(&client.subscriptions).contains_key(&channel) {
                continue;
            }
            let content = content.get_or_insert_with(|| published.message.cdr().into());
            client.push(Outgoing::Data { channel, log_ns, content: Arc::clone(content) });
        }
        Ok(())
    }
}

/// Accepts connections, up to [`MOST_CLIENTS`].
fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    for stream in listener.incoming() {
        if shared.is_over.load(Ordering::Relaxed) {
            return;
        }
        let Ok(mut stream) = stream else {
            // No descriptor is free, for instance.
            thread::sleep(DEADLINE_CHECK);
            continue;
        };
        if shared.connections.fetch_add(1, Ordering::Relaxed) >= MOST_CLIENTS {
            shared.connections.fetch_sub(1, Ordering::Relaxed);
            let many = "HTTP/1.1 503 Service Unavailable\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
            // The client may be gone.
            let _ = stream.write_all(many.as_bytes());
            shared.report(format!(
                "{MOST_CLIENTS} viewers are connected, and further ones are refused"
            ));
            continue;
        }
        let own = Arc::clone(shared);
        let thread = thread::Builder::new().name("viewer".to_owned());
        let spawned: io::Result<JoinHandle<()>> = thread.spawn(move || {
            // An error ends the connection of this client.
            let _ = serve_client(stream, &own);
            own.connections.fetch_sub(1, Ordering::Relaxed);
        });
        if spawned.is_err() {
            shared.connections.fetch_sub(1, Ordering::Relaxed);
        }
    }
}

impl Shared {
    /// Prints a warning once.
    fn report(&self, text: String) {
        let mut reported = locked(&self.reported);
        // The number is limited, because a page may come under many names.
        if reported.len() < MOST_CLIENTS && !reported.contains(&text) {
            warn(&text);
            reported.push(text);
        }
    }

    /// Checks the request of a client, and selects the protocol.
    fn check(&self, request: &Request) -> Result<&'static str, (StatusCode, String)> {
        let headers = request.headers();
        if let Some(origin) = headers.get("origin") {
            let origin = origin.to_str().unwrap_or_default();
            if !is_allowed(origin, headers, &self.origins) {
                self.report(format!(
                    "a page of {origin} was refused: --allow-origin {origin} lets it connect"
                ));
                return Err((StatusCode::FORBIDDEN, format!("origin {origin} is not allowed")));
            }
        }
        let offered = headers.get_all("sec-websocket-protocol").iter();
        let offered: Vec<&str> = offered
            .flat_map(|header| header.to_str().unwrap_or_default().split(','))
            .map(str::trim)
            .collect();
        let known = PROTOCOLS.into_iter().find(|protocol| offered.contains(protocol));
        known.ok_or_else(|| {
            (StatusCode::BAD_REQUEST, format!("the protocol must be {}", PROTOCOLS.join(" or ")))
        })
    }
}

/// Returns whether a page of this origin may connect: one of Foxglove, of this machine or of the host that it connects to,
/// or one that is allowed. Desktop programs have the origin of a file.
fn is_allowed(origin: &str, headers: &HeaderMap<HeaderValue>, allowed: &[String]) -> bool {
    if origin.starts_with("file:") || allowed.iter().any(|allowed| allowed == origin) {
        return true;
    }
    let Some((scheme, host)) = origin.split_once("://") else { return false };
    let name = host
        .strip_prefix('[')
        .and_then(|host| host.split_once(']'))
        .map_or_else(|| host.split(':').next().unwrap_or_default(), |(address, _)| address);
    let is_foxglove =
        scheme == "https" && (name == "foxglove.dev" || name.ends_with(".foxglove.dev"));
    let is_here =
        name == "localhost" || name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback());
    let own = headers.get("host").and_then(|host| host.to_str().ok());
    // Only an address is accepted, because an attacker can make a host name of his own resolve to this machine.
    let is_own = own == Some(host) && name.parse::<IpAddr>().is_ok();
    is_foxglove || is_here || is_own
}

/// Connection whose reads end at a deadline.
struct Timed {
    stream: TcpStream,
    /// End of the handshake; `None` after it.
    deadline: Option<Instant>,
}

impl Read for Timed {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        if let Some(deadline) = self.deadline {
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return Err(ErrorKind::TimedOut.into());
            }
            self.stream.set_read_timeout(Some(left))?;
        }
        self.stream.read(to)
    }
}

impl Write for Timed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

/// Request of a client.
#[derive(Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
enum ClientRequest {
    Subscribe {
        subscriptions: Vec<Subscription>,
    },
    #[serde(rename_all = "camelCase")]
    Unsubscribe {
        subscription_ids: Vec<u32>,
    },
    /// A request that belongs to a capability that the server does not offer.
    #[serde(other)]
    Other,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Subscription {
    id: u32,
    channel_id: u32,
}

/// Error that ends the connection of a client.
#[derive(Debug, thiserror::Error)]
enum ClientError {
    #[error(transparent)]
    Connection(#[from] io::Error),
    #[error(transparent)]
    Protocol(#[from] Box<tungstenite::Error>),
    #[error("the handshake has failed")]
    Handshake,
}

/// Serves a client until it leaves.
fn serve_client(stream: TcpStream, shared: &Shared) -> Result<(), ClientError> {
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(HANDSHAKE))?;
    let check = |request: &Request, mut response: Response| -> Result<Response, ErrorResponse> {
        match shared.check(request) {
            Ok(protocol) => {
                let value = HeaderValue::from_static(protocol);
                response.headers_mut().insert("sec-websocket-protocol", value);
                Ok(response)
            }
            Err((status, text)) => {
                let mut response = ErrorResponse::new(Some(text));
                *response.status_mut() = status;
                Err(response)
            }
        }
    };
    let timed = Timed { stream, deadline: Some(Instant::now() + HANDSHAKE) };
    let config = WebSocketConfig::default()
        .max_message_size(Some(LONGEST_REQUEST))
        .max_frame_size(Some(LONGEST_REQUEST));
    let socket = tungstenite::accept_hdr_with_config(timed, check, Some(config));
    let mut socket = socket.map_err(|_| ClientError::Handshake)?;
    let timed = socket.get_mut();
    timed.deadline = None;
    timed.stream.set_read_timeout(Some(LISTEN))?;
    timed.stream.set_write_timeout(Some(STALLED))?;
    let client = Arc::new(Client::default());
    {
        let announced = locked(&shared.announced);
        client.push(Outgoing::Announcement(shared.info.as_str().into()));
        for announcement in announced.iter() {
            client.push(Outgoing::Announcement(Arc::clone(announcement)));
        }
        locked(&shared.clients).push(Arc::clone(&client));
    }
    let served = converse(&mut socket, &client, shared);
    locked(&shared.clients).retain(|other| !Arc::ptr_eq(other, &client));
    // The client may be gone.
    let _ = socket.close(None);
    let _ = socket.flush();
    let _ = socket.get_ref().stream.shutdown(Shutdown::Both);
    served
}

/// Sends messages and processes requests, until the client leaves or the server ends.
fn converse(
    socket: &mut WebSocket<Timed>,
    client: &Client,
    shared: &Shared,
) -> Result<(), ClientError> {
    let failed = |error: tungstenite::Error| ClientError::Protocol(Box::new(error));
    while !shared.is_over.load(Ordering::Relaxed) {
        while let Some(outgoing) = client.pop() {
            match outgoing {
                Outgoing::Announcement(text) => {
                    socket.write(Message::text(&*text)).map_err(failed)?;
                }
                Outgoing::Data { channel, log_ns, content } => {
                    let subscription = locked(&client.subscriptions).get(&channel).copied();
                    let Some(subscription) = subscription else { continue };
                    let mut bytes = Vec::with_capacity(13 + content.len());
                    bytes.push(MESSAGE_DATA);
                    bytes.extend(subscription.to_le_bytes());
                    bytes.extend(log_ns.to_le_bytes());
                    bytes.extend(&*content);
                    socket.write(Message::binary(bytes)).map_err(failed)?;
                }
            }
            if shared.is_over.load(Ordering::Relaxed) {
                return Ok(());
            }
        }
        socket.flush().map_err(failed)?;
        match socket.read() {
            Ok(Message::Text(text)) => {
                let channels = locked(&shared.announced).len();
                client.take(&text, channels);
            }
            Ok(Message::Close(_)) => return Ok(()),
            Ok(_) => {}
            Err(tungstenite::Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
            Err(error) => return Err(failed(error)),
        }
    }
    Ok(())
}

impl Client {
    /// Processes a request; one that is not understood is ignored, as is a subscription to a channel beyond the announced
    /// ones, whose number is `channels`. So a client cannot have any number of subscriptions.
    fn take(&self, text: &str, channels: usize) {
        let mut subscriptions = locked(&self.subscriptions);
        match serde_json::from_str(text) {
            Ok(ClientRequest::Subscribe { subscriptions: new }) => {
                let is_announced = |subscription: &Subscription| {
                    usize::try_from(subscription.channel_id)
                        .is_ok_and(|id| (1..=channels).contains(&id))
                };
                for Subscription { id, channel_id } in new.into_iter().filter(is_announced) {
                    subscriptions.insert(channel_id, id);
                }
            }
            Ok(ClientRequest::Unsubscribe { subscription_ids }) => {
                subscriptions.retain(|_, id| !subscription_ids.contains(id));
            }
            Ok(ClientRequest::Other) | Err(_) => {}
        }
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
    address.ok_or_else(|| unknown(ErrorKind::NotFound.into()))
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
        source: io::Error,
    },
    /// The port is used by another program.
    #[error("port {port} of {host} is in use; --port 0 takes any free port")]
    PortInUse {
        /// The host.
        host: IpAddr,
        /// The port.
        port: u16,
    },
}

impl Worded for ViewError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_of_other_websites_are_refused() {
        let mut headers = HeaderMap::new();
        headers.insert("host", HeaderValue::from_static("192.168.1.5:8765"));
        let own = ["https://lab.example".to_owned()];
        for origin in [
            "https://app.foxglove.dev",
            "http://localhost:8080",
            "http://127.0.0.1:3000",
            "http://[::1]:3000",
            "http://192.168.1.5:8765",
            "file://",
            "https://lab.example",
        ] {
            assert!(is_allowed(origin, &headers, &own), "{origin}");
        }
        for origin in [
            "https://evil.example",
            "http://app.foxglove.dev",
            "https://foxglove.dev.evil.example",
            "https://evilfoxglove.dev",
            "http://localhost.evil.example",
            "http://192.168.1.6",
            "null",
            "",
        ] {
            assert!(!is_allowed(origin, &headers, &own), "{origin}");
        }
        // A name that an attacker has pointed to this machine.
        headers.insert("host", HeaderValue::from_static("evil.example:8765"));
        assert!(!is_allowed("http://evil.example:8765", &headers, &own));
    }

    #[test]
    fn subscriptions_to_unknown_channels_are_ignored() {
        let client = Client::default();
        for id in [0, 1, 2, 3, u32::MAX] {
            let request = json!({"op": "subscribe", "subscriptions": [{"id": 7, "channelId": id}]});
            client.take(&request.to_string(), 2);
        }
        let mut channels: Vec<u32> = locked(&client.subscriptions).keys().copied().collect();
        channels.sort_unstable();
        assert_eq!(channels, [1, 2]);
    }

    #[test]
    fn full_queue_drops_its_oldest_data() {
        let client = Client::default();
        client.push(Outgoing::Announcement("first".into()));
        let content: Arc<[u8]> = vec![0; 1 << 20].into();
        for log_ns in 0..100 {
            let content = Arc::clone(&content);
            client.push(Outgoing::Data { channel: 1, log_ns, content });
        }
        assert!(locked(&client.queue).bytes <= QUEUE_BYTES);
        assert!(matches!(client.pop(), Some(Outgoing::Announcement(_))));
        let mut times = Vec::new();
        while let Some(Outgoing::Data { log_ns, .. }) = client.pop() {
            times.push(log_ns);
        }
        assert_eq!(times, [97, 98, 99]);
        assert_eq!(locked(&client.queue).bytes, 0);
    }
}
