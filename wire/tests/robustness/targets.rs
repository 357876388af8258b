//! Fuzz targets, shared with the ordinary test `robustness`: any bytes go in, and
//! the output keeps its invariants.

use estimator_core::{Decision, Phase, Stream, Timestamp};
use wire::node::{NmtCommand, Published};
use wire::pdo::{Acceleration, Attitude, Axes, Bias, Contact, Health, Load, Rate, Status};
use wire::uart::{Decoder, MAX_FRAME, Message, encode};
use wire::{BootCause, CanFrame, Emergency, Event, Fault, Node, Settings, Value, dictionary};

/// Target: its name and function.
pub type Target = (&'static str, fn(&[u8]));

/// All targets.
pub const TARGETS: [Target; 4] =
    [("frames", frames), ("node", node), ("settings", settings), ("uart", uart)];

fn never_stable_in_doubt(status: Status) {
    let stable = status.decision() == Decision::Stable
        || matches!(status.phase(), Phase::Stance | Phase::QuietSwing);
    assert!(status.is_valid() || !stable);
}

/// Frames of fixed length: decoding any bytes and encoding again changes only bits that a
/// status must not have.
pub fn frames(data: &[u8]) {
    if let Some(bytes) = data.first_chunk::<8>() {
        let contact = Contact::decode(bytes);
        never_stable_in_doubt(contact.status);
        assert_eq!(Contact::decode(&contact.encode()), contact);
        assert_eq!(contact.encode()[..7], bytes[..7]);
        assert_eq!(Axes::decode(bytes).encode(), *bytes);
        assert_eq!(Attitude::decode(bytes).encode(), *bytes);
        assert_eq!(Acceleration::decode(bytes).encode(), *bytes);
        assert_eq!(Rate::decode(bytes).encode(), *bytes);
        assert_eq!(Bias::decode(bytes).encode(), *bytes);
        assert_eq!(Health::decode(bytes).encode(), *bytes);
        let emergency = Emergency::decode(bytes);
        assert_eq!(Emergency::decode(&emergency.encode()), emergency);
    }
    if let Some(load) = Load::decode(data) {
        assert!(load.0.is_finite());
    }
}

/// Frames of at most eight bytes for a node, with ticks in between; each starts with a byte
/// that selects its kind, so that few are wasted.
pub fn node(data: &[u8]) {
    let mut node = Node::new(Settings::default(), 0x1234_5678);
    node.boot(BootCause::PowerUp);
    let mut published = Published::default();
    let mut micros = 0;
    for piece in data.chunks(9) {
        let Some((&kind, payload)) = piece.split_first() else {
            continue;
        };
        let id = match kind % 8 {
            0 | 1 => 0x611,
            2 => 0x7E5,
            3 => 0x000,
            4 => 0x211,
            5 => 0x080,
            6 => 0x100,
            _ => u16::from(kind) << 3 | 1,
        };
        if kind == 0xFF {
            node.command(NmtCommand::EnterPreOperational);
        }
        let frame = CanFrame::new(id, payload).expect("at most eight bytes");
        micros += 1000;
        let outcome = node.receive(&frame, Timestamp::from_micros(micros), &mut published);
        match outcome.event {
            Some(Event::Store | Event::Restore) => {
                node.finish(Ok(()));
            }
            Some(Event::ResetNode | Event::ResetCommunication) => {
                node.boot(BootCause::Commanded);
            }
            _ => {}
        }
        if let Some(fault) = Fault::from_number(kind) {
            node.raise(fault, u32::from(kind));
        }
        let mut sent = 0;
        node.tick(&published, |_, frame| {
            assert!(frame.id() <= 0x7FF);
            sent += 1;
        });
        assert!(sent <= 10);
    }
    // Whatever was written, the estimator accepts the settings.
    assert!(node.settings().params().validate::<256>(Stream::KILOHERTZ).is_ok());
}

/// Stored settings of any bytes: the values applied are always valid together.
pub fn settings(data: &[u8]) {
    let stored = data.chunks_exact(5).map(|piece| {
        let entries = dictionary::entries().count();
        let (address, entry) =
            dictionary::entries().nth(usize::from(piece[0]) % entries).expect("an entry");
        let raw = u32::from_le_bytes([piece[1], piece[2], piece[3], piece[4]]);
        let value = Value::from_raw(entry.data_type(), raw);
        (address, value.unwrap_or(Value::U8(piece[1])))
    });
    let (settings, _) = Settings::set_all(stored);
    assert!(settings.params().validate::<256>(Stream::KILOHERTZ).is_ok());
    for (address, value) in settings.iter() {
        let mut copy = settings.clone();
        assert_eq!(copy.set(address, value), Ok(()));
    }
}

/// Decodes a stream of any bytes. Decoded frames are valid, and a complete frame after the stream is found.
pub fn uart(data: &[u8]) {
    let mut decoder = Decoder::new();
    for byte in data {
        let Some(Ok(frame)) = decoder.push(*byte) else {
            continue;
        };
        if let Message::Contact(contact) = frame.message {
            never_stable_in_doubt(contact.status);
        }
        let again = encode(frame.sequence, &frame.message);
        assert!(again.as_bytes().len() <= MAX_FRAME);
        let mut fresh = Decoder::new();
        let decoded = again.as_bytes().iter().find_map(|byte| fresh.push(*byte));
        let decoded = decoded.expect("an end").expect("a frame");
        // The message itself is not compared: a NaN in a scale is not equal to itself.
        assert_eq!(encode(decoded.sequence, &decoded.message).as_bytes(), again.as_bytes());
    }
    decoder.push(0);
    let request = Message::Nmt(wire::uart::NmtRequest(NmtCommand::StartRemoteNode));
    let found = encode(7, &request).as_bytes().iter().find_map(|byte| decoder.push(*byte));
    assert!(matches!(found, Some(Ok(frame)) if frame.sequence == 7));
    let drops = decoder.drops();
    assert!(u64::from(drops.frames) + u64::from(drops.refused()) <= data.len() as u64 + 1);
}
