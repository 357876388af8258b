//! Attacks on what the default preset promises, by a foot of their own: closed forms, and nothing of
//! `footfall::gait`. A test that fails today says so, with the number that was measured.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;

use estimator_core::stillness::Classes;
use estimator_core::{
    AngularRate, ContactEstimate, ContactEstimator, Decision, Flag, Gravity, ImuSample, Learning,
    Learnt, Params, Probabilities, Saturation, SpecificForce, Timestamp, Validity, Vec3,
};
use footfall::input::{Format, Hints, read};
use footfall::replay::replay;
use host_tests::changed::Chance;

const GRAVITY: f64 = 9.806_65;

/// Noise of the sensor, m/s² and rad/s.
const NOISE: (f64, f64) = (0.02, 0.0012);

/// A stance is checked from so long after its touchdown, s, when no ringing of it is left.
const SETTLED: f64 = 0.12;

/// Of a swing its first moments are left out, s: a probability needs some to fall.
const LIFTED: f64 = 0.015;

/// Steps after which a foot has to be told right again.
const STEPS: f64 = 10.0;

/// A gait in the sagittal plane. It begins with a touchdown.
#[derive(Clone, Copy, Debug)]
struct Gait {
    /// Duration of a stride, s.
    stride: f64,
    /// Share of it that is stance.
    duty: f64,
    /// Length and height of a step, m.
    length: f64,
    height: f64,
    /// How far the foot pitches in its swing, rad.
    pitch: f64,
    /// What a landing begins to ring with, m/s², at which frequency, Hz, and how soon it fades, s.
    impact: f64,
    ring: f64,
    fade: f64,
    /// What the stances shake with, m/s², and at which frequency, Hz.
    shake: f64,
    shake_hertz: f64,
    /// Where in the stride it begins, 0 to 1.
    phase: f64,
}

impl Gait {
    /// At a person's pace.
    const WALK: Self = Self {
        stride: 0.9,
        duty: 0.6,
        length: 0.5,
        height: 0.08,
        pitch: 0.4,
        impact: 40.0,
        ring: 60.0,
        fade: 0.012,
        shake: 0.15,
        shake_hertz: 17.0,
        phase: 0.0,
    };

    /// The same steps in less time.
    const TROT: Self = Self {
        stride: 0.6,
        ..Self::WALK
    };

    /// Stands all the time.
    const STANDING: Self = Self {
        duty: 1.0,
        impact: 0.0,
        shake: 0.0,
        ..Self::WALK
    };

    /// Time since touchdown, or since lift-off, at a time in s.
    fn part(&self, time: f64) -> Part {
        let phase = (time / self.stride + self.phase).rem_euclid(1.0);
        if phase < self.duty {
            Part::Stance(phase * self.stride)
        } else {
            Part::Swing((phase - self.duty) * self.stride)
        }
    }

    /// Acceleration forwards and upwards, m/s²; pitch, rad, and its rate, rad/s.
    fn motion(&self, time: f64) -> (f64, f64, f64, f64) {
        match self.part(time) {
            Part::Stance(since) => {
                let landing = self.impact * (-since / self.fade).exp();
                let shake = TAU * self.shake_hertz * time;
                (
                    0.6 * landing * (0.8 * TAU * self.ring * since).sin()
                        + 0.5 * self.shake * shake.sin(),
                    landing * (TAU * self.ring * since).cos() + self.shake * (1.3 * shake).cos(),
                    0.0,
                    0.0,
                )
            }
            Part::Swing(since) => {
                let swing = self.stride * (1.0 - self.duty);
                let turn = TAU * since / swing;
                let pitch = |turn: f64| 0.5 * self.pitch * (1.0 - turn.cos()) * (0.5 * turn).cos();
                let step = 1.0e-5;
                let rate = (pitch(turn + step) - pitch(turn - step)) / (2.0 * step) * TAU / swing;
                (
                    self.length * TAU / (swing * swing) * turn.sin(),
                    0.5 * self.height * (TAU / swing).powi(2) * turn.cos(),
                    pitch(turn),
                    rate,
                )
            }
        }
    }
}

