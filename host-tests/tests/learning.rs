//! Safety of learning: after any motion of the foot, the estimate is right again within ten steps of the walk; the
//! learnt values stay within their limits; and no sample in doubt is ever called stable.

use std::f32::consts::TAU;
use std::ops::Range;

use estimator_core::any::AnyParams;
use estimator_core::params::STANDARD_GRAVITY;
use estimator_core::{
    AngularRate, ContactEstimate, Decision, ImuSample, Learnt, Params, Saturation, SpecificForce,
    Validity, Vec3,
};
use gait::{Activity, FootState, GaitName, Ground, Plan, SensorParams, Simulation, simulate};
use host_tests::changed::{Chance, after, after_samples, changed};
use samples::estimate::estimates_and_learnt;
use samples::{Label, Recording};

/// Steps of the walk after which the estimate has to be right.
const STEPS: usize = 10;

/// Duration of the whole walk, s: ten steps of 0.9 s, and as many that are checked.
const WALK_SECONDS: f64 = 22.0;

/// Minimum duration of a good stance, s; shorter rests under load are ignored.
const SHORTEST_STANCE: f64 = 0.1;

/// Minimum share of a good stance with P > 0.5.
const OF_A_STANCE: f64 = 0.5;

/// Minimum share of a swing with P < 0.5.
const OF_A_SWING: f64 = 0.9;

/// Duration of the motion before the walk, s.
const MINUTES: f32 = 180.0;

/// Noise of the sensor, m/s² and rad/s.
const NOISE: (f32, f32) = (0.02, 0.0012);

fn walk() -> Simulation {
    let plan = Plan::steady(GaitName::Walk, Ground::Hard, WALK_SECONDS, 7);
    simulate(&plan, &SensorParams::LSM6DSOX, 7)
}

/// Specific force and angular rate at 1 kHz over a duration in s, from a function of time in s, with the sensor's
/// noise.
fn motion(
    seconds: f32,
    seed: u64,
    at: impl Fn(f32) -> (Vec3, Vec3),
) -> impl Iterator<Item = (Vec3, Vec3)> {
    let mut chance = Chance::new(seed);
    (0..(1000.0 * seconds) as u32).map(move |k| {
        // In f32, minutes at 1 kHz have a resolution of some hundredths of a millisecond.
        let (force, rate) = at((f64::from(k) * 1e-3) as f32);
        (force + chance.vector(NOISE.0), rate + chance.vector(NOISE.1))
    })
}

/// The ranges of samples for which a condition holds.
fn stretches<T>(items: &[T], holds: impl Fn(&T) -> bool) -> Vec<Range<usize>> {
    let mut stretches = Vec::new();
    let mut start = 0;
    for stretch in items.chunk_by(|a, b| holds(a) == holds(b)) {
        let range = start..start + stretch.len();
        start = range.end;
        if stretch.first().is_some_and(&holds) {
            stretches.push(range);
        }
    }
    stretches
}

/// Errors of the estimates of a walk from the eleventh step on; the last stance or swing may be cut off.
fn wrong(walk: &Simulation, estimates: &[ContactEstimate], steps: usize) -> Vec<String> {
    let swings = stretches(&walk.truth, |state: &FootState| state.activity == Activity::Swinging);
    let checked_from = swings[steps].start;
    let share = |range: &Range<usize>, holds: &dyn Fn(f32) -> bool| {
        let inside = &estimates[range.clone()];
        let count = inside.iter().filter(|e| holds(e.probabilities.stable));
        count.count() as f64 / inside.len() as f64
    };
    let mut wrong = Vec::new();
    for swing in swings.iter().filter(|swing| swing.start >= checked_from) {
        let found = share(swing, &|p| p < 0.5);
        if found <= OF_A_SWING {
            wrong.push(format!("swing at {} ms: P < 0.5 for {found:.2}", swing.start));
        }
    }
    let samples = &walk.recording.samples;
    let stances = stretches(samples, |sample| sample.label == Some(Label::Stable));
    let long = (SHORTEST_STANCE * f64::from(walk.recording.sample_rate)) as usize;
    for stance in stances {
        let found = share(&stance, &|p| p > 0.5);
        if stance.start >= checked_from && stance.len() >= long && found <= OF_A_STANCE {
            wrong.push(format!("stance at {} ms: P > 0.5 for {found:.2}", stance.start));
        }
    }
    wrong
}

fn assert_no_doubt_is_stable(name: &str, estimates: &[ContactEstimate]) {
    let doubtful = |e: &&ContactEstimate| e.flags.are_doubt() && e.decision == Decision::Stable;
    let found = estimates.iter().find(doubtful);
    assert_eq!(found, None, "{name}: in doubt and stable");
}

