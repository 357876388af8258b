//! TPDO7: health, and the foot's clock at the last SYNC.
//!
//! | bytes | field |
//! |---|---|
//! | 0 | the estimator's flags: bit 0 window not full, 1 up not known, 2 saturated, 3 stale, 4 invalid sample, 5 time gap |
//! | 1 | error register (object 0x1001) |
//! | 2, 3 | frames dropped before they got onto CAN or UART, modulo 2¹⁶ |
//! | 4 to 7 | the foot's clock when the last SYNC came, µs modulo 2³²; 0 before the first |
//!
//! A SYNC reaches all feet at the same moment, so the difference of two feet's bytes 4 to 7 is
//! the difference of their clocks.

use estimator_core::{Flag, Flags, Timestamp};

use super::{Mapped, Signal};
use crate::dictionary::index;

/// The contents of TPDO7.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// The estimator's flags as bits.
    pub flags: u8,
    /// The error register.
    pub register: u8,
    /// Frames dropped, modulo 2¹⁶.
    pub dropped: u16,
    /// The foot's clock when the last SYNC came, µs modulo 2³².
    pub sync_time: u32,
}

impl Health {
    /// The frame for these flags, this error register, these drops and this last SYNC.
    #[must_use]
    pub fn new(flags: Flags, register: u8, dropped: u32, sync: Option<Timestamp>) -> Self {
        Self {
            flags: flags.bits(),
            register,
            dropped: dropped as u16,
            sync_time: sync.map_or(0, |time| time.as_micros() as u32),
        }
    }

    /// Whether the estimator raised `flag`.
    #[must_use]
    pub const fn contains(&self, flag: Flag) -> bool {
        self.flags & Flags::NONE.with(flag).bits() != 0
    }

    /// The frame's bytes.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        let [dropped_low, dropped_high] = self.dropped.to_le_bytes();
        let [a, b, c, d] = self.sync_time.to_le_bytes();
        let (flags, register) = (self.flags, self.register);
        [flags, register, dropped_low, dropped_high, a, b, c, d]
    }

    /// The frame with these bytes, whatever they are.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        let [flags, register, dropped_low, dropped_high, a, b, c, d] = *bytes;
        Self {
            flags,
            register,
            dropped: u16::from_le_bytes([dropped_low, dropped_high]),
            sync_time: u32::from_le_bytes([a, b, c, d]),
        }
    }
}

pub(super) const MAPPING: &[Mapped] = &[
    Mapped::new(index::HEALTH, 1, 8),
    Mapped::new(index::ERROR_REGISTER, 0, 8),
    Mapped::new(index::HEALTH, 2, 16),
    Mapped::new(index::HEALTH, 3, 32),
];

pub(super) const SIGNALS: &[Signal] = &[
    Signal::flag("WindowNotFull", 0, "Fewer samples than the window holds."),
    Signal::flag("AttitudeNotInitialised", 1, "Up is not yet known."),
    Signal::flag(
        "SampleSaturated",
        2,
        "The newest sample is at the end of the sensor's range.",
    ),
    Signal::flag("Stale", 3, "The newest sample repeats an earlier one."),
    Signal::flag("InvalidSample", 4, "The newest sample cannot be used."),
    Signal::flag(
        "TimeGap",
        5,
        "More than one and a half periods since the sample before.",
    ),
    Signal::unsigned("ErrorRegister", 8, 8, 1.0, "", "Object 0x1001 of CiA 301."),
    Signal::unsigned(
        "Dropped",
        16,
        16,
        1.0,
        "",
        "Frames replaced by newer ones before they got onto CAN or UART; wraps after 65535.",
    ),
    Signal::unsigned(
        "SyncTime",
        32,
        32,
        1.0,
        "us",
        "The foot's clock when the last SYNC came; 0 before the first.",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes() {
        let flags = Flags::NONE.with(Flag::Stale).with(Flag::TimeGap);
        let sync = Some(Timestamp::from_micros(0x5_1234_5678));
        let health = Health::new(flags, 0x81, 0x1_0203, sync);
        assert_eq!(
            health.encode(),
            [0x28, 0x81, 0x03, 0x02, 0x78, 0x56, 0x34, 0x12]
        );
        assert_eq!(Health::decode(&health.encode()), health);
        assert!(health.contains(Flag::Stale) && !health.contains(Flag::Saturated));
    }

    #[test]
    fn the_first_signals_are_the_flags_in_their_order() {
        for (i, flag) in Flag::ALL.into_iter().enumerate() {
            let name: std::string::String = (SIGNALS[i].name.chars())
                .filter(|c| !c.is_whitespace())
                .collect();
            let flag = flag.name().replace('_', "");
            assert!(name.to_lowercase().ends_with(&flag), "{name} is not {flag}");
            assert_eq!(usize::from(SIGNALS[i].start), i);
        }
    }
}
