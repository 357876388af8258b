//! Tests of the clock: each time is true or flagged as not yet known, for a tenth of a second at most.

use std::collections::BTreeMap;
use std::ops::Range;

use estimator_core::Timestamp;
use wire::CanFrame;
use wire::pdo::{ClockReading, Contact, Health, LongTime, ShortTime};

use super::decode;
use crate::decode::Report;
use crate::decode::can_log::Logged;
use crate::decode::live::{LiveDecoder, MessageBody};
use crate::decode::row::{ClockTurn, ContactRow};

/// Start of the receiver's clock, µs.
const EPOCH_US: u64 = 1_700_000_000_000_000;

/// Longest time for which a time may be unknown: a period of health frames plus a contact.
const KNOWN_AFTER_US: u64 = 101_000;

/// A frame with its time on the bus, µs from the start, and for a contact its time on the foot's clock.
struct SentFrame {
    bus_us: u64,
    frame: CanFrame,
    clock_us: Option<u64>,
}

/// Feet that send a contact each period, and health every 100 ms.
struct SendingFeet {
    feet: u16,
    period_us: u64,
    /// Jitter of the sample's edge, µs.
    jitter_us: u64,
    /// Interval of numbered SYNCs, µs.
    sync_us: Option<u64>,
    length_us: u64,
    /// Clock of the first foot at the start, µs.
    start_us: u64,
    /// Time at which the first foot restarts, µs.
    restart_us: Option<u64>,
}

impl Default for SendingFeet {
    fn default() -> Self {
        Self {
            feet: 1,
            period_us: 1000,
            jitter_us: 0,
            sync_us: None,
            length_us: 12_000_000,
            start_us: 90_000_000,
            restart_us: None,
        }
    }
}

impl SendingFeet {
    /// Time on the foot's clock, µs; each further foot is some seconds ahead.
    fn clock_us(&self, foot: u16, bus_us: u64) -> u64 {
        match self.restart_us.filter(|at| foot == 0 && bus_us >= *at) {
            Some(at) => bus_us - at + 1_500_000,
            None => bus_us + self.start_us + 3_456_780 * u64::from(foot),
        }
    }

    fn sent(&self) -> Vec<SentFrame> {
        let mut sent = Vec::new();
        let mut put = |bus_us: u64, id: u16, data: &[u8], clock_us: Option<u64>| {
            let frame = CanFrame::new(id, data).unwrap();
            sent.push(SentFrame { bus_us, frame, clock_us });
        };
        let sync_at = |k: u64, every: u64| (k * every + 300, (k % 240) as u8 + 1);
        if let Some(every) = self.sync_us {
            for k in 0..self.length_us / every {
                let (at, counter) = sync_at(k, every);
                put(at, 0x080, &[counter], None);
            }
        }
        let each_tenth = 100_000 / self.period_us;
        for foot in 0..self.feet {
            let mut first = 0;
            for k in 0..self.length_us / self.period_us {
                let edge =
                    k * self.period_us + 130 * u64::from(foot) + k * 7919 % (self.jitter_us + 1);
                if self.restart_us.is_some_and(|at| foot == 0 && edge >= at) && first == 0 {
                    first = k;
                }
                let clock_us = self.clock_us(foot, edge) / 10 * 10;
                let contact = Contact {
                    timestamp: ShortTime((clock_us / 10) as u16),
                    sequence: (k - first) as u8,
                    ..Contact::default()
                };
                put(edge + 200, 0x191 + foot, &contact.encode(), Some(clock_us));
                if k % each_tenth == 17 * (u64::from(foot) + 1) % each_tenth {
                    let read = |sync, bus_us| ClockReading {
                        sync,
                        time: LongTime((self.clock_us(foot, bus_us) / 10) as u32),
                    };
                    let sync =
                        self.sync_us.map(|every| sync_at((edge.max(300) - 300) / every, every));
                    let recent =
                        sync.filter(|(at, _)| edge.abs_diff(*at) <= ClockReading::OLDEST_SYNC_US);
                    let clock = recent.map_or(read(0, edge), |(at, counter)| read(counter, at));
                    let health = Health { clock, ..Health::default() };
                    put(edge + 210, 0x511 + foot, &health.encode(), None);
                }
            }
        }
        sent.sort_by_key(|sent| sent.bus_us);
        sent
    }
}

/// A period in which the host reads nothing, µs, and the number of frames that are queued during it.
struct Stall {
    time_us: Range<u64>,
    kept: usize,
}

/// A decoded contact, with its true time; times in µs.
struct TimedContact {
    node: u8,
    row: ContactRow,
    clock_us: u64,
}

/// All decoded contacts, and the number of contacts lost.
struct Received {
    came: Vec<TimedContact>,
    lost: u64,
    report: Report,
}

