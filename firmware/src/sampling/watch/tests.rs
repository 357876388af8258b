use super::*;
use lsm6dsox::Config;
use std::vec::Vec;

const FRESH: u8 = 0b11;

/// A sample with this status and these codes, in the order wx wy wz ax ay az.
fn sample(status: u8, codes: [i16; 6]) -> RawSample {
    let mut bytes = [0; 16];
    bytes[0] = status;
    for (bytes, code) in bytes[4..].chunks_mut(2).zip(codes) {
        bytes.copy_from_slice(&code.to_le_bytes());
    }
    RawSample::decode(&bytes, &Config::FRESH_KILOHERTZ).expect("a status")
}

/// Samples in which no axis repeats.
fn moving(k: i16) -> RawSample {
    sample(FRESH, [k, k + 1, k + 2, k + 3, k + 4, k + 5])
}

fn tick(edge: bool, edges: Option<u16>) -> Tick {
    Tick { edge: edge.then(|| Timestamp::from_micros(1)), edges, ..Tick::default() }
}

fn ordinary() -> Tick {
    tick(true, Some(7))
}

/// Counts ticks, bad where `bad` is 1; returns whether only the last one causes a fault.
fn last_is_a_fault(bad: &[u8]) -> bool {
    let mut watch = Watch::default();
    let faults = bad.iter().map(|bad| {
        let issue = (*bad == 1).then_some(SampleIssue::Stale);
        watch.count(issue, Timestamp::from_micros(1)).is_some()
    });
    let faults: Vec<bool> = faults.collect();
    let (last, others) = faults.split_last().expect("ticks");
    assert!(!others.contains(&true), "{faults:?}");
    *last
}

#[test]
fn edges_are_counted_only_by_hardware_and_on_ticks_in_a_row() {
    for (edges, missed, issue) in [
        (Some(4), 0, Some(SampleIssue::Unannounced)),
        (Some(5), 0, None),
        (Some(8), 0, None),
        (Some(9), 0, Some(SampleIssue::Rate)),
        (Some(9), 1, None),
        (None, 0, None),
    ] {
        let mut watch = Watch::default();
        let tick = Tick { missed, ..tick(true, edges) };
        assert_eq!(watch.issue(&tick, &moving(0)), issue, "{edges:?}, {missed}");
    }
}

#[test]
fn issues_are_ranked_missing_edge_then_stale_then_repeat() {
    let stale = sample(0, [0; 6]);
    let mut watch = Watch::default();
    for _ in 0..4 {
        watch.issue(&ordinary(), &moving(0));
    }
    let issue = watch.issue(&tick(false, None), &stale);
    assert_eq!(issue, Some(SampleIssue::Edge));
    assert_eq!(watch.issue(&ordinary(), &stale), Some(SampleIssue::Stale));
}

#[test]
fn a_late_edge_ends_the_ticks_without_one() {
    let mut watch = Watch::default();
    let counts = [None, Some(0), Some(0), Some(1), None].map(|edges| {
        watch.issue(&tick(false, edges), &moving(0));
        watch.without_edge
    });
    assert_eq!(counts, [1, 2, 3, 0, 1]);
    watch.issue(&ordinary(), &moving(0));
    assert_eq!(watch.without_edge, 0);
}

#[test]
fn the_second_repeat_is_untrusted_and_the_third_is_a_fault() {
    let mut watch = Watch::default();
    let now = Timestamp::from_micros(1);
    let issues = [(); 4].map(|()| {
        let issue = watch.issue(&ordinary(), &moving(0));
        (issue, watch.count(issue, now))
    });
    let repeat = Some(SampleIssue::Repeat);
    assert_eq!(issues, [(None, None), (None, None), (repeat, None), (repeat, repeat)]);
    assert_eq!(watch.frozen_axes(), 0b11_1111);
    watch.issue(&ordinary(), &moving(1));
    assert_eq!(watch.frozen_axes(), 0);
}

#[test]
fn an_axis_that_has_not_changed_yet_is_not_a_fault() {
    let mut watch = Watch::default();
    for _ in 0..100 {
        let fault = watch.count(Some(SampleIssue::Unproven), Timestamp::from_micros(1));
        assert_eq!(fault, None);
    }
    assert_eq!((watch.bad_ticks, watch.good_ticks), (100, 0));
}

#[test]
fn consecutive_saturated_samples_are_counted_and_may_repeat() {
    let mut watch = Watch::default();
    let end = [0, 0, 0, i16::MAX, 0, 0];
    for count in 1..=60 {
        assert_eq!(watch.issue(&ordinary(), &sample(FRESH, end)), None);
        assert_eq!(watch.saturated_ticks, count);
    }
    watch.issue(&ordinary(), &sample(0, end));
    assert_eq!(watch.saturated_ticks, 0, "a stale one");
    watch.issue(&ordinary(), &sample(FRESH, end));
    watch.issue(&ordinary(), &moving(0));
    assert_eq!(watch.saturated_ticks, 0, "one within the range");
}

#[test]
fn three_bad_ticks_in_five_or_four_in_twenty_six_are_a_fault() {
    assert!(!last_is_a_fault(&[1, 1]));
    assert!(last_is_a_fault(&[1, 1, 1]));
    assert!(last_is_a_fault(&[1, 0, 1, 0, 1]));
    assert!(!last_is_a_fault(&[1, 0, 1, 0, 0, 1]));
    let four = |good: usize| {
        let mut ticks = std::vec![0; good];
        ticks.splice(0..0, [1, 1]);
        ticks.splice(5..5, [1]);
        ticks.push(1);
        last_is_a_fault(&ticks)
    };
    assert!(four(22));
    assert!(!four(23));
}

