//! Conversion of a step into its three segments: peel, swing, stance.

use crate::jet::Jet;
use crate::segment::{
    CHANNELS, Change, Kind, LoadProfile, PITCH, Pose, ROLL, Segment, X, Y, YAW, Z,
};
use crate::shape::{Quintic, Shape, Term};
use crate::step::{PlannedStep, Slip, Spring};

/// Time constants after which a ring has ended: e⁻¹⁰ of 25 g is 0.01 m/s², less than the noise.
const RING_TIME_CONSTANTS: f64 = 10.0;

/// Share of its rings after which a landing is over: e⁻⁵ and the shape's own fading leave a thousandth of the
/// landing's speed.
const LANDING_SHARE: f64 = 0.5;

/// Foot pitch in rad and its rate at the end of the peel: a heel that rolls off as the swing takes over.
const PEEL_PITCH: Jet = Jet::moving(0.04, 1.5);

/// Sensor height in m and its rate at the end of the peel.
const PEEL_HEIGHT: Jet = Jet::moving(0.003, 0.15);

/// Load on a foot while the robot stands on all four, N: a quarter of a GO1's 12 kg.
const STANDING_LOAD: f64 = 29.4;

/// Share of a ripple's amplitude that one period reaches under its envelope.
const ONE_PERIOD_PEAK: f64 = 0.56;

/// Share of stick-slip that acts vertically: the contact force dips whenever the foot lets go.
const VERTICAL_CHATTER: f64 = 1.0 / 3.0;

/// Stands still at the origin and level, from time 0 until the step `next` begins at `until` in s.
pub(crate) fn standing_still(until: f64, next: Option<&PlannedStep>) -> Segment {
    Segment {
        kind: Kind::Stance { settled: f64::NEG_INFINITY, slips: Vec::new() },
        start: 0.0,
        base: [Quintic::rest(0.0); CHANNELS],
        terms: Vec::new(),
        load: Some(LoadProfile {
            level: STANDING_LOAD,
            rise: Change::ALREADY,
            fall: unloading(until, next),
        }),
    }
}

/// Returns the segments of `step` from time `start` in s on, after the stance `before`; the step `next` determines
/// how the load decreases at the end.
pub(crate) fn stride(
    before: &Segment,
    start: f64,
    step: &PlannedStep,
    next: Option<&PlannedStep>,
) -> [Segment; 3] {
    let stood_at = before.pose(start);
    let (peel, lifted) = peel(step, start, &stood_at, before.load);
    let lift_off = start + step.peel;
    let (swing, landed) = swing(step, lift_off, &lifted, &stood_at);
    let touch_down = lift_off + step.swing;
    [peel, swing, stance(step, touch_down, &landed, next)]
}

/// Decrease of the load before the lift-off of the step `next`, whose peel begins at `peel_start`: much of it is
/// gone before the foot moves.
fn unloading(peel_start: f64, next: Option<&PlannedStep>) -> Change {
    next.map_or(Change::NEVER, |next| Change {
        start: peel_start + next.peel - next.load_change,
        duration: next.load_change,
    })
}

fn peel(
    step: &PlannedStep,
    start: f64,
    stood_at: &Pose,
    load: Option<LoadProfile>,
) -> (Segment, Pose) {
    let mut lifted = *stood_at;
    lifted[PITCH] += PEEL_PITCH;
    lifted[Z] += PEEL_HEIGHT;
    let segment = Segment {
        kind: Kind::Peel,
        start,
        base: paths(stood_at, &lifted, start, step.peel),
        terms: Vec::new(),
        load,
    };
    (segment, lifted)
}

fn swing(step: &PlannedStep, start: f64, lifted: &Pose, stood_at: &Pose) -> (Segment, Pose) {
    let duration = step.swing;
    let landing = &step.touch_down;
    let [roll, pitch, yaw] = step.tilt;
    let landed = [
        Jet::moving(stood_at[X].value + step.travel[0], landing.scuff[0]),
        Jet::moving(stood_at[Y].value + step.travel[1], landing.scuff[1]),
        // A foot that sank in leaves the hollow behind.
        Jet::moving(0.0, -landing.speed),
        Jet::moving(roll, landing.turn[0]),
        Jet::moving(pitch, landing.turn[1]),
        Jet::constant(yaw),
    ];
    let lift = Shape::Pulse { height: step.clearance };
    let pitching = Shape::Ripple {
        amplitude: step.pitch_swing / ONE_PERIOD_PEAK,
        angular_frequency: std::f64::consts::TAU / duration,
        phase: 0.0,
    };
    let segment = Segment {
        kind: Kind::Swing,
        start,
        base: paths(lifted, &landed, start, duration),
        terms: vec![
            (Z, Term::new(start, duration, lift)),
            (PITCH, Term::new(start, duration, pitching)),
        ],
        load: None,
    };
    (segment, landed)
}