impl Received {
    fn of(sent: &[SentFrame], stalls: &[Stall]) -> Self {
        let mut decoder = LiveDecoder::default();
        let (mut truth, mut came): (BTreeMap<u8, Vec<u64>>, _) = (BTreeMap::new(), Vec::new());
        let (mut lost, mut kept, mut newest) = (0, 0, 0);
        for sent in sent {
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
                    sent.bus_us + 50
                }
            };
            newest = read_us.max(newest + 1);
            if let Some(clock_us) = sent.clock_us {
                let node = (sent.frame.id() & 0x7F) as u8;
                truth.entry(node).or_default().push(clock_us);
            }
            let at = Timestamp::from_micros(EPOCH_US + newest);
            decoder.frame("can0", &sent.frame, at);
        }
        decoder.finish();
        let mut places: BTreeMap<u8, usize> = BTreeMap::new();
        while let Some(message) = decoder.next_message() {
            let MessageBody::Contact(row) = message.body else {
                continue;
            };
            let node = row.node.unwrap().get();
            let place = places.entry(node).or_default();
            let clock_us = truth[&node][*place];
            let row = *row;
            came.push(TimedContact { node, row, clock_us });
            *place += 1;
        }
        let report = decoder.reports()[0].1.clone();
        Self { came, lost, report }
    }

    /// Asserts that each time is true or flagged, and that none is flagged a tenth of a second after the start
    /// or a disturbance of its foot, whose ends on the foot's clock are `disturbed`, µs.
    fn assert_times(&self, disturbed: &[u64], said: &str) {
        let mut starts: BTreeMap<(u8, u32), u64> = BTreeMap::new();
        for TimedContact { node, row, clock_us } in &self.came {
            let start = *starts.entry((*node, row.segment)).or_insert(*clock_us);
            if row.turn == ClockTurn::Known {
                assert_eq!(row.timestamp.as_micros(), *clock_us, "{said}: node {node}");
                continue;
            }
            let mut recent = disturbed.iter().copied().chain([start]);
            assert!(
                recent.any(|at| (at..at + KNOWN_AFTER_US).contains(clock_us)),
                "{said}: node {node} at {clock_us}"
            );
        }
    }
}

fn line(sent: &SentFrame) -> String {
    let at = Timestamp::from_micros(EPOCH_US + sent.bus_us);
    format!("{}\n", Logged { at, frame: sent.frame }.line("can0"))
}

#[test]
fn every_time_is_known_after_a_tenth_of_a_second() {
    for sync_us in [None, Some(10_000), Some(1_000_000), Some(7_000_000)] {
        // The clock wraps after almost twelve hours.
        for start_us in [0, 90_000_000, 30_000_000_000, (1 << 32) * 10 - 5_000_000] {
            let robot = SendingFeet {
                feet: 4,
                jitter_us: 150,
                sync_us,
                start_us,
                ..SendingFeet::default()
            };
            let mut received = Received::of(&robot.sent(), &[]);
            let wrap_us = (1 << 32) * 10;
            received.came.iter_mut().for_each(|came| {
                // A foot whose clock has wrapped before the start counts from the wrap.
                if robot.clock_us(u16::from(came.node) - 0x11, 0) >= wrap_us {
                    came.clock_us -= wrap_us;
                }
            });
            received.assert_times(&[], &format!("SYNC {sync_us:?}, start {start_us}"));
            assert_eq!(received.report.missing, 0);
            assert!(received.report.problems.is_empty(), "{}", received.report);
        }
    }
}

#[test]
fn times_are_true_or_flagged_after_any_loss() {
    // Among them whole turns, multiples of 256 contacts, and both.
    for lost_ms in [1, 2, 50, 255, 256, 300, 655, 656, 700, 1500, 5000, 8192, 16_384, 19_660] {
        let robot = SendingFeet { length_us: 25_000_000, jitter_us: 150, ..SendingFeet::default() };
        let end_us = 2_123_000 + 1000 * lost_ms;
        let mut sent = robot.sent();
        sent.retain(|sent| !(2_123_000..end_us).contains(&sent.bus_us));
        let received = Received::of(&sent, &[]);
        let disturbed = [robot.clock_us(0, end_us - 1000)];
        received.assert_times(&disturbed, &format!("{lost_ms} ms lost"));
        assert_eq!(received.report.missing, lost_ms, "{}", received.report);
    }
}

