//! TPDO7: health, and the foot's clock at the last SYNC.
//!
//! A SYNC reaches all feet at the same moment: if two feet report the same SYNC, the
//! difference of their bytes 4 to 7 is the difference of their clocks. Byte 3 identifies the
//! SYNC, so the master has to number its SYNCs (object 0x1019 of the master). Bytes 4 and 5 are
//! the [`ShortTime`](super::ShortTime) of that moment, so the samples of both feet are on one
//! clock with it.

use estimator_core::{Flag, Flags};

use super::{Field, LongTime, Signal};
use crate::address::index;
use crate::value::Value;

/// The contents of TPDO7.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// The estimator's flags as bits.
    pub flags: u8,
    /// The error register.
    pub register: u8,
    /// Frames dropped, modulo 2⁸.
    pub dropped: u8,
    /// The last SYNC.
    pub sync: LastSync,
}

/// SYNC and its reception time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LastSync {
    /// Counter, 1 to [`Self::HIGHEST_NUMBER`]; 0 if it had none, and before the first.
    pub counter: u8,
    /// Reception time on the foot's clock.
    pub time: LongTime,
}

impl LastSync {
    /// Highest number of a SYNC: CiA 301 lets its master count to a limit of 2 to this, then from 1 again
    /// (object 0x1019).
    pub const HIGHEST_NUMBER: u8 = 240;

    /// Number of the SYNC after the one with this number, if all numbers are used; 1 after 0, for the
    /// first.
    #[must_use]
    pub const fn number_after(number: u8) -> u8 {
        number % Self::HIGHEST_NUMBER + 1
    }
}

impl Health {
    /// Creates the frame from flags, error register, number of dropped frames and last SYNC.
    #[must_use]
    pub fn new(flags: Flags, register: u8, dropped: u32, sync: LastSync) -> Self {
        Self {
            flags: flags.bits(),
            register,
            dropped: dropped as u8,
            sync,
        }
    }

    /// Returns whether the estimator raised `flag`.
    #[must_use]
    pub const fn contains(&self, flag: Flag) -> bool {
        self.flags & Flags::NONE.with(flag).bits() != 0
    }

    /// Encodes the frame.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        let [a, b, c, d] = self.sync.time.0.to_le_bytes();
        let (flags, register, dropped) = (self.flags, self.register, self.dropped);
        [flags, register, dropped, self.sync.counter, a, b, c, d]
    }

    /// Decodes the frame; accepts any bytes.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        let [flags, register, dropped, counter, a, b, c, d] = *bytes;
        Self {
            flags,
            register,
            dropped,
            sync: LastSync {
                counter,
                time: LongTime(u32::from_le_bytes([a, b, c, d])),
            },
        }
    }
}

pub(super) const FIELDS: [Field; 5] = [
    Field::new(
        index::HEALTH,
        1,
        "Flags",
        Value::U8(0),
        &[
            Signal::flag("WindowNotFull", "Fewer samples than the window holds."),
            Signal::flag("AttitudeNotInitialised", "Up is not yet known."),
            Signal::flag(
                "SampleSaturated",
                "The newest sample is at the end of the sensor's range.",
            ),
            Signal::flag("Stale", "The newest sample repeats an earlier one."),
            Signal::flag("InvalidSample", "The newest sample cannot be used."),
            Signal::flag(
                "TimeGap",
                "More than one and a half periods since the sample before.",
            ),
            Signal::flag(
                "Settling",
                "The foot has not learnt enough of its stillness and motion yet; a few steps end that.",
            ),
        ],
    )
    .doc("of the estimator: bit 0 window not full, 1 up not known, 2 saturated, 3 stale, 4 invalid sample, 5 time gap, 6 settling"),
    Field::new(
        index::ERROR_REGISTER,
        0,
        "Error register",
        Value::U8(0),
        &[Signal::unsigned(
            "ErrorRegister",
            8,
            1.0,
            "",
            "Object 0x1001 of CiA 301.",
        )],
    ),
    Field::new(
        index::HEALTH,
        2,
        "Dropped frames",
        Value::U8(0),
        &[Signal::unsigned(
            "Dropped",
            8,
            1.0,
            "",
            "Frames replaced by newer ones before they got onto CAN or UART; wraps after 255.",
        )],
    )
    .doc("modulo 256; all of them in 0x2112"),
    Field::new(
        index::HEALTH,
        3,
        "Counter of the last SYNC",
        Value::U8(0),
        &[Signal::unsigned(
            "SyncCounter",
            8,
            1.0,
            "",
            "The counter of the last SYNC; 0 where it had none, and before the first.",
        )],
    )
    .doc("0: it had none"),
    Field::new(
        index::HEALTH,
        4,
        "Time of the last SYNC",
        Value::U32(0),
        &[Signal::unsigned(
            "SyncTime",
            32,
            super::TIME_STEP_US as f64 / 1000.0,
            "ms",
            "The foot's clock when the SYNC of SyncCounter came; 0 before the first. Modulo 655.36 ms it is a Timestamp.",
        )],
    )
    .unit("10 µs")
    .doc("on the foot's clock; the low 16 bits are a timestamp of 0x2100:4"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes() {
        let flags = Flags::NONE.with(Flag::Stale).with(Flag::TimeGap);
        let sync = LastSync {
            counter: 240,
            time: LongTime(0x1234_5678),
        };
        let health = Health::new(flags, 0x81, 0x1_0203, sync);
        assert_eq!(
            health.encode(),
            [0x28, 0x81, 0x03, 240, 0x78, 0x56, 0x34, 0x12]
        );
        assert_eq!(Health::decode(&health.encode()), health);
        assert!(health.contains(Flag::Stale) && !health.contains(Flag::Saturated));
    }

    #[test]
    fn the_first_signals_are_the_flags_in_their_order() {
        let signals = super::super::Pdo::Health.signals();
        for (i, (flag, (_, signal))) in Flag::ALL.into_iter().zip(signals).enumerate() {
            let (name, flag) = (signal.name, flag.name().replace('_', ""));
            assert!(name.to_lowercase().ends_with(&flag), "{name} is not {flag}");
            assert_eq!(usize::from(signal.start), i);
        }
    }
}