/// What a foot does, and since when, s.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Part {
    Stance(f64),
    Swing(f64),
}

/// What the sensor measured, and what the foot did.
#[derive(Clone, Copy, Debug)]
struct Sample {
    time: f64,
    force: [f64; 3],
    rate: [f64; 3],
    part: Part,
}

/// A foot's samples, with the sensor's noise; each is the mean over its period.
fn measured(gait: &Gait, rate: f64, seconds: f64, gravity: Gravity) -> Vec<Sample> {
    let mut chance = Chance::new(7);
    let instants = (8000.0 / rate).max(4.0) as usize;
    let down = match gravity {
        Gravity::Included => GRAVITY,
        Gravity::Removed => 0.0,
    };
    (0..(seconds * rate) as usize)
        .map(|k| {
            let (mut force, mut turn) = ([0.0; 3], 0.0);
            for instant in 0..instants {
                let time = (k as f64 + (instant as f64 + 0.5) / instants as f64) / rate;
                let (along, up, pitch, pitch_rate) = gait.motion(time);
                let (sine, cosine) = pitch.sin_cos();
                force[0] += cosine * along - sine * (up + down);
                force[2] += sine * along + cosine * (up + down);
                turn += pitch_rate;
            }
            let share = 1.0 / instants as f64;
            let mut noisy = |value: f64, noise: f64| value * share + noise * chance.gaussian();
            let time = (k + 1) as f64 / rate;
            Sample {
                time,
                force: force.map(|value| noisy(value, NOISE.0)),
                rate: [0.0, turn, 0.0].map(|value| noisy(value, NOISE.1)),
                part: gait.part(time),
            }
        })
        .collect()
}

/// With a bias of the accelerometer, m/s², and of the gyroscope, rad/s.
fn biased(samples: &[Sample], force: [f64; 3], rate: [f64; 3]) -> Vec<Sample> {
    let mut samples = samples.to_vec();
    for sample in &mut samples {
        for axis in 0..3 {
            sample.force[axis] += force[axis];
            sample.rate[axis] += rate[axis];
        }
    }
    samples
}

/// Of a sensor that is mounted turned about an axis, by an angle in rad.
fn mounted(samples: &[Sample], axis: [f64; 3], angle: f64) -> Vec<Sample> {
    let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    let [x, y, z] = axis.map(|x| x / length);
    let (sine, cosine) = angle.sin_cos();
    let turned = |v: [f64; 3]| {
        let along = (v[0] * x + v[1] * y + v[2] * z) * (1.0 - cosine);
        let cross = [
            y * v[2] - z * v[1],
            z * v[0] - x * v[2],
            x * v[1] - y * v[0],
        ];
        let axis = [x, y, z];
        std::array::from_fn(|k| v[k] * cosine + cross[k] * sine + axis[k] * along)
    };
    let mut samples = samples.to_vec();
    for sample in &mut samples {
        sample.force = turned(sample.force);
        sample.rate = turned(sample.rate);
    }
    samples
}

fn vector(values: [f64; 3]) -> Vec3 {
    let [x, y, z] = values.map(|value| value as f32);
    Vec3::new(x, y, z)
}

fn params(rate: f64, gravity: Gravity) -> Params {
    Params {
        sample_rate: rate as f32,
        gravity,
        ..Params::DEFAULT
    }
}

/// An estimator and its clock.
struct Foot {
    estimator: Box<ContactEstimator<64>>,
    period: u64,
    now: u64,
}

impl Foot {
    fn new(params: &Params) -> Self {
        // The window of the paper's method, which nothing here uses.
        let params = Params {
            window: estimator_core::WindowLength::Samples(50),
            ..*params
        };
        Self {
            estimator: Box::new(ContactEstimator::new(&params.validate().expect("in range"))),
            period: (1.0e6 / f64::from(params.sample_rate)).round() as u64,
            now: 0,
        }
    }