fn stance(step: &PlannedStep, start: f64, landed: &Pose, next: Option<&PlannedStep>) -> Segment {
    let standing = step.standing();
    let landing = &step.touch_down;
    let springs = [
        (X, landing.tangential),
        (Y, landing.tangential),
        (Z, landing.vertical),
        (ROLL, landing.rotational),
        (PITCH, landing.rotational),
    ];
    let mut settled = start;
    let mut terms = Vec::new();
    for (channel, spring) in springs {
        let ring = ring(landed[channel].rate, spring, start, standing);
        settled = settled.max(start + LANDING_SHARE * ring.duration);
        terms.push((channel, ring));
    }
    if let Some(sinking) = step.sinking {
        let duration = sinking.duration.min(standing);
        settled = settled.max(start + duration);
        let [roll, pitch] = sinking.lean;
        for (channel, distance) in [(Z, -sinking.depth), (ROLL, roll), (PITCH, pitch)] {
            let shape = Shape::Slide { distance };
            terms.push((channel, Term::new(start, duration, shape)));
        }
    }
    terms.extend(tremor(step, start, standing));
    for slip in &step.slips {
        terms.extend(slide(slip, start));
    }
    Segment {
        kind: Kind::Stance { settled, slips: step.slips.clone() },
        start,
        base: landed.map(|channel| Quintic::rest(channel.value)),
        terms,
        load: Some(LoadProfile {
            level: step.load,
            rise: Change { start, duration: step.load_change },
            fall: unloading(start + standing, next),
        }),
    }
}

fn paths(from: &Pose, to: &Pose, start: f64, duration: f64) -> [Quintic; CHANNELS] {
    std::array::from_fn(|channel| Quintic::between(from[channel], to[channel], start, duration))
}

fn ring(speed: f64, spring: Spring, start: f64, at_most: f64) -> Term {
    let natural = std::f64::consts::TAU * spring.frequency;
    let decay = spring.damping * natural;
    Term {
        start,
        duration: at_most.min(RING_TIME_CONSTANTS / decay),
        shape: Shape::Ring {
            speed,
            angular_frequency: natural * libm::sqrt(1.0 - spring.damping * spring.damping),
            decay,
        },
    }
}

/// Returns a sine with its own phase for every axis that trembles.
fn tremor(step: &PlannedStep, start: f64, duration: f64) -> [(usize, Term); 5] {
    let angular_frequency = std::f64::consts::TAU * step.tremor.frequency;
    let length = step.tremor.acceleration / (angular_frequency * angular_frequency);
    let angle = step.tremor.rate / angular_frequency;
    let parts = [
        (X, length, 0.0),
        (Y, length, 1.3),
        (Z, length, 2.6),
        (ROLL, angle, 0.7),
        (PITCH, angle, 2.0),
    ];
    parts.map(|(channel, amplitude, phase)| {
        let shape = Shape::Ripple { amplitude, angular_frequency, phase };
        (channel, Term::new(start, duration, shape))
    })
}

/// Slide of a foot in contact since touch-down at `touch_down`.
fn slide(slip: &Slip, touch_down: f64) -> [(usize, Term); 6] {
    let (sin, cos) = libm::sincos(slip.heading);
    let angular_frequency = std::f64::consts::TAU * slip.chatter_frequency;
    let chatter = slip.chatter / (angular_frequency * angular_frequency);
    let ripple = |amplitude| Shape::Ripple { amplitude, angular_frequency, phase: 0.0 };
    let along = |distance| Shape::Slide { distance };
    let parts = [
        (X, along(slip.distance * cos)),
        (Y, along(slip.distance * sin)),
        (YAW, along(slip.twist)),
        (X, ripple(chatter * cos)),
        (Y, ripple(chatter * sin)),
        (Z, ripple(chatter * VERTICAL_CHATTER)),
    ];
    parts.map(|(channel, shape)| {
        let start = touch_down + slip.onset;
        (channel, Term::new(start, slip.duration, shape))
    })
}
