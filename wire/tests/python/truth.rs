//! Estimates of every kind, their frames, and the values that a reader of `footfall.dbc` is to find in them.

use estimator_core::{
    AngularRate, ContactEstimate, Decision, Flag, Flags, LinearAcceleration, PerAxis, Phase,
    Probabilities, Quaternion, Timestamp, Vec3,
};
use proptest::prelude::*;
use wire::pdo::{
    ACCELERATION_STEP, Acceleration, Attitude, Axes, BIAS_STEP, Bias, ClockReading, Contact,
    Health, LongTime, RATE_STEP, Rate, TEMPERATURE_STEP, UNIT_STEP,
};
use wire::{Fault, Faults, Pdo};

/// Encoded values, with the tolerance of their coding, by signal name.
#[derive(Debug)]
pub struct Truth {
    estimate: ContactEstimate,
    faults: Faults,
    sequence: u8,
    temperature: f32,
    dropped: u32,
    clock: ClockReading,
}

impl Truth {
    pub fn frame(&self, pdo: Pdo) -> [u8; 8] {
        let estimate = &self.estimate;
        match pdo {
            Pdo::Contact => Contact::new(estimate, self.sequence, self.faults).encode(),
            Pdo::Axes => Axes::new(estimate, self.faults).encode(),
            Pdo::Attitude => Attitude::new(estimate, self.faults).encode(),
            Pdo::Acceleration => Acceleration::new(estimate, self.faults).encode(),
            Pdo::Rate => Rate::new(estimate, self.faults).encode(),
            Pdo::Bias => Bias::new(estimate, self.temperature, self.faults).encode(),
            Pdo::Health => {
                let register = self.faults.register();
                Health::new(estimate.flags, register, self.dropped, self.clock).encode()
            }
        }
    }

    /// Value and tolerance of the decoded one.
    pub fn expected(&self, signal: &str) -> (f64, f64) {
        let flag = |flag| (f64::from(u8::from(self.estimate.flags.contains(flag))), 0.0);
        let exact = |value: f64| (value, 0.0);
        let yes = |yes: bool| (f64::from(u8::from(yes)), 0.0);
        let fault = self.faults.iter().any(Fault::voids_estimate);
        let p = |value: f32, steps: f64| {
            let value = if fault { 0.0 } else { f64::from(value) };
            (value, 0.5 / steps + 1.0e-7)
        };
        // Half a step, and the rounding error of an f32 at the end of the range.
        let unknown = [Flag::AttitudeNotInitialised, Flag::Stale, Flag::InvalidSample]
            .into_iter()
            .any(|flag| self.estimate.flags.contains(flag));
        let no_value = |step: f64| (-32_768.0 * step, 1.0e-9);
        let q = |value: f32, step: f64| {
            if fault || unknown { no_value(step) } else { (f64::from(value), step * 0.505) }
        };
        let valid = !self.estimate.flags.are_doubt() && !fault;
        let stable = self.estimate.decision == Decision::Stable;
        let phase = match self.estimate.phase {
            Phase::Stance | Phase::QuietSwing if !valid => Phase::Unknown,
            _ if fault => Phase::Unknown,
            phase => phase,
        };
        let Probabilities { axes, tangential, vertical, stable: total } =
            self.estimate.probabilities;
        let orientation = self.estimate.orientation;
        let acceleration = self.estimate.linear_acceleration.0;
        let rate = self.estimate.angular_rate.0;
        let bias = self.estimate.gyro_bias.0;
        let micros = self.estimate.timestamp.as_micros();
        match signal {
            "StableContactProbability" => p(total, 65_535.0),
            "TangentialProbability" => p(tangential, 255.0),
            "VerticalProbability" => p(vertical, 255.0),
            "ProbabilityAx" => p(axes.ax, 255.0),
            "ProbabilityAy" => p(axes.ay, 255.0),
            "ProbabilityAz" => p(axes.az, 255.0),
            "ProbabilityWx" => p(axes.wx, 255.0),
            "ProbabilityWy" => p(axes.wy, 255.0),
            "ProbabilityWz" => p(axes.wz, 255.0),
            // Truncated to 10 µs, then modulo 655.36 ms.
            "Timestamp" => ((micros / 10 % 65_536) as f64 / 100.0, 1.0e-9),
            "Sequence" => exact(f64::from(self.sequence)),
            "State" => exact(f64::from(phase as u8)),
            "Decision" => yes(stable && valid),
            "Valid" => yes(valid),
            "Fault" => yes(fault),
            "Saturated" | "SampleSaturated" => flag(Flag::Saturated),
            "Settling" => flag(Flag::Settling),
            "Starting" => yes(self.estimate.flags.contains(Flag::WindowNotFull)
                || self.estimate.flags.contains(Flag::AttitudeNotInitialised)),
            "WindowNotFull" => flag(Flag::WindowNotFull),
            "AttitudeNotInitialised" => flag(Flag::AttitudeNotInitialised),
            "Stale" => flag(Flag::Stale),
            "InvalidSample" => flag(Flag::InvalidSample),
            "TimeGap" => flag(Flag::TimeGap),
            "Unproven" => flag(Flag::Unproven),
            "QuaternionW" => q(orientation.w, UNIT_STEP),
            "QuaternionX" => q(orientation.x, UNIT_STEP),
            "QuaternionY" => q(orientation.y, UNIT_STEP),
            "QuaternionZ" => q(orientation.z, UNIT_STEP),
            "AccelerationX" => q(acceleration.x, ACCELERATION_STEP),
            "AccelerationY" => q(acceleration.y, ACCELERATION_STEP),
            "AccelerationZ" => q(acceleration.z, ACCELERATION_STEP),
            "RateX" => q(rate.x, RATE_STEP),
            "RateY" => q(rate.y, RATE_STEP),
            "RateZ" => q(rate.z, RATE_STEP),
            "BiasX" => q(bias.x, BIAS_STEP),
            "BiasY" => q(bias.y, BIAS_STEP),
            "BiasZ" => q(bias.z, BIAS_STEP),
            "Temperature" if fault => no_value(TEMPERATURE_STEP),
            "Temperature" => (f64::from(self.temperature), TEMPERATURE_STEP * 0.505),
            "ErrorRegister" => exact(f64::from(self.faults.register())),
            "Dropped" => exact(f64::from(self.dropped % 256)),
            "SyncCounter" => exact(f64::from(self.clock.sync)),
            "Clock" => (f64::from(self.clock.time.0) / 100.0, 1.0e-7),
            other => panic!("no truth for {other}"),
        }
    }
}

