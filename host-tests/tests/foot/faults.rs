//! Faults of the sensor: the flag, the detection time, and the recovery of the foot.

use crate::bench::{Bench, MS, ORDINARY, Run, SECOND, Sent, part, run, standing};
use estimator_core::Decision;
use lsm6dsox::sim::{Part, PartFault, PartOptions, SharedPart, Stimulus};
use wire::{Counter, Fault, Faults, Settings, Stage};

/// Time within which every fault of the sensor is flagged and P is 0, ns.
const LIMIT: u64 = 5 * MS;

/// Earliest time of faults: the foot stands and says "stable" by then.
const BEGIN: u64 = 1500 * MS;

/// Duration of a fault.
const DURATION: u64 = 150 * MS;

#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    fault: PartFault,
    /// Emergency messages that report it, in order.
    reported: &'static [Fault],
    /// Time after which no frame is valid, ns: one tick, unless the fault takes longer to detect.
    doubted_within: u64,
    edges_counted: bool,
}

const CASES: &[Case] = &[
    case(
        "data line stuck low",
        PartFault::MisoStuckLow,
        &[Fault::SensorWrongId],
    ),
    case(
        "data line stuck high",
        PartFault::MisoStuckHigh,
        &[Fault::SensorWrongId],
    ),
    doubted_within(
        4 * MS,
        case(
            "another identity",
            PartFault::WrongId(0x6B),
            &[Fault::SensorWrongId],
        ),
    ),
    case(
        "reset",
        PartFault::Reset,
        &[Fault::SensorSilent, Fault::SensorReset],
    ),
    doubted_within(
        3 * MS,
        case(
            "outputs frozen",
            PartFault::FrozenOutput,
            &[Fault::SensorFrozen],
        ),
    ),
    counted(case(
        "clock at a tenth",
        PartFault::ClockRatio(0.1),
        &[Fault::SensorTiming],
    )),
    counted(case(
        "data-ready storm",
        PartFault::DataReadyStorm { period_ns: 15_000 },
        &[Fault::SensorTiming],
    )),
];

const fn case(name: &'static str, fault: PartFault, reported: &'static [Fault]) -> Case {
    Case {
        name,
        fault,
        reported,
        doubted_within: MS + 300_000,
        edges_counted: false,
    }
}

const fn doubted_within(ns: u64, case: Case) -> Case {
    Case {
        doubted_within: ns,
        ..case
    }
}

/// Marks a case for boards that count edges; other boards detect only that samples are stale.
const fn counted(case: Case) -> Case {
    Case {
        edges_counted: true,
        ..case
    }
}

/// Observations of one fault.
#[derive(Default)]
struct Seen {
    /// Time from the fault to the first invalid frame.
    doubted: Option<u64>,
    /// Time from the fault to the first frame with P = 0 and the fault flag.
    flagged: Option<u64>,
    /// Time from the fault to the last frame that said "stable" before the recovery.
    last_stable: Option<u64>,
    /// Time from the end of the fault to the first valid frame.
    recovered: Option<u64>,
    /// Time from the end of the fault to the first frame that says "stable" again.
    stable_again: Option<u64>,
    reported: Vec<Fault>,
    restarts: u32,
}

/// Injects a fault at `begin`, clears it later, and checks every frame.
fn watch(fault: PartFault, begin: u64, edges_counted: bool) -> Seen {
    let part = standing();
    let end = begin + DURATION;
    let inject = |part: &SharedPart| part.inject(fault);
    let clear = |part: &SharedPart| part.with(Part::clear_faults);
    let options = Run {
        count_edges: edges_counted,
        actions: &[(begin, &inject), (end, &clear)],
        ..Run::default()
    };
    let mut bench = Bench::new(Settings::default());
    let mut seen = Seen::default();
    let mut said_stable = false;
    run(
        options,
        &part,
        &mut bench,
        end + 2 * SECOND,
        |bench, _, measurement| {
            seen.restarts = measurement.restarts;
            let Some(contact) = bench.contact() else {
                panic!("no contact frame at {} ns", part.now_ns());
            };
            let sent = Sent {
                ns: part.now_ns(),
                contact,
            };
            for emergency in bench.emergencies() {
                if emergency.code != 0 {
                    seen.reported.extend(emergency.fault);
                }
            }
            note(&mut seen, &mut said_stable, sent, begin, end);
        },
    );
    assert!(said_stable, "the foot never said stable before the fault");
    seen
}

fn note(seen: &mut Seen, said_stable: &mut bool, Sent { ns, contact }: Sent, begin: u64, end: u64) {
    let status = contact.status;
    let stable = status.decision() == Decision::Stable;
    if ns < begin {
        *said_stable |= stable;
        return;
    }
    let since = ns - begin;
    let flagged = status.has_fault() && contact.stable.0 == 0;
    if !status.is_valid() {
        seen.doubted.get_or_insert(since);
    }
    if flagged {
        seen.flagged.get_or_insert(since);
    }
    if ns < end {
        if stable {
            seen.last_stable = Some(since);
        }
    } else if status.is_valid() {
        seen.recovered.get_or_insert(ns - end);
        if stable {
            seen.stable_again.get_or_insert(ns - end);
        }
    }
}

