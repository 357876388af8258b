//! Expected output of `print.c`, from the crate's own decoders.

use std::fmt::{Display, Write};

use estimator_core::{Flag, Flags, PerAxis, Saturation, Validity, Vec3};
use wire::board::Counter;
use wire::foot::cob_id;
use wire::node::{NmtCommand, NmtState};
use wire::pdo::{
    Acceleration, Attitude, Axes, Bias, Contact, Health, Load, P8, P16, Rate, Status,
    TEMPERATURE_STEP, TIME_STEP_US,
};
use wire::uart::{Answer, ContactMessage, Frame, HealthMessage, Message, Problem, RawMessage};
use wire::{Address, Emergency, Fault, NodeId, Pdo};

/// `enum footfall_result`.
#[derive(Clone, Copy, Debug)]
enum Refused {
    UnknownId = 1,
    WrongLength,
    WrongValue,
    WrongCoding = 5,
    TooLong,
    TooShort,
    WrongCheck,
    UnknownVersion,
    UnknownType,
    WrongPayload,
}

/// Line under construction.
struct Line(String);

impl Line {
    fn value(&mut self, name: impl Display, value: impl Display) {
        let _ = write!(self.0, " {name}={value}");
    }

    /// Adds a real number by its bits, so that nothing is rounded.
    fn real(&mut self, name: impl Display, value: f32) {
        if value.is_nan() {
            self.value(name, "nan");
        } else {
            self.value(name, format_args!("{:08x}", value.to_bits()));
        }
    }

    fn named(&mut self, name: impl Display, code: impl Display, text: &str) {
        self.value(name, format_args!("{code}({text})"));
    }

    fn yes(&mut self, name: impl Display, value: bool) {
        self.value(name, u8::from(value));
    }

    fn bytes(&mut self, name: &str, bytes: &[u8]) {
        let hex: String = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
        self.value(name, hex);
    }

    fn vector(&mut self, name: &str, unit: &str, Vec3 { x, y, z }: Vec3) {
        for (axis, value) in [("x", x), ("y", y), ("z", z)] {
            self.real(format_args!("{name}_{axis}{unit}"), value);
        }
    }

    fn axes(&mut self, axes: PerAxis<f32>) {
        let names = ["ax", "ay", "az", "wx", "wy", "wz"];
        for (axis, value) in names.into_iter().zip(axes.to_array()) {
            self.real(format_args!("probability_{axis}"), value);
        }
    }

    fn status(&mut self, status: Status) {
        let phase = status.phase();
        self.named("status.state", phase as u8, phase.name());
        let decision = status.decision();
        self.named("status.decision", decision as u8, ["not_stable", "stable"][decision as usize]);
        self.yes("status.valid", status.is_valid());
        self.yes("status.saturated", status.is_saturated());
        self.yes("status.fault", status.has_fault());
        self.yes("status.starting", status.is_starting());
    }

    fn flags(&mut self, bits: u8) {
        for flag in Flag::ALL {
            let set = bits & Flags::NONE.with(flag).bits() != 0;
            // The status of a frame has a member "saturated", so the flag of the sample needs another name.
            let of = match flag {
                Flag::Saturated => "sample_saturated",
                flag => flag.name(),
            };
            self.yes(format_args!("flags.{of}"), set);
        }
    }

    fn short_time(&mut self, time: wire::pdo::ShortTime) {
        self.value("timestamp_us", u64::from(time.0) * TIME_STEP_US);
    }

    fn node_state(&mut self, name: &str, state: NmtState) {
        let text = match state {
            NmtState::Initialising => "boot_up",
            NmtState::Stopped => "stopped",
            NmtState::Operational => "operational",
            NmtState::PreOperational => "pre_operational",
        };
        self.named(name, state as u8, text);
    }

    fn object(&mut self, Address { index, subindex }: Address) {
        self.value("object", format_args!("{index:04X}:{subindex}"));
    }
}

/// Expected output for a CAN frame.
pub fn frame(id: u32, data: &[u8]) -> String {
    decoded(id, data).unwrap_or_else(|refused| format!("result {}", refused as u8))
}

