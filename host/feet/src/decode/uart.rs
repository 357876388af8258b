//! Decoding of recordings of the serial line.

use std::collections::VecDeque;
use std::io::{BufReader, Read};
use std::sync::Arc;

use estimator_core::Timestamp;
use wire::board::Counter;
use wire::pdo::{P16, TEMPERATURE_STEP};
use wire::uart::{
    ContactMessage, Decoder, Frame, HealthMessage, Kind, Message, Problem, Step, step_u16,
};
use wire::{Fault, NodeId};

use super::report::{BoardReport, Medium, Report};
use super::{ContactRow, DecodeError, FileOutcome, KnownFeet, RowSink};

/// Decodes all bytes of a recording; `None` if it contains no frame with a valid CRC.
pub(super) fn decode(
    source: impl Read,
    file: &str,
    feet: &KnownFeet,
    sink: RowSink<'_>,
) -> Result<Option<FileOutcome>, DecodeError> {
    let mut decoder = Decoder::new();
    let mut has_frame = false;
    let mut stream = UartDecoder::new(feet, file);
    let mut held = HeldBack::default();
    for byte in BufReader::with_capacity(1 << 14, source).bytes() {
        let Some(result) = decoder.push(byte.map_err(DecodeError::unreadable(file))?) else {
            continue;
        };
        has_frame |= result.as_ref().err().is_none_or(is_whole);
        match result {
            Ok(frame) => {
                if let Some(row) = stream.take(&frame) {
                    stream.report.count_row(&row);
                    let at = row.timestamp;
                    held.push(row, Some(at));
                }
                let rows = held.take_if(&stream);
                write_rows(rows, &stream, sink)?;
            }
            Err(problem) => stream.report.count_problem(name(problem)),
        }
    }
    write_rows(held.take(), &stream, sink)?;
    if !has_frame {
        return Ok(None);
    }
    if decoder.is_inside_frame() {
        stream.report.count_problem("unfinished_frames");
    }
    let (file, report, notices) = (file.to_owned(), stream.report, Vec::new());
    Ok(Some(FileOutcome { file, report, notices }))
}

/// Writes rows that were held back, completed with the known properties of their foot.
fn write_rows(
    rows: VecDeque<ContactRow>,
    stream: &UartDecoder,
    sink: RowSink<'_>,
) -> Result<(), DecodeError> {
    rows.into_iter().try_for_each(|mut row| {
        stream.identify(&mut row);
        sink(row).map_err(DecodeError::Rows)
    })
}

/// Longest time for which output is held back, µs: two periods of the health message, which identifies the foot.
const LONGEST_UNNAMED_US: u64 = 200_000;

/// Largest number of messages that are held back, for a foot whose clock stands. In two periods of the health message the
/// fastest foot sends 2,700: a contact and a raw sample at 6.7 kHz.
const MOST_UNNAMED: usize = 4096;

/// Output of a foot on a serial line, held back until its first health message identifies the foot.
///
/// Otherwise the first contacts would belong to a foot without a name. A foot that sends no health message remains
/// without a name. The time to wait for one passes on the foot's clock: if this machine or the line stalls, the health
/// message is late as well.
pub(crate) struct HeldBack<T> {
    held: VecDeque<T>,
    /// Time of the first sample on the foot's clock.
    first: Option<Timestamp>,
    /// Time of the newest sample on the foot's clock.
    newest: Option<Timestamp>,
    /// Whether the foot is known, or the time to wait for its health message has passed.
    is_over: bool,
}

impl<T> Default for HeldBack<T> {
    fn default() -> Self {
        Self { held: VecDeque::new(), first: None, newest: None, is_over: false }
    }
}

impl<T> HeldBack<T> {
    /// Adds output; `sampled` is the time of its sample on the foot's clock, if it has one.
    pub(crate) fn push(&mut self, output: T, sampled: Option<Timestamp>) {
        self.held.push_back(output);
        if let Some(sampled) = sampled {
            // A foot that restarts begins again.
            let is_earlier = |first: Timestamp| sampled.as_micros() < first.as_micros();
            if self.first.is_none_or(is_earlier) {
                self.first = Some(sampled);
            }
            self.newest = Some(sampled);
        }
    }

