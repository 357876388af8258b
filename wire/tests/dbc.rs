//! Every signal of `footfall.dbc`, as read by another crate, against the codecs: each frame is
//! encoded by the codec, its fields are extracted with the DBC's start bit, length and factor, and
//! must equal the encoded values.

use can_dbc::{
    ByteOrder, Dbc, Message, MessageId, NumericValue, Signal, ValueDescription, ValueType,
};
use estimator_core::{
    AngularRate, ContactEstimate, Decision, Flag, Flags, LinearAcceleration, PerAxis, Phase,
    Probabilities, Quaternion, Timestamp, Vec3,
};
use proptest::prelude::*;
use wire::dictionary::index;
use wire::pdo::{
    ACCELERATION_STEP, Acceleration, Attitude, Axes, BIAS_STEP, Bias, ClockReading, Contact,
    Health, LongTime, RATE_STEP, Rate, TEMPERATURE_STEP, UNIT_STEP,
};
use wire::{Address, BootCause, Fault, Faults, Foot, Node, Pdo, Settings, Value};

fn dbc() -> Dbc {
    Dbc::try_from(include_str!("../footfall.dbc")).expect("the DBC can be read")
}

/// Value of `signal` in `frame`.
fn extract(signal: &Signal, frame: [u8; 8]) -> f64 {
    assert_eq!(signal.byte_order, ByteOrder::LittleEndian);
    let mask = u64::MAX >> (64 - signal.size);
    let code = u64::from_le_bytes(frame) >> signal.start_bit & mask;
    let code = match signal.value_type {
        ValueType::Unsigned => code as f64,
        ValueType::Signed => {
            let unused = 64 - signal.size;
            ((code << unused) as i64 >> unused) as f64
        }
    };
    code * signal.factor + signal.offset
}

fn number(value: NumericValue) -> f64 {
    match value {
        NumericValue::Uint(value) => value as f64,
        NumericValue::Int(value) => value as f64,
        NumericValue::Double(value) => value,
    }
}

/// Encoded values, with the tolerance of their coding, by signal name.
#[derive(Debug)]
struct Truth {
    estimate: ContactEstimate,
    faults: Faults,
    sequence: u8,
    temperature: f32,
    dropped: u32,
    clock: ClockReading,
}

