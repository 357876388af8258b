//! A log of `candump -l`.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use estimator_core::Timestamp;
use wire::pdo::{
    Acceleration, Attitude, Axes, Bias, Contact, Health, Load, P8, Rate, ShortTime, TIME_STEP_US,
};
use wire::sequence::missing_u8;
use wire::{CanFrame, Emergency, Fault, NodeId, Pdo};

use super::report::{EmergencyReport, Format, Report};
use super::{Decoded, Row};
use crate::can_log::{self, Line, Logged, Other};

/// So many broken lines are named; the others are counted.
const NAMED_LINES: u64 = 10;

/// Beyond this time between two frames the log's own clock was set, µs: a day.
const LONGEST_BRIDGE_US: i64 = 86_400_000_000;

/// Lines of a log are never this far out of order, µs: its own clock was set back.
const LONGEST_RETURN_US: i64 = -1_000_000;

/// By how much the clocks of foot and log may differ, µs: frames wait in adapters and in queues.
const TOLERANCE_US: i64 = TURN_US / 4;

/// A step and a turn of the foot's short clock, µs.
const STEP_US: i64 = TIME_STEP_US as i64;
const TURN_US: i64 = STEP_US << 16;

/// Decodes all lines of a log.
pub(super) fn decode(text: &str, file: &str, others: &[NodeId]) -> Decoded {
    let mut log = Log::new(others);
    let mut notices = Vec::new();
    let mut malformed = 0;
    for (number, line) in (1_u64..).zip(text.lines()) {
        if line.trim().is_empty() {
            continue;
        }
        match can_log::parse(line) {
            Some(Line::Frame(interface, logged)) => log.take(interface, &logged),
            Some(Line::Other(other)) => log.report.count_frame(other_name(other)),
            None => {
                log.report.count_problem("malformed_lines");
                malformed += 1;
                if malformed <= NAMED_LINES {
                    let start: String = line.chars().take(60).collect();
                    notices.push(format!(
                        "{file}, line {number}: {start:?} is no line of candump -l, which are like (1609459200.000111) can0 191#FFFF80800C0007D8"
                    ));
                }
            }
        }
    }
    if malformed > NAMED_LINES {
        let others = malformed - NAMED_LINES;
        notices.push(format!(
            "{file}: {others} more lines are none of candump -l"
        ));
    }
    if log.rows.is_empty()
        && let Some(id) = log.stranger
    {
        notices.push(format!(
            "{file}: no foot of the ids 17 to 22 has sent a contact, but node {id} may be one: --node {id}"
        ));
    }
    log.report.finish(&log.rows);
    Decoded {
        rows: log.rows,
        report: log.report,
        notices,
    }
}

/// What the log has said so far.
struct Log {
    rows: Vec<Row>,
    report: Report,
    /// By interface and node id: two buses may have a foot of the same id each.
    feet: BTreeMap<(String, u8), Foot>,
    /// So often has each started anew.
    segments: BTreeMap<(String, u8), u32>,
    /// Node ids that are feet.
    nodes: BTreeSet<u8>,
    /// Another node that sends what may be a contact.
    stranger: Option<u8>,
}

impl Log {
    fn new(others: &[NodeId]) -> Self {
        let feet = wire::Foot::ALL.map(wire::Foot::default_node_id);
        Self {
            rows: Vec::new(),
            report: Report::new(Format::Can),
            feet: BTreeMap::new(),
            segments: BTreeMap::new(),
            nodes: feet.iter().chain(others).map(|node| node.get()).collect(),
            stranger: None,
        }
    }
}

/// What is known of a foot.
#[derive(Clone, Copy)]
struct Foot {
    /// The row of its newest contact: what it sends beside a contact belongs there.
    row: usize,
    /// The short time of that row.
    short: ShortTime,
    /// Its newest contact whose time the log does not contradict.
    mark: Mark,
    /// The one before: where the log's time of the newest was wrong, it goes on from here.
    before: Option<Mark>,
    /// A newer one whose time the log does contradict, if that came last.
    suspect: Option<Mark>,
    /// The newest sequence number.
    sequence: u8,
}