    /// One sample, so many µs after the one before.
    fn after(&mut self, micros: u64, sample: &Sample, validity: Validity) -> ContactEstimate {
        self.now = self.now.wrapping_add(micros);
        let imu = ImuSample {
            timestamp: Timestamp::from_micros(self.now),
            specific_force: SpecificForce(vector(sample.force)),
            angular_rate: AngularRate(vector(sample.rate)),
            validity,
        };
        self.estimator.update(&imu, None)
    }

    /// Samples at the period that the estimator knows.
    fn measures(&mut self, samples: &[Sample]) -> Vec<ContactEstimate> {
        let period = self.period;
        let valid = |sample| self.after(period, sample, Validity::Valid);
        samples.iter().map(valid).collect()
    }

    fn learnt(&mut self) -> Learnt {
        self.estimator.finish();
        self.estimator.learnt()
    }
}

/// Shares of what is checked in a walk.
#[derive(Clone, Copy, Debug)]
struct Shares {
    /// Of the stances: P > 0.5.
    stance: f64,
    /// Of the swings: P < 0.5.
    swing: f64,
    /// Of the swings: the decision is "stable".
    wrongly_stable: f64,
}

/// The shares from a time in s on.
fn shares(samples: &[Sample], estimates: &[ContactEstimate], from: f64) -> Shares {
    let checked = |stance: bool| {
        let pairs = samples.iter().zip(estimates);
        pairs.filter(move |(sample, _)| {
            sample.time >= from
                && match sample.part {
                    Part::Stance(since) => stance && since > SETTLED,
                    Part::Swing(since) => !stance && since > LIFTED,
                }
        })
    };
    let share = |stance: bool, holds: &dyn Fn(&ContactEstimate) -> bool| {
        let found = checked(stance).filter(|(_, estimate)| holds(estimate));
        found.count() as f64 / checked(stance).count().max(1) as f64
    };
    Shares {
        stance: share(true, &|e| e.probabilities.stable > 0.5),
        swing: share(false, &|e| e.probabilities.stable < 0.5),
        wrongly_stable: share(false, &|e| e.decision == Decision::Stable),
    }
}

fn assert_told_right(name: &str, shares: Shares) {
    println!("{name}: {shares:.3?}");
    let right = shares.stance > 0.7 && shares.swing > 0.8 && shares.wrongly_stable < 0.1;
    assert!(right, "{name}: {shares:.3?}");
}

/// A foot that goes through something and then walks: the shares from the eleventh step on.
fn walk_after(params: &Params, before: &[Sample], gait: &Gait, steps: f64) -> Shares {
    let rate = f64::from(params.sample_rate);
    let walk = measured(gait, rate, (steps + STEPS) * gait.stride, params.gravity);
    let mut foot = Foot::new(params);
    foot.measures(before);
    let estimates = foot.measures(&walk);
    shares(&walk, &estimates, steps * gait.stride)
}

// ---- Broken today ----

/// Fails today: stance 0.000 (P > 0.5 in no sample of any stance, five minutes later neither; no flag but
/// the first seconds' `settling`, `gyro_bias` stays 0). With 2 °/s it is 0.78, after 0.6 s of rest 1.
#[test]
fn a_foot_that_walks_before_it_has_rested_learns_a_gyroscope_bias_of_four_degrees_per_second() {
    let bias = [0.0, 4.0_f64.to_radians(), 0.0];
    let walk = measured(&Gait::WALK, 1000.0, 40.0, Gravity::Included);
    let walk = biased(&walk, [0.0; 3], bias);
    let estimates = Foot::new(&params(1000.0, Gravity::Included)).measures(&walk);
    let from = 20.0;
    assert_told_right("4 °/s", shares(&walk, &estimates, from));
}

/// Fails today: stance 0.000, largest P 0.003, for ever. Each sample comes after a gap of one, and P
/// is never higher than before a gap. `footfall replay` of such a recording gives the same.
#[test]
fn a_foot_of_which_every_second_sample_is_lost_finds_its_stances() {
    for gravity in [Gravity::Included, Gravity::Removed] {
        let mut foot = Foot::new(&params(1000.0, gravity));
        foot.measures(&measured(&Gait::WALK, 1000.0, 9.0, gravity));
        let walk = measured(&Gait::WALK, 500.0, 18.0, gravity);
        foot.period = 2000;
        let estimates = foot.measures(&walk);
        let name = format!("{gravity:?}");
        assert_told_right(&name, shares(&walk, &estimates, 9.0));
    }
}

