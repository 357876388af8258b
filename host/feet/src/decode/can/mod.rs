//! Decoding of CAN frames, as they arrive or from a log.
//!
//! [`CanDecoder`] assigns frames to feet. A contact starts a row, and the frames that its foot sends after it complete that
//! row. The row is final when the foot sends its next contact. [`foot`] dates the contacts: it counts the turns of the
//! foot's 16-bit clock.

mod foot;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, VecDeque};
use std::io::BufRead;
use std::sync::Arc;

use estimator_core::Timestamp;
use wire::foot::cob_id;
use wire::pdo::{
    Acceleration, Attitude, Axes, Bias, ClockReading, Contact, Health, Load, P8, Rate, ShortTime,
};
use wire::{CanFrame, Emergency, Fault, NodeId, Pdo};

use super::can_log::{Lines, LogContent, LogReader, LogTimes};
use super::report::{EmergencyReport, Report};
use super::row::{ClockTurn, CommonClock};
use super::{ContactRow, DecodeError, DecodeNotice, FileOutcome, KnownFeet, RowSink};
use foot::{ClockCorrection, FootOnCan, Syncs};

/// Meaning of a frame's time of reception.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Reception {
    /// Approximate time on the bus, because the log was written as frames arrived.
    #[default]
    Logged,
    /// Time of reading, before which the frame may have been queued and later frames may have been dropped.
    Live,
}

/// Decoder of CAN frames. A contact becomes a row, which further frames of its foot complete.
#[derive(Default)]
pub(crate) struct CanDecoder {
    /// Newest rows.
    pub(crate) rows: PendingRows,
    pub(crate) report: Report,
    /// Feet by interface and node id, because feet on two buses may share an id.
    feet: BTreeMap<(String, u8), FootEntry>,
    /// SYNCs by interface.
    syncs: BTreeMap<String, Syncs>,
    /// Nodes that are feet.
    pub(crate) known: KnownFeet,
    /// Other nodes whose frames may be contacts: the first of each interface.
    pub(crate) unknown_feet: Vec<(String, u8)>,
    /// Interface of the newest row.
    interface: Option<Arc<str>>,
    reception: Reception,
}

/// A foot with its restarts.
#[derive(Default)]
struct FootEntry {
    /// `None` from a boot-up to the next contact.
    foot: Option<FootOnCan>,
    /// Newest contact of the foot, if its number is 0.
    first: Option<First>,
    /// Number of restarts.
    segment: u32,
    /// Kinds of frames that came without a contact before them.
    early: Vec<Pdo>,
}

/// A contact of number 0, which may be the first after a start. A starting foot sends its first contact before
/// its boot-up, because the contact has the lower identifier.
struct First {
    contact: Contact,
    index: usize,
    at: Option<Timestamp>,
    /// Counts to apply if no boot-up follows.
    counted: Report,
}

impl CanDecoder {
    pub(crate) fn new(known: KnownFeet, reception: Reception) -> Self {
        Self { known, reception, ..Self::default() }
    }

    /// Processes a frame received at `at`.
    pub(crate) fn take(&mut self, interface: &str, frame: &CanFrame, at: Option<Timestamp>) {
        let id = frame.id();
        let (function, node) = cob_id::split(id);
        let kind = match (function, node) {
            (0x000, None) => "nmt",
            (cob_id::SYNC, None) => {
                self.sync(interface, frame, at);
                "sync"
            }
            (cob_id::TIME, None) => "time",
            _ if id == 0x7E4 || id == 0x7E5 => "lss",
            (
                cob_id::EMERGENCY | 0x180..=0x580 | cob_id::SDO_REQUEST | cob_id::HEARTBEAT,
                Some(node),
            ) if !self.known.contains(node) => {
                if function == Pdo::Contact.base() && frame.data8().is_some() {
                    let mut known = self.unknown_feet.iter();
                    if !known.any(|(other, _)| other == interface) {
                        self.unknown_feet.push((interface.to_owned(), node.get()));
                    }
                }
                "of_other_nodes"
            }
            (cob_id::EMERGENCY, Some(node)) => return self.emergency(interface, node, frame),
            (cob_id::SDO_RESPONSE, Some(_)) => "sdo_response",
            (cob_id::SDO_REQUEST, Some(_)) => "sdo_request",
            (cob_id::HEARTBEAT, Some(node)) if frame.data() == [0] => {
                self.boot_up(interface, node);
                "boot_up"
            }
            (cob_id::HEARTBEAT, Some(_)) => "heartbeat",
            (Load::BASE, Some(_)) => "load",
            _ => match Pdo::from_cob_id(id) {
                Some((pdo, node)) => return self.pdo(interface, pdo, node, frame, at),
                None => "not_of_a_foot",
            },
        };
        self.report.count_frame(kind);
    }

