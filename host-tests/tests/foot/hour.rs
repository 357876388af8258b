//! A minute and an hour of walking in virtual time.

use crate::bench::{Bench, MS, Run, SECOND, part, run};
use estimator_core::Decision;
use gait::sensor::felt_by;
use gait::{Activity, GaitName, Ground, Plan, SensorParams, Track};
use lsm6dsox::sim::Stimulus;
use wire::pdo::Unwrapper;
use wire::uart::Message;
use wire::{Counter, Faults, Settings, Stage};

/// Duration of the repeated walk, s; in the first two seconds the foot stands.
const WALK: f64 = 20.0;

/// Sensor ticks per second.
const RATE: f64 = 20_000.0 / 3.0;

/// An endlessly repeated walk: the sensor's input and whether the foot is in the air, at a time in s.
struct Walking {
    felt: Vec<(Stimulus, Activity)>,
}

impl Walking {
    fn new() -> Self {
        let motion = Track::new(&Plan::steady(GaitName::Walk, Ground::Hard, WALK, 1));
        let felt = (0..(WALK * RATE) as usize).map(|tick| {
            let foot = motion.at(tick as f64 / RATE);
            (felt_by(&foot, 25.0), foot.activity)
        });
        Self {
            felt: felt.collect(),
        }
    }

    fn at(&self, seconds: f64) -> (Stimulus, Activity) {
        self.felt[(seconds * RATE) as usize % self.felt.len()]
    }
}

#[test]
fn a_minute_of_walking_has_no_gaps() {
    assert_no_gaps(60 * SECOND);
}

#[test]
#[ignore = "full: an hour of a walk"]
fn an_hour_of_walking_has_no_gaps() {
    assert_no_gaps(3600 * SECOND);
}

/// Walks for a duration: each tick has its frames, and nothing is counted.
fn assert_no_gaps(duration: u64) {
    let walking = Walking::new();
    let truth = Walking::new();
    let part = part(
        move |seconds: f64| walking.at(seconds).0,
        SensorParams::LSM6DSOX.specimen(1),
    );
    let mut bench = Bench::new(Settings::default());
    let mut frames = 0_u64;
    let mut last: Option<u8> = None;
    let mut unwrapper = Unwrapper::default();
    let mut times: Option<(u64, u64)> = None;
    let (mut stable, mut stable_in_the_air, mut contacts) = (0_u64, 0_u64, 0_u64);
    run(
        Run::default(),
        &part,
        &mut bench,
        duration,
        |bench, tick, _| {
            let contact = bench.contact().expect("a contact frame each tick");
            frames += 1;
            if let Some(last) = last.replace(contact.sequence) {
                assert_eq!(contact.sequence, last.wrapping_add(1), "frame {frames}");
            }
            let micros = unwrapper.unwrap(contact.timestamp);
            let (first, previous) = *times.get_or_insert((micros, micros));
            if frames > 1 {
                let since = micros - previous;
                assert!(
                    (830..=1170).contains(&since),
                    "{since} µs to frame {frames}"
                );
            }
            times = Some((first, micros));
            contacts += bench
                .uart
                .iter()
                .filter(|m| matches!(m, Message::Contact(_)))
                .count() as u64;
            if contact.status.decision() == Decision::Stable {
                stable += 1;
                let (_, activity) = truth.at(tick.time.as_micros() as f64 * 1.0e-6);
                stable_in_the_air += u64::from(activity == Activity::Swinging);
            }
            if frames > 2000 {
                assert_eq!(bench.foot.faults(), Faults::NONE);
                assert_eq!(bench.foot.stage(), Stage::Running);
            }
        },
    );
    let ticks = duration / MS - 1;
    assert!(frames >= ticks - 1, "{frames} frames in {ticks} ticks");
    assert_eq!(contacts, frames, "messages on the UART");
    assert_eq!(bench.uart_missing(), 0);
    let counters = *bench.foot.counters();
    let count = |counter: Counter| u64::from(counters.get(counter));
    assert_eq!(count(Counter::Ticks), frames);
    for never in [
        Counter::SensorRestarts,
        Counter::CanDropped,
        Counter::UartDropped,
        Counter::LateTicks,
    ] {
        assert_eq!(count(never), 0, "{}", never.name());
    }
    // While the sensor starts, 10 ms of boot and 80 of turn-on, there are no samples; afterwards there is one per
    // tick.
    assert!(count(Counter::MissedSamples) < 95, "{counters:?}");
    let share = stable as f64 / frames as f64;
    println!(
        "{frames} ticks, {} valid and {} saturated samples, stable in {:.1} %, of which {:.3} % in the air",
        count(Counter::ValidSamples),
        count(Counter::SaturatedSamples),
        100.0 * share,
        100.0 * stable_in_the_air as f64 / stable as f64,
    );
    assert!((0.2..0.8).contains(&share), "{share}");
    assert!(stable_in_the_air * 1000 < stable, "{stable_in_the_air}");
}
