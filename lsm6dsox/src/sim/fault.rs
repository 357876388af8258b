//! Faults of a part, injected on request.

use crate::setting::Sensor;

/// An axis of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The first pair of output bytes.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

impl Axis {
    /// In the order of the outputs.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];
}

/// A fault of the part. Faults add up; the same kind again replaces the earlier one, but for
/// [`AxisStuck`](Self::AxisStuck), which each axis has for itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PartFault {
    /// The part's data line is stuck at 0: every byte read is 0x00.
    MisoStuckLow,
    /// The part's data line is stuck at 1: every byte read is 0xFF.
    MisoStuckHigh,
    /// Each bit read is wrong with this probability.
    BitFlips {
        /// Wrong bits in a million.
        per_million: u32,
    },
    /// `WHO_AM_I` says something else.
    WrongId(u8),
    /// The supply dips now: the part boots, and all its settings are gone. Done once.
    Reset,
    /// The interrupt pins stay low.
    DataReadyLost,
    /// The interrupt pins toggle on their own.
    DataReadyStorm {
        /// Time from one rising edge to the next, ns.
        period_ns: u32,
    },
    /// The outputs stay as they are, and yet are announced as new.
    FrozenOutput,
    /// The outputs of one sensor stay as they are, and yet are announced as new; the other sensor
    /// goes on.
    SensorFrozen(Sensor),
    /// One axis gives the same code with every sample, whatever the motion; the other five go on.
    AxisStuck {
        /// Of which sensor.
        sensor: Sensor,
        /// Which of its axes.
        axis: Axis,
        /// The code that it gives, in steps of the full scale that is set.
        code: i16,
    },
    /// Bits of a register change their value now, whether they can be written or not, and the part
    /// acts on it as on a write. Done once: a write or a reset puts the register right.
    RegisterFlipped {
        /// Where: 7 bits, in the bank described in [`register`](crate::register).
        address: u8,
        /// The bits that change.
        bits: u8,
    },
    /// From the clock's edge until the data line is valid it takes so long, instead of
    /// [`sdo_delay_ns`](super::PartOptions::sdo_delay_ns).
    SdoDelay {
        /// ns.
        ns: u32,
    },
    /// The interrupt pins show pulses of 1 µs in addition to those of the samples.
    DataReadyGlitches {
        /// Time from one rising edge of a glitch to the next, ns; at least 2 µs.
        period_ns: u32,
    },
    /// Every axis is driven beyond the end of its range.
    Saturation,
    /// The clock runs at this rate over the one it was made with; the trim does not show it.
    ClockRatio(f64),
}

/// The faults in force.
#[derive(Clone, Debug, Default)]
pub(super) struct Faults {
    pub(super) stuck: Option<u8>,
    pub(super) flips_per_million: u32,
    pub(super) id: Option<u8>,
    pub(super) pins_lost: bool,
    pub(super) storm_period_ns: Option<u64>,
    pub(super) sdo_delay_ns: Option<u32>,
    pub(super) glitch_period_ns: Option<u64>,
    pub(super) gyro: Broken,
    pub(super) accel: Broken,
    pub(super) saturated: bool,
}

/// The faults of the outputs of one sensor.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Broken {
    pub(super) frozen: bool,
    pub(super) stuck: [Option<i16>; 3],
}

impl Faults {
    pub(super) const fn broken(&mut self, sensor: Sensor) -> &mut Broken {
        match sensor {
            Sensor::Accel => &mut self.accel,
            Sensor::Gyro => &mut self.gyro,
        }
    }
}
