//! 0x2000 to 0x20FF: the configuration of the foot.

use estimator_core::any::AnyParams;
use estimator_core::correction::AccelerometerCorrection;
use estimator_core::mounting::SensorAxis;
use estimator_core::mounting::handedness;
use estimator_core::parameter::{self, Parameter, Row};
use estimator_core::{Learning, Learnt, Params, Stream};

use super::index;
use super::object::{Concern, Entry, Object, Shape, Text};
use crate::foot::Foot;
use crate::value::Value;

const MEANING_OF_FOOT: &str = "1 FL, 2 FR, 3 RL, 4 RR, 5 L, 6 R; a label for people and files; it determines the node id if 0x2001 is 0";
const RESTART: &str = "takes effect with the next reset of the node or of its communication";

/// Bit rates of a bus, kbit/s, in ascending order.
const CAN_BIT_RATES: &[Value] =
    &[Value::U16(125), Value::U16(250), Value::U16(500), Value::U16(1000)];

/// Maximum length of the window in the estimator on the board, samples.
pub const WINDOW_CAPACITY: usize = 256;

/// Window: at least one sample, at most the estimator's capacity.
const WINDOW: Row = {
    const PERIOD: f32 = 1.0 / Stream::KILOHERTZ.sample_rate();
    Row { least: PERIOD, most: WINDOW_CAPACITY as f32 * PERIOD, ..parameter::WINDOW }
};

/// Estimation of the probability.
const ESTIMATION: &[Entry] = &[
    Entry::switch(1, "Method", Concern::Estimator, AnyParams::DEFAULT.method as u8)
        .key("method")
        .doc("source of the limits of stillness. 0 self-calibrating: the foot learns them while it walks; 1 half-widths: those of 0x2012"),
    Entry::switch(2, "Learning", Concern::Estimator, matches!(Params::DEFAULT.learning, Learning::On) as u8)
        .key("learning")
        .doc("1 the foot learns; 0 frozen: the learnt values do not change. No effect with method 1"),
];

/// Numbers of [`Learnt`] in the order of its array.
pub(super) const LEARNT_NUMBERS: [Entry; Learnt::NUMBERS] = {
    const fn learnt(subindex: u8, name: &'static str, row: Row) -> Entry {
        Entry::row(subindex, name, Concern::Learnt, row)
    }
    let [still, moving, speed, still_seconds, moving_seconds] = Learnt::ROWS;
    [
        learnt(1, "Acceleration, still", still),
        learnt(2, "Acceleration, moving", moving).doc("not below that of stillness"),
        learnt(3, "Speed, still", speed)
            .doc("sum of the accelerations along the ground in stances"),
        learnt(4, "Stillness learnt from", still_seconds),
        learnt(5, "Motion learnt from", moving_seconds),
    ]
};

/// Words of [`Learnt`]'s stored form: its numbers, then the version and the CRC.
const LEARNT: [Entry; Learnt::WORDS] = {
    let [still, moving, speed, still_seconds, moving_seconds] = LEARNT_NUMBERS;
    [
        still,
        moving,
        speed,
        still_seconds,
        moving_seconds,
        Entry::setting(6, "Version", Concern::Learnt, Value::U32(0))
            .key("learnt.version")
            .doc("version of these numbers, 1 for this program. They are ignored with another version or a wrong CRC"),
        Entry::setting(7, "CRC", Concern::Learnt, Value::U32(0))
            .key("learnt.crc")
            .doc("CRC-32 (ISO-HDLC) of version and numbers, as 24 bytes with the lowest byte of each first. Write it last"),
    ]
};

const fn per_axis([ax, ay, az, wx, wy, wz]: [Parameter; 6]) -> [Entry; 6] {
    [
        Entry::parameter(1, "ax", ax),
        Entry::parameter(2, "ay", ay),
        Entry::parameter(3, "az", az),
        Entry::parameter(4, "wx", wx),
        Entry::parameter(5, "wy", wy),
        Entry::parameter(6, "wz", wz),
    ]
}

/// Settings of the attitude filter: `estimator_core::params::AttitudeParams` and its `RestParams`, except the
/// gyroscope's timing, which is a property of the board's sensor.
const ATTITUDE_FILTER: &[Entry] = &[
    Entry::parameter(1, "Motion time constant", Parameter::MotionTimeConstant),
    Entry::parameter(2, "Quiet gain", Parameter::QuietGain),
    Entry::parameter(3, "Quiet acceleration", Parameter::QuietAcceleration),
    Entry::parameter(4, "Quiet rate", Parameter::QuietRate),
    Entry::parameter(5, "Rest duration", Parameter::RestDuration),
    Entry::parameter(6, "Rest acceleration", Parameter::RestAcceleration),
    Entry::parameter(7, "Rest rate", Parameter::RestRate),
    Entry::parameter(8, "Bias limit", Parameter::BiasLimit),
    Entry::parameter(9, "Bias time constant", Parameter::BiasTimeConstant),
];