/// Fails today: of the swings from the eleventh to the twentieth step P < 0.5 in 0.552, and 0.379 are
/// decided to be stable, without a flag (100 Hz); without the trot 1.000 and 0.000. It takes 24 steps.
#[test]
fn a_foot_that_slows_down_from_a_trot_is_not_called_stable_while_it_swings() {
    let slow = Gait {
        stride: 1.5,
        length: 0.25,
        height: 0.04,
        pitch: 0.1,
        impact: 15.0,
        shake: 0.05,
        ..Gait::WALK
    };
    for rate in [100.0, 200.0] {
        let params = params(rate, Gravity::Included);
        assert_told_right("at once", walk_after(&params, &[], &slow, STEPS));
        let trot = measured(&Gait::TROT, rate, 60.0, Gravity::Included);
        let shares = walk_after(&params, &trot, &slow, STEPS);
        assert_told_right(&format!("{rate} Hz, after a trot"), shares);
    }
}

/// Fails today: 200 steps after the trot P < 0.5 still in 0.616 of the swings, 0.355 are decided to be
/// stable, and it stays so; without the trot 0.972 and 0.013.
#[test]
fn long_slow_steps_are_told_right_at_last_whatever_was_before_them() {
    let slow = Gait {
        stride: 2.133,
        duty: 0.354,
        length: 1.5,
        height: 0.189,
        pitch: 0.048,
        impact: 5.0,
        ring: 27.4,
        fade: 0.014,
        shake: 0.18,
        shake_hertz: 13.5,
        phase: 0.0,
    };
    let params = params(100.0, Gravity::Included);
    assert_told_right("at once", walk_after(&params, &[], &slow, 200.0));
    let trot = measured(&Gait::TROT, 100.0, 60.0, Gravity::Included);
    assert_told_right("after a trot", walk_after(&params, &trot, &slow, 200.0));
}

/// Fails today: stance 0.220 (P > 0.5 for a fifth of each stance) after five seconds of standing, and
/// 60 steps later no more; 1.000 without. The stances shake by 1.7 mm/s along the ground.
#[test]
fn a_foot_that_stood_before_it_walked_finds_stances_that_shake() {
    let shaking = Gait {
        stride: 1.377,
        duty: 0.371,
        length: 1.5,
        height: 0.131,
        pitch: 0.668,
        impact: 67.7,
        ring: 27.3,
        fade: 0.023,
        shake: 0.84,
        shake_hertz: 39.9,
        phase: 0.3,
    };
    let params = params(1000.0, Gravity::Included);
    let stood = measured(&Gait::STANDING, 1000.0, 5.0, Gravity::Included);
    let begins_in_swing = Gait {
        phase: 0.85,
        ..shaking
    };
    assert_told_right("at once", walk_after(&params, &[], &begins_in_swing, STEPS));
    assert_told_right("stood", walk_after(&params, &stood, &shaking, STEPS));
}

/// Fails today: P 0.578 at 100 Hz, and the decision is "stable", with the first sample after an hour that
/// nothing is known of.
#[test]
fn a_foot_that_was_not_seen_for_an_hour_is_not_stable_with_the_next_sample() {
    for rate in [100.0, 125.0, 200.0, 1000.0] {
        let mut foot = Foot::new(&params(rate, Gravity::Removed));
        let stood = measured(&Gait::STANDING, rate, 2.0, Gravity::Removed);
        foot.measures(&stood);
        let next = foot.after(3_600_000_000, &stood[0], Validity::Valid);
        let p = next.probabilities.stable;
        println!("{rate} Hz: {p}, {:?}", next.decision);
        assert_eq!(next.decision, Decision::NotStable, "{rate} Hz: P {p}");
        assert!(p < 0.5, "{rate} Hz: P {p}");
    }
}