    /// Takes the output if the foot is known, or if its clock shows that it sends no health message. Otherwise takes
    /// nothing.
    pub(crate) fn take_if(&mut self, stream: &UartDecoder) -> VecDeque<T> {
        let micros = |time: Option<Timestamp>| time.unwrap_or_default().as_micros();
        let waited_us = micros(self.newest).saturating_sub(micros(self.first));
        let is_too_long = waited_us > LONGEST_UNNAMED_US || self.held.len() > MOST_UNNAMED;
        self.is_over |= stream.is_known || is_too_long;
        if self.is_over { self.take() } else { VecDeque::new() }
    }

    /// Returns the oldest output if the foot's clock is unknown, because no output has a time so far. This is the case if the
    /// foot has only sent lines of its log.
    pub(crate) fn oldest_without_clock(&self) -> Option<&T> {
        self.held.front().filter(|_| self.first.is_none())
    }

    /// Takes the output if `waited_us` on this machine's clock is too long to wait. Otherwise takes nothing.
    pub(crate) fn take_after(&mut self, waited_us: u64) -> VecDeque<T> {
        if waited_us > LONGEST_UNNAMED_US { self.take() } else { VecDeque::new() }
    }

    /// Takes the output in any case.
    pub(crate) fn take(&mut self) -> VecDeque<T> {
        std::mem::take(&mut self.held)
    }
}

/// Returns whether the frame is undamaged but of an unknown version, kind or payload.
pub(crate) const fn is_whole(problem: &Problem) -> bool {
    matches!(problem, Problem::Version(_) | Problem::Kind(_) | Problem::Payload(_))
}

