//! Events of simulated walks against what really happened.

use estimator_core::Timestamp;
use firmware::imu::default_params;
use gait::slips::{SENSOR, profiles};
use gait::{Activity, FootState, GaitName, Ground, Plan, Simulation, Track, simulate};
use recordings::events::{Event, Events, Kind};
use recordings::recording::{Label, Recording};
use recordings::replay::Replay;

/// From rest under load to the decision, s: window and on-delay.
const DEBOUNCE: f64 = 0.06;

/// From the landing to rest under load, s.
const LANDING: f64 = 0.12;

fn events(recording: &Recording) -> Vec<Event> {
    let mut replay = Replay::new(recording.sample_rate, recording.gravity, &default_params())
        .expect("the preset");
    let mut events = Events::default();
    let mut found = Vec::new();
    for sample in &recording.samples {
        events.add(&replay.update(sample));
        found.extend(std::iter::from_fn(|| events.pop()));
    }
    found.extend(events.finish());
    assert!(found.is_sorted_by_key(|event| event.time.as_micros()));
    found
}

/// The walk as it is, and as a foot sees it that has no load signal.
fn with_and_without_load(simulation: &Simulation) -> [Recording; 2] {
    let mut alone = simulation.recording.clone();
    for sample in &mut alone.samples {
        sample.load = None;
    }
    [simulation.recording.clone(), alone]
}

fn seconds(time: Timestamp) -> f64 {
    time.as_micros() as f64 / 1.0e6
}

fn times(events: &[Event], kind: Kind) -> Vec<f64> {
    let of_kind = events.iter().filter(|event| event.kind == kind);
    of_kind.map(|event| seconds(event.time)).collect()
}

/// The steps of a gait on one ground.
fn steady(gait: GaitName, ground: Ground, seed: u64) -> (Plan, Simulation) {
    let plan = Plan::steady(gait, ground, 20.0, seed);
    let simulation = simulate(&plan, &SENSOR, seed);
    (plan, simulation)
}

/// When the foot is at rest under load for the first time after each of the impacts, as the labels say.
fn rests(plan: &Plan, simulation: &Simulation) -> Vec<f64> {
    let samples = &simulation.recording.samples;
    let stable_after = |impact: f64| {
        let mut after = samples.iter().filter(|sample| sample.time_s() > impact);
        let rest = after.find(|sample| sample.label == Some(Label::Stable))?;
        (rest.time_s() < impact + LANDING).then(|| rest.time_s())
    };
    Track::new(plan)
        .impacts()
        .filter_map(stable_after)
        .collect()
}

#[test]
fn every_touch_down_has_one_event_within_the_debounce_and_no_other_is_there() {
    for gait in [GaitName::Walk, GaitName::Trot, GaitName::Run] {
        for seed in 1..4 {
            let (plan, simulation) = steady(gait, Ground::Hard, seed);
            let rests = rests(&plan, &simulation);
            assert!(rests.len() > 15, "{gait}: {}", rests.len());
            for recording in with_and_without_load(&simulation) {
                let events = events(&recording);
                let found = times(&events, Kind::TouchDown);
                assert_eq!(found.len(), rests.len(), "{gait}, seed {seed}");
                for (rest, event) in rests.iter().zip(&found) {
                    let late = event - rest;
                    assert!((-0.01..DEBOUNCE).contains(&late), "{gait}, {rest}: {late}");
                }
                assert!(
                    times(&events, Kind::SlipStart).is_empty(),
                    "{gait}, seed {seed}"
                );
            }
        }
    }
}

#[test]
fn every_lift_off_has_one_event_while_the_foot_peels_off() {
    for gait in [GaitName::Walk, GaitName::Trot, GaitName::Run] {
        let (_, simulation) = steady(gait, Ground::Hard, 5);
        let truth = simulation.truth.iter().zip(&simulation.recording.samples);
        let peels: Vec<_> = truth
            .filter(|(state, _)| state.activity == Activity::Peeling)
            .map(|(_, sample)| sample.time_s())
            .collect();
        let peels: Vec<_> = peels.chunk_by(|a, b| b - a < 0.01).collect();
        for recording in with_and_without_load(&simulation) {
            let found = times(&events(&recording), Kind::LiftOff);
            assert_eq!(found.len(), peels.len(), "{gait}");
            for (peel, event) in peels.iter().zip(found) {
                let (start, end) = (peel[0], peel[peel.len() - 1]);
                assert!(
                    (start - 0.03..end).contains(&event),
                    "{gait}: {event}, {start}"
                );
            }
        }
    }
}

