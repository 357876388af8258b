//! Tests with a host that stalls during live reception: queued frames arrive at once, later ones are lost.

use std::collections::BTreeMap;
use std::ops::Range;

use super::super::*;
use crate::live::{Listener, Said};
use wire::pdo::{LastSync, LongTime, ShortTime};

/// Start of the receiver's clock, µs.
const EPOCH_US: u64 = 1_700_000_000_000_000;

/// A frame with its time on the bus, µs from the start, and for a contact its time on the foot's clock.
struct Sent {
    bus_us: u64,
    frame: CanFrame,
    clock_us: Option<u64>,
}

/// Feet that send a contact each period, and health every hundred periods.
struct Robot {
    feet: Vec<u16>,
    period_us: u64,
    /// Jitter of the sample's edge, µs.
    jitter_us: u64,
    /// Interval of numbered SYNCs, µs.
    sync_us: Option<u64>,
    length_us: u64,
    /// Time at which the first foot restarts and sends its boot-up, µs.
    restart_us: Option<u64>,
}

impl Default for Robot {
    fn default() -> Self {
        Self {
            feet: vec![0x11],
            period_us: 1000,
            jitter_us: 0,
            sync_us: Some(10_000),
            length_us: 16_000_000,
            restart_us: None,
        }
    }
}

impl Robot {
    /// Time on the foot's clock, µs; each further foot is some seconds ahead.
    fn clock_us(&self, foot: usize, bus_us: u64) -> u64 {
        match self.restart_us.filter(|at| foot == 0 && bus_us >= *at) {
            Some(at) => bus_us - at,
            None => bus_us + 90_000_000 + 3_456_780 * foot as u64,
        }
    }

    fn sent(&self) -> Vec<Sent> {
        let mut sent = Vec::new();
        let mut put = |bus_us: u64, id: u16, data: &[u8], clock_us: Option<u64>| {
            let frame = CanFrame::new(id, data).unwrap();
            sent.push(Sent {
                bus_us,
                frame,
                clock_us,
            });
        };
        let sync_at = |k: u64, every: u64| (k * every + 300, (k % 240) as u8 + 1);
        if let Some(every) = self.sync_us {
            for k in 0..self.length_us / every {
                let (at, counter) = sync_at(k, every);
                put(at, 0x080, &[counter], None);
            }
        }
        for (foot, node) in self.feet.iter().enumerate() {
            let mut first = 0;
            for k in 0..self.length_us / self.period_us {
                let phase = 130 * foot as u64;
                let edge = k * self.period_us + phase + k * 7919 % (self.jitter_us + 1);
                if self.restart_us.is_some_and(|at| foot == 0 && edge >= at) && first == 0 {
                    first = k;
                    put(edge, 0x700 + node, &[0], None);
                }
                let clock_us = self.clock_us(foot, edge) / 10 * 10;
                let contact = Contact {
                    timestamp: ShortTime((clock_us / 10) as u16),
                    sequence: (k - first) as u8,
                    ..Contact::default()
                };
                put(edge + 200, 0x180 + node, &contact.encode(), Some(clock_us));
                if k % 100 == 17 * (foot as u64 + 1) {
                    let sync = self.sync_us.map(|every| {
                        let (at, counter) = sync_at((edge - 300) / every, every);
                        let is_of_this_start = self
                            .restart_us
                            .is_none_or(|start| at >= start || edge < start || foot > 0);
                        let time = LongTime((self.clock_us(foot, at) / 10) as u32);
                        if is_of_this_start {
                            LastSync { counter, time }
                        } else {
                            LastSync::default()
                        }
                    });
                    let health = Health {
                        sync: sync.unwrap_or_default(),
                        ..Health::default()
                    };
                    put(edge + 210, 0x500 + node, &health.encode(), None);
                }
            }
        }
        sent.sort_by_key(|sent| sent.bus_us);
        sent
    }
}

/// A period in which the host reads nothing, µs, and the number of frames that are queued meanwhile.
struct Stall {
    time_us: Range<u64>,
    kept: usize,
}

/// A decoded contact, with its true time; times in µs.
struct Came {
    node: u8,
    segment: u32,
    t_us: u64,
    common_us: u64,
    received_us: u64,
    clock_us: u64,
}

/// All decoded contacts, and the number of contacts lost.
struct Heard {
    came: Vec<Came>,
    lost: u64,
    report: Report,
}