fn assert_can_be_learnt(name: &str, learnt: Learnt) {
    let params = Params { learnt: Some(learnt), ..Params::DEFAULT };
    assert_eq!(params.check(), Ok(()), "{name}: {learnt:?}");
}

/// Runs the estimator over the earlier motion and the walk, which is at the end of `recording`. Returns the errors
/// of [`wrong`].
fn walk_after(
    name: &str,
    recording: &Recording,
    walk: &Simulation,
    params: &AnyParams,
    steps: usize,
) -> Vec<String> {
    let before = recording.samples.len() - walk.recording.samples.len();
    if before > 0 {
        let mut first = recording.clone();
        first.samples.truncate(before);
        let (_, learnt) = estimates_and_learnt(&first, params, || ()).expect("valid parameters");
        println!("{name}: after what was before {learnt:.2?}");
        assert_can_be_learnt(name, learnt);
    }
    let (estimates, learnt) =
        estimates_and_learnt(recording, params, || ()).expect("valid parameters");
    assert_no_doubt_is_stable(name, &estimates);
    assert_can_be_learnt(name, learnt);
    let wrong = wrong(walk, &estimates[before..], steps).into_iter();
    wrong.map(|what| format!("{name}: {what}")).collect()
}

fn walk_after_motion(name: &str, before: impl IntoIterator<Item = (Vec3, Vec3)>) -> Vec<String> {
    let walk = walk();
    let recording = after(before, &walk.recording);
    walk_after(name, &recording, &walk, &AnyParams::DEFAULT, STEPS)
}

fn assert_nothing_wrong(wrong: &[String]) {
    assert!(wrong.is_empty(), "{wrong:#?}");
}

const UP: Vec3 = Vec3::new(0.0, 0.0, STANDARD_GRAVITY);

#[test]
fn a_foot_that_walks_at_once_is_estimated_correctly() {
    assert_nothing_wrong(&walk_after_motion("nothing before", []));
}

#[test]
fn a_walk_after_sliding_is_estimated_correctly() {
    // To and fro without a rest, once smoothly and once in stick-slip motion.
    let mut wrong = Vec::new();
    for (name, chatter) in [("ice", 0.0_f32), ("rubber", 3.0)] {
        let slide = motion(MINUTES, 1, |t| {
            let along = 0.6 * (TAU * 0.8 * t).sin() + chatter * (TAU * 45.0 * t).sin();
            (UP + Vec3::new(along, 0.3 * along, 0.0), Vec3::ZERO)
        });
        wrong.extend(walk_after_motion(&format!("slides on {name}"), slide));
    }
    assert_nothing_wrong(&wrong);
}

#[test]
fn a_walk_after_gentle_carrying_is_estimated_correctly() {
    let mut wrong = Vec::new();
    for strength in [0.3_f32, 1.0] {
        // Rolls by a fifth of a radian and is lifted and lowered.
        let carried = motion(MINUTES, 2, |t| {
            let (turns, lifts) = (TAU * 0.4, TAU * 1.1);
            let angle = 0.2 * strength * (turns * t).sin();
            let lifted = STANDARD_GRAVITY + 0.8 * strength * (lifts * t).sin();
            let force = Vec3::new(0.0, lifted * angle.sin(), lifted * angle.cos());
            let rate = 0.2 * strength * turns * (turns * t).cos();
            (force, Vec3::new(rate, 0.0, 0.0))
        });
        let name = format!("carried, strength {strength}");
        wrong.extend(walk_after_motion(&name, carried));
    }
    assert_nothing_wrong(&wrong);
}

#[test]
fn a_walk_after_lying_in_a_box_is_estimated_correctly() {
    let rest = motion(MINUTES, 3, |_| (Vec3::new(STANDARD_GRAVITY, 0.0, 0.0), Vec3::ZERO));
    assert_nothing_wrong(&walk_after_motion("in a box", rest));
}

#[test]
fn a_walk_after_ten_minutes_of_standing_is_right() {
    let stood = motion(600.0, 4, |_| (UP, Vec3::ZERO));
    assert_nothing_wrong(&walk_after_motion("stood", stood));
}