fn decoded(id: u32, data: &[u8]) -> Result<String, Refused> {
    let id = u16::try_from(id).map_err(|_| Refused::UnknownId)?;
    let node = NodeId::new((id & 0x7F) as u8).ok_or(Refused::UnknownId)?;
    let eight = || <&[u8; 8]>::try_from(data).map_err(|_| Refused::WrongLength);
    let head = |kind: &str| Line(format!("{kind} node={}", node.get()));
    let line = match id & !0x7F {
        cob_id::EMERGENCY => {
            let mut line = head("emergency");
            emergency(&mut line, &Emergency::decode(eight()?));
            line
        }
        cob_id::HEARTBEAT => {
            let [code] = *data else {
                return Err(Refused::WrongLength);
            };
            let mut line = head("heartbeat");
            let state = NmtState::from_wire(code).map_err(|_| Refused::WrongValue)?;
            line.node_state("state", state);
            line
        }
        Load::BASE => {
            if !(4..=8).contains(&data.len()) {
                return Err(Refused::WrongLength);
            }
            let mut line = head("load");
            line.real("load", Load::decode(data).ok_or(Refused::WrongValue)?.0);
            line
        }
        _ => {
            let (pdo, _) = Pdo::from_cob_id(id).ok_or(Refused::UnknownId)?;
            let mut line = head(&pdo.name().to_lowercase());
            process_data(&mut line, pdo, eight()?);
            line
        }
    };
    Ok(line.0)
}

fn emergency(line: &mut Line, emergency: &Emergency) {
    let (number, name) =
        emergency.fault.map_or((u8::MAX, "unknown"), |fault| (fault.number(), fault.name()));
    line.value("code", emergency.code);
    line.value("error_register", emergency.register);
    line.named("fault", number, name);
    let detail = emergency.fault.map_or("unknown", Fault::detail);
    // The text in C is ASCII.
    let detail = detail.replace('µ', "u").replace('°', "deg");
    line.named("of", emergency.fault.map_or(0, Fault::code), &detail);
    line.value("detail", emergency.detail);
}

fn process_data(line: &mut Line, pdo: Pdo, data: &[u8; 8]) {
    match pdo {
        Pdo::Contact => {
            let contact = Contact::decode(data);
            line.real("stable_contact_probability", contact.stable.probability());
            line.real("tangential_probability", contact.tangential.probability());
            line.real("vertical_probability", contact.vertical.probability());
            line.short_time(contact.timestamp);
            line.value("sequence", contact.sequence);
            line.status(contact.status);
        }
        Pdo::Axes => {
            let axes = Axes::decode(data);
            let probabilities = axes.probabilities.to_array().map(P8::probability);
            line.axes(PerAxis::from_array(probabilities));
            line.short_time(axes.timestamp);
        }
        Pdo::Attitude => {
            let q = Attitude::decode(data).orientation();
            for (part, value) in [("w", q.w), ("x", q.x), ("y", q.y), ("z", q.z)] {
                line.real(format_args!("quaternion_{part}"), value);
            }
        }
        Pdo::Acceleration => {
            let frame = Acceleration::decode(data);
            line.vector("acceleration", "_m_s2", frame.acceleration());
            line.short_time(frame.timestamp);
        }
        Pdo::Rate => {
            let frame = Rate::decode(data);
            line.vector("rate", "_rad_s", frame.rate());
            line.short_time(frame.timestamp);
        }
        Pdo::Bias => {
            let frame = Bias::decode(data);
            line.vector("bias", "_rad_s", frame.bias());
            line.real("temperature_deg_c", frame.temperature());
        }
        Pdo::Health => {
            let health = Health::decode(data);
            line.flags(health.flags);
            line.value("error_register", health.register);
            line.value("dropped", health.dropped);
            line.value("sync_counter", health.clock.sync);
            let clock = u64::from(health.clock.time.0) * TIME_STEP_US;
            line.value("clock_us", clock);
        }
    }
    let printed = line.0.matches('=').count() - 1;
    assert_eq!(printed, pdo.signals().count(), "signals of {pdo:?}");
}

/// Expected output at the end of a frame of the serial line.
pub fn message(came: &Result<Frame, Problem>) -> String {
    match came {
        Ok(frame) => understood(frame),
        Err(problem) => {
            let refused = match problem {
                Problem::Coding => Refused::WrongCoding,
                Problem::TooLong => Refused::TooLong,
                Problem::TooShort => Refused::TooShort,
                Problem::Check => Refused::WrongCheck,
                Problem::Version(_) => Refused::UnknownVersion,
                Problem::Kind(_) => Refused::UnknownType,
                Problem::Payload(_) => Refused::WrongPayload,
            };
            format!("result {}", refused as u8)
        }
    }
}