    /// Processes a frame of a foot's values: a contact starts a row, other frames complete the newest row of their foot.
    fn pdo(
        &mut self,
        interface: &str,
        pdo: Pdo,
        node: NodeId,
        frame: &CanFrame,
        at: Option<Timestamp>,
    ) {
        let Some(bytes) = frame.data8() else {
            let problem = format!("{}_of_wrong_length", kind_name(pdo));
            return self.report.count_problem(problem);
        };
        self.report.count_frame(kind_name(pdo));
        if pdo == Pdo::Contact {
            return self.contact(interface, node, &Contact::decode(bytes), at);
        }
        // Other frames of a foot belong to the contact that it sent just before.
        let key = (interface.to_owned(), node.get());
        let entry = self.feet.entry(key).or_default();
        let Some(foot) = &entry.foot else {
            // If reception began between a contact and its other frames, one of each kind may come.
            if entry.early.contains(&pdo) {
                self.report.count_problem("frames_before_any_contact");
            } else {
                entry.early.push(pdo);
            }
            return;
        };
        let row = self.rows.get_mut(foot.row);
        if !row.is_some_and(|row| complete_row(row, pdo, bytes, foot.newest.short)) {
            self.report.count_problem("frames_without_their_contact");
        }
        if pdo == Pdo::Health {
            self.correct_clock(interface, node, Health::decode(bytes).clock);
        }
    }

    /// Starts a row with a contact.
    fn contact(&mut self, interface: &str, node: NodeId, contact: &Contact, at: Option<Timestamp>) {
        let index = self.rows.next_index();
        let name = self.name(interface);
        let entry = self.feet.entry((interface.to_owned(), node.get()));
        let entry = entry.or_default();
        if let Some(first) = entry.first.take() {
            self.report.add_contact(first.counted);
        }
        let may_be_first = entry.foot.is_some() && contact.sequence == 0;
        let mut counted = Report::default();
        let report = if may_be_first { &mut counted } else { &mut self.report };
        let mut foot = match entry.foot.clone() {
            None => FootOnCan::new(contact, index, at, self.reception),
            Some(mut foot) => {
                if !foot.take(contact, index, at, report) {
                    return self.report.add_contact(counted);
                }
                foot
            }
        };
        let micros = foot.newest.micros;
        entry.first = may_be_first.then_some(First { contact: *contact, index, at, counted });
        self.rows.push(ContactRow {
            timestamp: Timestamp::from_micros(micros),
            turn: foot.turn(),
            missing: foot.take_missing(),
            received: at,
            common: foot.common(micros).or(at.map(|at| (at, CommonClock::Received))),
            interface: name,
            foot: self.known.name(node),
            node: Some(node),
            segment: entry.segment,
            sequence: u16::from(contact.sequence),
            stable: contact.stable.probability(),
            tangential: contact.tangential.probability(),
            vertical: contact.vertical.probability(),
            status: contact.status,
            ..ContactRow::default()
        });
        entry.foot = Some(foot);
    }

    /// Name of the interface, shared with the newest row if equal; `None` if the log does not name it.
    fn name(&mut self, interface: &str) -> Option<Arc<str>> {
        if self.interface.as_deref() != Some(interface) {
            self.interface = Some(interface.into());
        }
        self.interface.clone().filter(|name| !name.is_empty())
    }

