//! Messages of the serial line in C, field after field. The crate reads them in
//! `src/uart/{contact,raw,health}.rs`; `tests/c` compares the two on every frame.

use wire::counter::Counter;
use wire::pdo::TEMPERATURE_STEP;

use super::frames;
use super::structs::{Member, Refusal, Struct, Type};

/// Meaning of the validity codes.
pub const VALIDITIES: [(u8, &str); 6] = [
    (0, "valid"),
    (1, "accelerometer_saturated"),
    (2, "gyroscope_saturated"),
    (3, "saturated"),
    (4, "stale"),
    (5, "invalid"),
];

/// Consecutive fields.
#[derive(Debug, Default)]
struct Fields {
    members: Vec<Member>,
    end: usize,
}

impl Fields {
    fn push(
        &mut self,
        name: impl Into<String>,
        kind: Type,
        bytes: usize,
        about: &str,
        value: String,
    ) {
        self.members.push(Member {
            name: name.into(),
            kind,
            about: about.to_owned(),
            value,
            condition: None,
        });
        self.end += bytes;
    }

    fn u32(&mut self, name: &str, about: &str) {
        self.push(
            name,
            Type::U32,
            4,
            about,
            format!("u32_at(data + {})", self.end),
        );
    }

    fn u64(&mut self, name: &str, about: &str) {
        self.push(
            name,
            Type::U64,
            8,
            about,
            format!("u64_at(data + {})", self.end),
        );
    }

    fn f32(&mut self, name: &str, about: &str) {
        self.push(
            name,
            Type::Float,
            4,
            about,
            format!("f32_at(data + {})", self.end),
        );
    }

    fn probability(&mut self, name: impl Into<String>, about: &str) {
        let value = format!("(float)u16_at(data + {}) / 65535.0f", self.end);
        self.push(name, Type::Float, 2, about, value);
    }

    fn temperature(&mut self) {
        let value = frames::quantity(self.end, TEMPERATURE_STEP);
        let about = "Temperature of the sensor.";
        self.push("temperature_deg_c", Type::Float, 2, about, value);
    }

    /// Adds a byte with an enumerated value, masked with `mask`.
    fn one_of(&mut self, name: &'static str, mask: u8, about: &str) {
        let code = match mask {
            u8::MAX => format!("data[{}]", self.end),
            mask => format!("(data[{}] & 0x{mask:02X}u)", self.end),
        };
        let value = format!("(enum footfall_{name}){code}");
        self.push(name, Type::Enum(name), 1, about, value);
        self.must(format!("is_{name}({code})"));
    }

    /// Adds a condition under which the newest field is valid.
    fn must(&mut self, condition: String) {
        if let Some(last) = self.members.last_mut() {
            last.condition = Some(condition);
        }
    }

    fn into_struct(self, name: &str, about: &str) -> Struct {
        Struct {
            name: name.to_owned(),
            about: about.to_owned(),
            members: self.members,
            refusal: Refusal::UnlessLength(self.end),
        }
    }
}

/// Structures of the messages that a foot streams.
pub fn structs() -> Vec<Struct> {
    vec![contact(), raw(), health()]
}

fn contact() -> Struct {
    let mut fields = Fields::default();
    fields.u64(
        "timestamp_us",
        "When the sample was acquired, on the foot's clock.",
    );
    fields.probability(
        "stable_contact_probability",
        "Probability that the foot is in stable contact. 0 with a fault.",
    );
    fields.probability(
        "tangential_probability",
        "Probability of no motion along the ground. 0 with a fault.",
    );
    fields.probability(
        "vertical_probability",
        "Probability of no lifting and no tilting. 0 with a fault.",
    );
    for axis in ["ax", "ay", "az", "wx", "wy", "wz"] {
        let about = "Probability that the axis rests. 0 with a fault.";
        fields.probability(format!("probability_{axis}"), about);
    }
    for (name, read) in [("status", "status_of"), ("flags", "flags_bits")] {
        let value = format!("{read}(data[{}])", fields.end);
        fields.push(name, Type::Bits(name), 1, "As on CAN.", value);
    }
    fields.into_struct(
        "serial_contact",
        "The contact, at full resolution, each tick.",
    )
}

fn raw() -> Struct {
    let mut fields = Fields::default();
    fields.u64(
        "timestamp_us",
        "When the sample was acquired, on the foot's clock.",
    );
    fields.one_of("validity", u8::MAX, "What the driver says about it.");
    fields.temperature();
    let scales = fields.end + 2 * 6;
    let sensors = [
        ("accelerometer", "specific_force", "m_s2", scales),
        ("gyroscope", "angular_rate", "rad_s", scales + 4),
    ];
    for (sensor, quantity, unit, scale) in sensors {
        for axis in ["x", "y", "z"] {
            let code = format!("i16_at(data + {})", fields.end);
            let value = format!("(float){code} * f32_at(data + {scale})");
            fields.push(
                format!("{sensor}_{axis}_code"),
                Type::I16,
                0,
                "As the sensor gave it.",
                code,
            );
            let about = "Code times scale, frame of the sensor.";
            fields.push(
                format!("{quantity}_{axis}_{unit}"),
                Type::Float,
                2,
                about,
                value,
            );
        }
    }
    fields.f32("accelerometer_m_s2_per_code", "");
    fields.f32("gyroscope_rad_s_per_code", "");
    fields.into_struct("serial_raw", "What the sensor measured.")
}

fn health() -> Struct {
    let mut fields = Fields::default();
    fields.u64("timestamp_us", "The board's clock.");
    fields.one_of("stage", u8::MAX, "What the board is doing.");
    fields.one_of("node_state", 0x7F, "State of the node.");
    let id = format!("data[{}]", fields.end);
    let value = format!("(uint8_t)({id} == 255u ? 0u : {id})");
    fields.push("node", Type::U8, 1, "1 to 127; 0: it has none yet.", value);
    fields.must(format!("{id} == 255u || ({id} >= 1u && {id} <= 127u)"));
    // The error register, which follows from the faults.
    let register = fields.end;
    fields.end += 1;
    let faults = fields.end;
    fields.u32(
        "faults",
        "Active faults: bit i is the fault of number i; one that is not known here is of a newer version.",
    );
    fields.must(format!(
        "is_register_of(u32_at(data + {faults}), data[{register}])"
    ));
    fields.temperature();
    for counter in Counter::ALL {
        fields.u32(counter.name(), "");
    }
    fields.into_struct(
        "serial_health",
        "How the board is; counters since power-up.",
    )
}

/// Messages as members of a union.
pub fn members() -> String {
    structs()
        .iter()
        .map(|of| format!("        struct footfall_{} {};\n", of.name, member(of)))
        .collect()
}

/// Name of such a structure in the union.
pub fn member(of: &Struct) -> &str {
    of.name.strip_prefix("serial_").expect("of the serial line")
}
