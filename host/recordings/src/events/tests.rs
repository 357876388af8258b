//! Events from synthetic estimates.

use super::*;
use estimator_core::{Flag, Flags, LinearAcceleration, Phase, Probabilities, Quaternion, Vec3};

/// Motion of a foot during some milliseconds.
#[derive(Clone, Copy)]
enum Does {
    Stands,
    /// Swings with this phase.
    Swings(Phase),
    /// Slides along the ground with this acceleration, m/s².
    Slides(Phase, f32),
    /// Rolls about its toe: the sensor moves along the ground, and the foot is inclined by 5°.
    Rolls,
    /// Moves up and down on the spot.
    Sinks,
    /// Moves unseen: the samples are unusable.
    Hides,
    /// The same with a load.
    HidesLoaded,
}

use Does::{Hides, HidesLoaded, Rolls, Sinks, Slides, Stands, Swings};

/// Phase without a load.
const NONE: Phase = Phase::Unknown;

fn estimate(does: Does, ms: u64) -> ContactEstimate {
    let (decision, phase, stable, tangential, vertical, along) = match does {
        Stands => (Decision::Stable, NONE, 0.95, 1.0, 1.0, 0.0),
        Swings(phase) => (Decision::NotStable, phase, 0.0, 0.0, 0.0, 5.0),
        Slides(phase, along) => (Decision::NotStable, phase, 0.1, 0.1, 0.9, along),
        Rolls => (Decision::NotStable, NONE, 0.1, 0.1, 0.9, 1.0),
        Sinks => (Decision::NotStable, Phase::Slip, 0.3, 0.95, 0.3, 0.0),
        Hides => (Decision::NotStable, NONE, 0.0, 0.0, 0.0, 0.0),
        HidesLoaded => (Decision::NotStable, Phase::Slip, 0.0, 0.0, 0.0, 0.0),
    };
    ContactEstimate {
        timestamp: Timestamp::from_micros(1000 * ms),
        probabilities: Probabilities {
            stable,
            tangential,
            vertical,
            ..Probabilities::default()
        },
        decision,
        phase,
        flags: match does {
            Hides | HidesLoaded => Flags::NONE.with(Flag::InvalidSample),
            _ => Flags::NONE,
        },
        orientation: match does {
            Rolls => Quaternion {
                w: 0.99905,
                x: 0.0,
                y: 0.04362,
                z: 0.0,
            },
            _ => Quaternion::IDENTITY,
        },
        linear_acceleration: LinearAcceleration(Vec3::new(0.6 * along, 0.8 * along, 0.3)),
        ..ContactEstimate::default()
    }
}

/// Returns the events of a sequence of motions, each with its duration in ms.
fn events(of: &[(u64, Does)]) -> Vec<ContactEvent> {
    let mut events = Events::default();
    let mut found = Vec::new();
    let each = of.iter().flat_map(|(ms, does)| (0..*ms).map(|_| *does));
    for (ms, does) in (0..).zip(each) {
        events.add(&estimate(does, ms));
        found.extend(std::iter::from_fn(|| events.pop()));
    }
    found.extend(events.finish());
    found
}

/// Returns name, time and duration in ms of each event.
fn said(of: &[(u64, Does)]) -> Vec<(&'static str, u64, Option<u64>)> {
    let ms = |micros: u64| micros / 1000;
    let say = |e: &ContactEvent| (e.kind.name(), ms(e.time.as_micros()), e.duration_us.map(ms));
    events(of).iter().map(say).collect()
}

#[test]
fn step_yields_touch_down_and_lift_off() {
    for swing in [Phase::Swing, NONE] {
        let step = [
            (300, Swings(swing)),
            (500, Stands),
            (300, Swings(swing)),
            (400, Stands),
        ];
        assert_eq!(
            said(&step),
            [
                ("touch_down", 300, Some(500)),
                ("lift_off", 800, Some(500)),
                ("touch_down", 1100, None)
            ]
        );
    }
}

#[test]
fn loaded_stance_without_stability_is_an_event() {
    let swing = Swings(Phase::Swing);
    let slides = Slides(Phase::Slip, 1.0);
    let slippery = [
        (200, slides),
        (300, Stands),
        (200, swing),
        // Two stances that slide throughout, a bounce, a landing.
        (250, slides),
        (200, swing),
        (150, slides),
        (200, swing),
        (60, slides),
        (200, swing),
        (150, slides),
        (400, Stands),
    ];
    assert_eq!(
        said(&slippery),
        [
            ("lift_off", 500, None),
            ("unstable_start", 700, Some(250)),
            ("unstable_end", 950, Some(250)),
            ("unstable_start", 1150, Some(150)),
            ("unstable_end", 1300, Some(150)),
            ("touch_down", 1910, None)
        ]
    );
}

#[test]
fn unusable_samples_make_no_unstable_stance() {
    let lost = [
        (300, Stands),
        (200, Swings(Phase::Swing)),
        (100, Slides(Phase::Slip, 1.0)),
        (1, HidesLoaded),
        (100, Slides(Phase::Slip, 1.0)),
        (200, Swings(Phase::Swing)),
    ];
    assert_eq!(said(&lost), [("lift_off", 300, None)]);
}

#[test]
fn standing_at_start_yields_no_touch_down() {
    let begins = [(180, Hides), (500, Stands), (300, Swings(NONE))];
    assert_eq!(said(&begins), [("lift_off", 680, None)]);
}