    /// Corrects the times of a foot's newest rows by the full clock in its health frame.
    fn correct_clock(&mut self, interface: &str, node: NodeId, reading: ClockReading) {
        let key = (interface.to_owned(), node.get());
        let Some(FootEntry { foot: Some(foot), segment, .. }) = self.feet.get_mut(&key) else {
            return;
        };
        let (newest, change) = (foot.row, foot.read_clock(reading, &mut self.report));
        match change {
            ClockCorrection::None => {}
            ClockCorrection::Turn(from, shift_us) => {
                let common = |row: &mut ContactRow| {
                    row.common = foot.common(row.timestamp.as_micros()).or(row.common);
                };
                self.rows.shift(from, newest, shift_us, common);
            }
            // The boot-up was lost.
            ClockCorrection::Restart(from, shift_us) => {
                self.report.restarts += 1;
                *segment += 1;
                let restarted = |row: &mut ContactRow| {
                    row.segment = *segment;
                    row.common = row.received.map(|at| (at, CommonClock::Received));
                };
                self.rows.shift(from, newest, shift_us, restarted);
            }
        }
        if let Some(row) = self.rows.get_mut(newest) {
            row.missing += foot.take_missing();
        }
        if let Some(syncs) = self.syncs.get(interface)
            && let Some(offset) = foot.align(reading, syncs)
        {
            self.rows.align(newest, offset);
        }
    }

    /// Processes the start of a foot, whose clock and sequence numbers then restart.
    fn boot_up(&mut self, interface: &str, node: NodeId) {
        let entry = self.feet.get_mut(&(interface.to_owned(), node.get()));
        let Some(entry) = entry.filter(|entry| entry.foot.is_some()) else {
            return;
        };
        self.report.restarts += 1;
        entry.segment += 1;
        entry.foot = None;
        let Some(first) = entry.first.take() else {
            return;
        };
        // If nothing was missing before this contact, it continued the numbers before the boot-up, and the foot sent it
        // before the restart.
        if first.counted.missing == 0 && first.counted.problems.is_empty() {
            return self.report.add_contact(first.counted);
        }
        let (index, at) = (first.index, first.at);
        let foot = FootOnCan::new(&first.contact, index, at, self.reception);
        if let Some(row) = self.rows.get_mut(index) {
            row.timestamp = Timestamp::from_micros(foot.newest.micros);
            row.turn = foot.turn();
            row.missing = 0;
            row.segment = entry.segment;
            row.common = at.map(|at| (at, CommonClock::Received));
        }
        entry.foot = Some(foot);
    }

    /// Reports an emergency at the time of the newest contact of its foot.
    fn emergency(&mut self, interface: &str, node: NodeId, frame: &CanFrame) {
        self.report.count_frame("emergency");
        let Some(bytes) = frame.data8() else {
            return self.report.count_problem("emergency_of_wrong_length");
        };
        let emergency = Emergency::decode(bytes);
        let entry = self.feet.get(&(interface.to_owned(), node.get()));
        let foot = entry.and_then(|entry| entry.foot.as_ref());
        let fault = emergency.fault.map(Fault::name);
        self.report.emergencies.push(EmergencyReport {
            t: foot.map(|foot| foot.newest.micros as f64 / 1.0e6),
            interface: interface.to_owned(),
            node: node.get(),
            code: emergency.code,
            fault: fault.unwrap_or("a fault that is not known here").to_owned(),
            detail: emergency.detail,
        });
    }

    /// Stores the time of reception of a numbered SYNC.
    fn sync(&mut self, interface: &str, frame: &CanFrame, at: Option<Timestamp>) {
        let (&[counter], Some(at)) = (frame.data(), at) else {
            return;
        };
        let syncs = self.syncs.entry(interface.to_owned()).or_default();
        // 0 means that SYNCs are not numbered.
        if counter != 0 {
            syncs.insert(counter, at);
        }
    }

    /// Returns the rows that are final: their foot has sent its next contact, or they were received before
    /// `overdue`.
    pub(crate) fn final_rows(&mut self, overdue: Timestamp) -> impl Iterator<Item = ContactRow> {
        let (rows, feet, report) = (&mut self.rows, &self.feet, &mut self.report);
        std::iter::from_fn(move || {
            let index = rows.first_index();
            let row = rows.get_mut(index)?;
            let interface = row.interface.as_deref().unwrap_or_default();
            let is_newest = row.node.is_some_and(|node| {
                let entry = feet.get(&(interface.to_owned(), node.get()));
                let foot = entry.and_then(|entry| entry.foot.as_ref());
                foot.is_some_and(|foot| foot.row == index)
            });
            if is_newest && row.received.is_none_or(|received| received >= overdue) {
                return None;
            }
            rows.pop(report)
        })
    }