#[test]
fn times_are_true_or_flagged_after_a_stall() {
    for (stall_ms, kept) in
        [(300, 30), (900, 500), (2000, 0), (2000, 100), (4000, 1000), (4000, 9000)]
    {
        let robot = SendingFeet { feet: 4, sync_us: Some(10_000), ..SendingFeet::default() };
        let time_us = 3_123_456..3_123_456 + 1000 * stall_ms;
        let mut ends: Vec<_> =
            (0..4).map(|foot| robot.clock_us(foot, time_us.start - 1000)).collect();
        ends.extend((0..4).map(|foot| robot.clock_us(foot, time_us.end - 1000)));
        let received = Received::of(&robot.sent(), &[Stall { time_us, kept }]);
        received.assert_times(&ends, &format!("{stall_ms} ms, {kept} kept"));
        assert_eq!(received.report.missing, received.lost, "{}", received.report);
        for came in &received.came {
            let (common, _) = came.row.common.unwrap();
            assert!(came.row.turn == ClockTurn::NotYet || common <= came.row.received.unwrap());
        }
    }
}

#[test]
fn logged_contacts_before_a_health_frame_are_timed_by_it() {
    let robot = SendingFeet { length_us: 25_000_000, ..SendingFeet::default() };
    let decoded_after = |lost_ms: u64, print: fn(&SentFrame) -> String| {
        let mut sent = robot.sent();
        sent.retain(|sent| !(2_123_000..2_123_000 + 1000 * lost_ms).contains(&sent.bus_us));
        let decoded = decode(&sent.iter().map(print).collect::<String>(), "can.log", &[]);
        let truth = sent.iter().filter_map(|sent| sent.clock_us);
        let rows = decoded.rows.iter().map(|row| row.timestamp.as_micros());
        assert!(rows.eq(truth), "{lost_ms} ms");
        assert!(decoded.rows.iter().all(|row| row.turn == ClockTurn::Known));
        assert_eq!(decoded.report.missing, lost_ms, "{}", decoded.report);
    };
    for lost_ms in [1, 300, 656, 5000] {
        decoded_after(lost_ms, line);
        // Only the health frames show how long the gap was.
        decoded_after(lost_ms, |sent| {
            let bytes = sent.frame.data().iter();
            let bytes: Vec<_> = bytes.map(|byte| format!("{byte:02X}")).collect();
            let (id, count) = (sent.frame.id(), bytes.len());
            format!("  can0  {id:03X}   [{count}]  {}\n", bytes.join(" "))
        });
    }
    decoded_after(16_384, line);
}

#[test]
fn contacts_without_health_frames_stay_flagged() {
    let mut sent = SendingFeet::default().sent();
    sent.retain(|sent| sent.clock_us.is_some());
    let decoded = decode(&sent.iter().map(line).collect::<String>(), "can.log", &[]);
    assert!(decoded.rows.iter().all(|row| row.turn == ClockTurn::NotYet));
    assert!(decoded.rows[0].flag_names().contains(&"time_not_known"));
}

#[test]
fn restart_without_a_boot_up_begins_a_segment() {
    let robot = SendingFeet {
        feet: 2,
        sync_us: Some(10_000),
        restart_us: Some(5_200_000),
        ..SendingFeet::default()
    };
    for lost_ms in [0, 300, 2000] {
        let mut sent = robot.sent();
        sent.retain(|sent| !(5_000_000..5_200_000 + 1000 * lost_ms).contains(&sent.bus_us));
        let end_us = 5_200_000 + 1000 * lost_ms;
        let disturbed = [robot.clock_us(0, end_us), robot.clock_us(1, end_us)];
        let received = Received::of(&sent, &[]);
        received.assert_times(&disturbed, &format!("{lost_ms} ms lost"));
        assert_eq!(received.report.restarts, 1, "{}", received.report);
        let decoded = decode(&sent.iter().map(line).collect::<String>(), "can.log", &[]);
        for row in decoded.rows.iter().filter(|row| row.node.unwrap().get() == 0x11) {
            let is_after = row.received.unwrap().as_micros() > EPOCH_US + 5_200_000;
            assert_eq!((row.segment, row.turn), (u32::from(is_after), ClockTurn::Known));
        }
    }
}

#[test]
fn pause_of_the_foot_is_not_counted_as_loss() {
    // The foot does not advance its number while paused.
    let mut sent = SendingFeet::default().sent();
    sent.retain(|sent| !(5_000_000..7_345_000).contains(&sent.bus_us));
    let mut sequence = 0_u8;
    for sent in sent.iter_mut() {
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
    let received = Received::of(&sent, &[]);
    received.assert_times(&[SendingFeet::default().clock_us(0, 7_345_000 - 1000)], "pause");
    assert_eq!(received.report.missing, 0, "{}", received.report);
    assert!(received.report.problems.is_empty(), "{}", received.report);
}

#[test]
fn slow_foot_clock_causes_no_gaps() {
    // An emulated foot at a third of real time.
    let mut sent = SendingFeet::default().sent();
    sent.iter_mut().for_each(|sent| sent.bus_us *= 3);
    let received = Received::of(&sent, &[]);
    received.assert_times(&[], "slow");
    assert_eq!(received.report.missing, 0);
    assert!(received.report.problems.is_empty(), "{}", received.report);
}