#[test]
fn soft_ground_that_gives_way_is_no_slip() {
    for gait in [GaitName::Walk, GaitName::Trot] {
        let (plan, simulation) = steady(gait, Ground::Soft, 3);
        for recording in with_and_without_load(&simulation) {
            let events = events(&recording);
            assert!(times(&events, Kind::SlipStart).is_empty(), "{gait}");
            let track = Track::new(&plan);
            let impacts = track.impacts().filter(|t| t + 0.2 < plan.duration);
            assert_eq!(
                times(&events, Kind::TouchDown).len(),
                impacts.count(),
                "{gait}"
            );
        }
    }
}

#[test]
fn a_foot_that_stands_has_no_events() {
    let (_, simulation) = steady(GaitName::Stand, Ground::Hard, 1);
    for recording in with_and_without_load(&simulation) {
        assert_eq!(events(&recording), []);
    }
}

/// One slip of the truth: from when to when, s, and how far, m.
struct TrueSlip {
    from: f64,
    to: f64,
    distance: f64,
}

fn true_slips(simulation: &Simulation) -> Vec<TrueSlip> {
    let samples = &simulation.recording.samples;
    let slides = |state: &FootState| state.activity == Activity::Slipping;
    let mut slips = Vec::new();
    let mut start = 0;
    for run in simulation.truth.chunk_by(|a, b| slides(a) == slides(b)) {
        let end = start + run.len();
        if slides(&run[0]) && end < samples.len() {
            slips.push(TrueSlip {
                from: samples[start].time_s(),
                to: samples[end].time_s(),
                distance: run[run.len() - 1].slip - run[0].slip,
            });
        }
        start = end;
    }
    slips
}

#[test]
fn slips_are_found_with_their_distance() {
    let mut errors = Vec::new();
    let (mut slips, mut found_alone, mut split, mut extra) = (0, 0, 0, 0);
    for (seed, profile) in (1000..).zip(profiles()).step_by(3) {
        let simulation = profile.simulate(12.0, seed);
        let truth = true_slips(&simulation);
        for recording in with_and_without_load(&simulation) {
            let events = events(&recording);
            let found: Vec<_> = events
                .iter()
                .filter(|e| e.kind == Kind::SlipStart)
                .collect();
            let overlaps = |slip: &TrueSlip, event: &Event| {
                let start = seconds(event.time);
                let end = start + event.duration_us.unwrap_or(0) as f64 / 1.0e6;
                start < slip.to + 0.03 && slip.from < end
            };
            extra += found
                .iter()
                .filter(|event| !truth.iter().any(|slip| overlaps(slip, event)))
                .count();
            for slip in &truth {
                slips += 1;
                let of_slip: Vec<_> = found.iter().filter(|event| overlaps(slip, event)).collect();
                match of_slip[..] {
                    [] => {}
                    [event] => {
                        found_alone += 1;
                        if let Some(distance) = event.distance_m {
                            errors.push((profile.speed, slip.distance, distance - slip.distance));
                        }
                    }
                    _ => split += 1,
                }
            }
        }
    }
    println!("{slips} slips, {found_alone} alone, {split} split, {extra} extra");
    for speed in gait::slips::SPEEDS {
        let mut of: Vec<_> = errors
            .iter()
            .filter(|(s, ..)| *s == speed)
            .map(|(_, d, e)| (e.abs(), *d, *e))
            .collect();
        of.sort_by(|a, b| a.0.total_cmp(&b.0));
        let at = |q: f64| of[(q * (of.len() - 1) as f64) as usize].0 * 1e3;
        println!(
            "{speed}: {} median {:.2} 90% {:.2} worst {:.2} of {:.1}..{:.1} mean signed {:.2}",
            of.len(),
            at(0.5),
            at(0.9),
            at(1.0),
            1e3 * of.iter().map(|x| x.1).fold(f64::INFINITY, f64::min),
            1e3 * of.iter().map(|x| x.1).fold(0.0, f64::max),
            1e3 * of.iter().map(|x| x.2).sum::<f64>() / of.len() as f64
        );
    }
}