/// Fails today: by 0.869 at 1 kHz, where the slide test takes the sensor's z for up. At 200 Hz, without
/// it, the same.
#[test]
fn with_gravity_removed_it_does_not_matter_how_the_sensor_is_mounted() {
    for rate in [200.0, 1000.0] {
        let walk = measured(&Gait::WALK, rate, 18.0, Gravity::Removed);
        let estimates = |walk: &[Sample]| Foot::new(&params(rate, Gravity::Removed)).measures(walk);
        let expected = estimates(&walk);
        for axis in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.7, 0.3]] {
            let other = estimates(&mounted(&walk, axis, 0.5 * PI));
            let most = largest_difference(&expected, &other);
            assert!(
                most <= 0.01,
                "{rate} Hz, about {axis:?}: P differs by {most}"
            );
        }
    }
}

/// Fails today: stance 0.000 where gravity was removed: 0.52 m/s² in all, of which 0.32 are learnt.
#[test]
fn an_accelerometer_may_have_a_bias_on_each_axis_where_gravity_was_removed() {
    for gravity in [Gravity::Included, Gravity::Removed] {
        let walk = measured(&Gait::WALK, 1000.0, 27.0, gravity);
        let walk = biased(&walk, [0.3; 3], [0.0; 3]);
        let estimates = Foot::new(&params(1000.0, gravity)).measures(&walk);
        let name = format!("{gravity:?}");
        assert_told_right(&name, shares(&walk, &estimates, 9.0));
    }
}

/// Fails today: such classes are accepted, and then every quantity has nothing to say: P is 1 for ever
/// on a foot that shakes with 50 m/s², without a flag (below 400 Hz).
#[test]
fn frozen_classes_that_lie_together_do_not_make_a_shaken_foot_stable() {
    let together = Classes {
        still: -1.0,
        moving: -1.0,
        width: 0.5,
    };
    let params = Params {
        learning: Learning::Frozen,
        learnt: Some(Learnt {
            acceleration: together,
            rate: together,
            velocity: together,
            still_seconds: 8.0,
            moving_seconds: 8.0,
            idle_seconds: 0.0,
        }),
        ..params(100.0, Gravity::Included)
    };
    if params.validate::<64>().is_err() {
        return;
    }
    let mut foot = Foot::new(&params);
    let mut samples = measured(&Gait::STANDING, 100.0, 4.0, Gravity::Included);
    for sample in &mut samples[200..] {
        sample.force[0] += 50.0 * (TAU * 23.0 * sample.time).sin();
    }
    let last = *foot.measures(&samples).last().expect("a sample");
    let p = last.probabilities.stable;
    assert!(p < 0.5 && last.decision == Decision::NotStable, "P {p}");
}