impl Truth {
    fn frame(&self, pdo: Pdo) -> [u8; 8] {
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
    fn expected(&self, signal: &str) -> (f64, f64) {
        let flag = |flag| (f64::from(u8::from(self.estimate.flags.contains(flag))), 0.0);
        let exact = |value: f64| (value, 0.0);
        let yes = |yes: bool| (f64::from(u8::from(yes)), 0.0);
        let fault = self.faults.iter().any(Fault::voids_estimate);
        let p = |value: f32, steps: f64| {
            let value = if fault { 0.0 } else { f64::from(value) };
            (value, 0.5 / steps + 1.0e-7)
        };
        // Half a step, and the rounding error of an f32 at the end of the range.
        let unknown = [
            Flag::AttitudeNotInitialised,
            Flag::Stale,
            Flag::InvalidSample,
        ]
        .into_iter()
        .any(|flag| self.estimate.flags.contains(flag));
        let no_value = |step: f64| (-32_768.0 * step, 1.0e-9);
        let q = |value: f32, step: f64| {
            if fault || unknown {
                no_value(step)
            } else {
                (f64::from(value), step * 0.505)
            }
        };
        let valid = !self.estimate.flags.are_doubt() && !fault;
        let stable = self.estimate.decision == Decision::Stable;
        let phase = match self.estimate.phase {
            Phase::Stance | Phase::QuietSwing if !valid => Phase::Unknown,
            _ if fault => Phase::Unknown,
            phase => phase,
        };
        let Probabilities {
            axes,
            tangential,
            vertical,
            stable: total,
        } = self.estimate.probabilities;
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
    fn truth()(
        p in prop::array::uniform9(0.0..=1.0_f32),
        (micros, clock, sequence, dropped) in (0..u64::MAX / 2, any::<(u8, u32)>(), any::<u8>(), any::<u32>()),
        // Mostly without flags: otherwise there are too few valid frames.
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

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn every_signal_of_every_frame_is_what_was_encoded(truth in truth()) {
        thread_local!(static DBC: Dbc = dbc());
        DBC.with(|dbc| {
            for message in &dbc.messages {
                let Some((pdo, _)) = pdo_of(message.id) else {
                    continue;
                };
                let frame = truth.frame(pdo);
                for signal in &message.signals {
                    let (expected, tolerance) = truth.expected(&signal.name);
                    let decoded = extract(signal, frame);
                    assert!(
                        (decoded - expected).abs() <= tolerance,
                        "{} of {} is {decoded}, not {expected}", signal.name, message.name
                    );
                    if signal.value_type == ValueType::Signed && decoded == -32_768.0 * signal.factor {
                        continue;
                    }
                    assert!(decoded >= number(signal.min) - 1.0e-6, "{} is {decoded}", signal.name);
                    assert!(decoded <= number(signal.max) + 1.0e-6, "{} is {decoded}", signal.name);
                }
            }
        });
    }
}

fn standard(id: MessageId) -> u16 {
    match id {
        MessageId::Standard(id) => id,
        MessageId::Extended(_) => panic!("{id:?} is not a standard identifier"),
    }
}

fn pdo_of(id: MessageId) -> Option<(Pdo, Foot)> {
    let (pdo, node) = Pdo::from_cob_id(standard(id))?;
    let foot = Foot::ALL
        .into_iter()
        .find(|foot| foot.default_node_id() == node)
        .expect("a default node id");
    Some((pdo, foot))
}

#[test]
fn every_foot_has_every_message_under_its_name() {
    let dbc = dbc();
    // Including emergency, heartbeat and load.
    assert_eq!(dbc.messages.len(), Foot::ALL.len() * (Pdo::ALL.len() + 3));
    for message in &dbc.messages {
        let Some((pdo, foot)) = pdo_of(message.id) else {
            continue;
        };
        assert_eq!(message.name, format!("{}_{}", foot.name(), pdo.name()));
        assert_eq!(message.transmitter.as_deref(), Some(foot.name()));
        assert_eq!(message.size, 8);
    }
}

#[test]
fn emergencies_and_heartbeats_match_those_of_a_node() {
    let dbc = dbc();
    for foot in Foot::ALL {
        let mut settings = Settings::default();
        let node_id = foot.default_node_id();
        let address = Address::new(index::NODE_ID, 0);
        assert_eq!(settings.set(address, Value::U8(node_id.get())), Ok(()));
        let mut node = Node::new(settings, 0);
        let boot = node.boot(BootCause::PowerUp).expect("a boot-up message");
        let heartbeat = message(&dbc, boot.id());
        assert_eq!(heartbeat.name, format!("{}_Heartbeat", foot.name()));
        for fault in Fault::ALL {
            let frame = node.raise(fault, 0x1234_5678).expect("an emergency");
            let message = message(&dbc, frame.id());
            assert_eq!(message.name, format!("{}_Emergency", foot.name()));
            let register = f64::from(node.faults().register());
            let expected = [
                ("EmergencyCode", f64::from(fault.code())),
                ("ErrorRegister", register),
                ("FaultNumber", f64::from(fault.number())),
                ("Detail", f64::from(0x1234_5678)),
            ];
            assert_eq!(message.signals.len(), expected.len());
            for (signal, (name, value)) in message.signals.iter().zip(expected) {
                assert_eq!(signal.name, name);
                let bytes = *frame.data8().expect("eight bytes");
                assert_eq!(extract(signal, bytes), value, "{name}");
            }
            let named = dbc.value_descriptions_for_signal(message.id, "EmergencyCode");
            let named = named.expect("codes have names");
            let name = named.iter().find(|name| name.id == i64::from(fault.code()));
            let name = name.expect("every fault's code has a name");
            assert_eq!(name.description, fault.name());
        }
    }
}

fn message(dbc: &Dbc, id: u16) -> &Message {
    let found = |message: &&Message| standard(message.id) == id;
    dbc.messages
        .iter()
        .find(found)
        .expect("a message of the DBC")
}

#[test]
fn signals_do_not_overlap() {
    for message in dbc().messages {
        let mut used = 0_u64;
        for signal in message.signals {
            let bits = u64::MAX >> (64 - signal.size) << signal.start_bit;
            assert_eq!(used & bits, 0, "{} of {}", signal.name, message.name);
            used |= bits;
        }
    }
}

#[test]
fn every_signal_has_a_comment_and_the_enumerations_have_names() {
    let dbc = dbc();
    for message in &dbc.messages {
        for signal in &message.signals {
            let comment = dbc.signal_comment(message.id, &signal.name);
            assert!(comment.is_some(), "{} has no comment", signal.name);
        }
    }
    let mut signed = 0;
    for message in &dbc.messages {
        for signal in &message.signals {
            if signal.value_type == ValueType::Signed && signal.size == 16 {
                signed += 1;
                let names = dbc.value_descriptions_for_signal(message.id, &signal.name);
                let [no_value] = names.expect("a name for no value") else {
                    panic!("{} has other names", signal.name);
                };
                assert_eq!(
                    (no_value.id, no_value.description.as_str()),
                    (-32_768, "no_value")
                );
            }
        }
    }
    assert_eq!(signed, 14 * Foot::ALL.len());
    let states = dbc.value_descriptions.iter().find_map(|names| match names {
        ValueDescription::Signal {
            name,
            value_descriptions,
            ..
        } if name == "State" => Some(value_descriptions),
        _ => None,
    });
    let states = states.expect("State has names");
    for phase in Phase::ALL {
        let name = states.iter().find(|state| state.id == phase as i64);
        assert_eq!(
            name.map(|name| name.description.as_str()),
            Some(phase.name())
        );
    }
}