impl Heard {
    fn of(sent: &[Sent], stalls: &[Stall], latency_us: impl Fn(usize) -> u64) -> Self {
        let mut listener = Listener::default();
        let (mut truth, mut came): (BTreeMap<u8, Vec<u64>>, _) = (BTreeMap::new(), Vec::new());
        let (mut lost, mut kept, mut newest) = (0, 0, 0);
        for (index, sent) in sent.iter().enumerate() {
            let stall = stalls.iter().find(|s| s.time_us.contains(&sent.bus_us));
            let read_us = match stall {
                Some(stall) if kept < stall.kept => {
                    kept += 1;
                    stall.time_us.end
                }
                Some(_) => {
                    lost += u64::from(sent.clock_us.is_some());
                    continue;
                }
                None => {
                    kept = 0;
                    sent.bus_us + latency_us(index)
                }
            };
            newest = read_us.max(newest + 1);
            if let Some(clock_us) = sent.clock_us {
                let node = (sent.frame.id() & 0x7F) as u8;
                truth.entry(node).or_default().push(clock_us);
            }
            listener.frame(
                "can0",
                &sent.frame,
                Timestamp::from_micros(EPOCH_US + newest),
            );
        }
        listener.finish();
        let mut places: BTreeMap<u8, usize> = BTreeMap::new();
        while let Some(heard) = listener.next_heard() {
            let Said::Contact(row) = heard.said else {
                continue;
            };
            let node = row.node.unwrap().get();
            let place = places.entry(node).or_default();
            came.push(Came {
                node,
                segment: row.segment,
                t_us: row.timestamp.as_micros(),
                common_us: row.common.unwrap().0.as_micros(),
                received_us: row.received.unwrap().as_micros(),
                clock_us: truth[&node][*place],
            });
            *place += 1;
        }
        let report = listener.reports()[0].1.clone();
        Self { came, lost, report }
    }

    fn feet(&self) -> BTreeMap<u8, Vec<&Came>> {
        let mut feet: BTreeMap<u8, Vec<&Came>> = BTreeMap::new();
        for came in &self.came {
            feet.entry(came.node).or_default().push(came);
        }
        feet
    }

    /// Asserts that no foot's time goes back and no common time is ahead of reception.
    fn assert_in_order(&self, said: &str) {
        for came in &self.came {
            let ahead = came.common_us.saturating_sub(came.received_us);
            assert_eq!(ahead, 0, "{said}: at {}", came.received_us - EPOCH_US);
        }
        for came in self.feet().values() {
            for pair in came
                .windows(2)
                .filter(|pair| pair[0].segment == pair[1].segment)
            {
                assert!(pair[0].t_us < pair[1].t_us, "{said}: {}", pair[0].t_us);
            }
        }
    }

    /// Asserts that all times of a foot are true, except for the turns before the first contact.
    fn assert_times(&self, said: &str) {
        for came in self.feet().values() {
            let ahead = came[0].clock_us - came[0].t_us;
            assert_eq!(ahead % 655_360, 0);
            for came in came {
                assert_eq!(came.t_us + ahead, came.clock_us, "{said}");
            }
        }
    }

    /// Asserts that common times are within 0.15 ms of the true times, about the delay of SYNCs.
    fn assert_common(&self, robot: &Robot, said: &str) {
        for came in self
            .came
            .iter()
            .filter(|came| came.received_us > EPOCH_US + 1_000_000)
        {
            let foot = robot
                .feet
                .iter()
                .position(|node| *node == u16::from(came.node));
            let made = EPOCH_US + came.clock_us - robot.clock_us(foot.unwrap(), 0);
            assert!(
                came.common_us.abs_diff(made) <= 150,
                "{said}: {}, {made}",
                came.common_us
            );
        }
    }
}

const fn at_once(_: usize) -> u64 {
    50
}

fn seconds(from: u64, length: u64) -> Range<u64> {
    from * 1_000_000 + 123_456..(from + length) * 1_000_000 + 123_456
}

#[test]
fn stall_shifts_no_time_and_lost_contacts_are_counted() {
    for sync_us in [Some(10_000), None] {
        for feet in [1, 3] {
            for (period_us, jitter_us) in [(1000, 160), (1003, 0), (5000, 300)] {
                for length in [1, 2, 5, 10] {
                    for kept in [0, 1000] {
                        let robot = Robot {
                            feet: (0x11..0x11 + feet).collect(),
                            period_us,
                            jitter_us,
                            sync_us,
                            ..Robot::default()
                        };
                        let stall = Stall {
                            time_us: seconds(4, length),
                            kept,
                        };
                        let said = format!(
                            "{feet} feet, each {period_us} µs, {length} s, {kept} kept, SYNC {sync_us:?}"
                        );
                        let heard = Heard::of(&robot.sent(), &[stall], at_once);
                        heard.assert_in_order(&said);
                        heard.assert_times(&said);
                        if sync_us.is_some() {
                            heard.assert_common(&robot, &said);
                        }
                        assert_eq!(heard.report.missing, heard.lost, "{said}");
                    }
                }
            }
        }
    }
}