/// Fails today: P 1.000 and "stable", no flag, for as long as the reading is repeated to the last bit.
/// The firmware finds that out where it samples; for a recording nothing does.
#[test]
fn a_recorded_reading_that_is_repeated_to_the_last_bit_for_ten_seconds_is_not_stable() {
    // Ends in the middle of a stance.
    let mut samples = measured(&Gait::WALK, 1000.0, 9.27, Gravity::Included);
    samples.extend(vec![*samples.last().expect("a sample"); 10_000]);
    let mut table = String::from("t,ax,ay,az,wx,wy,wz\n");
    for (k, sample) in samples.iter().enumerate() {
        let ([ax, ay, az], [wx, wy, wz]) = (sample.force, sample.rate);
        let time = k as f64 * 1.0e-3;
        writeln!(table, "{time:.3},{ax},{ay},{az},{wx},{wy},{wz}").expect("a string");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("frozen.csv");
    std::fs::write(&path, table).expect("a file");
    let loaded = read(&path, Format::Csv, &Hints::default()).expect("a recording");
    let estimates = replay(&loaded.recording, &Params::DEFAULT).expect("the preset");
    let last = estimates.last().expect("a sample");
    assert!(
        last.decision == Decision::NotStable || !last.flags.is_empty(),
        "P {}",
        last.probabilities.stable
    );
}

// ---- Held ----

fn largest_difference(expected: &[ContactEstimate], other: &[ContactEstimate]) -> f32 {
    let pairs = expected.iter().zip(other);
    let differences = pairs.map(|(a, b)| (a.probabilities.stable - b.probabilities.stable).abs());
    differences.fold(0.0, f32::max)
}

/// Numbers of any size between two.
fn scale(chance: &mut Chance, low: f64, high: f64) -> f64 {
    low * (high / low).powf(chance.even())
}

fn any_gait(chance: &mut Chance) -> Gait {
    let stride = scale(chance, 0.5, 2.5);
    let duty = 0.5 + 0.25 * chance.even();
    let swing = stride * (1.0 - duty);
    Gait {
        stride,
        duty,
        length: (scale(chance, 3.0, 60.0) * swing * swing / TAU).min(1.5),
        height: (scale(chance, 2.0, 30.0) * swing * swing * 2.0 / (TAU * TAU)).min(0.4),
        pitch: scale(chance, 0.02, 0.8),
        impact: scale(chance, 1.0, 120.0),
        ring: 25.0 + 55.0 * chance.even(),
        fade: scale(chance, 0.004, 0.02),
        shake: scale(chance, 0.01, 0.2),
        shake_hertz: 10.0 + 30.0 * chance.even(),
        phase: chance.even(),
    }
}

/// Of 1481 such gaits all were.
#[test]
fn gaits_of_every_size_and_pace_are_told_right_within_ten_steps_at_every_rate() {
    let mut chance = Chance::new(1);
    for k in 0..60 {
        let gait = any_gait(&mut chance);
        let rate = [100.0, 200.0, 400.0, 1000.0][k % 4];
        let gravity = [Gravity::Included, Gravity::Included, Gravity::Removed][k % 3];
        let shares = walk_after(&params(rate, gravity), &[], &gait, STEPS);
        assert_told_right(&format!("{rate} Hz, {gravity:?}, {gait:.3?}"), shares);
    }
}

#[test]
fn however_the_sensor_is_mounted_and_wherever_in_a_stride_it_starts_p_is_the_same() {
    let mut chance = Chance::new(2);
    for phase in [0.0, 0.3, 0.7, 0.95] {
        let gait = Gait {
            phase,
            ..Gait::WALK
        };
        let walk = measured(&gait, 1000.0, 4.5, Gravity::Included);
        let walk = biased(&walk, [0.1, -0.2, 0.1], [0.0, -0.02, 0.01]);
        let estimates = |walk: &[Sample]| Foot::new(&Params::DEFAULT).measures(walk);
        let expected = estimates(&walk);
        let mut mountings = vec![([1.0, 0.0, 0.0], PI), ([0.0, 1.0, 0.0], PI)];
        mountings.extend((0..6).map(|_| {
            let axis = [(); 3].map(|()| chance.gaussian());
            (axis, PI * chance.even())
        }));
        for (axis, angle) in mountings {
            let most = largest_difference(&expected, &estimates(&mounted(&walk, axis, angle)));
            assert!(most <= 0.01, "{axis:?} by {angle}: P differs by {most}");
        }
    }
}

#[test]
fn a_foot_that_walks_on_a_ship_or_in_a_lift_is_told_right() {
    let walk = measured(&Gait::WALK, 200.0, 27.0, Gravity::Included);
    for (hertz, degrees, heave) in [(0.1, 10.0_f64, 0.0), (0.3, 5.0, 0.0), (0.3, 0.0, 1.0)] {
        let moved = walk.iter().map(|sample| {
            let turn = TAU * hertz * sample.time;
            let roll = degrees.to_radians() * turn.sin();
            let [x, y, z] = sample.force;
            let z = z + heave * turn.sin();
            let (sine, cosine) = roll.sin_cos();
            let mut moved = *sample;
            moved.force = [x, cosine * y + sine * z, cosine * z - sine * y];
            moved.rate[0] += degrees.to_radians() * TAU * hertz * turn.cos();
            moved
        });
        let moved: Vec<Sample> = moved.collect();
        let estimates = Foot::new(&params(200.0, Gravity::Included)).measures(&moved);
        assert_told_right("afloat", shares(&moved, &estimates, 9.0));
    }
}

#[test]
fn a_foot_that_was_turned_about_up_from_power_up_finds_its_stances() {
    for degrees in [2.0_f64, 5.0] {
        let turned = measured(&Gait::STANDING, 1000.0, 3.0, Gravity::Included);
        let turned = biased(&turned, [0.0; 3], [0.0, 0.0, degrees.to_radians()]);
        let shares = walk_after(&Params::DEFAULT, &turned, &Gait::WALK, STEPS);
        assert_told_right("turned", shares);
    }
}

#[test]
fn a_landing_that_clips_after_a_restart_with_what_a_louder_robot_has_learnt_is_not_stable() {
    let loud = Gait {
        length: 1.0,
        height: 0.16,
        impact: 80.0,
        shake: 3.0,
        ..Gait::WALK
    };
    let mut foot = Foot::new(&Params::DEFAULT);
    foot.measures(&measured(&loud, 1000.0, 60.0, Gravity::Included));
    let params = Params {
        learnt: Some(foot.learnt()),
        ..Params::DEFAULT
    };
    let hard = Gait {
        impact: 300.0,
        phase: 0.999,
        ..Gait::WALK
    };
    let walk = measured(&hard, 1000.0, 18.0, Gravity::Included);
    let mut foot = Foot::new(&params);
    for sample in &walk {
        let clips = sample.force.iter().any(|force| force.abs() > 156.0);
        let validity = match clips {
            true => Validity::Saturated(Saturation::Accelerometer),
            false => Validity::Valid,
        };
        let estimate = foot.after(1000, sample, validity);
        let lands = matches!(sample.part, Part::Stance(since) if since < 0.01);
        let stable = estimate.decision == Decision::Stable || estimate.probabilities.stable > 0.5;
        assert!(!(stable && (clips || lands)), "{} s", sample.time);
    }
}

/// All probabilities.
fn all(p: &Probabilities) -> [f32; 9] {
    let [ax, ay, az, wx, wy, wz] = p.axes.to_array();
    [ax, ay, az, wx, wy, wz, p.tangential, p.vertical, p.stable]
}

/// An event of a random sequence, and what one of its samples is like.
fn disturb(
    event: u64,
    first: bool,
    period: u64,
    sample: &mut Sample,
    chance: &mut Chance,
) -> (u64, Validity) {
    let mut micros = period;
    let mut validity = Validity::Valid;
    match event {
        0 => sample.force = [(); 3].map(|()| 40.0 * chance.gaussian()),
        1 => {
            let doubts = [
                Validity::Stale,
                Validity::Invalid,
                Validity::Saturated(Saturation::Both),
                Validity::Saturated(Saturation::Gyroscope),
            ];
            validity = doubts[chance.bits() as usize % doubts.len()];
        }
        2 if first => micros += (12.0 * chance.even() * period as f64) as u64,
        3 if first => micros = [10_001, 30_000, 100_000, 3_600_000_000][chance.bits() as usize % 4],
        // Back in time.
        4 if first => {
            micros = [0, u64::MAX, 0_u64.wrapping_sub(60_000_000)][chance.bits() as usize % 3];
        }
        5 => micros = (period as f64 * (0.3 + 1.4 * chance.even())) as u64 + 1,
        6 if chance.bits().is_multiple_of(3) => {
            sample.force[chance.bits() as usize % 3] =
                [f64::NAN, f64::INFINITY, -1.0e30][chance.bits() as usize % 3];
        }
        7 => micros = chance.bits() % 3,
        _ => {}
    }
    (micros, validity)
}

/// Of 30 000 such sequences none broke it.
#[test]
fn in_no_order_of_events_is_a_sample_in_doubt_stable_or_p_higher_after_a_gap_than_before() {
    for seed in 0..1500 {
        let mut chance = Chance::new(seed);
        let rate = [100.0, 200.0, 333.0, 400.0, 1000.0][chance.bits() as usize % 5];
        let gravity = [Gravity::Included, Gravity::Removed][chance.bits() as usize % 2];
        let mut foot = Foot::new(&params(rate, gravity));
        let mut before: Option<ContactEstimate> = None;
        let rest = match gravity {
            Gravity::Included => [0.0, 0.0, GRAVITY],
            Gravity::Removed => [0.0; 3],
        };
        for _ in 0..10 {
            let event = chance.bits() % 12;
            for k in 0..scale(&mut chance, 1.0, 200.0) as u64 {
                let mut sample = Sample {
                    time: 0.0,
                    force: rest.map(|force| force + NOISE.0 * chance.gaussian()),
                    rate: [(); 3].map(|()| NOISE.1 * chance.gaussian()),
                    part: Part::Stance(0.0),
                };
                let (micros, validity) =
                    disturb(event, k == 0, foot.period, &mut sample, &mut chance);
                let then = foot.now;
                let estimate = foot.after(micros, &sample, validity);
                let context = || format!("seed {seed}, event {event}: {estimate:?}");
                let p = all(&estimate.probabilities);
                assert!(p.iter().all(|p| (0.0..=1.0).contains(p)), "{}", context());
                let backwards = before.is_some() && foot.now <= then;
                let finite = sample.force.iter().all(|force| force.abs() < 1.0e4);
                if validity != Validity::Valid || backwards || !finite {
                    assert!(estimate.flags.are_doubt(), "{}", context());
                }
                if estimate.flags.are_doubt() {
                    assert_eq!(estimate.decision, Decision::NotStable, "{}", context());
                }
                if let Some(before) = before.filter(|_| !backwards && micros >= 2 * foot.period) {
                    assert!(estimate.flags.contains(Flag::TimeGap), "{}", context());
                    let pairs = p.iter().zip(all(&before.probabilities));
                    let mut risen = pairs.filter(|(p, before)| **p > before + 1.0e-6);
                    assert_eq!(risen.next(), None, "{}", context());
                }
                before = Some(estimate);
            }
        }
    }
}

/// Of 900 such starts at all rates some take longer than ten steps, none takes half a minute.
#[test]
fn at_1_khz_a_foot_that_starts_with_anything_that_can_be_learnt_is_told_right_in_half_a_minute() {
    let mut chance = Chance::new(5);
    for _ in 0..20 {
        let mut classes = || {
            let still = 18.6 * chance.even() - 9.3;
            Classes {
                still: still as f32,
                moving: (still + (9.3 - still) * chance.even()).min(9.3) as f32,
                width: (9.3 * chance.even()) as f32,
            }
        };
        let learnt = Learnt {
            acceleration: classes(),
            rate: classes(),
            velocity: classes(),
            still_seconds: 8.0,
            moving_seconds: 8.0,
            idle_seconds: 0.0,
        };
        let params = Params {
            learnt: Some(learnt),
            ..Params::DEFAULT
        };
        let steps = 30.0 / Gait::WALK.stride;
        let shares = walk_after(&params, &[], &Gait::WALK, steps);
        assert_told_right(&format!("{learnt:.1?}"), shares);
    }
}

#[test]
fn times_that_alternate_or_jitter_by_most_of_a_period_keep_the_stances() {
    let mut chance = Chance::new(6);
    let walk = measured(&Gait::WALK, 500.0, 27.0, Gravity::Included);
    for name in ["alternating", "jittering"] {
        let mut foot = Foot::new(&params(500.0, Gravity::Included));
        let mut late = 0;
        let estimates: Vec<ContactEstimate> = (0_u64..)
            .zip(&walk)
            .map(|(k, sample)| {
                let next = match name {
                    "alternating" => 1200 * (k % 2),
                    _ => chance.bits() % 1400,
                };
                let micros = 2000 + next - late;
                late = next;
                foot.after(micros, sample, Validity::Valid)
            })
            .collect();
        assert_told_right(name, shares(&walk, &estimates, 9.0));
    }
}