#[test]
fn a_good_tick_ends_the_bad_ones_and_is_remembered() {
    let mut watch = Watch::default();
    let at = Timestamp::from_micros;
    watch.count(Some(SampleIssue::Bus), at(1));
    watch.count(Some(SampleIssue::Status(0x80)), at(2));
    assert_eq!((watch.bad_ticks, watch.last_good), (2, None));
    watch.count(None, at(3));
    watch.count(None, at(4));
    assert_eq!((watch.bad_ticks, watch.good_ticks), (0, 2));
    assert_eq!(watch.last_good, Some(at(4)));
}

#[test]
fn a_restart_resets_everything_except_the_read_back_turn() {
    let mut watch = Watch { turn: 7, ..Watch::default() };
    watch.issue(&tick(false, None), &moving(0));
    watch.count(Some(SampleIssue::Edge), Timestamp::from_micros(1));
    watch.restart();
    assert_eq!((watch.turn, watch.without_edge, watch.bad_ticks), (7, 0, 0));
    assert_eq!(watch.badness, 0);
}

#[test]
fn dead_line_differs_from_a_silent_sensor() {
    let mut watch = Watch::default();
    let dead = tick(false, Some(0));
    assert_eq!(watch.issue(&dead, &moving(1)), Some(SampleIssue::Unannounced));
    assert_eq!(watch.issue(&dead, &sample(0, [0; 6])), Some(SampleIssue::Edge));
}

#[test]
fn third_lost_edge_soon_has_samples_read_by_the_timer() {
    for (between, read_at) in [(40, ReadAt::Timer), (60, ReadAt::Edge)] {
        let mut watch = Watch::default();
        for lost in 0..3 {
            for k in 0..between {
                assert_eq!(watch.read_at, ReadAt::Edge, "{lost}, {k}");
                let tick = if k == 0 { tick(false, Some(6)) } else { ordinary() };
                watch.issue(&tick, &moving(k));
                watch.turn += 1;
                if lost == 2 && k == 1 {
                    break;
                }
            }
        }
        assert_eq!(watch.read_at, read_at);
    }
}

#[test]
fn ticks_that_show_a_lost_edge() {
    let after = |first: Tick, second: Tick| {
        let mut watch = Watch { turn: 10, lost: LOST - 1, lost_turn: 9, ..Watch::default() };
        watch.issue(&ordinary(), &moving(0));
        let issue = watch.issue(&first, &moving(1));
        assert_eq!(issue, Some(SampleIssue::Unannounced));
        (watch.issue(&second, &moving(2)), watch.read_at)
    };
    let lost = tick(false, Some(6));
    assert_eq!(after(lost, ordinary()), (None, ReadAt::Timer));
    assert_eq!(after(lost, lost), (None, ReadAt::Timer));
    let unannounced = Some(SampleIssue::Unannounced);
    // A line that is dead, and a sensor that is too slow.
    for edges in [0, 4] {
        let second = tick(false, Some(edges));
        assert_eq!(after(lost, second), (unannounced, ReadAt::Edge));
    }
    let uncounted = tick(false, None);
    assert_eq!(after(uncounted, uncounted), (unannounced, ReadAt::Edge));
    assert_eq!(after(uncounted, tick(true, None)), (None, ReadAt::Timer));
}

#[test]
fn a_wrong_rate_is_an_issue_of_the_timer_after_a_while() {
    for wrong in [tick(true, Some(3)), tick(true, Some(60))] {
        let mut watch = Watch { read_at: ReadAt::Timer, ..Watch::default() };
        let first_issue = |watch: &mut Watch| {
            let issue = (0..1000).find(|k| watch.issue(&wrong, &moving(*k)).is_some());
            issue.expect("an issue")
        };
        assert_eq!(first_issue(&mut watch), 199);
        // A restart of the sensor changes nothing about it, a tick without edges or with the right number ends it.
        watch.restart();
        assert_eq!(first_issue(&mut watch), 0);
        for other in [tick(false, Some(0)), ordinary()] {
            assert_eq!(watch.issue(&other, &moving(1)), None);
            assert_eq!(first_issue(&mut watch), 199);
        }
        assert_eq!(watch.read_at, ReadAt::Timer);
    }
}

#[test]
fn edges_of_a_second_end_the_reading_by_timer() {
    let mut watch = Watch { read_at: ReadAt::Timer, ..Watch::default() };
    watch.restart();
    assert_eq!(watch.issue(&tick(false, Some(0)), &moving(0)), None);
    assert_eq!(watch.issue(&tick(false, Some(0)), &sample(0, [0; 6])), Some(SampleIssue::Stale));
    let ticks = |watch: &mut Watch, ticks: i16, tick: Tick| {
        for k in 0..ticks {
            assert_eq!(watch.issue(&tick, &moving(k)), None);
        }
    };
    ticks(&mut watch, 999, ordinary());
    // One tick without begins anew, as does one with too many.
    ticks(&mut watch, 1, tick(true, Some(60)));
    ticks(&mut watch, 999, ordinary());
    assert_eq!(watch.read_at, ReadAt::Timer);
    ticks(&mut watch, 1, ordinary());
    assert_eq!(watch.read_at, ReadAt::Edge);
}
