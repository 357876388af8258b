//! Serial ports as pseudo-terminals, with the board's own program behind them.

#![cfg(unix)]

use std::fs::File;
use std::io::{Read, Write};
use std::os::fd::OwnedFd;
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use feet::decode::KnownFeet;
use feet::decode::live::{FootMessage, LiveDecoder, MessageBody};
use feet::feed::FeedEvent;
use feet::link::Arrived;
use feet::link::serial::{SlcanParser, SlcanWord};
use feet::{Feed, LineSource, Link, Sending, Session, Source};
use rustix::fs::{Mode, OFlags, open};
use rustix::io::ioctl_fionread;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use simulated_robot::{DemoLine, Robot};
use wire::{CanFrame, slcan};

fn source(text: &str) -> Source {
    text.parse().expect("a source")
}

/// Opens a pseudo-terminal; returns our end and the name of the other.
fn terminal() -> (OwnedFd, String) {
    let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).expect("a pseudo-terminal");
    grantpt(&ours).expect("granted");
    unlockpt(&ours).expect("unlocked");
    let mut settings = tcgetattr(&ours).expect("its settings");
    settings.make_raw();
    tcsetattr(&ours, OptionalActions::Now, &settings).expect("set");
    let name = ptsname(&ours, Vec::new()).expect("its name");
    (ours, name.into_string().expect("text"))
}

/// Receives the bytes that arrive at our end.
fn received(ours: &OwnedFd) -> Receiver<Vec<u8>> {
    let mut file = File::from(ours.try_clone().expect("a second handle"));
    let (to, bytes) = channel();
    thread::spawn(move || {
        let mut piece = [0; 4096];
        // An error means that the other end is closed; it may be reopened.
        loop {
            match file.read(&mut piece) {
                Ok(0) => return,
                Ok(count) => {
                    if to.send(piece[..count].to_vec()).is_err() {
                        return;
                    }
                }
                Err(_) => thread::sleep(Duration::from_millis(5)),
            }
        }
    });
    bytes
}

/// Timeout that ends a hang.
const LONGEST: Duration = Duration::from_secs(120);

/// Timeout of one receive.
const PIECE: Duration = Duration::from_millis(100);

/// Listens to a feed until `is_enough`.
fn listen(feed: &Feed, is_enough: impl FnMut(&[FootMessage]) -> bool) -> Vec<FootMessage> {
    let next = || match feed.next(PIECE) {
        Some(FeedEvent::Arrived(arrived)) => Some(arrived),
        Some(FeedEvent::Ended(error)) => panic!("{error}"),
        _ => None,
    };
    decode(next, is_enough)
}

/// Listens to a line until `is_enough`.
fn listen_to_line(
    link: &mut dyn Link,
    is_enough: impl FnMut(&[FootMessage]) -> bool,
) -> Vec<FootMessage> {
    decode(|| link.receive(PIECE).expect("an unbroken line"), is_enough)
}

/// Decodes arrivals until `is_enough`.
fn decode(
    mut next: impl FnMut() -> Option<Arrived>,
    mut is_enough: impl FnMut(&[FootMessage]) -> bool,
) -> Vec<FootMessage> {
    let mut decoder = LiveDecoder::default();
    let mut heard = Vec::new();
    let end = Instant::now() + LONGEST;
    while !is_enough(&heard) {
        assert!(Instant::now() < end, "{} things heard", heard.len());
        if let Some((at, arrival)) = next() {
            decoder.take(arrival, at);
        }
        heard.extend(std::iter::from_fn(|| decoder.next_message()));
    }
    heard
}

fn contacts(heard: &[FootMessage]) -> usize {
    let contacts = heard.iter().filter(|h| matches!(h.body, MessageBody::Contact(_)));
    contacts.count()
}

/// Runs a foot at our end of a terminal until the other end is closed; returns the name of that.
fn foot() -> String {
    let (ours, name) = terminal();
    let requests = received(&ours);
    thread::spawn(move || {
        let mut to = File::from(ours);
        let mut robot = Robot::new(1, 1, DemoLine::Uart);
        loop {
            requests.try_iter().for_each(|bytes| robot.send_serial(0, &bytes));
            robot.tick();
            let sent = robot.take_serial(0);
            if to.write_all(&sent).is_err() {
                return;
            }
            thread::sleep(Duration::from_micros(200));
        }
    });
    name
}

