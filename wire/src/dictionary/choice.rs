//! Settings with a list of allowed values.

use super::axes;
use crate::value::Value;

/// Bit rates of a bus, kbit/s, in ascending order.
const CAN_BIT_RATES: &[Value] = &[
    Value::U16(125),
    Value::U16(250),
    Value::U16(500),
    Value::U16(1000),
];

/// Lists of allowed values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Choice {
    CanBitRate,
    Axes,
}

impl Choice {
    pub(super) const fn values(self) -> &'static [Value] {
        match self {
            Self::CanBitRate => CAN_BIT_RATES,
            Self::Axes => axes::AXES,
        }
    }
}
