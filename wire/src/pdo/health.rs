//! TPDO7: health, and the foot's full clock.
//!
//! The short times of contacts wrap every 655.36 ms. Bytes 4 to 7 are the foot's full clock at a moment less than
//! [`ClockReading::OLDEST_SYNC_US`] from the contact sent just before. So a listener knows the time of each contact
//! from the first health frame on, and again after any loss.
//!
//! Byte 3 identifies the moment. 0 is the sample of that contact. Any other number is the reception of the SYNC with
//! that number. A SYNC reaches all feet at the same moment: if two feet report the same SYNC, their bytes 4 to 7 differ
//! by the difference of their clocks. The master has to number its SYNCs (object 0x1019 of the master).

use estimator_core::{Flag, Flags, Timestamp};

use super::code::{LongTime, TIME_STEP_US};
use super::field::{Field, Signal};
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
    /// The foot's clock.
    pub clock: ClockReading,
}

/// Reading of the foot's clock, and the moment at which it was read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClockReading {
    /// Number of the SYNC at whose reception the clock was read, 1 to [`Self::HIGHEST_SYNC`]; 0 for the sample of the
    /// newest contact.
    pub sync: u8,
    /// The foot's clock at that moment.
    pub time: LongTime,
}

impl ClockReading {
    /// Highest number of a SYNC. A SYNC master counts up to a limit of 2 to 240, then from 1 again (CiA 301, object
    /// 0x1019).
    pub const HIGHEST_SYNC: u8 = 240;

    /// Age up to which a SYNC is reported, µs. Together with the 100 ms to the next health frame it is less than half a
    /// turn of the short clock. So the short time of each contact until then belongs to one full time only.
    pub const OLDEST_SYNC_US: u64 = 200_000;

    /// Number of the SYNC that follows the SYNC with this number, if all numbers are used. It is 1 after 0, for the first SYNC.
    #[must_use]
    pub const fn sync_after(number: u8) -> u8 {
        number % Self::HIGHEST_SYNC + 1
    }

    /// Clock reading to report with a contact of a sample acquired at `sample`, if `sync` is the last SYNC: the reading of
    /// the SYNC if the SYNC is numbered and recent, otherwise the reading of the sample.
    #[must_use]
    pub fn to_report(sync: Self, sample: Timestamp) -> Self {
        let sample = LongTime::from(sample);
        // A SYNC may arrive between the sample and the frame.
        let age = (sample.0.wrapping_sub(sync.time.0) as i32).unsigned_abs();
        if sync.sync != 0 && age <= (Self::OLDEST_SYNC_US / TIME_STEP_US) as u32 {
            return sync;
        }
        Self { sync: 0, time: sample }
    }
}

impl Health {
    /// Creates the frame from flags, error register, number of dropped frames and clock.
    #[must_use]
    pub fn new(flags: Flags, register: u8, dropped: u32, clock: ClockReading) -> Self {
        Self { flags: flags.bits(), register, dropped: dropped as u8, clock }
    }

    /// Returns whether the estimator raised `flag`.
    #[must_use]
    pub const fn contains(&self, flag: Flag) -> bool {
        self.flags & Flags::NONE.with(flag).bits() != 0
    }

    /// Encodes the frame.
    #[must_use]
    pub fn encode(&self) -> [u8; 8] {
        let [a, b, c, d] = self.clock.time.0.to_le_bytes();
        let (flags, register, dropped) = (self.flags, self.register, self.dropped);
        [flags, register, dropped, self.clock.sync, a, b, c, d]
    }

    /// Decodes the frame; accepts any bytes.
    #[must_use]
    pub fn decode(bytes: &[u8; 8]) -> Self {
        let [flags, register, dropped, sync, a, b, c, d] = *bytes;
        Self {
            flags,
            register,
            dropped,
            clock: ClockReading { sync, time: LongTime(u32::from_le_bytes([a, b, c, d])) },
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
                "More than 1.75 periods since the previous sample: one or more are missing.",
            ),
            Signal::flag(
                "Settling",
                "The foot has not learnt enough of its stances and swings yet; a few steps suffice.",
            ),
            Signal::flag(
                "Unproven",
                "The foot hardly moves, but has neither rested nor landed for a stride.",
            ),
        ],
    )
    .doc("of the estimator: bit 0 window not full, 1 up not known, 2 saturated, 3 stale, 4 invalid sample, 5 time gap, 6 settling, 7 unproven"),
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
            "Frames replaced by newer ones before they were sent on CAN or UART; wraps after 255.",
        )],
    )
    .doc("modulo 256; the full count is in 0x2112"),
    Field::new(
        index::HEALTH,
        3,
        "SYNC of the clock",
        Value::U8(0),
        &[Signal::unsigned(
            "SyncCounter",
            8,
            1.0,
            "",
            "When Clock was read: at the SYNC with this counter, at most 200 ms ago; 0: at the sample of the previous contact.",
        )],
    )
    .doc("counter of the SYNC at which 2107:4 was read; 0: read at the newest sample"),
    Field::new(
        index::HEALTH,
        4,
        "Clock",
        Value::U32(0),
        &[Signal::unsigned(
            "Clock",
            32,
            TIME_STEP_US as f64 / 1000.0,
            "ms",
            "The foot's clock at the moment given by SyncCounter. Modulo 655.36 ms it is a Timestamp.",
        )],
    )
    .unit("10 µs")
    .doc("of the foot; the low 16 bits are a timestamp of 0x2100:4"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn golden_bytes() {
        let flags = Flags::NONE.with(Flag::Stale).with(Flag::TimeGap);
        let clock = ClockReading { sync: 240, time: LongTime(0x1234_5678) };
        let health = Health::new(flags, 0x81, 0x1_0203, clock);
        assert_eq!(health.encode(), [0x28, 0x81, 0x03, 240, 0x78, 0x56, 0x34, 0x12]);
        assert_eq!(Health::decode(&health.encode()), health);
        assert!(health.contains(Flag::Stale) && !health.contains(Flag::Saturated));
    }

    #[test]
    fn sync_is_reported_while_recent_and_numbered() {
        let read =
            |sync, micros| ClockReading { sync, time: Timestamp::from_micros(micros).into() };
        let day = 86_400_000_000;
        for start in [500_000, day, u64::from(u32::MAX) * TIME_STEP_US] {
            let reported = |sync: u8, age_us: i64| {
                let sample = Timestamp::from_micros(start.wrapping_add_signed(age_us));
                let reported = ClockReading::to_report(read(sync, start), sample);
                let expected =
                    if reported.sync == 0 { sample.into() } else { read(sync, start).time };
                assert_eq!(reported.time, expected, "{start} {age_us}");
                reported.sync
            };
            assert_eq!([0, 1, 240].map(|sync| reported(sync, 1000)), [0, 1, 240]);
            let ages = [-400_000, -300, 0, 200_000, 200_010, 700_000, 10_000_000];
            let expected = [0, 7, 7, 7, 0, 0, 0];
            assert_eq!(ages.map(|age| reported(7, age)), expected, "{start}");
        }
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