fn understood(frame: &Frame) -> String {
    let kind = match frame.message {
        Message::Contact(_) => "contact",
        Message::Raw(_) => "raw",
        Message::Health(_) => "health",
        Message::ConfigGet(_) => "config_get",
        Message::ConfigSet(_) => "config_set",
        Message::ConfigResponse(_) => "config_response",
        Message::Log(_) => "log",
        Message::Nmt(_) => "nmt",
    };
    let mut line = Line(format!("{kind} sequence={}", frame.sequence));
    match &frame.message {
        Message::Contact(message) => contact(&mut line, message),
        Message::Raw(sample) => raw(&mut line, sample),
        Message::Health(message) => health(&mut line, message),
        Message::ConfigGet(get) => line.object(get.address),
        Message::ConfigSet(set) => {
            line.object(set.address);
            line.bytes("value", set.value.as_bytes());
        }
        Message::ConfigResponse(response) => {
            line.object(response.address);
            match &response.answer {
                Answer::Value(value) => line.bytes("value", value.as_bytes()),
                Answer::Done => line.0 += " done",
                Answer::Refused(abort) => line.named("refused", abort.code(), abort.name()),
            }
        }
        Message::Log(log) => {
            line.value("level", log.level);
            line.bytes("text", log.text().as_bytes());
            line.value("end", 0);
        }
        Message::Nmt(request) => {
            let text = match request.0 {
                NmtCommand::StartRemoteNode => "start",
                NmtCommand::StopRemoteNode => "stop",
                NmtCommand::EnterPreOperational => "enter_pre_operational",
                NmtCommand::ResetNode => "reset_node",
                NmtCommand::ResetCommunication => "reset_communication",
            };
            line.named("command", request.0 as u8, text);
        }
    }
    line.0
}

fn contact(line: &mut Line, message: &ContactMessage) {
    line.value("timestamp_us", message.timestamp.as_micros());
    line.real("stable_contact_probability", message.stable.probability());
    line.real("tangential_probability", message.tangential.probability());
    line.real("vertical_probability", message.vertical.probability());
    let axes = message.axes.to_array().map(P16::probability);
    line.axes(PerAxis::from_array(axes));
    line.status(message.status);
    line.flags(message.flags);
}

fn raw(line: &mut Line, sample: &RawMessage) {
    line.value("timestamp_us", sample.timestamp.as_micros());
    let (code, text) = match sample.validity {
        Validity::Valid => (0, "valid"),
        Validity::Saturated(Saturation::Accelerometer) => (1, "accelerometer_saturated"),
        Validity::Saturated(Saturation::Gyroscope) => (2, "gyroscope_saturated"),
        Validity::Saturated(Saturation::Both) => (3, "saturated"),
        Validity::Stale => (4, "stale"),
        Validity::Invalid => (5, "invalid"),
    };
    line.named("validity", code, text);
    line.real("temperature_deg_c", sample.temperature.value(TEMPERATURE_STEP));
    let si = sample.to_si();
    let triple = |Vec3 { x, y, z }: Vec3| [x, y, z];
    let force = sample.acceleration.into_iter().zip(triple(si.specific_force.0));
    let rate = sample.rate.into_iter().zip(triple(si.angular_rate.0));
    for (axis, (code, value)) in ["x", "y", "z"].into_iter().zip(force) {
        line.value(format_args!("accelerometer_{axis}_code"), code);
        line.real(format_args!("specific_force_{axis}_m_s2"), value);
    }
    for (axis, (code, value)) in ["x", "y", "z"].into_iter().zip(rate) {
        line.value(format_args!("gyroscope_{axis}_code"), code);
        line.real(format_args!("angular_rate_{axis}_rad_s"), value);
    }
    line.real("accelerometer_m_s2_per_code", sample.acceleration_scale);
    line.real("gyroscope_rad_s_per_code", sample.rate_scale);
}

fn health(line: &mut Line, message: &HealthMessage) {
    line.value("timestamp_us", message.timestamp.as_micros());
    line.named("stage", message.stage.code(), message.stage.name());
    line.node_state("node_state", message.state);
    line.value("node", message.id.map_or(0, NodeId::get));
    line.value("faults", message.faults.bits() | message.unknown_faults);
    line.real("temperature_deg_c", message.temperature.value(TEMPERATURE_STEP));
    for counter in Counter::ALL {
        line.value(counter.name(), message.counters.get(counter));
    }
}
