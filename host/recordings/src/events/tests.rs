//! Events from synthetic estimates.

use super::*;
use estimator_core::{Flag, Flags, LinearAcceleration, Phase, Probabilities, Quaternion, Vec3};

/// Estimate of a foot that does this:
///
/// | letter | it |
/// |---|---|
/// | `s` | stands |
/// | `f`, `F` | swings; with a load signal |
/// | `a`, `b`, `+`, `-`, `L` | slides with 1, 2, 2.5 or −1.5 m/s², with 1 m/s² and a load |
/// | `c` | slides with −2 m/s² |
/// | `r` | rolls about its toe: the sensor moves along the ground, and the foot is inclined by 5° |
/// | `v` | moves up and down on the spot |
/// | `h`, `H` | moves unseen: the samples are unusable; with a load |
fn estimate(does: char, ms: u64) -> ContactEstimate {
    let (phase, [stable, tangential, vertical], along) = match does {
        's' => (Phase::Unknown, [0.95, 1.0, 1.0], 0.0),
        'f' => (Phase::Unknown, [0.0; 3], 5.0),
        'F' => (Phase::Swing, [0.0; 3], 5.0),
        'a' | 'r' => (Phase::Unknown, [0.1, 0.1, 0.9], 1.0),
        'b' => (Phase::Unknown, [0.1, 0.1, 0.9], 2.0),
        'c' => (Phase::Unknown, [0.1, 0.1, 0.9], -2.0),
        '+' => (Phase::Unknown, [0.1, 0.1, 0.9], 2.5),
        '-' => (Phase::Unknown, [0.1, 0.1, 0.9], -1.5),
        'L' => (Phase::Slip, [0.1, 0.1, 0.9], 1.0),
        'v' => (Phase::Slip, [0.3, 0.95, 0.3], 0.0),
        'h' => (Phase::Unknown, [0.0; 3], 0.0),
        'H' => (Phase::Slip, [0.0; 3], 0.0),
        _ => panic!("{does}"),
    };
    ContactEstimate {
        timestamp: Timestamp::from_micros(1000 * ms),
        probabilities: Probabilities { stable, tangential, vertical, ..Probabilities::default() },
        decision: match does {
            's' => Decision::Stable,
            _ => Decision::NotStable,
        },
        phase,
        flags: match does {
            'h' | 'H' => Flags::NONE.with(Flag::InvalidSample),
            _ => Flags::NONE,
        },
        orientation: match does {
            'r' => Quaternion { w: 0.99905, x: 0.0, y: 0.04362, z: 0.0 },
            _ => Quaternion::IDENTITY,
        },
        linear_acceleration: LinearAcceleration(Vec3::new(0.6 * along, 0.8 * along, 0.3)),
        ..ContactEstimate::default()
    }
}

/// Returns the events of a sequence such as `300f 500s`: durations in ms, and what the foot does.
fn events(of: &str) -> Vec<ContactEvent> {
    let each = of.split_whitespace().flat_map(|part| {
        let (ms, does) = part.split_at(part.len() - 1);
        (0..ms.parse().expect(part)).flat_map(move |_: u64| does.chars())
    });
    let mut events = Events::default();
    let mut found = Vec::new();
    for (ms, does) in (0..).zip(each) {
        events.add(&estimate(does, ms));
        found.extend(std::iter::from_fn(|| events.pop()));
    }
    found.extend(events.finish());
    found
}

/// Returns name, time in ms, and duration in ms of each event.
fn described(of: &str) -> String {
    let say = |event: &ContactEvent| {
        let (name, ms) = (event.kind.name(), event.time.as_micros() / 1000);
        let duration = event.duration_us.map(|us| format!(" {}", us / 1000));
        format!("{name} {ms}{}", duration.unwrap_or_default())
    };
    let described: Vec<String> = events(of).iter().map(say).collect();
    described.join(", ")
}

#[test]
fn motions_yield_events() {
    const STEP: &str = "touch_down 300 500, lift_off 800 500, touch_down 1100";
    const SLIPPERY: &str = "lift_off 500, unstable_start 700 250, unstable_end 950 250, \
        unstable_start 1150 150, unstable_end 1300 150, touch_down 1910";
    for (why, motions, expected) in [
        ("a step", "300F 500s 300F 400s", STEP),
        ("a step without a load", "300f 500s 300f 400s", STEP),
        (
            "two stances that slide throughout, a bounce, a landing",
            "200L 300s 200F 250L 200F 150L 200F 60L 200F 150L 400s",
            SLIPPERY,
        ),
        ("unusable samples make no unstable stance", "300s 200F 100L 1H 100L 200F", "lift_off 300"),
        ("it stands at the start", "180h 500s 300f", "lift_off 680"),
        (
            "a slip within a stance",
            "300f 100s 100b 100c 200s 300f",
            "touch_down 300 500, slip_start 400 200, slip_end 600 200, lift_off 800 500",
        ),
        (
            "a slip ends at the lift-off",
            "100s 200L 300F 50s",
            "slip_start 100 200, slip_end 300 200, lift_off 300, touch_down 600",
        ),
        ("a short one is the lift-off", "100s 60L 300F 50s", "lift_off 100, touch_down 460"),
        ("it rocks about its toe", "100s 30a 120r 100s", ""),
        ("it rolls off about its toe", "100s 30a 120r 300f 50s", "lift_off 100, touch_down 550"),
        ("a slide before a roll", "100s 150a 50r 100s", "slip_start 100 200, slip_end 300 200"),
        ("it sinks", "100s 200v 100s", ""),
        (
            "the end of the stance is unseen",
            "300f 300s 400h 300s 200f 9s",
            "touch_down 300, lift_off 1300, touch_down 1500",
        ),
        (
            "a short gap is bridged",
            "300f 300s 20h 300s 200f 9s",
            "touch_down 300 620, lift_off 920 620, touch_down 1120",
        ),
    ] {
        assert_eq!(described(motions), expected, "{why}");
    }
    // A short shock in the stance is not a swing.
    let knocked = events("200s 50f 200s");
    assert!(knocked.iter().all(|event| event.kind.name().starts_with("slip")));
}

#[test]
fn slip_has_a_distance_and_a_peak() {
    // Up to 0.2 m/s and back to rest in 0.2 s; then with a constant error of 0.5 m/s².
    for slip in ["100s 100b 100c 200s", "100s 100+ 100- 100s"] {
        let found = events(slip);
        let [Some(start), Some(end)] = [found[0].distance_m, found[1].distance_m] else {
            panic!("{found:?}");
        };
        assert!(start == end && (start - 0.02).abs() < 5e-4, "{start}");
    }
    let hidden = events("100s 100b 1h 100c 100s");
    assert_eq!(hidden.len(), 2);
    assert_eq!((hidden[0].distance_m, hidden[0].duration_us), (None, Some(201_000)));
    let stance = events("300f 100s 100b 100s 300f");
    let of = stance.iter().map(|event| (event.peak, event.distance_m.is_some()));
    let of: Vec<_> = of.collect();
    assert_eq!(of, [(0.95, false), (0.1, true), (0.1, true), (0.95, false)]);
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
    assert_eq!(row(None, &event, -2_000_000), "-0.500000,slip_end,1.000020,0.25,0.012300\n");
    let blank =
        ContactEvent { kind: EventKind::TouchDown, duration_us: None, distance_m: None, ..event };
    assert_eq!(row(Some("a,b"), &blank, 0), "\"a,b\",1.500000,touch_down,,0.25,\n");
    assert_eq!(row(None, &blank, 0).matches(',').count(), HEADER.matches(',').count());
}
