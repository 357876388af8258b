//! Faults of the sensor: the flag, the detection time, and the recovery of the foot.

use crate::STRIDE;
use crate::bench::{Bench, MS, ORDINARY, Run, SECOND, part, run, standing};
use estimator_core::Decision;
use lsm6dsox::Sensor;
use lsm6dsox::sim::{Axis, Part, PartFault, PartOptions, SharedPart, Stimulus};
use wire::{Counter, Fault, Faults, Settings, Stage};

/// Time within which every fault of the sensor is flagged and P is 0, ns.
const LIMIT: u64 = 5 * MS;

/// Earliest time of faults: the foot stands and says "stable" by then.
const BEGIN: u64 = 1500 * MS;

/// Duration of a fault.
const DURATION: u64 = 150 * MS;

/// A fault; the emergency messages that report it, in order; the time after which no frame is valid, ns, which is one tick
/// unless the fault takes longer to detect; and whether the board counts edges. Without the count, samples are only stale.
type Case = (PartFault, &'static [Fault], u64, bool);

const CASES: [Case; 7] = [
    (PartFault::MisoStuckLow, &[Fault::SensorWrongId], TICK, false),
    (PartFault::MisoStuckHigh, &[Fault::SensorWrongId], TICK, false),
    (PartFault::WrongId(0x6B), &[Fault::SensorWrongId], 4 * MS, false),
    (PartFault::Reset, &[Fault::SensorSilent, Fault::SensorReset], TICK, false),
    (PartFault::FrozenOutput, &[Fault::SensorFrozen], 3 * MS, false),
    (PartFault::ClockRatio(0.1), &[Fault::SensorTiming], TICK, true),
    (PartFault::DataReadyStorm { period_ns: 15_000 }, &[Fault::SensorTiming], TICK, true),
];

const TICK: u64 = MS + 300_000;

/// Observations of one fault; times in ns.
#[derive(Debug, Default)]
struct Seen {
    /// Time from the fault to the first invalid frame.
    doubted: Option<u64>,
    /// Time from the fault to the first frame with P = 0 and the fault flag.
    flagged: Option<u64>,
    /// Time from the fault to the last frame that said "stable" before the recovery.
    last_stable: Option<u64>,
    /// Time from the end of the fault to the first valid frame.
    recovered: Option<u64>,
    /// Whether a frame said "stable" after the recovery.
    stable_again: bool,
    reported: Vec<Fault>,
    /// Detail of the first report.
    detail: Option<u32>,
    /// Whether a report was withdrawn while the fault lasted.
    withdrawn: bool,
    restarts: u32,
}

/// Least duration of a fault, ns: the supply dips once, and the sensor takes as long to start again.
fn lasts(fault: PartFault) -> u64 {
    match fault {
        PartFault::Reset => 100 * MS,
        _ => DURATION,
    }
}

/// Observes a foot at rest with a fault from `begin` on, for [`DURATION`].
fn watch(fault: PartFault, begin: u64, count_edges: bool) -> Seen {
    watch_moving(fault, Stimulus::REST, begin, Run { count_edges, ..Run::default() })
}

/// Observes a foot that moves by `moves` during a fault from `begin` on, on a board with these options.
fn watch_moving(fault: PartFault, moves: Stimulus, begin: u64, board: Run<'_>) -> Seen {
    let end = begin + DURATION;
    let moving = begin as f64 / 1.0e9..end as f64 / 1.0e9;
    let motion = move |t: f64| if moving.contains(&t) { moves } else { Stimulus::REST };
    let part = part(motion, ORDINARY);
    let inject = |part: &SharedPart| part.inject(fault);
    let clear = |part: &SharedPart| part.with(Part::clear_faults);
    let options = Run { actions: &[(begin, &inject), (end, &clear)], ..board };
    let mut bench = Bench::new(Settings::default());
    let mut seen = Seen::default();
    let mut said_stable = false;
    let ns = end + 2 * SECOND;
    run(options, &part, &mut bench, ns, |bench, _, measurement| {
        let now = part.now_ns();
        let contact = bench.contact().expect("a contact frame each tick");
        let status = contact.status;
        let stable = status.decision() == Decision::Stable;
        seen.restarts = measurement.restarts;
        for emergency in bench.emergencies() {
            if emergency.code == 0 {
                seen.withdrawn |= now < end;
                continue;
            }
            seen.detail.get_or_insert(emergency.detail);
            seen.reported.extend(emergency.fault);
        }
        if now < begin {
            said_stable |= stable;
            return;
        }
        if !status.is_valid() {
            seen.doubted.get_or_insert(now - begin);
        }
        if status.has_fault() && contact.stable.0 == 0 {
            seen.flagged.get_or_insert(now - begin);
        }
        if now < begin + lasts(fault) {
            seen.last_stable = stable.then_some(now - begin).or(seen.last_stable);
        } else if now >= end && status.is_valid() {
            seen.recovered.get_or_insert(now - end);
            seen.stable_again |= stable;
        }
    });
    assert!(said_stable, "the foot never said stable before the fault");
    seen
}

#[test]
fn every_sensor_fault_is_flagged_within_5_ms_and_recovers() {
    for (fault, reported, doubted_within, edges_counted) in CASES {
        // At any phase of four ticks and of the sensor's period.
        for phase in (0..40).step_by(STRIDE) {
            let begin = BEGIN + phase * 113_313;
            let seen = watch(fault, begin, edges_counted);
            let at = format!("{fault:?} at {begin} ns");
            let within = |time: Option<u64>, limit: u64| time.is_some_and(|ns| ns <= limit);
            assert!(within(seen.doubted, doubted_within), "{at}: {seen:?}");
            assert!(within(seen.flagged, LIMIT), "{at}: {:?}", seen.flagged);
            assert!(seen.last_stable.unwrap_or(0) < LIMIT, "{at}: {seen:?}");
            assert!(seen.recovered.is_some() && seen.stable_again, "{at}");
            assert!(seen.reported.starts_with(reported), "{at}: {seen:?}");
            assert!(seen.restarts > 0, "{at}");
        }
    }
}

#[test]
fn a_half_dead_sensor_is_reported_with_its_axes_and_never_trusted() {
    let [x, y, z] = Stimulus::REST.specific_force;
    let slide = Stimulus { specific_force: [x + 3.0, y, z], ..Stimulus::REST };
    let turn = Stimulus { angular_rate: [2.0, 0.0, 0.0], ..Stimulus::REST };
    let stuck = |sensor, axis, code| PartFault::AxisStuck { sensor, axis, code };
    for (fault, moves, axes, within_ms) in [
        (stuck(Sensor::Accel, Axis::X, 0), slide, 0b1, 31),
        (stuck(Sensor::Accel, Axis::Z, 2049), slide, 0b100, 31),
        (stuck(Sensor::Gyro, Axis::X, 0), turn, 0b1000, 91),
        // 0.2 rad/s.
        (stuck(Sensor::Gyro, Axis::Y, 164), Stimulus::REST, 0b1_0000, 91),
        (PartFault::SensorFrozen(Sensor::Accel), slide, 0b111, 21),
        (PartFault::SensorFrozen(Sensor::Gyro), turn, 0b11_1000, 41),
        (PartFault::FrozenOutput, slide, 0b11_1111, 5),
    ] {
        for phase in 0..4 {
            let seen = watch_moving(fault, moves, BEGIN + phase * 2_713_313, Run::default());
            let name = format!("{fault:?}, phase {phase}");
            let first = (seen.reported.first(), seen.detail);
            assert_eq!(first, (Some(&Fault::SensorFrozen), Some(axes)), "{name}");
            let flagged = seen.flagged.unwrap_or(u64::MAX);
            assert!(flagged <= (within_ms + 1) * MS, "{name}: {flagged} ns");
            let last_stable = seen.last_stable.unwrap_or(0);
            assert!(last_stable <= within_ms * MS, "{name}: {last_stable} ns");
            assert!(!seen.withdrawn && seen.stable_again, "{name}");
        }
    }
}

#[test]
fn a_foot_at_rest_has_no_frozen_axis() {
    let mut bench = Bench::new(Settings::default());
    let mut reported = Vec::new();
    // The run lasts ten minutes, or a part of them.
    let ns = 600 * SECOND / STRIDE as u64;
    run(Run::default(), &standing(), &mut bench, ns, |bench, _, _| {
        reported.extend(bench.emergencies());
    });
    assert_eq!(reported, []);
}

/// A board whose sensor is on a cable without a wire for edges.
const WITHOUT_LINE: Run =
    Run { self_test: false, count_edges: false, is_without_line: true, actions: &[] };

#[test]
fn sensor_faults_are_flagged_on_a_board_without_a_line() {
    // All faults except the faults of the edges.
    for (fault, reported, doubted_within, _) in &CASES[..5] {
        for phase in 0..10 {
            let begin = BEGIN + phase * 113_313;
            let seen = watch_moving(*fault, Stimulus::REST, begin, WITHOUT_LINE);
            let at = format!("{fault:?} at {begin} ns: {seen:?}");
            assert!(seen.doubted.is_some_and(|ns| ns <= *doubted_within), "{at}");
            assert!(seen.flagged.is_some_and(|ns| ns <= LIMIT), "{at}");
            assert!(seen.last_stable.unwrap_or(0) < LIMIT && seen.stable_again, "{at}");
            // Without edges, a stuck data line looks like a silent sensor.
            let is_stuck = matches!(fault, PartFault::MisoStuckLow | PartFault::MisoStuckHigh);
            let reported = if is_stuck { &[Fault::SensorSilent][..] } else { reported };
            assert!(seen.reported.starts_with(reported), "{at}");
        }
    }
}

#[test]
fn board_without_a_line_reads_the_newest_sample_at_each_tick() {
    let part = standing();
    let mut bench = Bench::new(Settings::default());
    let (mut ages, mut stable) = (Vec::new(), 0);
    run(WITHOUT_LINE, &part, &mut bench, 5 * SECOND, |bench, tick, measurement| {
        assert_eq!(bench.emergencies(), []);
        if measurement.raw.is_none() {
            return;
        }
        let sampled = measurement.sample.timestamp.as_micros();
        ages.push(tick.time.as_micros() as i64 - sampled as i64);
        let contact = bench.contact().expect("a contact each tick");
        stable += u32::from(contact.status.decision() == Decision::Stable);
    });
    // The mean age of a sample at 6667 Hz.
    assert!(ages.len() > 4_500 && ages.iter().all(|age| *age == 75), "{}", ages.len());
    assert!(stable > 3_000, "{stable}");
}

#[test]
fn samples_are_read_by_the_timer_where_no_edge_comes() {
    for (phase, edges_counted) in [(0, true), (7, false), (23, true)] {
        let lost = BEGIN + phase * 113_313;
        let back = lost + 1_500 * MS;
        let part = standing();
        let lose = |part: &SharedPart| part.inject(PartFault::DataReadyLost);
        let clear = |part: &SharedPart| part.with(Part::clear_faults);
        let options = Run {
            count_edges: edges_counted,
            actions: &[(lost, &lose), (back, &clear)],
            ..Run::default()
        };
        let mut bench = Bench::new(Settings::default());
        let mut outages = Vec::new();
        let mut faults = Vec::new();
        let mut was_valid = true;
        let mut ages = Vec::new();
        run(options, &part, &mut bench, back + 1_200 * MS, |bench, tick, measurement| {
            let now = part.now_ns();
            let contact = bench.contact().expect("a contact each tick");
            let is_valid = contact.status.is_valid();
            if is_valid != was_valid && now > SECOND {
                outages.push(now);
                was_valid = is_valid;
            }
            if is_valid && tick.edge.is_none() {
                let sampled = measurement.sample.timestamp.as_micros() as i64;
                ages.push(now as i64 / 1000 - sampled);
            }
            for emergency in bench.emergencies() {
                faults.push((emergency.code != 0, emergency.fault, now));
            }
        });
        // There is one outage, because of a restart, although the line remains dead.
        let [from, to] = outages[..] else {
            panic!("{outages:?}");
        };
        assert!(from - lost < 2 * MS && to - lost < 300 * MS, "{outages:?}");
        let times = |raised: bool, wanted: Fault| -> Vec<u64> {
            let of_it =
                faults.iter().filter(|(is, fault, _)| *is == raised && *fault == Some(wanted));
            of_it.map(|(.., time)| *time).collect()
        };
        assert_eq!(times(true, Fault::SensorSilent).len(), 1, "{faults:?}");
        assert_eq!(times(false, Fault::SensorSilent).len(), 1, "{faults:?}");
        assert_eq!(times(true, Fault::DataReadyDead).len(), 1, "{faults:?}");
        let cleared = times(false, Fault::DataReadyDead);
        assert!(
            matches!(cleared[..], [time] if (998 * MS..1_010 * MS).contains(&(time - back))),
            "{faults:?}"
        );
        // At the end of a wait for an edge, the newest sample is at most one period of the sensor old.
        assert!(ages.len() > 1_000, "{}", ages.len());
        assert!(ages.iter().all(|age| (0..=200).contains(age)), "{ages:?}");
    }
}

#[test]
fn faults_are_reported_while_the_data_ready_line_is_dead() {
    for (fault, reported) in [
        (PartFault::Reset, Fault::SensorReset),
        (PartFault::FrozenOutput, Fault::SensorFrozen),
        (PartFault::MisoStuckHigh, Fault::SensorWrongId),
        (PartFault::ClockRatio(0.1), Fault::SensorTiming),
        (PartFault::Saturation, Fault::SensorSaturated),
    ] {
        for phase in 0..4 {
            let begin = BEGIN + phase * 113_313;
            let (end, back) = (begin + DURATION, begin + 2 * SECOND);
            let part = standing();
            let lose = |part: &SharedPart| part.inject(PartFault::DataReadyLost);
            let inject = |part: &SharedPart| part.inject(fault);
            let back_to_dead = |part: &SharedPart| {
                part.with(Part::clear_faults);
                lose(part);
            };
            let clear = |part: &SharedPart| part.with(Part::clear_faults);
            let options = Run {
                actions: &[(1, &lose), (begin, &inject), (end, &back_to_dead), (back, &clear)],
                ..Run::default()
            };
            let mut bench = Bench::new(Settings::default());
            let (mut raised, mut messages, mut previous) = (Vec::new(), 0, 0);
            let mut stable = false;
            run(options, &part, &mut bench, back + 2 * SECOND, |bench, _, measurement| {
                let now = part.now_ns();
                let sampled = measurement.sample.timestamp.as_micros();
                assert!(previous < sampled && sampled * 1000 <= now, "{fault:?}: {now}");
                previous = sampled;
                let contact = bench.contact().expect("a contact each tick");
                stable = contact.status.decision() == Decision::Stable;
                assert!(
                    !stable || !(begin + LIMIT..begin + lasts(fault)).contains(&now),
                    "{fault:?}: {now}"
                );
                for emergency in bench.emergencies() {
                    messages += 1;
                    if now >= begin && emergency.code != 0 {
                        raised.extend(emergency.fault);
                    }
                }
            });
            assert!(raised.contains(&reported), "{fault:?}: {raised:?}");
            assert!(messages <= 8, "{fault:?}: {messages} messages");
            assert_eq!((bench.foot.faults(), stable), (Faults::NONE, true));
        }
    }
}

#[test]
fn ordinary_sensor_irregularities_are_not_faults() {
    let harmless: [(&str, PartFault, bool); 3] = [
        ("a clock 3 % slow", PartFault::ClockRatio(0.97), true),
        ("a clock 5 % fast", PartFault::ClockRatio(1.05), true),
        ("one bit in a million", PartFault::BitFlips { per_million: 1 }, false),
    ];
    for (name, fault, edges_counted) in harmless {
        let seen = watch(fault, BEGIN, edges_counted);
        assert_eq!((seen.reported, seen.restarts), (vec![], 0), "{name}");
    }
}

#[test]
fn a_sensor_beyond_its_range_is_doubted_from_the_first_sample() {
    for phase in 0..10 {
        let seen = watch(PartFault::Saturation, BEGIN + phase * 113_313, false);
        assert!(seen.doubted.is_some_and(|ns| ns <= 2 * MS), "{seen:?}");
        assert!(seen.last_stable.unwrap_or(0) <= 2 * MS, "{seen:?}");
        // An impact lasts some milliseconds, whereas a saturation of fifty is a fault.
        assert!(seen.flagged.is_some_and(|ns| (48 * MS..52 * MS).contains(&ns)), "{seen:?}");
        assert_eq!((seen.reported, seen.restarts), (vec![Fault::SensorSaturated], 0));
        assert!(seen.recovered.is_some() && seen.stable_again);
    }
}

#[test]
fn a_noisy_line_is_doubted_and_reported_without_a_checksum() {
    let flips = PartFault::BitFlips { per_million: 100_000 };
    for phase in 0..10 {
        let seen = watch(flips, BEGIN + phase * 113_313, false);
        assert!(seen.flagged.is_some_and(|ns| ns <= 30 * MS), "{seen:?}");
        assert!(seen.last_stable.unwrap_or(0) <= LIMIT, "{seen:?}");
        assert!(seen.recovered.is_some());
    }
}

#[test]
fn a_failed_first_start_is_reported_if_the_second_succeeds() {
    let part = standing();
    part.inject(PartFault::MisoStuckHigh);
    let clear = |part: &SharedPart| part.with(Part::clear_faults);
    let options = Run {
        // The identity is read after 10 ms. After a reset it is read 10 ms later, and again at 30 ms at the earliest.
        actions: &[(25 * MS, &clear)],
        ..Run::default()
    };
    let mut bench = Bench::new(Settings::default());
    let mut reported = Vec::new();
    let mut restarts = 0;
    run(options, &part, &mut bench, 2 * SECOND, |bench, _, measurement| {
        restarts = measurement.restarts;
        let emergencies = bench.emergencies();
        reported.extend(emergencies.iter().map(|e| (e.fault, e.code)));
    });
    let fault = Fault::SensorWrongId;
    reported.retain(|(of, _)| *of == Some(fault));
    let codes: Vec<_> = reported.iter().map(|(_, code)| *code).collect();
    assert_eq!(codes, [fault.code(), 0]);
    assert_eq!((restarts, bench.foot.stage()), (1, Stage::Running));
}

#[test]
fn missed_ticks_are_counted_and_a_fault_for_one_second() {
    let mut bench = Bench::new(Settings::default()).running();
    let late = Faults::NONE.with(Fault::LateTick);
    for (missed, counted, reported) in [(3, 3, Some(3000)), (2, 5, None)] {
        bench.still_after(missed);
        assert_eq!(bench.foot.counters().get(Counter::LateTicks), counted);
        let emergencies = bench.emergencies();
        let details = emergencies.iter().map(|emergency| emergency.detail);
        assert!(details.eq(reported), "{emergencies:?}");
        (0..998).for_each(|_| bench.still());
        assert_eq!(bench.foot.faults(), late);
    }
    bench.still();
    assert_eq!(bench.foot.faults(), Faults::NONE);
}

#[test]
fn a_failed_self_test_axis_invalidates_every_estimate() {
    for (signal, failed) in [(4.9, 0), (0.1, 0b111)] {
        let options = PartOptions { accel_test_signal: [signal; 3], ..ORDINARY };
        let part = part(|_: f64| Stimulus::REST, options);
        let mut bench = Bench::new(Settings::default());
        let mut stages = Vec::new();
        let mut detail = 0;
        let mut frames = 0;
        let options = Run { self_test: true, ..Run::default() };
        run(options, &part, &mut bench, 4 * SECOND, |bench, _, _| {
            if stages.last() != Some(&bench.foot.stage()) {
                stages.push(bench.foot.stage());
            }
            frames += u32::from(bench.contact().is_some());
            for emergency in bench.emergencies() {
                detail = emergency.detail;
            }
        });
        assert_eq!(stages, [Stage::Starting, Stage::SelfTest, Stage::HoldStill, Stage::Running]);
        assert!(frames >= 3998, "{frames} frames: the self-test held up the ticks");
        assert_eq!(detail, failed);
        let status = bench.contact().expect("a frame").status;
        assert_eq!(status.is_valid(), failed == 0);
    }
}

#[test]
fn self_test_keeps_the_report_of_lost_settings() {
    let part = standing();
    // The reset comes in the first self-test. The second self-test follows a start that finds the settings lost.
    let reset = |part: &SharedPart| part.inject(PartFault::Reset);
    let options = Run { self_test: true, actions: &[(300 * MS, &reset)], ..Run::default() };
    let mut bench = Bench::new(Settings::default());
    let (mut stages, mut raised) = (Vec::new(), Vec::new());
    run(options, &part, &mut bench, 4 * SECOND, |bench, _, _| {
        if stages.last() != Some(&bench.foot.stage()) {
            stages.push(bench.foot.stage());
        }
        let emergencies = bench.emergencies();
        raised.extend(emergencies.iter().filter(|emergency| emergency.code != 0).map(|e| e.fault));
    });
    assert_eq!(stages[..4], [Stage::Starting, Stage::SelfTest, Stage::Recovering, Stage::SelfTest]);
    assert_eq!(raised, [Some(Fault::SensorSilent), Some(Fault::SensorReset)]);
}
