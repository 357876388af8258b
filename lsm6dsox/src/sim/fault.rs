//! Faults of the simulated part.

use crate::setting::Sensor;

/// An axis of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// First pair of output bytes.
    X,
    /// Second pair.
    Y,
    /// Third pair.
    Z,
}

impl Axis {
    /// All axes, in the order of the outputs.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];
}

/// Fault of the part. Faults accumulate. A second fault of the same kind replaces the first, except that
/// [`AxisStuck`](Self::AxisStuck) applies per axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PartFault {
    /// The part's data line is stuck at 0: every byte read is 0x00.
    MisoStuckLow,
    /// The part's data line is stuck at 1: every byte read is 0xFF.
    MisoStuckHigh,
    /// Each bit read is inverted with this probability.
    BitFlips {
        /// Inverted bits per million.
        per_million: u32,
    },
    /// `WHO_AM_I` reads this value.
    WrongId(u8),
    /// The supply dips now. The part boots, and all its settings are lost. Applied once.
    Reset,
    /// The supply dips now, as with [`Reset`](Self::Reset), and returns while INT1 is held high. The part then answers
    /// only on I3C. Applied once.
    Int1High,
    /// The interrupt pins stay low.
    DataReadyLost,
    /// Pulses of samples are lost at random on the interrupt pins.
    DataReadyLosses {
        /// Lost pulses per million, at most 999 999.
        per_million: u32,
    },
    /// The interrupt pins toggle on their own.
    DataReadyStorm {
        /// Time from one rising edge to the next, ns.
        period_ns: u32,
    },
    /// The outputs do not change, but are reported as new.
    FrozenOutput,
    /// The outputs of one sensor do not change, but are reported as new; the other sensor
    /// is unaffected.
    SensorFrozen(Sensor),
    /// One axis outputs the same code with every sample, whatever the motion; the other five are unaffected.
    AxisStuck {
        /// Affected sensor.
        sensor: Sensor,
        /// Affected axis.
        axis: Axis,
        /// Output code, in steps of the configured full scale.
        code: i16,
    },
    /// Bits of a register flip now, whether writable or not, and the part
    /// acts on the value as on a write. Applied once: a write or a reset restores the register.
    RegisterFlipped {
        /// Address: 7 bits, in the bank described in [`register`](crate::register).
        address: u8,
        /// Bits to flip.
        bits: u8,
    },
    /// Reserved bits of the registers that can be written read as the opposite of the data sheet's values.
    ReservedBits,
    /// Delay from the clock's edge until the data line is valid, instead of
    /// [`sdo_delay_ns`](super::PartOptions::sdo_delay_ns).
    SdoDelay {
        /// Delay, ns.
        ns: u32,
    },
    /// The interrupt pins show short pulses in addition to those of the samples.
    DataReadyGlitches {
        /// Time from one rising edge of a glitch to the next, ns; at least twice its width.
        period_ns: u32,
        /// Width, ns.
        width_ns: u32,
    },
    /// The interrupt pins are inverted on their way to the host.
    PinsInverted,
    /// Every axis is driven beyond the end of its range.
    Saturation,
    /// Ratio of the clock's rate to its initial rate. The trim does not show it.
    ClockRatio(f64),
}

/// Active faults.
#[derive(Clone, Debug, Default)]
pub(super) struct Faults {
    pub(super) stuck: Option<u8>,
    pub(super) flips_per_million: u32,
    pub(super) id: Option<u8>,
    pub(super) reserved_bits: bool,
    pub(super) pins_lost: bool,
    pub(super) losses_per_million: u32,
    pub(super) storm_period_ns: Option<u64>,
    pub(super) sdo_delay_ns: Option<u32>,
    /// Period and width.
    pub(super) glitches_ns: Option<[u64; 2]>,
    pub(super) pins_inverted: bool,
    pub(super) gyro: Broken,
    pub(super) accel: Broken,
    pub(super) saturated: bool,
}

/// Active faults of the outputs of one sensor.
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
