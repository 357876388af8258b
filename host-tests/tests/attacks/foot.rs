//! A foot in closed form, without code in common with `gait`: its gait, its sensor, and the scoring of an
//! estimator.

use std::f64::consts::TAU;

use estimator_core::{
    AngularRate, ContactEstimate, ContactEstimator, Decision, Gravity, ImuSample, Learnt, Params,
    SpecificForce, Stream, Timestamp, Validity, Vec3,
};
use host_tests::changed::Chance;

pub const GRAVITY: f64 = 9.806_65;

/// Noise of the sensor, m/s² and rad/s.
pub const NOISE: (f64, f64) = (0.02, 0.0012);

/// Time after touchdown from which a stance is checked, s, because the ringing has decayed by then.
pub const SETTLED: f64 = 0.12;

/// Time at the start of a swing that is not checked, s, because a probability needs time to fall.
pub const LIFTED: f64 = 0.015;

/// Steps after which the estimates have to be right again.
pub const STEPS: f64 = 10.0;

/// A gait in the sagittal plane. It begins with a touchdown.
#[derive(Clone, Copy, Debug)]
pub struct Gait {
    /// Period of a stride, s.
    pub stride: f64,
    /// Share of the stride that is stance.
    pub duty: f64,
    /// Length and height of a step, m.
    pub length: f64,
    pub height: f64,
    /// Pitch of the foot in swing, rad.
    pub pitch: f64,
    /// Initial amplitude of the ringing after a landing, m/s², its frequency, Hz, and its decay time, s.
    pub impact: f64,
    pub ring: f64,
    pub fade: f64,
    /// Amplitude of the vibration in stance, m/s², and its frequency, Hz.
    pub shake: f64,
    pub shake_hertz: f64,
    /// Initial phase in the stride, 0 to 1.
    pub phase: f64,
}

impl Gait {
    /// Pace of a person.
    pub const WALK: Self = Self {
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

    /// Standing all the time.
    pub const STANDING: Self = Self { duty: 1.0, impact: 0.0, shake: 0.0, ..Self::WALK };

    /// Phase of the gait at a time in s.
    pub fn part(&self, time: f64) -> Part {
        let phase = (time / self.stride + self.phase).rem_euclid(1.0);
        if phase < self.duty {
            Part::Stance(phase * self.stride)
        } else {
            Part::Swing((phase - self.duty) * self.stride)
        }
    }

    /// Acceleration forwards and upwards, m/s²; pitch, rad, and its rate, rad/s.
    pub fn motion(&self, time: f64) -> (f64, f64, f64, f64) {
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

/// Phase of the gait, with the time since its start, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Part {
    Stance(f64),
    Swing(f64),
}

/// Reading of the sensor, and the true phase of the foot.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub time: f64,
    pub force: [f64; 3],
    pub rate: [f64; 3],
    pub part: Part,
}

/// Samples of a foot with the sensor's noise; each is the mean over its period.
pub fn measured(gait: &Gait, rate: f64, seconds: f64, gravity: Gravity) -> Vec<Sample> {
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

pub fn vector(values: [f64; 3]) -> Vec3 {
    let [x, y, z] = values.map(|value| value as f32);
    Vec3::new(x, y, z)
}

pub fn stream(rate: f64, gravity: Gravity) -> Stream {
    Stream::new(rate as f32, gravity).expect("in range")
}

/// An estimator and its clock.
pub struct Foot {
    pub estimator: Box<ContactEstimator>,
    pub period: u64,
    pub now: u64,
}

impl Foot {
    pub fn new(stream: Stream) -> Self {
        Self::with_learnt(None, stream)
    }

    pub fn with_learnt(learnt: Option<Learnt>, stream: Stream) -> Self {
        let config = Params { learnt, ..Params::DEFAULT }.validate().expect("in range");
        Self {
            estimator: Box::new(ContactEstimator::new(&config, stream)),
            period: (1.0e6 / f64::from(stream.sample_rate())).round() as u64,
            now: 0,
        }
    }

    /// Processes one sample, `micros` µs after the previous one.
    pub fn after(&mut self, micros: u64, sample: &Sample, validity: Validity) -> ContactEstimate {
        self.now = self.now.wrapping_add(micros);
        let imu = ImuSample {
            timestamp: Timestamp::from_micros(self.now),
            specific_force: SpecificForce(vector(sample.force)),
            angular_rate: AngularRate(vector(sample.rate)),
            validity,
        };
        self.estimator.update(&imu, None)
    }

    /// Processes samples at the period of the estimator's parameters.
    pub fn measures(&mut self, samples: &[Sample]) -> Vec<ContactEstimate> {
        let period = self.period;
        let valid = |sample| self.after(period, sample, Validity::Valid);
        samples.iter().map(valid).collect()
    }

    pub fn learnt(&self) -> Learnt {
        self.estimator.learnt()
    }
}

/// Shares of the checked samples of a walk.
#[derive(Clone, Copy, Debug)]
pub struct Shares {
    /// Share of stance samples with P > 0.5.
    pub stance: f64,
    /// Share of swing samples with P < 0.5.
    pub swing: f64,
    /// Share of swing samples with the decision "stable".
    pub wrongly_stable: f64,
}

/// Shares from a time in s on.
pub fn shares(samples: &[Sample], estimates: &[ContactEstimate], from: f64) -> Shares {
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

/// Least share of stance samples with P > 0.5.
pub const STANCE: f64 = 0.7;

pub fn assert_told_right(name: &str, shares: Shares) {
    assert_at_least(STANCE, name, shares);
}

pub fn assert_at_least(stance: f64, name: &str, shares: Shares) {
    println!("{name}: {shares:.3?}");
    let right = shares.stance > stance && shares.swing > 0.8 && shares.wrongly_stable < 0.1;
    assert!(right, "{name}: {shares:.3?}");
}

/// Shares of a walk after some steps.
pub fn walk_after(learnt: Option<Learnt>, stream: Stream, gait: &Gait, steps: f64) -> Shares {
    let rate = f64::from(stream.sample_rate());
    let walk = measured(gait, rate, (steps + STEPS) * gait.stride, stream.gravity());
    let mut foot = Foot::with_learnt(learnt, stream);
    let estimates = foot.measures(&walk);
    shares(&walk, &estimates, steps * gait.stride)
}
