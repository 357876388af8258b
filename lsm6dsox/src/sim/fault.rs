//! What can be wrong with a part, on request.

/// A fault. Faults add up; the same kind again replaces the earlier one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
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
    /// Every axis is driven beyond the end of its range.
    Saturation,
    /// The clock runs at this rate over the one it was made with; the trim does not tell.
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
    pub(super) frozen: bool,
    pub(super) saturated: bool,
}
