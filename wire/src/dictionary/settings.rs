//! 0x2000 to 0x20FF: the configuration of the foot.

use estimator_core::stillness;
use estimator_core::{
    AccelerometerCorrection, AttitudeParams, Learning, Learnt, Params, PerAxis, WindowLength,
};

use super::{Choice, Entry, Object, Shape, Text, index};
use crate::foot::Foot;
use crate::value::Value;

/// kbit/s, in ascending order.
pub(super) const CAN_BIT_RATES: &[Value] = &[
    Value::U16(125),
    Value::U16(250),
    Value::U16(500),
    Value::U16(1000),
];

const MEANING_OF_FOOT: &str = "1 FL, 2 FR, 3 RL, 4 RR, 5 L, 6 R; a label for people and files, and the node id where none is set";
const RESTART: &str = "takes effect with the next reset of the node or of its communication";

/// A time in s as whole µs.
const fn micros(seconds: f32) -> Value {
    Value::U32((seconds as f64 * 1.0e6 + 0.5) as u32)
}

const fn window_us(window: WindowLength) -> Value {
    match window {
        WindowLength::Duration(seconds) => micros(seconds),
        WindowLength::Samples(samples) => micros(samples as f32 / Params::DEFAULT.sample_rate),
    }
}

/// How the probability is found.
const ESTIMATION: &[Entry] = &[
    Entry::switch(1, "Method", Params::DEFAULT.method as u8)
        .doc("0 self-calibrating: the foot learns its limits of stillness while it walks; 1 half-widths: the limits of 0x2012"),
    Entry::switch(2, "Learning", matches!(Params::DEFAULT.learning, Learning::On) as u8)
        .doc("1 on; 0 frozen: what has been learnt stays as it is. Without effect with method 1"),
];

/// The numbers of [`Learnt`] in the order of its array. Limits are those of the estimator.
pub(super) const LEARNT: [Entry; Learnt::NUMBERS] = {
    /// Logarithms of amplitudes: from 1e-4 to 1e4 of the unit.
    const LOGARITHM: f32 = stillness::LOGARITHM.1;
    const fn amplitude(sub: u8, name: &'static str, unit: &'static str) -> Entry {
        real(sub, name, 0.0, -LOGARITHM, LOGARITHM).unit(unit)
    }
    const fn width(sub: u8, name: &'static str) -> Entry {
        real(sub, name, 0.0, 0.0, LOGARITHM).doc("mean deviation in stillness, of the logarithm")
    }
    const ACCELERATION: &str = "ln(m/s²)";
    const RATE: &str = "ln(rad/s)";
    [
        amplitude(1, "Acceleration, still", ACCELERATION),
        amplitude(2, "Acceleration, moving", ACCELERATION).doc(NOT_BELOW_STILL),
        width(3, "Acceleration, width"),
        amplitude(4, "Rate, still", RATE),
        amplitude(5, "Rate, moving", RATE).doc(NOT_BELOW_STILL),
        width(6, "Rate, width"),
        amplitude(7, "Velocity, still", ACCELERATION).doc("of the leaky mean of the acceleration"),
        amplitude(8, "Velocity, moving", ACCELERATION).doc(NOT_BELOW_STILL),
        width(9, "Velocity, width"),
        real(
            10,
            "Stillness learnt from",
            0.0,
            0.0,
            stillness::MOST_SECONDS,
        )
        .unit("s"),
        real(11, "Motion learnt from", 0.0, 0.0, stillness::MOST_SECONDS).unit("s"),
        real(12, "Age", 0.0, 0.0, stillness::OLDEST)
            .unit("s")
            .doc("how long the foot has run since it last learnt anything"),
    ]
};

const NOT_BELOW_STILL: &str = "not below that of stillness";