    /// Ends reception: applies the pending counts.
    pub(crate) fn finish(&mut self) {
        let feet = self.feet.values_mut();
        for first in feet.filter_map(|entry| entry.first.take()) {
            self.report.add_contact(first.counted);
        }
    }
}

/// Completes the row of the contact at `short` with another frame of the foot, and returns whether it belongs to that
/// contact. The values of a frame with another time are discarded.
fn complete_row(row: &mut ContactRow, pdo: Pdo, bytes: &[u8; 8], short: ShortTime) -> bool {
    let mut time = short;
    match pdo {
        Pdo::Contact => {}
        Pdo::Axes => {
            let axes = Axes::decode(bytes);
            time = axes.timestamp;
            row.axes = Some(axes.probabilities.map(P8::probability)).filter(|_| time == short);
        }
        Pdo::Attitude => row.orientation = Some(Attitude::decode(bytes).orientation()),
        Pdo::Acceleration => {
            let acceleration = Acceleration::decode(bytes);
            time = acceleration.timestamp;
            row.acceleration = Some(acceleration.acceleration()).filter(|_| time == short);
        }
        Pdo::Rate => {
            let rate = Rate::decode(bytes);
            time = rate.timestamp;
            row.rate = Some(rate.rate()).filter(|_| time == short);
        }
        Pdo::Bias => {
            let bias = Bias::decode(bytes);
            row.bias = Some(bias.bias());
            row.temperature = Some(bias.temperature());
        }
        Pdo::Health => row.flags = Some(Health::decode(bytes).flags),
    }
    time == short
}

/// Name of a PDO in reports.
const fn kind_name(pdo: Pdo) -> &'static str {
    match pdo {
        Pdo::Contact => "contact",
        Pdo::Axes => "axes",
        Pdo::Attitude => "attitude",
        Pdo::Acceleration => "acceleration",
        Pdo::Rate => "rate",
        Pdo::Bias => "bias",
        Pdo::Health => "health",
    }
}

/// The newest rows, which further frames may still complete, and the number of rows already returned.
#[derive(Default)]
pub(crate) struct PendingRows {
    rows: VecDeque<ContactRow>,
    returned: usize,
}

impl PendingRows {
    /// Index of the next row, from the start of the log.
    fn next_index(&self) -> usize {
        self.returned + self.rows.len()
    }

    /// Index of the oldest row kept.
    const fn first_index(&self) -> usize {
        self.returned
    }

    fn push(&mut self, row: ContactRow) {
        self.rows.push_back(row);
    }

    /// The row with this index; `None` if it was already returned.
    fn get_mut(&mut self, index: usize) -> Option<&mut ContactRow> {
        self.rows.get_mut(index.checked_sub(self.returned)?)
    }

    /// Sets the common time of the kept rows of one foot, the foot of row `index`, to the foot's clock plus `offset`, µs.
    /// Does nothing if the common time of row `index` was set by a SYNC before.
    fn align(&mut self, index: usize, offset: i64) {
        let Some(row) = self.get_mut(index) else {
            return;
        };
        if matches!(row.common, Some((_, CommonClock::Sync))) {
            return;
        }
        let (interface, node, segment) = (row.interface.clone(), row.node, row.segment);
        for row in &mut self.rows {
            if row.node == node && row.segment == segment && row.interface == interface {
                let common = row.timestamp.as_micros().checked_add_signed(offset);
                if let Some(common) = common {
                    row.common = Some((Timestamp::from_micros(common), CommonClock::Sync));
                }
            }
        }
    }

    /// Shifts the times of a foot's rows from row `from` on by `shift_us`, and marks their turn as known. Applies `change`
    /// to each of these rows.
    fn shift(
        &mut self,
        from: usize,
        newest: usize,
        shift_us: i64,
        change: impl Fn(&mut ContactRow),
    ) {
        let Some(last) = self.get_mut(newest) else {
            return;
        };
        let (interface, node) = (last.interface.clone(), last.node);
        for row in self.rows.iter_mut().skip(from.saturating_sub(self.returned)) {
            if row.node == node && row.interface == interface {
                let micros = row.timestamp.as_micros().saturating_add_signed(shift_us);
                row.timestamp = Timestamp::from_micros(micros);
                row.turn = ClockTurn::Known;
                change(row);
            }
        }
    }

