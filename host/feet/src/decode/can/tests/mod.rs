//! Tests with generated and damaged logs.

mod clock;

use super::*;
use crate::decode::Decoded;
use crate::decode::can_log::Logged;
use crate::remedy::FootHint;
use wire::pdo::{Axes, ClockReading, LongTime, ShortTime};

const NODE_33: NodeId = NodeId::new(33).unwrap();

/// A contact of the front left foot, logged at `log_ms`.
fn contact(interface: &str, log_ms: u64, sequence: u8, step: u16) -> String {
    let contact = Contact { timestamp: ShortTime(step), sequence, ..Contact::default() };
    let frame = CanFrame::new(0x191, &contact.encode()).unwrap();
    let at = Timestamp::from_micros(log_ms * 1000);
    format!("{}\n", Logged { at, frame }.line(interface))
}

fn decode(log: &str, file: &str, others: &[NodeId]) -> Decoded {
    let mut feet = KnownFeet::default();
    others.iter().for_each(|node| feet.add(*node));
    crate::decode::decode(log.as_bytes(), file, &feet).unwrap()
}

fn sentences(decoded: &Decoded) -> Vec<String> {
    decoded.notices.iter().map(|notice| notice.sentence("can.log")).collect()
}

fn times(decoded: &Decoded) -> Vec<u64> {
    decoded.rows.iter().map(|row| row.timestamp.as_micros()).collect()
}

#[test]
fn contact_before_its_boot_up_belongs_to_the_new_segment() {
    let before = (0..300_u16).map(|k| contact("can0", 1000 + u64::from(k), k as u8, 100 * k));
    let mut log: String = before.collect();
    log += &contact("can0", 1400, 0, 600);
    log += "(1.400000) can0 711#00\n";
    log += &contact("can0", 1401, 1, 700);
    log += &contact("can0", 1402, 2, 800);
    let decoded = decode(&log, "can.log", &[]);
    let Report { missing, restarts, .. } = decoded.report;
    assert_eq!((missing, restarts), (0, 1), "{:?}", decoded.report);
    assert_eq!(decoded.report.problems.len(), 0);
    let last: Vec<_> = decoded.rows.iter().rev().take(4).collect();
    let last: Vec<_> =
        last.iter().rev().map(|row| (row.segment, row.timestamp.as_micros())).collect();
    assert_eq!(last, [(0, 299_000), (1, 6_000), (1, 7_000), (1, 8_000)]);
    // If no boot-up follows, contacts are missing.
    let log = log.replace("(1.400000) can0 711#00\n", "");
    assert!(decode(&log, "can.log", &[]).report.missing > 0);
    // A number 0 that follows its predecessor belongs to the old segment.
    let mut log: String =
        (0..257_u16).map(|k| contact("can0", 1000 + u64::from(k), k as u8, 100 * k)).collect();
    log += "(1.257000) can0 711#00\n";
    let decoded = decode(&log, "can.log", &[]);
    let last = decoded.rows.last().expect("a row");
    assert_eq!((last.segment, last.timestamp.as_micros()), (0, 256_000));
}

/// One contact per millisecond on both clocks, starting just before the short clock wraps.
fn steady(count: u16) -> Vec<String> {
    let contact = |k: u16| {
        let step = 65_000_u16.wrapping_add(k.wrapping_mul(100));
        contact("can0", 1_000 + u64::from(k), k as u8, step)
    };
    (0..count).map(contact).collect()
}

fn steady_times(count: u64) -> Vec<u64> {
    (0..count).map(|k| 650_000 + 1_000 * k).collect()
}