const fn per_axis(defaults: PerAxis<f32>, high: f32, units: [&'static str; 2]) -> [Entry; 6] {
    const fn axis(sub: u8, name: &'static str, value: f32, high: f32, unit: &'static str) -> Entry {
        Entry::setting(sub, name, Value::F32(value))
            .range(Value::F32(1.0e-6), Value::F32(high))
            .unit(unit)
    }
    let [acceleration, rate] = units;
    [
        axis(1, "ax", defaults.ax, high, acceleration),
        axis(2, "ay", defaults.ay, high, acceleration),
        axis(3, "az", defaults.az, high, acceleration),
        axis(4, "wx", defaults.wx, high, rate),
        axis(5, "wy", defaults.wy, high, rate),
        axis(6, "wz", defaults.wz, high, rate),
    ]
}

const SI: [&str; 2] = ["m/s²", "rad/s"];

/// A duration of the decision.
const fn delay(sub: u8, name: &'static str, seconds: f32) -> Entry {
    Entry::setting(sub, name, micros(seconds))
        .range(Value::U32(0), Value::U32(10_000_000))
        .unit("µs")
}

const fn load_threshold(sub: u8, name: &'static str, default: f32) -> Entry {
    Entry::setting(sub, name, Value::F32(default))
        .range(Value::F32(-1.0e9), Value::F32(1.0e9))
        .unit("N")
}

/// The settings of the attitude filter: those of `estimator_core::AttitudeParams` and its
/// `RestParams`, but for the gyroscope's timing, which belongs to the board's sensor.
const ATTITUDE_FILTER: &[Entry] = {
    const FILTER: AttitudeParams = AttitudeParams::DEFAULT;
    &[
        real(
            1,
            "Motion time constant",
            FILTER.motion_time_constant,
            0.1,
            100.0,
        )
        .unit("s"),
        real(2, "Quiet gain", FILTER.quiet_gain, 1.0, 1.0e4),
        real(
            3,
            "Quiet acceleration",
            FILTER.quiet_acceleration,
            1.0e-3,
            10.0,
        )
        .unit("m/s²"),
        real(4, "Quiet rate", FILTER.quiet_rate, 1.0e-4, 1.0).unit("rad/s"),
        real(5, "Rest duration", FILTER.rest.duration, 0.1, 100.0).unit("s"),
        real(
            6,
            "Rest acceleration",
            FILTER.rest.acceleration,
            1.0e-3,
            10.0,
        )
        .unit("m/s²"),
        real(7, "Rest rate", FILTER.rest.rate, 1.0e-4, 1.0).unit("rad/s"),
        real(8, "Bias limit", FILTER.rest.bias_limit, 0.0, 1.0).unit("rad/s"),
        real(
            9,
            "Bias time constant",
            FILTER.rest.bias_time_constant,
            0.1,
            1.0e3,
        )
        .unit("s"),
    ]
};

/// What is wrong with the accelerometer. The ranges are far beyond what an LSM6DSOX has and leave
/// room for no mistake of unit.
const ACCELEROMETER: &[Entry] = {
    const fn bias(sub: u8, name: &'static str, value: f32) -> Entry {
        real(sub, name, value, -2.0, 2.0).unit("m/s²")
    }
    const fn scale(sub: u8, name: &'static str, value: f32) -> Entry {
        real(sub, name, value, 0.9, 1.1)
    }
    const NONE: AccelerometerCorrection = AccelerometerCorrection::NONE;
    &[
        bias(1, "Bias x", NONE.bias.x),
        bias(2, "Bias y", NONE.bias.y),
        bias(3, "Bias z", NONE.bias.z),
        scale(4, "Scale x", NONE.scale.x),
        scale(5, "Scale y", NONE.scale.y),
        scale(6, "Scale z", NONE.scale.z),
    ]
};

const fn real(sub: u8, name: &'static str, default: f32, low: f32, high: f32) -> Entry {
    Entry::setting(sub, name, Value::F32(default)).range(Value::F32(low), Value::F32(high))
}

pub(super) const OBJECTS: &[Object] = &[
    Object {
        index: index::FOOT,
        name: Text::new("Foot"),
        shape: Shape::Var,
        doc: Text::new(MEANING_OF_FOOT),
        entries: &[Entry::setting(0, "Foot", Value::U8(Foot::FrontLeft.code()))
            .range(Value::U8(1), Value::U8(6))],
    },
    Object {
        index: index::NODE_ID,
        name: Text::new("Node id"),
        shape: Shape::Var,
        doc: Text::new("0: that of the foot, 0x10 + 0x2000; 255: none, waits for LSS"),
        entries: &[Entry::setting(0, "Node id", Value::U8(0))
            .range_without([0, 255, 128, 254])
            .doc(RESTART)],
    },
    Object {
        index: index::CAN_BIT_RATE,
        name: Text::new("CAN bit rate"),
        shape: Shape::Var,
        doc: Text::new(
            "125, 250, 500 or 1000; what is sent must not take more than three quarters of it",
        ),
        entries: &[Entry::setting(0, "CAN bit rate", Value::U16(1000))
            .one_of(Choice::CanBitRate)
            .unit("kbit/s")
            .doc(RESTART)],
    },
    Object {
        index: index::UART_RATE,
        name: Text::new("UART rate"),
        shape: Shape::Var,
        doc: Text::new(""),
        entries: &[Entry::setting(0, "UART rate", Value::U32(1_000_000))
            .range(Value::U32(9_600), Value::U32(3_000_000))
            .unit("baud")
            .doc(RESTART)],
    },
    Object {
        index: index::AUTOSTART,
        name: Text::new("Autostart"),
        shape: Shape::Var,
        doc: Text::new("1: operational, and so streaming, by itself after power-up"),
        entries: &[Entry::switch(0, "Autostart", 1)],
    },
    Object {
        index: index::LOCK,
        name: Text::new("Configuration lock"),
        shape: Shape::Var,
        doc: Text::new(
            "1: no other setting can be changed or restored. Guards against accidents, not against intent",
        ),
        entries: &[Entry::switch(0, "Configuration lock", 0)],
    },
    Object {
        index: index::LOG_LEVEL,
        name: Text::new("Log level"),
        shape: Shape::Var,
        doc: Text::new(
            "what is logged over UART: 0 nothing, 1 errors, 2 warnings, 3 information, 4 debugging",
        ),
        entries: &[Entry::setting(0, "Log level", Value::U8(3)).range(Value::U8(0), Value::U8(4))],
    },
    Object {
        index: index::SELF_TEST,
        name: Text::new("Self-test at start"),
        shape: Shape::Var,
        doc: Text::new("1: the sensor's self-test runs at each start"),
        entries: &[Entry::switch(0, "Self-test at start", 0)],
    },
    Object {
        index: index::UART_STREAMS,
        name: Text::new("UART streams"),
        shape: Shape::Array,
        doc: Text::new("one message in so many ticks; 0: none"),
        entries: &[
            Entry::setting(1, "Contact", Value::U16(1)).unit("ms"),
            Entry::setting(2, "Raw sample", Value::U16(0)).unit("ms"),
            Entry::setting(3, "Health", Value::U16(100)).unit("ms"),
        ],
    },
    Object {
        index: index::WINDOW,
        name: Text::new("Window"),
        shape: Shape::Var,
        doc: Text::new("how far back the estimate looks; only with method 1 of 0x2016"),
        entries: &[
            Entry::setting(0, "Window", window_us(Params::DEFAULT.window))
                .range(Value::U32(1_000), Value::U32(256_000))
                .unit("µs"),
        ],
    },
    Object {
        index: index::BANDWIDTH,
        name: Text::new("Bandwidth"),
        shape: Shape::Array,
        doc: Text::new(
            "kernel standard deviation h: the sensor's noise; only with method 1 of 0x2016",
        ),
        entries: &per_axis(Params::DEFAULT.bandwidth, 1.0e3, SI),
    },
    Object {
        index: index::HALF_WIDTH,
        name: Text::new("Half-width"),
        shape: Shape::Array,
        doc: Text::new("motion within ±δ counts as rest; only with method 1 of 0x2016"),
        entries: &per_axis(Params::DEFAULT.half_width, 1.0e4, SI),
    },
    Object {
        index: index::ATTITUDE_FILTER,
        name: Text::new("Attitude filter"),
        shape: Shape::Record,
        doc: Text::new("how gravity and the gyroscope's bias are found"),
        entries: ATTITUDE_FILTER,
    },
    Object {
        index: index::DECISION,
        name: Text::new("Decision"),
        shape: Shape::Record,
        doc: Text::new("when the probability becomes a yes or a no"),
        entries: &[
            Entry::setting(
                1,
                "Threshold",
                Value::F32(Params::DEFAULT.decision.threshold),
            )
            .range(Value::F32(0.01), Value::F32(0.99)),
            delay(2, "On delay", Params::DEFAULT.decision.on_delay),
            delay(3, "Off delay", Params::DEFAULT.decision.off_delay),
        ],
    },
    Object {
        index: index::LOAD_INPUT,
        name: Text::new("Load input"),
        shape: Shape::Record,
        doc: Text::new("load = scale × (reading − offset)"),
        entries: &[
            Entry::setting(1, "Source", Value::U8(0))
                .range(Value::U8(0), Value::U8(2))
                .doc("0 none, 1 analog input, 2 CAN (RPDO1)"),
            Entry::setting(2, "Scale", Value::F32(1.0))
                .range(Value::F32(-1.0e6), Value::F32(1.0e6))
                .unit("N")
                .doc("per step of the analog reading"),
            Entry::setting(3, "Offset", Value::F32(0.0))
                .range(Value::F32(-1.0e6), Value::F32(1.0e6))
                .doc("the analog reading without load"),
            load_threshold(4, "On threshold", Params::DEFAULT.load.on_threshold)
                .doc("loaded from here on; not below the off threshold"),
            load_threshold(5, "Off threshold", Params::DEFAULT.load.off_threshold)
                .doc("no longer loaded below; not above the on threshold"),
        ],
    },
    Object {
        index: index::ESTIMATION,
        name: Text::new("Estimation"),
        shape: Shape::Record,
        doc: Text::new("where the limits of stillness come from"),
        entries: ESTIMATION,
    },
    Object {
        index: index::ACCELEROMETER,
        name: Text::new("Accelerometer correction"),
        shape: Shape::Record,
        doc: Text::new(
            "what the estimate rests on is (reading − bias) × scale; `footfall calibrate --rests` finds both",
        ),
        entries: ACCELEROMETER,
    },
    Object {
        index: index::LEARNT,
        name: Text::new("Learnt"),
        shape: Shape::Record,
        doc: Text::new(
            "what the foot starts with: means of the logarithms of amplitudes, and what they rest on. Nothing where 10 and 11 are both 0, whatever else stands here. To write all of it: first 0 to 10 and 11, then the others, then those two. 0x2120 writes it from what the foot has learnt",
        ),
        entries: &LEARNT,
    },
];