#[test]
fn slip_within_stance_has_distance() {
    let slip = [
        (300, Swings(NONE)),
        (100, Stands),
        (100, Slides(NONE, 2.0)),
        (100, Slides(NONE, -2.0)),
        (200, Stands),
        (300, Swings(NONE)),
    ];
    assert_eq!(
        said(&slip),
        [
            ("touch_down", 300, Some(500)),
            ("slip_start", 400, Some(200)),
            ("slip_end", 600, Some(200)),
            ("lift_off", 800, Some(500)),
        ]
    );
    let distances: Vec<_> = events(&slip).iter().map(|e| e.distance_m).collect();
    // Up to 0.2 m/s and back to rest in 0.2 s.
    assert!(
        matches!(distances[..], [None, Some(a), Some(b), None] if a == b && (a - 0.02).abs() < 5e-4),
        "{distances:?}"
    );
}

#[test]
fn constant_acceleration_error_adds_no_distance() {
    let biased = [
        (100, Stands),
        (100, Slides(NONE, 2.5)),
        (100, Slides(NONE, -1.5)),
        (100, Stands),
    ];
    let distance = events(&biased)[0].distance_m.unwrap();
    assert!((distance - 0.02).abs() < 5e-4, "{distance}");
}

#[test]
fn distance_is_blank_after_doubtful_sample() {
    let hidden = [
        (100, Stands),
        (100, Slides(NONE, 2.0)),
        (1, Hides),
        (100, Slides(NONE, -2.0)),
        (100, Stands),
    ];
    let found = events(&hidden);
    assert_eq!(
        (found.len(), found[0].distance_m, found[0].duration_us),
        (2, None, Some(201_000))
    );
}

#[test]
fn slip_ends_at_lift_off() {
    let lost = [
        (100, Stands),
        (200, Slides(Phase::Slip, 1.0)),
        (300, Swings(Phase::Swing)),
        (50, Stands),
    ];
    let slip = ("slip_start", 100, Some(200));
    let end = ("slip_end", 300, Some(200));
    assert_eq!(
        said(&lost),
        [
            slip,
            end,
            ("lift_off", 300, None),
            ("touch_down", 600, None)
        ]
    );
    let peeled = [
        (100, Stands),
        (60, Slides(Phase::Slip, 1.0)),
        (300, Swings(Phase::Swing)),
        (50, Stands),
    ];
    assert_eq!(
        said(&peeled),
        [("lift_off", 100, None), ("touch_down", 460, None)]
    );
}

#[test]
fn foot_that_rolls_off_about_its_toe_has_no_slip() {
    let stance = [(100, Stands), (30, Slides(NONE, 1.0)), (120, Rolls)];
    let rocks = [&stance[..], &[(100, Stands)]].concat();
    assert_eq!(said(&rocks), []);
    let lifts = [&stance[..], &[(300, Swings(NONE)), (50, Stands)]].concat();
    assert_eq!(
        said(&lifts),
        [("lift_off", 100, None), ("touch_down", 550, None)]
    );
}

#[test]
fn slide_before_a_roll_keeps_its_slip() {
    let slides = [
        (100, Stands),
        (150, Slides(NONE, 1.0)),
        (50, Rolls),
        (100, Stands),
    ];
    assert_eq!(
        said(&slides),
        [("slip_start", 100, Some(200)), ("slip_end", 300, Some(200))]
    );
}

#[test]
fn sinking_foot_has_no_event() {
    assert_eq!(said(&[(100, Stands), (200, Sinks), (100, Stands)]), []);
}

#[test]
fn short_shock_in_stance_is_not_a_swing() {
    let knocked = [(200, Stands), (50, Swings(NONE)), (200, Stands)];
    assert!(
        said(&knocked)
            .iter()
            .all(|(name, ..)| name.starts_with("slip")),
        "{:?}",
        said(&knocked)
    );
}

#[test]
fn duration_is_blank_if_stance_end_is_unseen() {
    let unseen = |hidden| {
        said(&[
            (300, Swings(NONE)),
            (300, Stands),
            (hidden, Hides),
            (300, Stands),
            (200, Swings(NONE)),
            (9, Stands),
        ])
    };
    assert_eq!(
        unseen(400),
        [
            ("touch_down", 300, None),
            ("lift_off", 1300, None),
            ("touch_down", 1500, None)
        ]
    );
    // A short gap is bridged.
    let bridged = unseen(20);
    assert_eq!(
        bridged[..2],
        [("touch_down", 300, Some(620)), ("lift_off", 920, Some(620))]
    );
}

#[test]
fn peak_is_that_of_the_stance_or_slip() {
    let slip = [
        (300, Swings(NONE)),
        (100, Stands),
        (100, Slides(NONE, 2.0)),
        (100, Stands),
        (300, Swings(NONE)),
    ];
    let peaks: Vec<_> = events(&slip).iter().map(|e| e.peak).collect();
    assert_eq!(peaks, [0.95, 0.1, 0.1, 0.95]);
}

#[test]
fn row_has_a_cell_for_every_header_name() {
    let event = ContactEvent {
        time: Timestamp::from_micros(1_500_000),
        kind: EventKind::SlipEnd,
        duration_us: Some(1_000_020),
        peak: 0.25,
        distance_m: Some(0.0123),
    };
    let row = |foot, event: &ContactEvent, start_us| {
        let mut bytes = Vec::new();
        write_event(foot, event, start_us, &mut bytes).unwrap();
        String::from_utf8(bytes).unwrap()
    };
    assert_eq!(
        row(None, &event, -2_000_000),
        "-0.500000,slip_end,1.000020,0.25,0.012300\n"
    );
    let blank = ContactEvent {
        kind: EventKind::TouchDown,
        duration_us: None,
        distance_m: None,
        ..event
    };
    assert_eq!(
        row(Some("a,b"), &blank, 0),
        "\"a,b\",1.500000,touch_down,,0.25,\n"
    );
    assert_eq!(
        row(None, &blank, 0).matches(',').count(),
        HEADER.matches(',').count()
    );
}