#[test]
fn consecutive_stalls_are_counted_separately() {
    let robot = Robot::default();
    let stalls = [(2, 1), (4, 2), (7, 3), (11, 2)].map(|(from, length)| Stall {
        time_us: seconds(from, length),
        kept: 300,
    });
    let heard = Heard::of(&robot.sent(), &stalls, at_once);
    heard.assert_in_order("");
    heard.assert_times("");
    heard.assert_common(&robot, "");
    assert_eq!(heard.report.missing, heard.lost);
    assert_eq!(heard.report.problems["contacts_that_waited"], 4);
}

#[test]
fn latency_without_a_stall_causes_no_problem() {
    for largest_us in [1, 5_000, 100_000] {
        let robot = Robot {
            feet: vec![0x11, 0x12],
            jitter_us: 160,
            ..Robot::default()
        };
        let late = |index: usize| 50 + (index as u64 / 64 * 7919) % largest_us;
        let heard = Heard::of(&robot.sent(), &[], late);
        heard.assert_in_order("");
        heard.assert_times("");
        let report = heard.report;
        assert_eq!((report.missing, report.gaps), (0, 0));
        assert!(report.problems.is_empty(), "{report}");
    }
}

#[test]
fn restart_during_a_stall_begins_a_new_segment() {
    let robot = Robot {
        feet: vec![0x11, 0x12],
        restart_us: Some(6_000_000),
        ..Robot::default()
    };
    let stall = Stall {
        time_us: seconds(4, 4),
        kept: 100,
    };
    let heard = Heard::of(&robot.sent(), &[stall], at_once);
    heard.assert_in_order("");
    assert_eq!(heard.report.restarts, 1);
    let feet = heard.feet();
    let first = &feet[&0x11];
    let again = first.iter().position(|came| came.segment == 1).unwrap();
    // At most a tenth of a second later, with the next health frame.
    assert!(first[again].clock_us < 2_123_456 + 110_000);
    let ahead = first[again].clock_us - first[again].t_us;
    assert_eq!(ahead % 655_360, 0);
    assert!(
        first[again..]
            .iter()
            .all(|came| came.t_us + ahead == came.clock_us)
    );
    assert!(feet[&0x12].iter().all(|came| came.segment == 0));
}

#[test]
fn pause_of_the_foot_is_not_counted_as_loss() {
    // The foot does not advance its number while paused.
    let mut sent = Robot::default().sent();
    let paused = 5_000_000..7_345_000_u64;
    sent.retain(|sent| !paused.contains(&sent.bus_us));
    let mut sequence = 0_u8;
    for sent in &mut sent {
        let Some(clock_us) = sent.clock_us else {
            continue;
        };
        let contact = Contact {
            timestamp: ShortTime((clock_us / 10) as u16),
            sequence,
            ..Contact::default()
        };
        sent.frame = CanFrame::new(0x191, &contact.encode()).unwrap();
        sequence = sequence.wrapping_add(1);
    }
    let heard = Heard::of(&sent, &[], at_once);
    heard.assert_in_order("");
    heard.assert_times("");
    assert_eq!(heard.report.missing, 0);
    assert!(heard.report.problems.is_empty(), "{}", heard.report);
}

/// A stall from 4 s to 8 s in which contacts are lost for `lost_ms` from 4.2 s on, then queued again.
fn late_after_a_gap(sync_us: Option<u64>, lost_ms: u64) -> Heard {
    let robot = Robot {
        sync_us,
        ..Robot::default()
    };
    let mut sent = robot.sent();
    let gap = 4_200_000..4_200_000 + 1000 * lost_ms;
    sent.retain(|sent| !gap.contains(&sent.bus_us));
    let stall = Stall {
        time_us: seconds(4, 4),
        kept: 1000,
    };
    let mut heard = Heard::of(&sent, &[stall], at_once);
    heard.lost += lost_ms;
    heard
}

#[test]
fn number_and_pace_give_the_turn_after_a_gap() {
    for lost_ms in [300, 800, 1500] {
        let heard = late_after_a_gap(None, lost_ms);
        assert_eq!(heard.report.missing, heard.lost, "{}", heard.report);
        heard.assert_in_order("");
        heard.assert_times("");
    }
}

