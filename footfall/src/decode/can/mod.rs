//! A log of `candump -l`.
//!
//! | idea | file |
//! |---|---|
//! | lines become frames, frames go to their foot | this one |
//! | the time of a contact, from the clocks of foot and log | `clock` |
//! | a foot: its newest contact, its numbers, its doubts | `foot` |
//! | the cells of a row | `rows` |

mod clock;
mod foot;
mod rows;
#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use estimator_core::Timestamp;
use wire::pdo::{Contact, Load};
use wire::{CanFrame, Emergency, Fault, NodeId, Pdo};

use super::report::{EmergencyReport, Medium, Report};
use super::{Decoded, Row};
use crate::can_log::{self, Line, Logged, Other};
use foot::LoggedFoot;
use rows::{Belongs, complete, kind_name, row_of};

/// Number of broken lines that are named; the others are counted.
const NAMED_LINES: u64 = 10;

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
        && let Some(id) = log.unknown_foot
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

/// The log up to the newest line.
struct Log {
    rows: Vec<Row>,
    report: Report,
    /// By interface and node id: two buses may have a foot of the same id each.
    feet: BTreeMap<(String, u8), LoggedFoot>,
    /// How often each has started again.
    segments: BTreeMap<(String, u8), u32>,
    /// Node ids that are feet.
    nodes: BTreeSet<u8>,
    /// Another node that sends what may be a contact.
    unknown_foot: Option<u8>,
}

impl Log {
    fn new(others: &[NodeId]) -> Self {
        let feet = wire::Foot::ALL.map(wire::Foot::default_node_id);
        Self {
            rows: Vec::new(),
            report: Report::new(Medium::Can),
            feet: BTreeMap::new(),
            segments: BTreeMap::new(),
            nodes: feet.iter().chain(others).map(|node| node.get()).collect(),
            unknown_foot: None,
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
                    self.unknown_foot.get_or_insert(node.get());
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

    /// Forgets what the foot was: its clock and its numbers begin again.
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

    fn foot(&self, interface: &str, node: NodeId) -> Option<LoggedFoot> {
        self.feet.get(&(interface.to_owned(), node.get())).copied()
    }

    /// The interface's name, shared with the newest row where it is the same.
    fn name(&self, interface: &str) -> Arc<str> {
        match self.rows.last().and_then(|row| row.interface.as_ref()) {
            Some(name) if **name == *interface => Arc::clone(name),
            _ => interface.into(),
        }
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
        if complete(&mut self.rows[foot.row], pdo, bytes, foot.short) == Belongs::Elsewhere {
            self.report.count_problem("frames_without_their_contact");
        }
    }

    fn contact(&mut self, interface: &str, node: NodeId, contact: &Contact, at: Timestamp) {
        let key = (interface.to_owned(), node.get());
        let row = self.rows.len();
        let known = self.feet.get(&key).copied();
        let mut foot = known.unwrap_or_else(|| LoggedFoot::new(contact, row, at));
        let Some(micros) = foot.take(contact, row, at, &mut self.report) else {
            return;
        };
        let segment = self.segments.get(&key).copied().unwrap_or(0);
        let name = self.name(interface);
        self.rows.push(row_of(contact, micros, name, node, segment));
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