    /// Writes the oldest rows until `kept` are left.
    fn write_but(
        &mut self,
        kept: usize,
        report: &mut Report,
        sink: RowSink<'_>,
    ) -> Result<(), DecodeError> {
        while self.rows.len() > kept
            && let Some(row) = self.pop(report)
        {
            sink(row).map_err(DecodeError::Rows)?;
        }
        Ok(())
    }

    /// Removes, counts and returns the oldest row.
    fn pop(&mut self, report: &mut Report) -> Option<ContactRow> {
        let row = self.rows.pop_front()?;
        self.returned += 1;
        report.count_row(&row);
        Some(row)
    }
}

/// Number of rows kept: a second of four feet. The other frames of a sample follow the contact within
/// milliseconds; the first SYNC that a foot reports follows within a tenth of a second.
const KEPT: usize = 4096;

/// Number of malformed lines that are quoted; further ones are only counted.
const NAMED_LINES: u64 = 10;

/// Decodes all lines of a log.
pub(super) fn decode(
    mut lines: Lines<impl BufRead>,
    mut reader: LogReader,
    file: &str,
    feet: &KnownFeet,
    sink: RowSink<'_>,
) -> Result<FileOutcome, DecodeError> {
    let mut log = CanDecoder::new(feet.clone(), Reception::Logged);
    log.report.log = Some(reader.form);
    let mut notices = Vec::new();
    let mut malformed = 0;
    let mut has_times = false;
    let unreadable = DecodeError::unreadable(file);
    while let Some((number, line)) = lines.next().map_err(&unreadable)? {
        if line.trim().is_empty() {
            continue;
        }
        let read = reader.read(&line);
        has_times |= matches!(&read, Some(read) if read.time.is_some());
        match read.map(|read| (read.content, read.time)) {
            Some((LogContent::Frame(interface, frame), at)) => log.take(interface, &frame, at),
            Some((LogContent::Other(other), _)) => log.report.count_frame(other.name()),
            Some((LogContent::Dropped(count), _)) => {
                log.report.count_problems("dropped_before_the_log", count);
            }
            None => {
                log.report.count_problem("malformed_lines");
                malformed += 1;
                if malformed <= NAMED_LINES {
                    let start: String = line.chars().take(60).collect();
                    let form = reader.form;
                    notices.push(DecodeNotice::MalformedLine { number, start, form });
                }
            }
        }
        log.rows.write_but(KEPT, &mut log.report, sink)?;
    }
    log.finish();
    log.rows.write_but(0, &mut log.report, sink)?;
    if malformed > NAMED_LINES {
        let more = malformed - NAMED_LINES;
        notices.push(DecodeNotice::MoreMalformedLines(more, reader.form));
    }
    if log.report.rows == 0
        && let Some((_, node)) = log.unknown_feet.first()
    {
        notices.push(DecodeNotice::UnknownFoot { known: feet.ids(), node: *node });
    }
    if reader.times == LogTimes::Differences {
        notices.push(DecodeNotice::TimesAreDifferences);
    }
    notices.extend(clock_notice(&log, has_times));
    Ok(FileOutcome { file: file.to_owned(), report: log.report, notices })
}

/// Notice of the common clock of several feet; `None` for a single foot.
fn clock_notice(log: &CanDecoder, has_times: bool) -> Option<DecodeNotice> {
    let feet = log.feet.values().filter(|entry| entry.foot.is_some());
    if feet.count() < 2 {
        return None;
    }
    let of = |clock: CommonClock| log.report.clocks.get(clock.name()).copied().unwrap_or(0);
    Some(if !has_times {
        DecodeNotice::NoCommonClock
    } else if of(CommonClock::Sync) == 0 {
        DecodeNotice::CommonByReception
    } else {
        DecodeNotice::CommonBySync { received: of(CommonClock::Received) }
    })
}