/// Errors of the accelerometer. The ranges far exceed those of an LSM6DSOX, but exclude values in a wrong unit.
const ACCELEROMETER: &[Entry] = {
    const fn corrected(sub: u8, name: &'static str, value: f32, low: f32, high: f32) -> Entry {
        Entry::setting(sub, name, Concern::Correction, Value::F32(value))
            .range(Value::F32(low), Value::F32(high))
    }
    const fn bias(sub: u8, name: &'static str, key: &'static str, value: f32) -> Entry {
        corrected(sub, name, value, -2.0, 2.0).unit("m/s²").key(key)
    }
    const fn scale(sub: u8, name: &'static str, key: &'static str, value: f32) -> Entry {
        corrected(sub, name, value, 0.9, 1.1).key(key)
    }
    const NONE: AccelerometerCorrection = AccelerometerCorrection::NONE;
    &[
        bias(1, "Bias x", "accelerometer.bias_m_s2.ax", NONE.bias.x),
        bias(2, "Bias y", "accelerometer.bias_m_s2.ay", NONE.bias.y),
        bias(3, "Bias z", "accelerometer.bias_m_s2.az", NONE.bias.z),
        scale(4, "Scale x", "accelerometer.scale.ax", NONE.scale.x),
        scale(5, "Scale y", "accelerometer.scale.ay", NONE.scale.y),
        scale(6, "Scale z", "accelerometer.scale.az", NONE.scale.z),
        Entry::setting(7, "Part", Concern::Correction, Value::U8(0))
            .range(Value::U8(0), Value::U8(1))
            .doc("0 LSM6DSOX, ±16 g; 1 LSM6DSO32, ±32 g. The self-test follows it from the next start on"),
    ]
};

/// Code of a mounting given by the quaternion.
pub(crate) const AS_QUATERNION: u16 = 0;

/// Number of orientations in which a sensor's axes lie along those of the foot.
const WAYS: usize = 24;

/// Code of the sensor's axes along the foot's x, y and z. Its digits are these axes, numbered as in [`SensorAxis`]. So
/// a mounting along axes is one number, and each allowed number is a mounting.
#[must_use]
pub const fn code_of_axes([x, y, z]: [SensorAxis; 3]) -> u16 {
    100 * x as u16 + 10 * y as u16 + z as u16
}

/// Codes of all mountings along axes, in ascending order. The compiler builds the list, and would report an index out
/// of range.
#[allow(clippy::indexing_slicing)]
const AXES: &[Value] = &{
    let mut values = [Value::U16(AS_QUATERNION); 1 + WAYS];
    let (mut count, mut i) = (1, 0);
    while i < 6 * 6 * 6 {
        const ALL: [SensorAxis; 6] = SensorAxis::ALL;
        let axes = [ALL[i / 36], ALL[i / 6 % 6], ALL[i % 6]];
        if handedness(axes) == 1 {
            values[count] = Value::U16(code_of_axes(axes));
            count += 1;
        }
        i += 1;
    }
    assert!(count == values.len());
    values
};

/// Orientation of the sensor's axes in the foot.
const MOUNTING: Object = {
    const fn part(subindex: u8, name: &'static str, default: f32) -> Entry {
        Entry::setting(subindex, name, Concern::Correction, Value::F32(default))
            .range(Value::F32(-1.0), Value::F32(1.0))
    }
    const IDENTITY: u16 = code_of_axes([SensorAxis::X, SensorAxis::Y, SensorAxis::Z]);
    Object {
        index: index::MOUNTING,
        name: Text::new("Mounting"),
        shape: Shape::Record,
        doc: Text::new(
            "orientation of the sensor's axes in the foot, whose z is up. Applied to samples after 0x2017 and before the estimate; `footfall calibrate` finds it",
        ),
        entries: &[
            Entry::setting(1, "Axes", Concern::Correction, Value::U16(IDENTITY))
                .one_of(AXES)
                .key("axes")
                .doc("one digit each for the foot's x, y and z: the sensor's axis along it (1 x, 2 y, 3 z, 4 −x, 5 −y, 6 −z). 0: the quaternion in 2 to 5, whose length must be 1 within a thousandth"),
            part(2, "Rotation w", 1.0).doc("2 to 5: quaternion, Hamilton, sensor → foot"),
            part(3, "Rotation x", 0.0),
            part(4, "Rotation y", 0.0),
            part(5, "Rotation z", 0.0),
        ],
    }
};