/// Name of a problem in the report.
pub(crate) fn name(problem: Problem) -> String {
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

/// State of a serial line up to its newest byte.
#[derive(Default)]
pub(crate) struct UartDecoder {
    pub(crate) report: Report,
    feet: KnownFeet,
    /// Name given to the foot of this line.
    given: Option<Arc<str>>,
    newest: Option<u16>,
    /// Time of the newest row of the segment.
    last: Option<Timestamp>,
    segment: u32,
    /// Number of missing frames that the rows so far show.
    shown_missing: u64,
    /// Node id of the foot, known from its first health message on.
    pub(crate) node: Option<NodeId>,
    /// Whether a health message was received.
    is_known: bool,
}

impl UartDecoder {
    /// Creates the state of a line before its first byte.
    pub(crate) fn new(feet: &KnownFeet, line: &str) -> Self {
        let given = feet.name_of_line(line);
        Self { report: Report::new(Medium::Uart), feet: feet.clone(), given, ..Self::default() }
    }

    /// Name of the foot: the name given to its line, or the name of its node id once the id is known.
    pub(crate) fn name(&self) -> Option<Arc<str>> {
        let of_node = || self.node.and_then(|node| self.feet.name(node));
        self.given.clone().or_else(of_node)
    }

    /// Adds the known properties of the foot to a row.
    pub(crate) fn identify(&self, row: &mut ContactRow) {
        row.node = self.node;
        row.foot = self.name();
    }

    /// Processes a frame; returns a row for a contact.
    pub(crate) fn take(&mut self, frame: &Frame) -> Option<ContactRow> {
        self.report.count_frame(kind_name(frame.message.kind()));
        if self.restarts(&frame.message) {
            self.segment += 1;
            self.report.restarts += 1;
            (self.newest, self.last) = (None, None);
        }
        let step = self.newest.map(|newest| step_u16(newest, frame.sequence));
        match step {
            Some(Step::Missing(count)) => self.report.count_missing(u64::from(count)),
            Some(Step::Late) => self.report.count_overtaken(),
            Some(Step::Restart) | None => {}
        }
        if step != Some(Step::Late) {
            self.newest = Some(frame.sequence);
        }
        match &frame.message {
            Message::Contact(contact) => Some(self.contact(contact, frame.sequence)),
            Message::Health(health) => {
                self.health(health);
                None
            }
            _ => None,
        }
    }

    /// Returns whether the foot has restarted: its clock, which does not wrap, is earlier than the last time.
    fn restarts(&self, message: &Message) -> bool {
        matches!((message, self.last), (Message::Contact(contact), Some(last))
            if contact.timestamp.as_micros() < last.as_micros())
    }

    fn contact(&mut self, contact: &ContactMessage, sequence: u16) -> ContactRow {
        let shown = std::mem::replace(&mut self.shown_missing, self.report.missing);
        let row = ContactRow {
            timestamp: Timestamp::from_micros(contact.timestamp.as_micros()),
            missing: self.report.missing.wrapping_sub(shown).cast_signed(),
            node: self.node,
            foot: self.name(),
            segment: self.segment,
            sequence,
            stable: contact.stable.probability(),
            tangential: contact.tangential.probability(),
            vertical: contact.vertical.probability(),
            axes: Some(contact.axes.map(P16::probability)),
            status: contact.status,
            flags: Some(contact.flags),
            ..ContactRow::default()
        };
        if let Some(last) = self.last.replace(row.timestamp) {
            self.report.count_step(last.as_micros(), row.timestamp.as_micros());
        }
        row
    }

    fn health(&mut self, health: &HealthMessage) {
        self.node = health.id;
        self.is_known = true;
        let temperature = health.temperature.value(TEMPERATURE_STEP);
        let counters = Counter::ALL.map(|counter| (counter.name(), health.counters.get(counter)));
        self.report.board = Some(BoardReport {
            stage: health.stage.name(),
            faults: health.faults.iter().map(Fault::name).collect(),
            temperature: Some(temperature).filter(|celsius| celsius.is_finite()),
            counters: counters.into(),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::ContactEstimate;
    use wire::{Faults, uart};

    use crate::decode::Decoded;

    fn decode(bytes: &[u8]) -> Option<Decoded> {
        crate::decode::decode(bytes, "uart.bin", &KnownFeet::default()).ok()
    }

    fn contact(sequence: u16, ms: u64) -> Vec<u8> {
        let estimate = ContactEstimate {
            timestamp: Timestamp::from_micros(ms * 1000),
            ..ContactEstimate::default()
        };
        let message = Message::Contact(ContactMessage::new(&estimate, Faults::default()));
        uart::encode(sequence, &message).as_bytes().to_vec()
    }

    #[test]
    fn restart_begins_a_new_segment() {
        // First as if 40 000 numbers were missing, then backwards.
        for (last, first) in [(10_000, 50_000), (50_000, 0)] {
            let stream = [
                contact(last - 1, 1_000),
                contact(last, 1_001),
                contact(first, 1),
                contact(first + 1, 2),
            ];
            let decoded = decode(&stream.concat()).unwrap();
            let segments: Vec<_> = decoded.rows.iter().map(|row| row.segment).collect();
            assert_eq!(segments, [0, 0, 1, 1]);
            let report = decoded.report;
            assert_eq!((report.restarts, report.missing, report.gaps), (1, 0, 0));
            assert_eq!(report.longest_step_s, Some(0.001));
        }
    }

    #[test]
    fn overtaken_frame_is_not_missing() {
        let stream = [contact(1, 1), contact(3, 2), contact(2, 3), contact(5, 4)];
        let report = decode(&stream.concat()).unwrap().report;
        assert_eq!((report.restarts, report.missing, report.gaps), (0, 1, 1));
    }

    #[test]
    fn recording_may_begin_with_any_two_bytes() {
        let frame = contact(1, 1);
        let begun = &frame[frame.len() - 3..];
        for first in 0..=u16::MAX {
            let stream = [&first.to_le_bytes()[..], begun, &frame].concat();
            let rows = decode(&stream).map(|decoded| decoded.rows.len());
            assert_eq!(rows, Some(1), "{first:04x}");
        }
    }

    #[test]
    fn recording_without_a_valid_frame_is_rejected() {
        let mut damaged = contact(1, 1);
        damaged[5] ^= 1;
        assert_eq!(decode(&damaged), None);
        assert!(decode(&[damaged, contact(2, 2)].concat()).is_some());
    }
}