#[test]
fn foot_on_a_serial_port_streams_and_responds() {
    use wire::uart::{Answer, ConfigGet, Message, encode};
    let name = foot();
    let mut line = source(&format!("uart:{name}")).open().expect("a port");
    let heard = listen_to_line(line.as_mut(), |heard| contacts(heard) >= 500);
    let first = heard.iter().find_map(|heard| match &heard.body {
        MessageBody::Contact(row) => Some(row.sequence),
        _ => None,
    });
    assert!(first.is_some());
    let address = wire::Address::new(0x2000, 0);
    let request = encode(0, &Message::ConfigGet(ConfigGet { address }));
    let request = Sending::Bytes { port: None, bytes: request.as_bytes().to_vec() };
    line.send(&request).expect("sent");
    let is_answer = |heard: &FootMessage| matches!(&heard.body, MessageBody::Answer(answer) if answer.address == address);
    let heard = listen_to_line(line.as_mut(), |heard| heard.iter().any(is_answer));
    let answer = heard.into_iter().find(is_answer).map(|heard| heard.body);
    match answer {
        Some(MessageBody::Answer(answer)) => assert!(matches!(answer.answer, Answer::Value(_))),
        other => panic!("{other:?}"),
    }
}

/// A board on USB keeps a packet that the program before has not taken when it ended.
#[test]
fn contact_from_before_the_port_was_opened_is_not_heard() {
    use estimator_core::{ContactEstimate, Timestamp};
    use wire::Faults;
    use wire::uart::{ContactMessage, Message, encode};

    let contact = |sequence: u16| {
        let timestamp = Timestamp::from_micros(1_000 * u64::from(sequence));
        let estimate = ContactEstimate { timestamp, ..ContactEstimate::default() };
        encode(sequence, &Message::Contact(ContactMessage::new(&estimate, Faults::NONE)))
    };
    let (ours, name) = terminal();
    let mut board = File::from(ours);
    board.write_all(contact(1).as_bytes()).expect("sent");
    let system = open(&name, OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).expect("opened");
    while ioctl_fionread(&system).expect("a count") == 0 {
        thread::sleep(Duration::from_millis(1));
    }
    let feed = Feed::open(source(&format!("uart:{name}")));
    thread::spawn(move || {
        for sequence in 20_000..u16::MAX {
            if board.write_all(contact(sequence).as_bytes()).is_err() {
                return;
            }
            thread::sleep(Duration::from_millis(1));
        }
    });
    let heard = listen(&feed, |heard| contacts(heard) >= 5);
    let rows = heard.iter().filter_map(|heard| match &heard.body {
        MessageBody::Contact(row) => Some(row),
        _ => None,
    });
    let rows: Vec<_> = rows.map(|row| (row.sequence >= 20_000, row.missing)).collect();
    assert!(rows.iter().all(|row| *row == (true, 0)), "{rows:?}");
}

#[test]
fn feet_on_several_ports_are_one_feed_with_names() {
    let ports = [foot(), foot()];
    let sources =
        ports.iter().map(|port| Box::new(source(&format!("uart:{port}"))) as Box<dyn LineSource>);
    let feed = Feed::open_all(sources.collect());
    let of = |heard: &[FootMessage], port: &str| {
        heard.iter().filter(|heard| *heard.foot.line == *port).count()
    };
    let heard = listen(&feed, |heard| ports.iter().all(|port| of(heard, port) >= 300));
    assert!(heard.iter().all(|heard| heard.foot.node == Some(0x11)), "no foot without a name");
    let mut session = Session::new(KnownFeet::default());
    let end = Instant::now() + LONGEST;
    while session.same_name().is_none() {
        assert!(Instant::now() < end);
        session.listen(&feed, Duration::from_millis(100));
        while session.next_update().is_some() {}
    }
    let same = session.same_name().expect("both are FL");
    assert_eq!(same.unused, "FR");
}