/// A contact, by its foot's clock and by the log's.
#[derive(Clone, Copy)]
struct Mark {
    micros: u64,
    short: ShortTime,
    logged_us: u64,
}

/// What the log's clock says of the time from one contact to another by the foot's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Elapsed {
    /// Both clocks agree on so many µs.
    Agreed(i64),
    /// The nearest that the foot's clock allows, µs, is far from what the log's says.
    Contradicted(i64),
    /// The log's clock was set in between; µs by the foot's clock alone, less than a turn.
    Unbridged(i64),
}

impl Mark {
    /// The time to a contact at `short`, logged at `at`. The foot's own clock wraps every
    /// 655.36 ms; which turn it is, forwards or backwards, the log's clock decides.
    fn elapsed(self, short: ShortTime, at: Timestamp) -> Elapsed {
        let steps = i64::from(short.0.wrapping_sub(self.short.0)) * STEP_US;
        // Signed: a log may run backwards.
        let logged = at.as_micros().wrapping_sub(self.logged_us) as i64;
        if !(LONGEST_RETURN_US..LONGEST_BRIDGE_US).contains(&logged) {
            return Elapsed::Unbridged(steps);
        }
        let turns = (logged - steps + TURN_US / 2).div_euclid(TURN_US);
        let elapsed = steps + turns * TURN_US;
        if (elapsed - logged).abs() <= TOLERANCE_US {
            Elapsed::Agreed(elapsed)
        } else {
            Elapsed::Contradicted(elapsed)
        }
    }

    /// The contact that came so many µs later.
    fn after(self, elapsed: i64, short: ShortTime, at: Timestamp) -> Self {
        Self {
            micros: self.micros.saturating_add_signed(elapsed),
            short,
            logged_us: at.as_micros(),
        }
    }
}

impl Log {
    fn take(&mut self, interface: &str, logged: &Logged) {
        let frame = &logged.frame;
        let id = frame.id();
        let node = NodeId::new((id & 0x7F) as u8);
        let kind = match (id & 0x780, node) {
            (0x000, None) => "nmt",
            (0x080, None) => "sync",
            (0x100, None) => "time",
            _ if id == 0x7E4 || id == 0x7E5 => "lss",
            (0x080 | 0x180..=0x580 | 0x600 | 0x700, Some(node))
                if !self.nodes.contains(&node.get()) =>
            {
                if id & 0x780 == Pdo::Contact.base() && frame.data8().is_some() {
                    self.stranger.get_or_insert(node.get());
                }
                "of_other_nodes"
            }
            (0x080, Some(node)) => return self.emergency(interface, node, frame),
            (0x580, Some(_)) => "sdo_response",
            (0x600, Some(_)) => "sdo_request",
            (0x700, Some(node)) if frame.data() == [0] => {
                self.boot_up(interface, node);
                "boot_up"
            }
            (0x700, Some(_)) => "heartbeat",
            (Load::BASE, Some(_)) => "load",
            _ => match Pdo::from_cob_id(id) {
                Some((pdo, node)) => return self.pdo(interface, pdo, node, logged),
                None => "not_of_a_foot",
            },
        };
        self.report.count_frame(kind);
    }

    /// Forgets what the foot was: its clock and its numbers begin anew.
    fn boot_up(&mut self, interface: &str, node: NodeId) {
        let key = (interface.to_owned(), node.get());
        if self.feet.remove(&key).is_some() {
            self.report.restarts += 1;
            *self.segments.entry(key).or_default() += 1;
        }
    }

    fn emergency(&mut self, interface: &str, node: NodeId, frame: &CanFrame) {
        self.report.count_frame("emergency");
        let Some(bytes) = frame.data8() else {
            self.report.count_problem("emergency_of_wrong_length");
            return;
        };
        let emergency = Emergency::decode(bytes);
        let row = self.foot(interface, node).map(|foot| &self.rows[foot.row]);
        let t = row.map(|row| row.timestamp.as_micros() as f64 / 1.0e6);
        self.report.emergencies.push(EmergencyReport {
            t,
            interface: interface.to_owned(),
            node: node.get(),
            code: emergency.code,
            fault: emergency
                .fault
                .map_or("a fault that is not known here", Fault::name)
                .to_owned(),
            detail: emergency.detail,
        });
    }