fn milliseconds(ns: Option<u64>) -> String {
    ns.map_or("never".to_owned(), |ns| {
        format!("{:.2} ms", ns as f64 / 1.0e6)
    })
}

#[test]
fn every_sensor_fault_is_flagged_within_5_ms_and_recovers() {
    println!(
        "| fault | emergency | not valid after | flagged, P = 0 after | last \"stable\" after | recovered in |"
    );
    println!("|---|---|---|---|---|---|");
    for case in CASES {
        let mut worst = Seen::default();
        // At any phase of four ticks and of the sensor's period.
        for phase in 0..40 {
            let begin = BEGIN + phase * 113_313;
            let seen = watch(case.fault, begin, case.edges_counted);
            let at = format!("{} at {begin} ns", case.name);
            assert!(
                seen.doubted.is_some_and(|ns| ns <= case.doubted_within),
                "{at}: doubted after {:?}",
                seen.doubted
            );
            assert!(
                seen.flagged.is_some_and(|ns| ns <= LIMIT),
                "{at}: flagged after {:?}",
                seen.flagged
            );
            assert!(
                seen.last_stable.unwrap_or(0) < LIMIT,
                "{at}: stable after {:?}",
                seen.last_stable
            );
            assert!(seen.recovered.is_some(), "{at}: not recovered");
            assert!(seen.stable_again.is_some(), "{at}: never stable again");
            assert!(
                seen.reported.starts_with(case.reported),
                "{at}: reported {:?}",
                seen.reported
            );
            assert!(seen.restarts > 0, "{at}");
            worst.doubted = worst.doubted.max(seen.doubted);
            worst.flagged = worst.flagged.max(seen.flagged);
            worst.last_stable = worst.last_stable.max(seen.last_stable);
            worst.recovered = worst.recovered.max(seen.recovered);
        }
        println!(
            "| {} | {} | {} | {} | {} | {} |",
            case.name,
            case.reported
                .iter()
                .map(|f| format!("{:#06X}", f.code()))
                .collect::<Vec<_>>()
                .join(", "),
            milliseconds(worst.doubted),
            milliseconds(worst.flagged),
            milliseconds(worst.last_stable),
            milliseconds(worst.recovered),
        );
    }
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
        run(
            options,
            &part,
            &mut bench,
            back + 1_200 * MS,
            |bench, tick, measurement| {
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
            },
        );
        // One outage, of a restart, though the line stays dead.
        let [from, to] = outages[..] else {
            panic!("{outages:?}");
        };
        assert!(from - lost < 2 * MS && to - lost < 300 * MS, "{outages:?}");
        let times = |raised: bool, wanted: Fault| -> Vec<u64> {
            let of_it = faults
                .iter()
                .filter(|(is, fault, _)| *is == raised && *fault == Some(wanted));
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
        // The newest sample is at most a period of the edges old when the wait for one ends.
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
                actions: &[
                    (1, &lose),
                    (begin, &inject),
                    (end, &back_to_dead),
                    (back, &clear),
                ],
                ..Run::default()
            };
            let mut bench = Bench::new(Settings::default());
            let (mut raised, mut messages, mut previous) = (Vec::new(), 0, 0);
            let mut stable = false;
            run(
                options,
                &part,
                &mut bench,
                back + 2 * SECOND,
                |bench, _, measurement| {
                    let now = part.now_ns();
                    let sampled = measurement.sample.timestamp.as_micros();
                    assert!(
                        previous < sampled && sampled * 1000 <= now,
                        "{fault:?}: {now}"
                    );
                    previous = sampled;
                    let contact = bench.contact().expect("a contact each tick");
                    stable = contact.status.decision() == Decision::Stable;
                    assert!(
                        !stable || !(begin + LIMIT..end).contains(&now),
                        "{fault:?}: {now}"
                    );
                    for emergency in bench.emergencies() {
                        messages += 1;
                        if now >= begin && emergency.code != 0 {
                            raised.extend(emergency.fault);
                        }
                    }
                },
            );
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
        (
            "one bit in a million",
            PartFault::BitFlips { per_million: 1 },
            false,
        ),
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
        assert!(
            seen.doubted.is_some_and(|ns| ns <= 2 * MS),
            "{:?}",
            seen.doubted
        );
        assert!(
            seen.last_stable.unwrap_or(0) <= 2 * MS,
            "{:?}",
            seen.last_stable
        );
        // An impact lasts milliseconds; saturation of fifty is a fault.
        assert!(
            seen.flagged
                .is_some_and(|ns| (48 * MS..52 * MS).contains(&ns)),
            "{:?}",
            seen.flagged
        );
        assert_eq!(
            (seen.reported, seen.restarts),
            (vec![Fault::SensorSaturated], 0)
        );
        assert!(seen.recovered.is_some() && seen.stable_again.is_some());
    }
}

