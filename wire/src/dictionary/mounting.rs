//! 0x2019: orientation of the sensor's axes in the foot.

use estimator_core::SensorAxis;

use super::axes::{AXES, code_of_axes};
use super::{Concern, Entry, Object, Shape, Text, index};
use crate::value::Value;

pub(super) const OBJECT: Object = {
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
            "how the sensor's axes lie in the foot, whose z is up: samples are turned by it after 0x2017 and before the estimate; `footfall calibrate` finds it",
        ),
        entries: &[
            Entry::setting(1, "Axes", Concern::Correction, Value::U16(IDENTITY))
                .one_of(AXES)
                .key("axes")
                .doc("one digit each for the foot's x, y and z: the sensor's axis along it, 1 x, 2 y, 3 z, 4 −x, 5 −y, 6 −z; 0: as 2 to 5 say, which must then be of length 1 within a thousandth"),
            part(2, "Rotation w", 1.0).doc("2 to 5: quaternion, Hamilton, sensor → foot"),
            part(3, "Rotation x", 0.0),
            part(4, "Rotation y", 0.0),
            part(5, "Rotation z", 0.0),
        ],
    }
};
