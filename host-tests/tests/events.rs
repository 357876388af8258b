//! scratch
use firmware::imu::default_params;
use gait::slips::profiles;
use gait::{GaitName, Ground, Plan, SensorParams, Simulation, Track, simulate};
use recordings::events::*;
use recordings::recording::Recording;
use recordings::replay::replay;

fn events(recording: &Recording) -> Vec<Event> {
    let est = replay(recording, &default_params()).unwrap();
    let mut events = Events::default();
    let mut found = vec![];
    for e in &est {
        events.add(e);
        while let Some(e) = events.pop() {
            found.push(e);
        }
    }
    found.extend(events.finish());
    assert!(found.is_sorted_by_key(|e| e.time.as_micros()));
    found
}

fn show(plan: &Plan, sim: &Simulation) {
    for load in [true, false] {
        let mut rec = sim.recording.clone();
        if !load {
            for s in &mut rec.samples {
                s.load = None;
            }
        }
        println!("== {} load {load}", sim.recording.name);
        let ev = events(&rec);
        let impacts: Vec<f64> = Track::new(plan).impacts().collect();
        println!(
            "impacts {} of {:?}",
            impacts.iter().filter(|t| **t < plan.duration).count(),
            impacts
                .iter()
                .map(|t| (t * 1e3).round())
                .collect::<Vec<_>>()
        );
        for e in &ev {
            let k = rec
                .samples
                .partition_point(|s| s.imu.timestamp.as_micros() < e.time.as_micros());
            let t = sim.truth[k];
            println!(
                "{:9.3} {:10} {:?} {:.2} {:?} true {:?}",
                e.time.as_micros() as f64 / 1e6,
                e.kind.name(),
                e.duration_us.map(|d| d as f64 / 1e3),
                e.peak,
                e.distance_m.map(|d| (d * 1e4).round() / 10.0),
                (t.slip * 1e4).round() / 10.0
            );
        }
    }
}

#[test]
fn scratch() {
    for k in 1..3 {
        show(
            &Plan::demo(k),
            &simulate(&Plan::demo(k), &SensorParams::LSM6DSOX_WARMING, k),
        );
    }
    for gait in [GaitName::Walk, GaitName::Trot, GaitName::Run] {
        for ground in [Ground::Hard, Ground::Soft, Ground::Greased] {
            let p = Plan::steady(gait, ground, 12.0, 3);
            show(&p, &simulate(&p, &SensorParams::LSM6DSOX_WARMING, 3));
        }
    }
    for (k, p) in profiles().enumerate() {
        if k % 17 == 0 {
            println!("{p:?}");
            show(
                &p.plan(12.0, 1000 + k as u64),
                &p.simulate(12.0, 1000 + k as u64),
            );
        }
    }
}