pub(super) const OBJECTS: &[Object] = &[
    Object {
        index: index::FOOT,
        name: Text::new("Foot"),
        shape: Shape::Var,
        doc: Text::new(MEANING_OF_FOOT),
        entries: &[Entry::setting(0, "Foot", Concern::Node, Value::U8(Foot::FrontLeft.code()))
            .range(Value::U8(1), Value::U8(6))],
    },
    Object {
        index: index::NODE_ID,
        name: Text::new("Node id"),
        shape: Shape::Var,
        doc: Text::new("0: 0x10 plus the value of 0x2000; 255: none, the node waits for LSS"),
        entries: &[Entry::setting(0, "Node id", Concern::Node, Value::U8(0))
            .range_without(&[Value::U8(0), Value::U8(255), Value::U8(128), Value::U8(254)])
            .doc(RESTART)],
    },
    Object {
        index: index::CAN_BIT_RATE,
        name: Text::new("CAN bit rate"),
        shape: Shape::Var,
        doc: Text::new(
            "125, 250, 500 or 1000; the foot's messages must not take more than three quarters of it",
        ),
        entries: &[Entry::setting(0, "CAN bit rate", Concern::Node, Value::U16(1000))
            .one_of(CAN_BIT_RATES)
            .unit("kbit/s")
            .doc(RESTART)],
    },
    Object {
        index: index::UART_RATE,
        name: Text::new("UART rate"),
        shape: Shape::Var,
        doc: Text::new(""),
        entries: &[Entry::setting(0, "UART rate", Concern::Node, Value::U32(1_000_000))
            .range(Value::U32(9_600), Value::U32(3_000_000))
            .unit("baud")
            .doc(concat!(
                "takes effect with the next reset of the node or of its communication; ",
                "a rate of 3000000 is 2963000 in fact, 1.2 % lower"
            ))],
    },
    Object {
        index: index::AUTOSTART,
        name: Text::new("Autostart"),
        shape: Shape::Var,
        doc: Text::new(
            "1: the node becomes operational after power-up without a command, and streams",
        ),
        entries: &[Entry::switch(0, "Autostart", Concern::Node, 1)],
    },
    Object {
        index: index::LOCK,
        name: Text::new("Configuration lock"),
        shape: Shape::Var,
        doc: Text::new(
            "1: no other setting can be changed or restored. Protects against accidents, not against intent",
        ),
        entries: &[Entry::switch(0, "Configuration lock", Concern::Node, 0)],
    },
    Object {
        index: index::LOG_LEVEL,
        name: Text::new("Log level"),
        shape: Shape::Var,
        doc: Text::new(
            "highest level logged over UART: 0 none, 1 errors, 2 warnings, 3 information",
        ),
        entries: &[Entry::setting(0, "Log level", Concern::Stream, Value::U8(3))
            .range(Value::U8(0), Value::U8(3))],
    },
    Object {
        index: index::SELF_TEST,
        name: Text::new("Self-test at start"),
        shape: Shape::Var,
        doc: Text::new("1: the sensor's self-test runs at each start"),
        entries: &[Entry::switch(0, "Self-test at start", Concern::Sensor, 0)],
    },
    Object {
        index: index::UART_STREAMS,
        name: Text::new("UART streams"),
        shape: Shape::Array,
        doc: Text::new("one message in N ms, to the nearest tick; 0: none"),
        entries: &[
            Entry::setting(1, "Contact", Concern::Stream, Value::U16(1)).unit("ms"),
            Entry::setting(2, "Raw sample", Concern::Stream, Value::U16(0)).unit("ms"),
            Entry::setting(3, "Health", Concern::Stream, Value::U16(100)).unit("ms"),
        ],
    },
    Object {
        index: index::WINDOW,
        name: Text::new("Window"),
        shape: Shape::Var,
        doc: Text::new("length of the estimate's window; only with method 1 of 0x2016"),
        entries: &[Entry::row_in_micros(0, "Window", Concern::Estimator, WINDOW)],
    },
    Object {
        index: index::BANDWIDTH,
        name: Text::new("Bandwidth"),
        shape: Shape::Array,
        doc: Text::new(
            "kernel standard deviation h: the sensor's noise; only with method 1 of 0x2016",
        ),
        entries: &per_axis([
            Parameter::BandwidthAx,
            Parameter::BandwidthAy,
            Parameter::BandwidthAz,
            Parameter::BandwidthWx,
            Parameter::BandwidthWy,
            Parameter::BandwidthWz,
        ]),
    },
    Object {
        index: index::HALF_WIDTH,
        name: Text::new("Half-width"),
        shape: Shape::Array,
        doc: Text::new("motion within ±δ counts as rest; only with method 1 of 0x2016"),
        entries: &per_axis([
            Parameter::HalfWidthAx,
            Parameter::HalfWidthAy,
            Parameter::HalfWidthAz,
            Parameter::HalfWidthWx,
            Parameter::HalfWidthWy,
            Parameter::HalfWidthWz,
        ]),
    },
    Object {
        index: index::ATTITUDE_FILTER,
        name: Text::new("Attitude filter"),
        shape: Shape::Record,
        doc: Text::new("estimation of gravity and of the gyroscope's bias"),
        entries: ATTITUDE_FILTER,
    },
    Object {
        index: index::DECISION,
        name: Text::new("Decision"),
        shape: Shape::Record,
        doc: Text::new("debounced decision from the probability"),
        entries: &[
            Entry::parameter(1, "Threshold", Parameter::DecisionThreshold),
            Entry::parameter_in_micros(2, "On delay", Parameter::DecisionOnDelay),
            Entry::parameter_in_micros(3, "Off delay", Parameter::DecisionOffDelay),
        ],
    },
    Object {
        index: index::LOAD_INPUT,
        name: Text::new("Load input"),
        shape: Shape::Record,
        doc: Text::new("load = scale × (reading − offset)"),
        entries: &[
            Entry::setting(1, "Source", Concern::Load, Value::U8(0))
                .range(Value::U8(0), Value::U8(2))
                .doc("0 none, 1 analog input, 2 CAN (RPDO1)"),
            Entry::setting(2, "Scale", Concern::Load, Value::F32(1.0))
                .range(Value::F32(-1.0e6), Value::F32(1.0e6))
                .unit("N")
                .doc("load per step of the analog reading"),
            Entry::setting(3, "Offset", Concern::Load, Value::F32(0.0))
                .range(Value::F32(-1.0e6), Value::F32(1.0e6))
                .doc("the analog reading without load"),
            Entry::parameter(4, "On threshold", Parameter::LoadOnThreshold)
                .doc("the foot is loaded from this load on; not below the off threshold"),
            Entry::parameter(5, "Off threshold", Parameter::LoadOffThreshold)
                .doc("the foot is no longer loaded below this load; not above the on threshold"),
        ],
    },
    Object {
        index: index::ESTIMATION,
        name: Text::new("Estimation"),
        shape: Shape::Record,
        doc: Text::NONE,
        entries: ESTIMATION,
    },
    Object {
        index: index::ACCELEROMETER,
        name: Text::new("Accelerometer correction"),
        shape: Shape::Record,
        doc: Text::new(
            "the estimate uses (reading − bias) × scale; `footfall calibrate --rests` finds both",
        ),
        entries: ACCELEROMETER,
    },
    Object {
        index: index::LEARNT,
        name: Text::new("Learnt"),
        shape: Shape::Record,
        doc: Text::new(
            "learnt values with which the foot starts. 0x2120 copies the present ones here",
        ),
        entries: &LEARNT,
    },
    MOUNTING,
    Object {
        index: index::VELOCITY,
        name: Text::new("Zero-velocity measurement"),
        shape: Shape::Record,
        doc: Text::new(
            "σ² = (speed (1 − P)/P)² + (lever |ω|)² + floor²: standard deviation of a foot's velocity about zero",
        ),
        entries: &[
            Entry::parameter(1, "Speed", Parameter::VelocitySpeed),
            Entry::parameter(2, "Lever", Parameter::VelocityLever),
            Entry::parameter(3, "Floor", Parameter::VelocityFloor),
        ],
    },
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    #[test]
    fn every_code_is_a_quaternion_or_axes_in_ascending_order() {
        let codes: Vec<u32> = AXES.iter().map(|value| value.to_raw()).collect();
        assert!(codes.is_sorted_by(|a, b| a < b));
        assert_eq!((codes[0], codes[1], codes.len()), (0, 123, 25));
        // x, −z, y, and its mirror image.
        assert!(codes.contains(&162) && !codes.contains(&132));
    }
}