#[test]
fn gaps_shorter_than_a_day_are_bridged() {
    let day = 86_400_000;
    let elapsed = (day - 1) * 1_000;
    let step = 65_000_u16.wrapping_add((elapsed / 10 % 65_536) as u16);
    for (log_ms, problems, last) in
        [(day - 1, 0, 650_000 + elapsed), (day, 1, 650_000 + elapsed % 655_360)]
    {
        let log = [contact("can0", 1, 0, 65_000), contact("can0", 1 + log_ms, 1, step)];
        let decoded = decode(&log.concat(), "can.log", &[]);
        let counted = decoded.report.problems.get("clock_of_the_log_set");
        assert_eq!(counted.copied().unwrap_or(0), problems);
        assert_eq!(times(&decoded), [650_000, last]);
    }
}

#[test]
fn damaged_foot_time_affects_only_its_row() {
    let (backwards, against) = ("times_that_run_backwards", "times_against_the_log");
    for (damaged, problem) in [
        // The time is off by 100 ms, within the tolerance for late frames: once before the turn, and once after it.
        (65_500_u16.wrapping_add(10_000), backwards),
        (65_500 - 10_000, backwards),
        // Off by more.
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
fn damaged_log_time_shifts_no_later_row() {
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
        // A frame may be late by up to a quarter of a turn.
        let is_noticed = damaged_ms != 900;
        assert_eq!(problems > 0, is_noticed, "{damaged_ms}: {problems}");
        assert_eq!((report.missing, report.rows), (0, 10));
    }
}

#[test]
fn lines_out_of_order_keep_their_times_and_are_reported() {
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
fn setting_the_log_clock_causes_one_problem_and_no_turn_error() {
    // The clock is set forwards, by whole turns of the foot's clock or not, and backwards by half a minute.
    for set_ms in [3_600_000_i64, 65_536, 3_600_300, -30_000] {
        let log = (0..10_u16).map(|k| {
            let set = if k < 5 { 0 } else { set_ms };
            let log_ms = (1_000_000 + i64::from(k) + set).unsigned_abs();
            contact("can0", log_ms, k as u8, 100 * k)
        });
        let decoded = decode(&log.collect::<String>(), "can.log", &[]);
        let problem = ("clock_of_the_log_set".to_owned(), 1);
        assert_eq!(decoded.report.problems, [problem].into());
        let times = times(&decoded);
        let mut pairs = times.windows(2);
        assert!(pairs.all(|pair| pair[1] == pair[0] + 1_000), "{times:?}");
    }
}

#[test]
fn duplicate_line_yields_one_row() {
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
fn same_number_at_another_time_is_a_gap_of_255() {
    // The second is a whole turn of the short clock later by the log's clock.
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
fn restart_begins_a_new_segment() {
    let boot_up = |id: u16| format!("(1.500000) can0 {id:03X}#00\n");
    // The same id on another bus, and another foot, have not restarted.
    let mut log = vec![boot_up(0x711), contact("can1", 1_000, 7, 100)];
    log.extend(steady(3));
    log.extend([boot_up(0x711), boot_up(0x712)]);
    // On the old clock this time would contradict the log, and 254 contacts would be missing.
    log.extend([contact("can0", 1_600, 1, 5_000), contact("can0", 1_601, 2, 5_100)]);
    log.push(contact("can1", 1_001, 8, 200));
    let decoded = decode(&log.concat(), "can.log", &[]);
    let rows = decoded.rows.iter();
    let rows: Vec<_> = rows.map(|row| (row.segment, row.sequence)).collect();
    assert_eq!(rows, [(0, 7), (0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (0, 8)]);
    assert_eq!(times(&decoded)[4..], [50_000, 51_000, 2_000]);
    let report = decoded.report;
    assert_eq!((report.restarts, report.missing), (1, 0));
    assert!(report.problems.is_empty());
    assert_eq!(report.longest_step_s, Some(0.001));
    assert!(report.to_string().contains("\nrestarts 1\n"));
}

#[test]
fn rows_name_the_interface_of_their_foot() {
    let log = [contact("can0", 1, 0, 100), contact("can1", 1, 0, 100)];
    let decoded = decode(&log.concat(), "can.log", &[]);
    let interfaces = decoded.rows.iter().map(|row| row.interface.as_deref());
    assert!(interfaces.eq([Some("can0"), Some("can1")]));
}

#[test]
fn other_nodes_are_ignored_unless_added_as_feet() {
    // Frames of node 33: boot-up, contact, axes, health, emergency and two of SDO.
    let mut log = String::new();
    for id in [0x721, 0x1A1, 0x2A1, 0x4A1, 0xA1, 0x5A1, 0x621] {
        log += &format!("(1.000000) can0 {id:03X}#0000000000000000\n");
    }
    let decoded = decode(&log, "can.log", &[]);
    assert_eq!(decoded.rows, []);
    assert_eq!(decoded.report.frames, [("of_other_nodes", 7)].into());
    assert!(decoded.report.emergencies.is_empty());
    let known = "17 to 22".to_owned();
    assert_eq!(decoded.notices, [DecodeNotice::UnknownFoot { known, node: 33 }]);
    assert_eq!(decoded.notices[0].hint(), Some(FootHint::NameNodeAsFoot(33)));
    assert_eq!(
        sentences(&decoded),
        ["can.log: no foot of the ids 17 to 22 has sent a contact, but node 33 may be one"]
    );
    let decoded = decode(&log, "can.log", &[NODE_33]);
    assert_eq!(decoded.rows.len(), 1);
    assert_eq!(decoded.rows[0].node, Some(NODE_33));
    assert_eq!(decoded.report.frames.get("of_other_nodes"), None);
    assert!(decoded.notices.is_empty());
    // No notice if a known foot has sent contacts.
    let decoded = decode(&(log + &contact("can0", 1, 0, 0)), "can.log", &[]);
    assert!(decoded.rows.len() == 1 && decoded.notices.is_empty());
}

#[test]
fn malformed_line_is_reported_and_skipped() {
    let log = [contact("can0", 1, 0, 0), "(1.2) x\n".to_owned(), contact("can0", 2, 1, 100)];
    let decoded = decode(&log.concat(), "can.log", &[]);
    assert_eq!(decoded.rows.len(), 2);
    assert_eq!(
        sentences(&decoded),
        [
            "can.log, line 2: \"(1.2) x\" is not a line of candump -l, which look like (1609459200.000111) can0 191#FFFF80800C0007D8"
        ]
    );
    let log = contact("can0", 1, 0, 0) + &"x\n".repeat(1000);
    let decoded = decode(&log, "can.log", &[]);
    assert_eq!(decoded.report.problems["malformed_lines"], 1000);
    assert_eq!(decoded.notices.len(), 11);
    assert_eq!(sentences(&decoded)[10], "can.log: 990 more lines are not lines of candump -l");
}

#[test]
fn frames_of_a_contact_before_the_log_are_no_problem() {
    let axes = |step: u16| {
        let axes = Axes { timestamp: ShortTime(step), ..Axes::default() };
        let frame = CanFrame::new(0x291, &axes.encode()).unwrap();
        format!("{}\n", Logged { at: Timestamp::from_micros(3000), frame }.line("can0"))
    };
    let log = [axes(300), contact("can0", 5, 0, 500)].concat();
    assert!(decode(&log, "can.log", &[]).report.problems.is_empty());
    // Where a kind comes twice, the contact between is missing.
    let log = [axes(300), axes(500), contact("can0", 7, 0, 700)].concat();
    assert_eq!(decode(&log, "can.log", &[]).report.problems["frames_before_any_contact"], 1);
}

#[test]
fn frames_without_their_contact_complete_no_row() {
    let axes = Axes { timestamp: ShortTime(300), ..Axes::default() };
    let frame = CanFrame::new(0x291, &axes.encode()).unwrap();
    let at = Timestamp::from_micros(3000);
    let axes = format!("{}\n", Logged { at, frame }.line("can0"));
    let decoded = decode(&[contact("can0", 1, 0, 100), axes.clone()].concat(), "can.log", &[]);
    assert_eq!(decoded.rows[0].axes, None);
    assert_eq!(decoded.report.problems["frames_without_their_contact"], 1);
    let decoded = decode(&[contact("can0", 1, 0, 300), axes].concat(), "can.log", &[]);
    assert!(decoded.rows[0].axes.is_some() && decoded.report.problems.is_empty());
}

#[test]
fn other_frames_are_counted_by_kind() {
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

/// A health frame of `node` with its clock at the SYNC of number `counter`, logged at `log_us`.
fn health(node: u16, log_us: u64, counter: u8, clock_us: u64) -> String {
    let health = Health {
        clock: ClockReading { sync: counter, time: LongTime((clock_us / 10) as u32) },
        ..Health::default()
    };
    line(0x500 + node, log_us, &health.encode())
}

fn line(id: u16, log_us: u64, data: &[u8]) -> String {
    let frame = CanFrame::new(id, data).unwrap();
    let at = Timestamp::from_micros(log_us);
    format!("{}\n", Logged { at, frame }.line("can0"))
}

fn contact_of(node: u16, log_us: u64, k: u64, clock_us: u64) -> String {
    let contact = Contact {
        timestamp: ShortTime((clock_us / 10) as u16),
        sequence: k as u8,
        ..Contact::default()
    };
    line(0x180 + node, log_us, &contact.encode())
}

/// Two feet, whose clocks are 3.3 s and 7.7 s ahead of the log's. Both sample at the same moments each
/// millisecond, received up to 0.7 ms later; SYNCs each 10 ms, received up to 0.4 ms later; health each
/// 100 ms, at different moments for the two feet.
fn two_feet_with_syncs(milliseconds: u64, counted: bool) -> String {
    let start = 1_000_000_000;
    let mut log = String::new();
    let mut newest = 0;
    for k in 0..milliseconds {
        let now = start + 1000 * k;
        if k % 10 == 3 {
            newest = now - start;
            let counter = (k / 10 % 240) as u8 + 1;
            let data: &[u8] = if counted { &[counter] } else { &[] };
            log += &line(0x80, now + k * 7919 % 400, data);
        }
        for (node, ahead, phase) in [(0x11, 3_300_000, 20), (0x12, 7_700_000, 55)] {
            let late = 200 + (k * 6007 + u64::from(node) * 101) % 500;
            log += &contact_of(node, now + late, k, now - start + ahead);
            if k % 100 == phase {
                let counter = if counted { ((k - 3) / 10 % 240) as u8 + 1 } else { 0 };
                let read_at = if counted { newest } else { now - start };
                log += &health(node, now + late + 10, counter, read_at + ahead);
            }
        }
    }
    log
}

/// Times of the two feet on the common clock, in pairs of the same moment, µs.
fn common(decoded: &Decoded) -> Vec<(u64, u64)> {
    let of = |id: u8| {
        let rows = decoded.rows.iter().filter(move |row| row.node.unwrap().get() == id);
        rows.map(|row| row.common.unwrap().0.as_micros())
    };
    of(0x11).zip(of(0x12)).collect()
}

#[test]
fn numbered_syncs_align_feet_to_the_log_clock() {
    let decoded = decode(&two_feet_with_syncs(6000, true), "can.log", &[]);
    assert_eq!(decoded.report.clocks, [("sync", 12_000)].into());
    assert_eq!(sentences(&decoded), ["can.log: t_common is by numbered SYNCs"]);
    let pairs = common(&decoded);
    assert_eq!(pairs.len(), 6000);
    for (k, (left, right)) in pairs.into_iter().enumerate() {
        // The delay of one SYNC, less than 0.4 ms, remains; the delays of samples do not.
        let sample = 1_000_000_000 + 1000 * k as u64;
        assert!((sample..sample + 400).contains(&left), "{k}: {left}");
        assert!((sample..sample + 400).contains(&right), "{k}: {right}");
        if k > 1500 {
            assert!(left.abs_diff(right) < 150, "{k}: {left} and {right}");
        }
    }
    assert!(decoded.report.to_string().contains("\nclock    sync 12000\n"));
}

#[test]
fn reception_time_is_common_without_numbered_syncs() {
    let decoded = decode(&two_feet_with_syncs(300, false), "can.log", &[]);
    assert_eq!(decoded.report.clocks, [("received", 600)].into());
    assert_eq!(decoded.notices.len(), 1);
    let said =
        "can.log: t_common is the time of reception, as no foot has reported a numbered SYNC";
    assert!(sentences(&decoded)[0].starts_with(said), "{:?}", decoded.notices);
    for row in &decoded.rows {
        assert_eq!(row.common, row.received.map(|at| (at, CommonClock::Received)));
    }
}

#[test]
fn foot_without_sync_uses_reception_time() {
    let health = format!(" {:03X}#", 0x512);
    let log: String = two_feet_with_syncs(300, true)
        .lines()
        .filter(|line| !line.contains(&health))
        .map(|line| format!("{line}\n"))
        .collect();
    let decoded = decode(&log, "can.log", &[]);
    assert_eq!(decoded.report.clocks, [("received", 300), ("sync", 300)].into());
    assert!(sentences(&decoded)[0].contains("but for 300 rows"), "{:?}", decoded.notices);
}

#[test]
fn restarted_foot_needs_a_new_sync() {
    let (mut log, mut after) = (two_feet_with_syncs(300, true), String::new());
    log += "(1000.400000) can0 711#00\n";
    for k in 0..20 {
        after += &contact_of(0x11, 1_000_500_000 + 1000 * k, k, 1000 * k);
    }
    let decoded = decode(&(log + &after), "can.log", &[]);
    let clocks = [("received", 20), ("sync", 600)];
    assert_eq!(decoded.report.clocks, clocks.into());
    assert_eq!(decoded.rows.last().unwrap().segment, 1);
}

#[test]
fn differences_of_time_are_added_up() {
    let mut printed = String::new();
    for (k, line) in steady(50).iter().enumerate() {
        let data = line.trim().split_once('#').unwrap().1;
        let bytes: Vec<_> = (0..8).map(|k| &data[2 * k..2 * k + 2]).collect();
        let difference = if k == 0 { 0 } else { 900 + 200 * (k % 2) };
        printed += &format!(" (000.{difference:06})  can0  191   [8]  {}\n", bytes.join(" "));
    }
    let decoded = decode(&printed, "can.log", &[]);
    assert_eq!(times(&decoded), steady_times(50));
    let received = decoded.rows.last().unwrap().received.unwrap();
    assert_eq!(received.as_micros(), 25 * 1100 + 24 * 900);
    let said = "can.log: its times are differences from line to line; t_received is their sum";
    assert_eq!(sentences(&decoded), [said]);
}

#[test]
fn rows_of_long_logs_are_complete_and_in_order() {
    // More rows than are kept.
    let axes = |k: u16| {
        let axes = Axes { timestamp: ShortTime(100_u16.wrapping_mul(k)), ..Axes::default() };
        line(0x291, 1000 * u64::from(k), &axes.encode())
    };
    let log = (0..10_000_u16).map(|k| {
        let clock = u64::from(100 * u32::from(k) % 65_536) * 10;
        contact_of(0x11, 1000 * u64::from(k), u64::from(k), clock) + &axes(k)
    });
    let decoded = decode(&log.collect::<String>(), "can.log", &[]);
    assert_eq!((decoded.report.rows, decoded.rows.len()), (10_000, 10_000));
    assert!(decoded.report.problems.is_empty(), "{}", decoded.report);
    let in_order = |(k, row): (usize, &ContactRow)| {
        row.timestamp.as_micros() == 1000 * k as u64 && row.axes.is_some()
    };
    assert!(decoded.rows.iter().enumerate().all(in_order));
}