    fn foot(&self, interface: &str, node: NodeId) -> Option<Foot> {
        self.feet.get(&(interface.to_owned(), node.get())).copied()
    }

    fn pdo(&mut self, interface: &str, pdo: Pdo, node: NodeId, logged: &Logged) {
        let Some(bytes) = logged.frame.data8() else {
            self.report
                .count_problem(format!("{}_of_wrong_length", kind_name(pdo)));
            return;
        };
        self.report.count_frame(kind_name(pdo));
        if pdo == Pdo::Contact {
            self.contact(interface, node, &Contact::decode(bytes), logged.at);
            return;
        }
        // What a foot sends beside the contact belongs to the contact that it sent just before.
        let Some(foot) = self.foot(interface, node) else {
            self.report.count_problem("frames_before_any_contact");
            return;
        };
        let row = &mut self.rows[foot.row];
        let mut time = foot.short;
        match pdo {
            Pdo::Contact => {}
            Pdo::Axes => {
                let axes = Axes::decode(bytes);
                time = axes.timestamp;
                row.axes =
                    Some(axes.probabilities.map(P8::probability)).filter(|_| time == foot.short);
            }
            Pdo::Attitude => row.orientation = Some(Attitude::decode(bytes).orientation()),
            Pdo::Acceleration => {
                let acceleration = Acceleration::decode(bytes);
                time = acceleration.timestamp;
                row.acceleration = Some(acceleration.acceleration()).filter(|_| time == foot.short);
            }
            Pdo::Rate => {
                let rate = Rate::decode(bytes);
                time = rate.timestamp;
                row.rate = Some(rate.rate()).filter(|_| time == foot.short);
            }
            Pdo::Bias => {
                let bias = Bias::decode(bytes);
                row.bias = Some(bias.bias());
                row.temperature = Some(bias.temperature());
            }
            Pdo::Health => row.flags = Some(Health::decode(bytes).flags),
        }
        if time != foot.short {
            self.report.count_problem("frames_without_their_contact");
        }
    }

    /// The interface's name, shared with the newest row where it is the same.
    fn name(&self, interface: &str) -> Arc<str> {
        match self.rows.last().and_then(|row| row.interface.as_ref()) {
            Some(name) if **name == *interface => Arc::clone(name),
            _ => interface.into(),
        }
    }

