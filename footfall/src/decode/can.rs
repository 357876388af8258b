//! A log of `candump -l`.

use std::collections::BTreeMap;

use estimator_core::Timestamp;
use wire::pdo::{
    Acceleration, Attitude, Axes, Bias, Contact, Health, Load, P8, Rate, ShortTime, TIME_STEP_US,
};
use wire::{CanFrame, Emergency, Fault, NodeId, Pdo};

use super::report::{EmergencyReport, Format, Report};
use super::{Decoded, Row};
use crate::can_log::{self, Line, Logged, Other};

/// So many broken lines are named; the others are counted.
const NAMED_LINES: u64 = 10;

/// Beyond this time between two frames the log's own clock is not asked, µs: a day.
const LONGEST_BRIDGE_US: u64 = 86_400_000_000;

/// Decodes all lines of a log.
pub(super) fn decode(text: &str, file: &str) -> Decoded {
    let mut log = Log::default();
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
}

impl Default for Log {
    fn default() -> Self {
        Self {
            rows: Vec::new(),
            report: Report::new(Format::Can),
            feet: BTreeMap::new(),
        }
    }
}

/// The newest contact of a foot.
#[derive(Clone, Copy)]
struct Foot {
    row: usize,
    short: ShortTime,
    sequence: u8,
    logged_us: u64,
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
            (0x080, Some(node)) => return self.emergency(interface, node, frame),
            (0x580, Some(_)) => "sdo_response",
            (0x600, Some(_)) => "sdo_request",
            (0x700, Some(_)) if frame.data() == [0] => "boot_up",
            (0x700, Some(_)) => "heartbeat",
            (Load::BASE, Some(_)) => "load",
            _ if id == 0x7E4 || id == 0x7E5 => "lss",
            _ => match Pdo::from_cob_id(id) {
                Some((pdo, node)) => return self.pdo(interface, pdo, node, logged),
                None => "not_of_a_foot",
            },
        };
        self.report.count_frame(kind);
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

    fn contact(&mut self, interface: &str, node: NodeId, contact: &Contact, at: Timestamp) {
        let last = self.foot(interface, node);
        let micros = match last {
            None => u64::from(contact.timestamp.0) * TIME_STEP_US,
            Some(last) => {
                let before = self.rows[last.row].timestamp.as_micros();
                before + elapsed_us(last, contact.timestamp, at)
            }
        };
        let row = Row {
            timestamp: Timestamp::from_micros(micros),
            node: Some(node),
            sequence: u16::from(contact.sequence),
            stable: contact.stable.probability(),
            tangential: contact.tangential.probability(),
            vertical: contact.vertical.probability(),
            status: contact.status,
            ..Row::default()
        };
        if let Some(last) = last {
            let missing = contact.sequence.wrapping_sub(last.sequence).wrapping_sub(1);
            self.report.count_missing(u64::from(missing));
            self.report.count_step(&self.rows[last.row], &row);
        }
        let foot = Foot {
            row: self.rows.len(),
            short: contact.timestamp,
            sequence: contact.sequence,
            logged_us: at.as_micros(),
        };
        self.feet.insert((interface.to_owned(), node.get()), foot);
        self.rows.push(row);
    }
}

/// The time from a foot's last contact to one with the time `now`, µs. Its own clock wraps every
/// 655.36 ms; the log's clock tells how many turns of it have passed.
fn elapsed_us(last: Foot, now: ShortTime, logged: Timestamp) -> u64 {
    const TURN: u64 = 1 << 16;
    let steps = u64::from(now.0.wrapping_sub(last.short.0));
    let bridged = logged
        .as_micros()
        .checked_sub(last.logged_us)
        .filter(|elapsed| *elapsed < LONGEST_BRIDGE_US)
        .unwrap_or(0)
        / TIME_STEP_US;
    // Rounded to the nearest turn; never less than none.
    let turns = (bridged + TURN / 2).saturating_sub(steps) / TURN;
    (steps + turns * TURN) * TIME_STEP_US
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
        let decoded = decode(&log.concat(), "can.log");
        assert_eq!(times(&decoded), [650_000, 651_000, 10_651_000, 10_652_000]);
        assert_eq!(decoded.report.longest_step_s, Some(10.0));
    }

    #[test]
    fn missing_frames_are_counted_per_foot_and_across_the_wrap() {
        let log = [
            contact("can0", 1, 254, 100),
            contact("can1", 1, 7, 100),
            contact("can0", 2, 1, 200),
            contact("can1", 2, 8, 200),
        ];
        let report = decode(&log.concat(), "can.log").report;
        assert_eq!((report.gaps, report.missing, report.rows), (1, 2, 4));
    }

    #[test]
    fn a_broken_line_is_named_and_passed_over() {
        let log = [
            contact("can0", 1, 0, 0),
            "(1.2) x\n".to_owned(),
            contact("can0", 2, 1, 100),
        ];
        let decoded = decode(&log.concat(), "can.log");
        assert_eq!(decoded.rows.len(), 2);
        assert_eq!(
            decoded.notices,
            [
                "can.log, line 2: \"(1.2) x\" is no line of candump -l, which are like (1609459200.000111) can0 191#FFFF80800C0007D8"
            ]
        );
        let decoded = decode(&"x\n".repeat(1000), "can.log");
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
        );
        assert_eq!(decoded.rows[0].axes, None);
        assert_eq!(decoded.report.problems["frames_without_their_contact"], 1);
        let decoded = decode(&[contact("can0", 1, 0, 300), axes].concat(), "can.log");
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
        let report = decode(log, "can.log").report;
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