#[test]
fn health_frame_corrects_contacts_timed_too_late() {
    // The number after the gap is the next one.
    let heard = late_after_a_gap(Some(10_000), 768);
    let report = &heard.report;
    assert_eq!(
        report.problems.get("turns_that_were_wrong"),
        Some(&1),
        "{report}"
    );
    assert_eq!(report.missing, heard.lost, "{report}");
    for came in &heard.came {
        assert!(came.common_us <= came.received_us);
    }
    let ahead = heard.came[0].clock_us - heard.came[0].t_us;
    let newest = heard.came.iter().rev().take(7000);
    newest.for_each(|came| assert_eq!(came.t_us + ahead, came.clock_us));
}

#[test]
fn slow_or_missing_syncs_cause_no_turn_error() {
    for (every_us, from_us) in [
        (500_000, 16_000_000),
        (700_000, 16_000_000),
        (3_000_000, 16_000_000),
        (10_000, 4_000_000),
    ] {
        let mut robot = Robot {
            sync_us: Some(every_us),
            ..Robot::default()
        };
        robot.length_us = from_us;
        let mut sent = robot.sent();
        robot.length_us = 16_000_000;
        let until = LastSync {
            counter: 1,
            time: LongTime((robot.clock_us(0, from_us - 10_000) / 10) as u32),
        };
        // The foot then repeats the same SYNC until SYNCs resume after 12 s.
        sent.extend(
            robot
                .sent()
                .into_iter()
                .filter(|s| s.bus_us >= from_us)
                .filter_map(|mut sent| {
                    let is_quiet = sent.bus_us < 12_000_000;
                    match sent.frame.id() {
                        0x080 if is_quiet => return None,
                        0x511 if is_quiet => {
                            let health = Health {
                                sync: until,
                                ..Health::default()
                            };
                            sent.frame = CanFrame::new(0x511, &health.encode()).unwrap();
                        }
                        _ => {}
                    }
                    Some(sent)
                }),
        );
        let heard = Heard::of(&sent, &[], at_once);
        let said = format!("SYNC each {every_us} µs, until {from_us} µs");
        heard.assert_in_order(&said);
        heard.assert_times(&said);
        assert_eq!(heard.report.missing, 0, "{said}");
        assert!(heard.report.problems.is_empty(), "{said}: {}", heard.report);
    }
}

#[test]
fn health_frame_corrects_a_gap_hidden_by_the_receiver_clock() {
    // The clock is set back by the length of the gap, so by reception nothing is missing.
    let sent = Robot::default().sent();
    let gap = 5_000_000..8_000_000_u64;
    let mut listener = Listener::default();
    let mut lost = 0;
    for sent in sent {
        if gap.contains(&sent.bus_us) {
            lost += u64::from(sent.clock_us.is_some());
            continue;
        }
        let back = if sent.bus_us < gap.start {
            0
        } else {
            3_000_000
        };
        let at = Timestamp::from_micros(EPOCH_US + sent.bus_us - back);
        listener.frame("can0", &sent.frame, at);
        if sent.bus_us >= gap.end + 110_000 {
            break;
        }
    }
    let report = listener.reports()[0].1;
    assert_eq!(report.missing, lost, "{report}");
    assert_eq!(report.problems["turns_that_were_wrong"], 1);
}

#[test]
fn health_frame_reveals_a_hidden_loss() {
    // 64 turns of the number equal 25 turns of the clock.
    let mut sent = Robot {
        length_us: 25_000_000,
        ..Robot::default()
    }
    .sent();
    let gap = 5_000_000..21_384_000_u64;
    sent.retain(|sent| !gap.contains(&sent.bus_us));
    let heard = Heard::of(&sent, &[], at_once);
    assert_eq!(heard.report.missing, 16_384, "{}", heard.report);
}

#[test]
fn slow_foot_clock_causes_no_gaps() {
    // The clock runs at a third of the speed, as on an overloaded emulator; some edges are late.
    let mut listener = Listener::default();
    let clock_us = |k: u64| 1000 * k + if k % 500 == 250 { 700 } else { 0 };
    for k in 0..8000 {
        let contact = Contact {
            timestamp: ShortTime((clock_us(k) / 10) as u16),
            sequence: k as u8,
            ..Contact::default()
        };
        let frame = CanFrame::new(0x191, &contact.encode()).unwrap();
        let at = Timestamp::from_micros(EPOCH_US + 3000 * k);
        listener.frame("can0", &frame, at);
    }
    listener.finish();
    let rows = std::iter::from_fn(|| listener.next_heard()).filter_map(|heard| match heard.said {
        Said::Contact(row) => Some(row.timestamp.as_micros()),
        _ => None,
    });
    assert!(rows.eq((0..8000).map(clock_us)));
    let missing: Vec<_> = listener
        .reports()
        .iter()
        .map(|(_, report)| report.missing)
        .collect();
    assert_eq!(missing, [0]);
}