#[test]
fn a_walk_after_hanging_and_vibrating_is_right() {
    let mut wrong = Vec::new();
    let hertz = [12.0_f32, 12.0, 30.0, 30.0, 80.0, 80.0, 200.0];
    let amplitudes = [0.3_f32, 2.0, 1.0, 5.0, 2.0, 10.0, 4.0];
    for (hertz, amplitude) in hertz.into_iter().zip(amplitudes) {
        let hangs = motion(120.0, 5, |t| {
            let swing = (TAU * hertz * t).sin();
            let force = Vec3::new(amplitude * swing, 0.4 * amplitude * swing, 0.0);
            // On a lever of a tenth of a metre.
            let rate = 10.0 * amplitude / (TAU * hertz) * (TAU * hertz * t).cos();
            (UP + force, Vec3::new(0.0, rate, 0.0))
        });
        let name = format!("{hertz} Hz, {amplitude} m/s²");
        wrong.extend(walk_after_motion(&name, hangs));
    }
    assert_nothing_wrong(&wrong);
}

#[test]
fn a_walk_after_a_stuck_axis_is_estimated_correctly() {
    let long = Plan::steady(GaitName::Walk, Ground::Hard, MINUTES.into(), 8);
    let long = simulate(&long, &SensorParams::LSM6DSOX, 8).recording;
    let walk = walk();
    type Stick = fn(&mut ImuSample);
    let sticks: [(&str, usize, Stick); 4] = [
        ("ay at 0", STEPS, |imu| imu.specific_force.0.y = 0.0),
        ("ax at 20 m/s²", STEPS, |imu| imu.specific_force.0.x = 20.0),
        ("az at 0", STEPS, |imu| imu.specific_force.0.z = 0.0),
        // The resulting bias estimate decays within 10 s, and until then tilts the foot.
        ("wy at 1 rad/s", STEPS + 10, |imu| {
            imu.angular_rate.0.y = 1.0;
        }),
    ];
    let mut wrong = Vec::new();
    for (name, steps, stick) in sticks {
        let stuck = changed(&long, |sample| stick(&mut sample.imu));
        let before = stuck.samples.iter().map(|sample| sample.imu);
        let recording = after_samples(before, &walk.recording);
        wrong.extend(walk_after(name, &recording, &walk, &AnyParams::DEFAULT, steps));
    }
    assert_nothing_wrong(&wrong);
}

#[test]
fn a_walk_with_values_learnt_by_another_robot_is_right() {
    let walk = walk();
    let (_, own) = estimates_and_learnt(&walk.recording, &AnyParams::DEFAULT, || ())
        .expect("valid parameters");
    let mut wrong = Vec::new();
    for factor in [10.0_f32, 0.1] {
        let learnt = Learnt {
            still: own.still + factor.ln(),
            moving: own.moving + factor.ln(),
            speed: own.speed + factor.ln(),
            ..own
        };
        let params = Params { learnt: Some(learnt), ..Params::DEFAULT }.into();
        let name = format!("a warm start {factor} times as large");
        wrong.extend(walk_after(&name, &walk.recording, &walk, &params, STEPS));
    }
    assert_nothing_wrong(&wrong);
}

/// Samples of any bits and any validity.
fn garbage(samples: usize) -> impl Iterator<Item = ImuSample> {
    let mut chance = Chance::new(9);
    (0..samples).map(move |_| {
        let mut number = || match chance.bits() % 4 {
            0 => f32::from_bits(chance.bits() as u32),
            _ => 300.0 * (chance.even() as f32 - 0.5),
        };
        let force = Vec3::new(number(), number(), number());
        let rate = Vec3::new(number(), number(), number());
        let validity = match chance.bits() % 8 {
            0 => Validity::Stale,
            1 => Validity::Invalid,
            2 => Validity::Saturated(Saturation::Gyroscope),
            3 => Validity::Saturated(Saturation::Both),
            _ => Validity::Valid,
        };
        ImuSample {
            specific_force: SpecificForce(force),
            angular_rate: AngularRate(rate),
            validity,
            ..ImuSample::default()
        }
    })
}

#[test]
fn a_walk_after_garbage_and_saturation_is_right() {
    let walk = walk();
    let recording = after_samples(garbage(120_000), &walk.recording);
    let preset = AnyParams::DEFAULT;
    assert_nothing_wrong(&walk_after("garbage", &recording, &walk, &preset, STEPS));
    let saturated = ImuSample {
        specific_force: SpecificForce(Vec3::new(0.0, 0.0, 156.0)),
        validity: Validity::Saturated(Saturation::Accelerometer),
        ..ImuSample::default()
    };
    let before = std::iter::repeat_n(saturated, 120_000);
    let recording = after_samples(before, &walk.recording);
    assert_nothing_wrong(&walk_after("saturation", &recording, &walk, &preset, STEPS));
}