/// Runs an adapter at our end of a terminal, with a robot of four feet on its bus. The frames that it receives
/// are returned through the channel.
fn adapter(ours: OwnedFd) -> Receiver<CanFrame> {
    let commands = received(&ours);
    let (to_test, given) = channel();
    thread::spawn(move || {
        let mut to = File::from(ours);
        let mut robot = Robot::new(4, 1, DemoLine::Can);
        let mut parser = SlcanParser::default();
        let mut is_open = false;
        loop {
            for byte in commands.try_iter().flatten() {
                let answer: &[u8] = match parser.push(byte) {
                    Some(SlcanWord::Frame(frame)) => {
                        robot.send(frame);
                        // The test may have ended.
                        let _ = to_test.send(frame);
                        b"z\r"
                    }
                    Some(SlcanWord::Line(command)) => match command.as_str() {
                        "S8" if !is_open => b"\r",
                        "O" if !is_open => {
                            is_open = true;
                            b"\r"
                        }
                        "C" if is_open => {
                            is_open = false;
                            b"\r"
                        }
                        _ => b"\x07",
                    },
                    _ => continue,
                };
                if to.write_all(answer).is_err() {
                    return;
                }
            }
            robot.tick();
            let mut lines = Vec::new();
            while let Some((_, frame)) = robot.next_frame() {
                lines.extend_from_slice(&slcan::encode(&frame));
            }
            if is_open && to.write_all(&lines).is_err() {
                return;
            }
            thread::sleep(Duration::from_micros(300));
        }
    });
    given
}

/// Opens an adapter. It refuses commands at first, because it responds late until its robot has started.
fn open_adapter(source: &Source) -> Box<dyn Link> {
    let end = Instant::now() + LONGEST;
    loop {
        match source.open() {
            Ok(line) => return line,
            Err(error) => assert!(error.may_pass() && Instant::now() < end, "{error}"),
        }
    }
}

#[test]
fn slcan_adapter_receives_from_and_sends_to_four_feet() {
    let (ours, name) = terminal();
    let given = adapter(ours);
    let mut line = open_adapter(&source(&format!("slcan:{name}")));
    let heard = listen_to_line(line.as_mut(), |heard| contacts(heard) >= 1000);
    let mut nodes: Vec<_> = heard.iter().filter_map(|heard| heard.foot.node).collect();
    nodes.sort_unstable();
    nodes.dedup();
    assert_eq!(nodes, [0x11, 0x12, 0x13, 0x14]);
    // An SDO that reads the device type, 0x1000.
    let request = CanFrame::new(0x611, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]).expect("a frame");
    line.send(&Sending::Frame(request)).expect("sent");
    let is_sdo = |heard: &FootMessage| matches!(heard.body, MessageBody::Sdo(_));
    let heard = listen_to_line(line.as_mut(), |heard| heard.iter().any(is_sdo));
    assert!(heard.iter().any(|h| matches!(h.body, MessageBody::Sdo([0x43, 0x00, 0x10, ..]))));
    let frames: Vec<_> = given.try_iter().collect();
    assert!(frames.contains(&request), "{frames:?}");
}

#[test]
fn port_without_an_adapter_is_reported() {
    let (ours, name) = terminal();
    let feed = Feed::open(source(&format!("slcan:{name}")));
    match feed.next(LONGEST) {
        Some(FeedEvent::WaitsFor(error)) => {
            assert!(
                error.to_string().contains("does not respond like an slcan adapter"),
                "{error}"
            );
        }
        other => panic!("{other:?}"),
    }
    drop(ours);
}

#[test]
fn unplugged_port_is_retried() {
    let (ours, name) = terminal();
    let feed = Feed::open(source(&format!("uart:{name}")));
    assert!(matches!(feed.next(LONGEST), Some(FeedEvent::Opened)));
    drop(ours);
    match feed.next(LONGEST) {
        Some(FeedEvent::WaitsFor(error)) => {
            assert!(error.to_string().starts_with(&name), "{error}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn second_open_of_a_port_is_rejected() {
    let (_ours, name) = terminal();
    let source = source(&format!("uart:{name}"));
    let first = source.open().expect("a port");
    let error = source.open().err().expect("the first has it");
    assert_eq!(error.to_string(), format!("{name}: another program has it open"));
    drop(first);
    source.open().expect("it is free again");
}

#[test]
fn dropped_feed_frees_its_silent_port() {
    let (_ours, name) = terminal();
    let source = source(&format!("uart:{name}"));
    let feed = Feed::open(source.clone());
    assert!(matches!(feed.next(LONGEST), Some(FeedEvent::Opened)));
    drop(feed);
    let end = Instant::now() + LONGEST;
    while source.open().is_err() {
        assert!(Instant::now() < end, "the port is still in use");
        thread::sleep(Duration::from_millis(5));
    }
}