#[test]
fn a_noisy_line_is_doubted_and_reported_without_a_checksum() {
    let flips = PartFault::BitFlips {
        per_million: 100_000,
    };
    for phase in 0..10 {
        let seen = watch(flips, BEGIN + phase * 113_313, false);
        assert!(
            seen.flagged.is_some_and(|ns| ns <= 30 * MS),
            "{:?}",
            seen.flagged
        );
        assert!(
            seen.last_stable.unwrap_or(0) <= LIMIT,
            "{:?}",
            seen.last_stable
        );
        assert!(seen.recovered.is_some());
    }
}

#[test]
fn a_foot_without_a_sensor_only_reports_its_absence() {
    let part = standing();
    part.inject(PartFault::MisoStuckHigh);
    let mut bench = Bench::new(Settings::default());
    let mut reported = Vec::new();
    let mut frames = 0_u32;
    run(
        Run::default(),
        &part,
        &mut bench,
        3 * SECOND,
        |bench, _, _| {
            let contact = bench.contact().expect("a contact frame each tick");
            frames += 1;
            assert_eq!(contact.sequence, (frames - 1) as u8);
            assert!(!contact.status.is_valid() && contact.stable.0 == 0);
            assert_eq!(contact.status.decision(), Decision::NotStable);
            reported.extend(bench.emergencies());
        },
    );
    assert!(frames >= 2998, "{frames}");
    let reported: Vec<_> = reported.iter().map(|e| (e.code, e.detail)).collect();
    assert_eq!(reported, [(Fault::SensorWrongId.code(), 0xFF)]);
}

#[test]
fn a_failed_first_start_is_reported_if_the_second_succeeds() {
    let part = standing();
    part.inject(PartFault::MisoStuckHigh);
    let clear = |part: &SharedPart| part.with(Part::clear_faults);
    let options = Run {
        // The identity is read after 10 ms, and again 20 ms later at the earliest.
        actions: &[(15 * MS, &clear)],
        ..Run::default()
    };
    let mut bench = Bench::new(Settings::default());
    let mut reported = Vec::new();
    let mut restarts = 0;
    run(
        options,
        &part,
        &mut bench,
        2 * SECOND,
        |bench, _, measurement| {
            restarts = measurement.restarts;
            let emergencies = bench.emergencies();
            reported.extend(emergencies.iter().map(|e| (e.fault, e.code)));
        },
    );
    let fault = Fault::SensorWrongId;
    reported.retain(|(of, _)| *of == Some(fault));
    let codes: Vec<_> = reported.iter().map(|(_, code)| *code).collect();
    assert_eq!(codes, [fault.code(), 0]);
    assert_eq!((restarts, bench.foot.stage()), (1, Stage::Running));
}

#[test]
fn an_implausible_rate_at_rest_is_reported_in_millidegrees() {
    let turns = |seconds: f64| Stimulus {
        angular_rate: [0.0, 0.0, if seconds < 8.0 { 0.5 } else { 0.0 }],
        ..Stimulus::REST
    };
    let part = part(turns, ORDINARY);
    let mut bench = Bench::new(Settings::default());
    let mut reported = Vec::new();
    run(
        Run::default(),
        &part,
        &mut bench,
        9 * SECOND,
        |bench, _, _| {
            reported.extend(bench.emergencies());
        },
    );
    reported.retain(|emergency| emergency.fault == Some(Fault::GyroBias));
    let [raised, cleared] = reported[..] else {
        panic!("{reported:?}");
    };
    assert_eq!(raised.code, Fault::GyroBias.code());
    assert!(raised.detail.abs_diff(28_648) < 100, "{raised:?}");
    assert_eq!((cleared.code, cleared.detail), (0, 0));
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
        let options = PartOptions {
            accel_test_signal: [signal; 3],
            ..ORDINARY
        };
        let part = part(|_: f64| Stimulus::REST, options);
        let mut bench = Bench::new(Settings::default());
        let mut stages = Vec::new();
        let mut detail = 0;
        let mut frames = 0;
        let options = Run {
            self_test: true,
            ..Run::default()
        };
        run(options, &part, &mut bench, 4 * SECOND, |bench, _, _| {
            if stages.last() != Some(&bench.foot.stage()) {
                stages.push(bench.foot.stage());
            }
            frames += u32::from(bench.contact().is_some());
            for emergency in bench.emergencies() {
                detail = emergency.detail;
            }
        });
        assert_eq!(
            stages,
            [
                Stage::Starting,
                Stage::SelfTest,
                Stage::HoldStill,
                Stage::Running
            ]
        );
        assert!(
            frames >= 3998,
            "{frames} frames: the self-test held up the ticks"
        );
        assert_eq!(detail, failed);
        let status = bench.contact().expect("a frame").status;
        assert_eq!(status.is_valid(), failed == 0);
    }
}
