//! A recording of the serial line.

use std::collections::BTreeMap;

use estimator_core::Timestamp;
use wire::counter::Counter;
use wire::pdo::{P16, TEMPERATURE_STEP};
use wire::uart::{ContactMessage, Decoder, Frame, HealthMessage, Kind, Message, Problem};
use wire::{Fault, NodeId};

use super::report::{BoardReport, Format, Report};
use super::{Decoded, Row};

/// Decodes all bytes of a recording.
pub(super) fn decode(bytes: &[u8]) -> Decoded {
    let mut decoder = Decoder::new();
    let mut stream = Stream::new();
    for byte in bytes {
        match decoder.push(*byte) {
            Some(Ok(frame)) => stream.take(&frame),
            Some(Err(problem)) => stream.report.count_problem(name(problem)),
            None => {}
        }
    }
    if decoder.is_inside_frame() {
        stream.report.count_problem("unfinished_frames");
    }
    stream.report.finish(&stream.rows);
    Decoded {
        rows: stream.rows,
        report: stream.report,
        notices: Vec::new(),
    }
}

/// How a problem is called in the report.
fn name(problem: Problem) -> String {
    match problem {
        Problem::Coding => "bad_cobs".to_owned(),
        Problem::TooLong => "too_long".to_owned(),
        Problem::TooShort => "too_short".to_owned(),
        Problem::Check => "crc_errors".to_owned(),
        Problem::Version(version) => format!("unknown_version_{version}"),
        Problem::Kind(kind) => format!("unknown_type_0x{kind:02X}"),
        Problem::Payload(kind) => format!("bad_payload_of_{}", kind_name(kind)),
    }
}

const fn kind_name(kind: Kind) -> &'static str {
    match kind {
        Kind::Contact => "contact",
        Kind::Raw => "raw",
        Kind::Health => "health",
        Kind::ConfigGet => "config_get",
        Kind::ConfigSet => "config_set",
        Kind::ConfigResponse => "config_response",
        Kind::Log => "log",
        Kind::Nmt => "nmt",
    }
}

struct Stream {
    rows: Vec<Row>,
    report: Report,
    last: Option<u16>,
    node: Option<NodeId>,
}

impl Stream {
    const fn new() -> Self {
        Self {
            rows: Vec::new(),
            report: Report::new(Format::Uart),
            last: None,
            node: None,
        }
    }

    fn take(&mut self, frame: &Frame) {
        self.report.count_frame(kind_name(frame.message.kind()));
        if let Some(last) = self.last.replace(frame.sequence) {
            let missing = frame.sequence.wrapping_sub(last).wrapping_sub(1);
            // Not forwards: the foot has started anew.
            if missing < 1 << 15 {
                self.report.count_missing(u64::from(missing));
            }
        }
        match &frame.message {
            Message::Contact(contact) => self.contact(contact, frame.sequence),
            Message::Health(health) => self.health(health),
            _ => {}
        }
    }

    fn contact(&mut self, contact: &ContactMessage, sequence: u16) {
        let row = Row {
            timestamp: Timestamp::from_micros(contact.timestamp.as_micros()),
            node: self.node,
            sequence,
            stable: contact.stable.probability(),
            tangential: contact.tangential.probability(),
            vertical: contact.vertical.probability(),
            axes: Some(contact.axes.map(P16::probability)),
            status: contact.status,
            flags: Some(contact.flags),
            ..Row::default()
        };
        if let Some(last) = self.rows.last() {
            self.report
                .count_step(last.timestamp.as_micros(), row.timestamp.as_micros());
        }
        self.rows.push(row);
    }

    fn health(&mut self, health: &HealthMessage) {
        self.node = health.id;
        let temperature = health.temperature.value(TEMPERATURE_STEP);
        let counters: BTreeMap<_, _> = Counter::ALL
            .into_iter()
            .map(|counter| (counter.name(), health.counters.get(counter)))
            .collect();
        self.report.board = Some(BoardReport {
            stage: health.stage.name(),
            faults: health.faults.iter().map(Fault::name).collect(),
            temperature: Some(temperature).filter(|celsius| celsius.is_finite()),
            counters,
        });
    }
}