    fn contact(&mut self, interface: &str, node: NodeId, contact: &Contact, at: Timestamp) {
        let key = (interface.to_owned(), node.get());
        let Contact {
            timestamp: short,
            sequence,
            ..
        } = *contact;
        let first = Mark {
            micros: u64::from(short.0) * TIME_STEP_US,
            short,
            logged_us: at.as_micros(),
        };
        let row = self.rows.len();
        let mut foot = self.feet.get(&key).copied().unwrap_or(Foot {
            row,
            short,
            mark: first,
            before: None,
            suspect: None,
            sequence: sequence.wrapping_sub(1),
        });
        let missing = missing_u8(foot.sequence, sequence);
        let after_suspect = foot.suspect.take().and_then(|suspect| {
            match suspect.elapsed(short, at) {
                // Two that agree with each other: it is the mark that is out of date.
                Elapsed::Agreed(elapsed) if elapsed > 0 => Some(suspect.after(elapsed, short, at)),
                _ => None,
            }
        });
        let mut elapsed = foot.mark.elapsed(short, at);
        if let Some(before) = foot.before
            && let Elapsed::Agreed(nearer) = before.elapsed(short, at)
            && nearer > 0
            && !matches!(elapsed, Elapsed::Agreed(elapsed) if elapsed < nearer)
        {
            self.report.count_problem("times_against_the_log");
            (foot.mark, elapsed) = (before, Elapsed::Agreed(nearer));
        }
        let mark = match (elapsed, after_suspect) {
            (Elapsed::Agreed(0), _) if missing == u8::MAX => {
                self.report.duplicates += 1;
                return;
            }
            (Elapsed::Contradicted(_), Some(mark)) => mark,
            (
                Elapsed::Agreed(elapsed)
                | Elapsed::Contradicted(elapsed)
                | Elapsed::Unbridged(elapsed),
                _,
            ) => foot.mark.after(elapsed, short, at),
        };
        let is_back = matches!(elapsed, Elapsed::Agreed(elapsed) if elapsed < 0);
        // Both the time and the number say so; the number alone goes on where a time is wrong.
        let is_late = is_back && missing >= 1 << 7;
        match elapsed {
            Elapsed::Agreed(_) if is_late => self.report.count_problem("contacts_out_of_order"),
            Elapsed::Contradicted(_) if after_suspect.is_none() => {
                self.report.count_problem("times_against_the_log");
                foot.suspect = Some(mark);
            }
            _ => {
                if is_back {
                    self.report.count_problem("times_that_run_backwards");
                } else if let Elapsed::Unbridged(_) = elapsed {
                    self.report.count_problem("clock_of_the_log_set");
                }
                if foot.row != row {
                    self.report.count_step(foot.mark.micros, mark.micros);
                }
                foot.before = (foot.row != row && after_suspect.is_none()).then_some(foot.mark);
                foot.mark = mark;
            }
        }
        let row_of_contact = Row {
            timestamp: Timestamp::from_micros(mark.micros),
            interface: Some(self.name(interface)),
            node: Some(node),
            segment: self.segments.get(&key).copied().unwrap_or(0),
            sequence: u16::from(sequence),
            stable: contact.stable.probability(),
            tangential: contact.tangential.probability(),
            vertical: contact.vertical.probability(),
            status: contact.status,
            ..Row::default()
        };
        if !is_late {
            self.report.count_missing(u64::from(missing));
            foot.sequence = sequence;
        }
        self.rows.push(row_of_contact);
        foot.row = row;
        foot.short = short;
        self.feet.insert(key, foot);
    }
}