fn vector(limit: f32) -> impl Strategy<Value = Vec3> {
    let component = move || -limit..=limit;
    (component(), component(), component()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

prop_compose! {
    pub fn truth()(
        p in prop::array::uniform9(0.0..=1.0_f32),
        (micros, clock, sequence, dropped) in (0..u64::MAX / 2, any::<(u8, u32)>(), any::<u8>(), any::<u32>()),
        // Most estimates have no flags, because otherwise there would be too few valid frames.
        flags in prop_oneof![2 => Just(0), 1 => 0..64_u8],
        faults in prop_oneof![2 => Just(0), 1 => any::<u32>()],
        (phase, stable) in (0..5_usize, any::<bool>()),
        acceleration in vector(327.0),
        rate in vector(40.9),
        bias in vector(0.327),
        axis in vector(1.0),
        w in -1.0..=1.0_f32,
        temperature in -40.0..=125.0_f32,
    ) -> Truth {
        let flags = Flag::ALL.into_iter().enumerate().fold(Flags::NONE, |set, (i, flag)| {
            if flags >> i & 1 == 1 { set.with(flag) } else { set }
        });
        let [a, b, c, d, e, f, tangential, vertical, stable_p] = p;
        Truth {
            estimate: ContactEstimate {
                timestamp: Timestamp::from_micros(micros),
                probabilities: Probabilities {
                    axes: PerAxis::from_array([a, b, c, d, e, f]),
                    tangential,
                    vertical,
                    stable: stable_p,
                },
                decision: if stable { Decision::Stable } else { Decision::NotStable },
                phase: Phase::ALL[phase],
                flags,
                orientation: Quaternion { w, x: axis.x, y: axis.y, z: axis.z }.normalised(),
                linear_acceleration: LinearAcceleration(acceleration),
                angular_rate: AngularRate(rate),
                gyro_bias: AngularRate(bias),
                ..ContactEstimate::default()
            },
            faults: Faults::from_bits(faults),
            sequence,
            temperature,
            dropped,
            clock: ClockReading { sync: clock.0, time: LongTime(clock.1) },
        }
    }
}
