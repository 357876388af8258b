//! 0x2000 to 0x20FF: the configuration of the foot.

use estimator_core::{
    AccelerometerCorrection, AttitudeParams, Params, PerAxis, Residual, SlideParams, WindowLength,
};

use super::{Entry, Limits, Object, Shape, Text, index};
use crate::foot::Foot;
use crate::value::Value;

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

/// What else testifies of an axis, and how sharply: what the default preset adds to the paper's
/// method.
const WITNESSES: &[Entry] = {
    const SHORT_WINDOW: Value = match Params::DEFAULT.short_window {
        Some(window) => window_us(window),
        None => Value::U32(0),
    };
    const SLIDE: SlideParams = match Params::DEFAULT.slide {
        Some(slide) => slide,
        None => SlideParams {
            speed: 0.0,
            ..SlideParams::DEFAULT
        },
    };
    &[
        Entry::setting(1, "Short window", SHORT_WINDOW)
            .range(Value::U32(0), Value::U32(256_000))
            .unit("µs")
            .doc("an axis has the lower probability of both windows; at least 5 samples; 0, or the window or more: there is but one"),
        real(2, "Slide speed", SLIDE.speed, 0.0, 1.0e3)
            .unit("m/s")
            .doc("least speed along the ground that is no rest, more where half-widths are wide; 0, or fewer than 200 samples a second: accelerations only"),
        real(3, "Slide time constant", SLIDE.time_constant, 1.0e-3, 10.0)
            .unit("s")
            .doc("for how long speed is remembered"),
        real(4, "Tolerance", Params::DEFAULT.tolerance, 0.0, 1.0)
            .doc("how well half-widths are known, as a part of themselves; from 0.74 on a foot at rest is below one half"),
        Entry::switch(
            5,
            "Residual",
            matches!(Params::DEFAULT.residual, Residual::Removed) as u8,
        )
        .doc("1: what quiet stances show to be left of gravity is taken out; 0: it stays in"),
    ]
};

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
            .limits(Limits::RangeWithout(&[
                Value::U8(0),
                Value::U8(255),
                Value::U8(128),
                Value::U8(254),
            ]))
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
            .limits(Limits::OneOf(&[
                Value::U16(125),
                Value::U16(250),
                Value::U16(500),
                Value::U16(1000),
            ]))
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
        doc: Text::new("how far back the estimate looks"),
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
        doc: Text::new("kernel standard deviation h: the sensor's noise"),
        entries: &per_axis(Params::DEFAULT.bandwidth, 1.0e3, SI),
    },
    Object {
        index: index::HALF_WIDTH,
        name: Text::new("Half-width"),
        shape: Shape::Array,
        doc: Text::new("motion within ±δ counts as rest"),
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
        index: index::WITNESSES,
        name: Text::new("Witnesses"),
        shape: Shape::Record,
        doc: Text::new("what else testifies of an axis beside the window, and how sharply"),
        entries: WITNESSES,
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
];