const fn other_name(other: Other) -> &'static str {
    match other {
        Other::Remote => "remote",
        Other::Extended => "extended",
        Other::Error => "error_frame",
        Other::Fd => "fd",
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;

    const NODE_33: NodeId = NodeId::new(33).unwrap();

    /// A contact of the front left foot, logged at `log_ms`.
    fn contact(interface: &str, log_ms: u64, sequence: u8, step: u16) -> String {
        let contact = Contact {
            timestamp: ShortTime(step),
            sequence,
            ..Contact::default()
        };
        let frame = CanFrame::new(0x191, &contact.encode()).unwrap();
        let at = Timestamp::from_micros(log_ms * 1000);
        format!("{}\n", Logged { at, frame }.line(interface))
    }

    fn times(decoded: &Decoded) -> Vec<u64> {
        decoded
            .rows
            .iter()
            .map(|row| row.timestamp.as_micros())
            .collect()
    }

    #[test]
    fn the_logs_clock_bridges_what_the_foots_short_one_cannot() {
        // 650 ms on the short clock; then 1 ms, 10 s of silence, and a log whose clock was set back.
        let log = [
            contact("can0", 1_000, 0, 65_000),
            contact("can0", 1_001, 1, 65_100),
            contact(
                "can0",
                11_001,
                2,
                65_100_u16.wrapping_add((1_000_000_u32 % 65_536) as u16),
            ),
            contact(
                "can0",
                500,
                3,
                65_200_u16.wrapping_add((1_000_000_u32 % 65_536) as u16),
            ),
        ];
        let decoded = decode(&log.concat(), "can.log", &[]);
        assert_eq!(times(&decoded), [650_000, 651_000, 10_651_000, 10_652_000]);
        assert_eq!(decoded.report.longest_step_s, Some(10.0));
    }

    /// A contact a millisecond, on both clocks, from just before the short one's turn.
    fn steady(count: u16) -> Vec<String> {
        let contact = |k: u16| {
            let step = 65_000_u16.wrapping_add(100 * k);
            contact("can0", 1_000 + u64::from(k), k as u8, step)
        };
        (0..count).map(contact).collect()
    }

    fn steady_times(count: u64) -> Vec<u64> {
        (0..count).map(|k| 650_000 + 1_000 * k).collect()
    }

    #[test]
    fn a_day_is_bridged_and_no_more() {
        let day = 86_400_000;
        let elapsed = (day - 1) * 1_000;
        let step = 65_000_u16.wrapping_add((elapsed / 10 % 65_536) as u16);
        for (log_ms, problems, last) in [
            (day - 1, 0, 650_000 + elapsed),
            (day, 1, 650_000 + elapsed % 655_360),
        ] {
            let log = [
                contact("can0", 1, 0, 65_000),
                contact("can0", 1 + log_ms, 1, step),
            ];
            let decoded = decode(&log.concat(), "can.log", &[]);
            let counted = decoded.report.problems.get("clock_of_the_log_set");
            assert_eq!(counted.copied().unwrap_or(0), problems);
            assert_eq!(times(&decoded), [650_000, last]);
        }
    }

    #[test]
    fn a_damaged_time_is_a_problem_of_its_own_row_alone() {
        let (backwards, against) = ("times_that_run_backwards", "times_against_the_log");
        for (damaged, problem) in [
            // By 100 ms, which frames may be late: before and after the turn.
            (65_500_u16.wrapping_add(10_000), backwards),
            (65_500 - 10_000, backwards),
            // By more.
            (20_000, against),
            (33_000, against),
            (40_000, against),
        ] {
            let mut log = steady(10);
            log[5] = contact("can0", 1_005, 5, damaged);
            let decoded = decode(&log.concat(), "can.log", &[]);
            let (mut times, mut expected) = (times(&decoded), steady_times(10));
            assert_ne!(times.remove(5), expected.remove(5));
            assert_eq!(times, expected, "{damaged}");
            let report = decoded.report;
            assert_eq!(report.problems.get(problem), Some(&1), "{damaged}");
            // The next contact may contradict it too.
            assert!(report.problems.values().sum::<u64>() <= 2, "{damaged}");
            assert_eq!((report.missing, report.rows), (0, 10));
        }
    }

    #[test]
    fn a_damaged_time_of_the_log_is_a_problem_and_shifts_no_later_row() {
        for damaged_ms in [0, 400, 900, 1_400, 5_000, 21_005, 30_000, u64::MAX / 1_000] {
            let mut log = steady(10);
            log[5] = contact("can0", damaged_ms, 5, 65_500);
            let decoded = decode(&log.concat(), "can.log", &[]);
            let (mut times, mut expected) = (times(&decoded), steady_times(10));
            times.remove(5);
            expected.remove(5);
            assert_eq!(times, expected, "{damaged_ms}");
            let report = decoded.report;
            let problems: u64 = report.problems.values().sum();
            // Up to a quarter of a turn a frame may be late.
            let is_noticed = damaged_ms != 900;
            assert_eq!(problems > 0, is_noticed, "{damaged_ms}: {problems}");
            assert_eq!((report.missing, report.rows), (0, 10));
        }
    }

    #[test]
    fn lines_out_of_order_keep_their_times_and_are_a_problem() {
        for (from, to) in [(5, 6), (3, 8)] {
            let mut log = steady(10);
            let (line, mut expected) = (log.remove(from), steady_times(10));
            log.insert(to, line);
            let time = expected.remove(from);
            expected.insert(to, time);
            let decoded = decode(&log.concat(), "can.log", &[]);
            assert_eq!(times(&decoded), expected);
            let report = decoded.report;
            let problem = ("contacts_out_of_order".to_owned(), 1);
            assert_eq!(report.problems, [problem].into());
            assert_eq!((report.gaps, report.missing, report.rows), (1, 1, 10));
        }
    }

    #[test]
    fn a_clock_of_the_log_that_is_set_costs_one_problem_and_no_turn() {
        // Forwards by an hour and some, which are no whole turns; backwards by half a minute.
        for (set_ms, problem) in [
            (3_600_300_i64, "times_against_the_log"),
            (-30_000, "clock_of_the_log_set"),
        ] {
            let log = (0..10_u16).map(|k| {
                let set = if k < 5 { 0 } else { set_ms };
                let log_ms = (1_000_000 + i64::from(k) + set).unsigned_abs();
                contact("can0", log_ms, k as u8, 100 * k)
            });
            let decoded = decode(&log.collect::<String>(), "can.log", &[]);
            let report = &decoded.report;
            assert_eq!(report.problems, [(problem.to_owned(), 1)].into());
            let times = times(&decoded);
            let mut pairs = times.windows(2).skip(5);
            assert!(pairs.all(|pair| pair[1] == pair[0] + 1_000));
        }
    }

    #[test]
    fn a_line_that_stands_twice_is_one_row_and_nothing_is_missing() {
        let mut log = steady(10);
        log.insert(6, log[5].clone());
        log.insert(7, contact("can0", 1_006, 5, 65_500));
        let decoded = decode(&log.concat(), "can.log", &[]);
        assert_eq!(times(&decoded), steady_times(10));
        let report = decoded.report;
        assert_eq!((report.duplicates, report.missing, report.gaps), (2, 0, 0));
        assert!(report.problems.is_empty());
        let text = report.to_string();
        assert!(text.contains("\nmissing  0 in 0 gaps, 2 duplicates\n"));
    }

    #[test]
    fn the_same_number_at_another_time_is_a_gap_of_255_and_no_duplicate() {
        // The second is a whole turn of the short clock later, which the log's clock tells.
        for (log_ms, step) in [(257, 25_700), (656, 100)] {
            let log = [contact("can0", 1, 7, 100), contact("can0", log_ms, 7, step)];
            let report = decode(&log.concat(), "can.log", &[]).report;
            assert_eq!((report.duplicates, report.missing), (0, 255));
        }
    }

    #[test]
    fn missing_frames_are_counted_per_foot_and_across_the_wrap() {
        let log = [
            contact("can0", 1, 254, 100),
            contact("can1", 1, 7, 100),
            contact("can0", 2, 1, 200),
            contact("can1", 2, 8, 200),
        ];
        let report = decode(&log.concat(), "can.log", &[]).report;
        assert_eq!((report.gaps, report.missing, report.rows), (1, 2, 4));
    }

    #[test]
    fn a_foot_that_starts_anew_begins_another_segment() {
        let boot_up = |id: u16| format!("(1.500000) can0 {id:03X}#00\n");
        // The same ids on another bus, and another foot, have not started anew.
        let mut log = vec![boot_up(0x711), contact("can1", 1_000, 7, 100)];
        log.extend(steady(3));
        log.extend([boot_up(0x711), boot_up(0x712)]);
        // On the old clock this would be a time that the log contradicts, and 254 missing.
        log.extend([
            contact("can0", 1_600, 1, 5_000),
            contact("can0", 1_601, 2, 5_100),
        ]);
        log.push(contact("can1", 1_001, 8, 200));
        let decoded = decode(&log.concat(), "can.log", &[]);
        let rows = decoded.rows.iter();
        let rows: Vec<_> = rows.map(|row| (row.segment, row.sequence)).collect();
        assert_eq!(
            rows,
            [(0, 7), (0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (0, 8)]
        );
        assert_eq!(times(&decoded)[4..], [50_000, 51_000, 2_000]);
        let report = decoded.report;
        assert_eq!((report.restarts, report.missing), (1, 0));
        assert!(report.problems.is_empty());
        assert_eq!(report.longest_step_s, Some(0.001));
        assert!(report.to_string().contains("\nrestarts 1\n"));
    }

    #[test]
    fn rows_tell_on_which_bus_their_foot_is() {
        let log = [contact("can0", 1, 0, 100), contact("can1", 1, 0, 100)];
        let decoded = decode(&log.concat(), "can.log", &[]);
        let interfaces = decoded.rows.iter().map(|row| row.interface.as_deref());
        assert!(interfaces.eq([Some("can0"), Some("can1")]));
    }

    #[test]
    fn other_devices_are_no_feet_unless_they_are_said_to_be() {
        // Of node 33: boot-up, a contact, axes, health, an emergency and two of SDO.
        let mut log = String::new();
        for id in [0x721, 0x1A1, 0x2A1, 0x4A1, 0xA1, 0x5A1, 0x621] {
            log += &format!("(1.000000) can0 {id:03X}#0000000000000000\n");
        }
        let decoded = decode(&log, "can.log", &[]);
        assert_eq!(decoded.rows, []);
        assert_eq!(decoded.report.frames, [("of_other_nodes", 7)].into());
        assert!(decoded.report.emergencies.is_empty());
        assert_eq!(
            decoded.notices,
            [
                "can.log: no foot of the ids 17 to 22 has sent a contact, but node 33 may be one: --node 33"
            ]
        );
        let decoded = decode(&log, "can.log", &[NODE_33]);
        assert_eq!(decoded.rows.len(), 1);
        assert_eq!(decoded.rows[0].node, Some(NODE_33));
        assert_eq!(decoded.report.frames.get("of_other_nodes"), None);
        assert!(decoded.notices.is_empty());
        // Beside a foot there is nothing to say.
        let decoded = decode(&(log + &contact("can0", 1, 0, 0)), "can.log", &[]);
        assert!(decoded.rows.len() == 1 && decoded.notices.is_empty());
    }

    #[test]
    fn a_broken_line_is_named_and_passed_over() {
        let log = [
            contact("can0", 1, 0, 0),
            "(1.2) x\n".to_owned(),
            contact("can0", 2, 1, 100),
        ];
        let decoded = decode(&log.concat(), "can.log", &[]);
        assert_eq!(decoded.rows.len(), 2);
        assert_eq!(
            decoded.notices,
            [
                "can.log, line 2: \"(1.2) x\" is no line of candump -l, which are like (1609459200.000111) can0 191#FFFF80800C0007D8"
            ]
        );
        let decoded = decode(&"x\n".repeat(1000), "can.log", &[]);
        assert_eq!(decoded.report.problems["malformed_lines"], 1000);
        assert_eq!(decoded.notices.len(), 11);
        assert_eq!(
            decoded.notices[10],
            "can.log: 990 more lines are none of candump -l"
        );
    }

    #[test]
    fn frames_that_lost_their_contact_go_into_no_row() {
        let axes = Axes {
            timestamp: ShortTime(300),
            ..Axes::default()
        };
        let frame = CanFrame::new(0x291, &axes.encode()).unwrap();
        let at = Timestamp::from_micros(3000);
        let axes = format!("{}\n", Logged { at, frame }.line("can0"));
        let decoded = decode(
            &[contact("can0", 1, 0, 100), axes.clone()].concat(),
            "can.log",
            &[],
        );
        assert_eq!(decoded.rows[0].axes, None);
        assert_eq!(decoded.report.problems["frames_without_their_contact"], 1);
        let decoded = decode(&[contact("can0", 1, 0, 300), axes].concat(), "can.log", &[]);
        assert!(decoded.rows[0].axes.is_some() && decoded.report.problems.is_empty());
    }

    #[test]
    fn other_frames_are_counted_by_what_they_are() {
        let log = "(1.000000) can0 000#0111\n(1.000000) can0 080#\n(1.000000) can0 711#00\n\
                   (1.000000) can0 711#05\n(1.000000) can0 611#4018100400000000\n\
                   (1.000000) can0 211#00000000\n(1.000000) can0 7E5#04\n\
                   (1.000000) can0 191#0000\n(1.000000) can0 18DAF110#00\n\
                   (1.000000) can0 123#R\n(1.000000) can0 123##100\n\
                   (1.000000) can0 20000004#0004000000000000\n(1.000000) can0 7FF#00\n\
                   (1.000000) can0 091#0170810000000000\n";
        let report = decode(log, "can.log", &[]).report;
        for kind in [
            "nmt",
            "sync",
            "boot_up",
            "heartbeat",
            "sdo_request",
            "load",
            "lss",
            "not_of_a_foot",
            "emergency",
            "extended",
            "remote",
            "fd",
            "error_frame",
        ] {
            assert_eq!(report.frames.get(kind), Some(&1), "{kind}");
        }
        assert_eq!(report.problems["contact_of_wrong_length"], 1);
        assert_eq!(report.emergencies[0].fault, "sensor silent");
    }
}
