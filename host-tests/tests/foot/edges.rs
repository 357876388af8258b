//! A data-ready line that loses edges, and one that comes back with a sensor that runs at a wrong rate.

use crate::bench::{Action, Bench, MS, Run, SECOND, run, standing};
use estimator_core::Decision;
use firmware::sampling::ReadAt;
use lsm6dsox::sim::{Part, PartFault, SharedPart};
use wire::{Fault, Faults, Settings};

/// Time of the fault, ns: the foot stands and says "stable" by then.
const BEGIN: u64 = 1_500 * MS;

/// Observations from [`BEGIN`] on.
#[derive(Default)]
struct Seen {
    contacts: u32,
    valid: u32,
    stable: u32,
    restarts: u32,
    /// Time of the first tick without an edge, ns.
    missed: Option<u64>,
    /// Reports of faults and of their ends, with their times, ns.
    reports: Vec<(Fault, bool, u64)>,
    read_at: ReadAt,
    faults: Faults,
}

impl Seen {
    fn raised(&self, wanted: Fault) -> Vec<u64> {
        let raised = self.reports.iter();
        let raised = raised.filter(|(fault, is_raised, _)| *is_raised && *fault == wanted);
        raised.map(|(.., at)| *at).collect()
    }
}

fn watch(actions: &[Action<'_>], ns: u64) -> Seen {
    let part = standing();
    let options = Run {
        count_edges: true,
        actions,
        ..Run::default()
    };
    let mut bench = Bench::new(Settings::default());
    let mut seen = Seen::default();
    run(
        options,
        &part,
        &mut bench,
        ns,
        |bench, tick, measurement| {
            let now = part.now_ns();
            if now < BEGIN {
                return;
            }
            if tick.edge.is_none() {
                seen.missed.get_or_insert(now);
            }
            let status = bench.contact().expect("a contact each tick").status;
            seen.contacts += 1;
            seen.valid += u32::from(status.is_valid());
            seen.stable += u32::from(status.decision() == Decision::Stable);
            for emergency in bench.emergencies() {
                let fault = emergency.fault.expect("a fault");
                seen.reports.push((fault, emergency.code != 0, now));
            }
            seen.restarts = measurement.restarts;
            seen.read_at = measurement.read_at;
            seen.faults = bench.foot.faults();
        },
    );
    seen
}

#[test]
fn lost_edges_are_reported_and_survived() {
    for per_million in [
        200, 2_000, 10_000, 50_000, 200_000, 500_000, 800_000, 950_000,
    ] {
        for phase in 0..4 {
            let begin = BEGIN + phase * 113_313;
            let end = begin + 20 * SECOND;
            let lose = |part: &SharedPart| part.inject(PartFault::DataReadyLosses { per_million });
            let clear = |part: &SharedPart| part.with(Part::clear_faults);
            let seen = watch(&[(begin, &lose), (end, &clear)], end + 2 * SECOND);
            let case = format!("{per_million} in a million, phase {phase}");
            assert!(seen.restarts <= 2, "{case}: {} restarts", seen.restarts);
            let reported = seen.raised(Fault::DataReadyDead);
            // A few cost a sample of doubt each, and need no report.
            if per_million >= 10_000 {
                let (Some(missed), Some(first)) = (seen.missed, reported.first()) else {
                    panic!("{case}: {:?}", seen.reports);
                };
                let after_ms = first.saturating_sub(missed) / MS;
                println!(
                    "{case}: reported after {after_ms} ms, {} restarts",
                    seen.restarts
                );
                assert!(after_ms <= 500, "{case}: {:?}", seen.reports);
            }
            // The estimate goes on, but for a sample of doubt each second and two restarts.
            let doubtful = seen.contacts - seen.valid;
            assert!(doubtful <= 40 + 350 * seen.restarts, "{case}: {doubtful}");
            assert!(seen.contacts - seen.stable <= 1_500, "{case}");
            assert_eq!(
                (seen.read_at, seen.faults),
                (ReadAt::Edge, Faults::NONE),
                "{case}"
            );
        }
    }
}

#[test]
fn a_wrong_rate_on_a_line_that_is_back_is_reported() {
    for (wrong, seconds) in [
        (PartFault::ClockRatio(0.5), 3),
        (PartFault::ClockRatio(1.5), 3),
        (PartFault::DataReadyStorm { period_ns: 10_000 }, 3),
    ] {
        let back = BEGIN + SECOND;
        let end = back + seconds * SECOND;
        let lose = |part: &SharedPart| part.inject(PartFault::DataReadyLost);
        let return_wrong = |part: &SharedPart| {
            part.with(Part::clear_faults);
            part.inject(wrong);
        };
        let clear = |part: &SharedPart| part.with(Part::clear_faults);
        let actions: [Action<'_>; 3] = [(BEGIN, &lose), (back, &return_wrong), (end, &clear)];
        let seen = watch(&actions, end + 4 * SECOND);
        let reported = seen.raised(Fault::SensorTiming);
        assert!(
            matches!(reported[..], [at, ..] if at - back < 400 * MS),
            "{wrong:?}: {:?}",
            seen.reports
        );
        assert_eq!(
            (seen.read_at, seen.faults),
            (ReadAt::Edge, Faults::NONE),
            "{wrong:?}"
        );
        println!("{wrong:?}: {} restarts, {:?}", seen.restarts, seen.reports);
    }
}
