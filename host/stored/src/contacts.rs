//! Contacts that a foot sent, as the estimates of a recording, in a temporary file.

use std::io;

use estimator_core::{
    AngularRate, ContactEstimate, Decision, Flag, Flags, LinearAcceleration, PerAxis, Phase,
    Probabilities, Quaternion, Timestamp, Vec3, VelocitySigma,
};

use crate::rate::TimesSoFar;
use crate::spool::{Spool, Spooled, SpooledRows};
use samples::space::components;
use samples::{phase_code, phase_of_code};

/// Value of a number that was not recorded.
const UNKNOWN: f32 = f32::NAN;

/// Vector that was not recorded.
pub const NO_VECTOR: Vec3 = Vec3::new(UNKNOWN, UNKNOWN, UNKNOWN);

/// Orientation that was not recorded.
pub const NO_ORIENTATION: Quaternion =
    Quaternion { w: UNKNOWN, x: UNKNOWN, y: UNKNOWN, z: UNKNOWN };

/// Maximum age of the orientation of a contact, µs. Feet send an orientation every 20 ms.
const OLDEST_ORIENTATION_US: i64 = 25_000;

/// Contact as a foot sent it. Numbers that were not recorded are NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SentContact {
    /// Time of the sample on the file's clock, µs.
    pub time_us: i64,
    /// Probabilities of stable contact.
    pub probabilities: Probabilities,
    /// Standard deviation of the velocity, m/s.
    pub velocity_sigma: f32,
    /// Debounced decision.
    pub decision: Decision,
    /// Phase of the gait.
    pub phase: Phase,
    /// Reasons for doubt. On CAN from the newest health frame, up to 0.1 s older than the contact.
    pub flags: Flags,
    /// Whether the foot sent it as valid.
    pub is_valid: bool,
    /// Newest orientation of the foot at that time, foot → world.
    pub orientation: Quaternion,
    /// Acceleration without gravity of this sample, m/s².
    pub acceleration: Vec3,
}

impl SentContact {
    /// Estimate at this time with the values in the message of a contact. All other numbers are NaN.
    pub const fn estimate(&self, timestamp: Timestamp) -> ContactEstimate {
        ContactEstimate {
            timestamp,
            probabilities: self.probabilities,
            orientation: NO_ORIENTATION,
            linear_acceleration: LinearAcceleration(NO_VECTOR),
            gyro_bias: AngularRate(NO_VECTOR),
            angular_rate: AngularRate(NO_VECTOR),
            velocity_sigma: VelocitySigma(self.velocity_sigma),
            decision: self.decision,
            phase: self.phase,
            flags: self.flags,
        }
    }
}

/// Flags of a contact. If it is invalid without a flag, as during a fault of the foot, it gets the flag of an invalid
/// sample.
#[must_use]
pub const fn flags_of_contact(flags: Flags, is_valid: bool) -> Flags {
    if is_valid || flags.are_doubt() { flags } else { flags.with(Flag::InvalidSample) }
}

/// Newest orientation of a foot, which is sent less often than its contacts.
#[derive(Clone, Copy, Debug, Default)]
pub struct NewestOrientation(Option<(i64, Quaternion)>);

impl NewestOrientation {
    /// Takes an orientation at `time_us`, µs.
    pub const fn set(&mut self, time_us: i64, orientation: Quaternion) {
        self.0 = Some((time_us, orientation));
    }

    /// Returns the orientation at `time_us`, µs; [`NO_ORIENTATION`] if the newest is more than 25 ms older.
    #[must_use]
    pub fn at(&self, time_us: i64) -> Quaternion {
        match self.0 {
            Some((at_us, orientation))
                if (0..=OLDEST_ORIENTATION_US).contains(&time_us.saturating_sub(at_us)) =>
            {
                orientation
            }
            _ => NO_ORIENTATION,
        }
    }
}

/// Contacts of a foot in order of time, written once and read as often as needed.
#[derive(Default)]
pub struct Contacts {
    spool: Spool<SentContact>,
    times: TimesSoFar,
    /// Time of the first contact, µs.
    first_us: Option<i64>,
}

impl Contacts {
    /// Appends a contact. Returns whether it is later than the last one; otherwise it is left out.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn push(&mut self, contact: &SentContact) -> io::Result<bool> {
        let now_us = contact.time_us;
        if self.times.newest_us.is_some_and(|last_us| last_us >= now_us) {
            return Ok(false);
        }
        self.first_us.get_or_insert(now_us);
        self.spool.push(contact)?;
        self.times.add(now_us);
        Ok(true)
    }

    /// Number of contacts.
    pub const fn count(&self) -> usize {
        self.spool.len()
    }

    /// Span and rate of the contacts; `None` of fewer than two.
    pub fn span_and_rate(&self) -> Option<SpanAndRate> {
        Some(SpanAndRate {
            first_us: self.first_us?,
            last_us: self.times.newest_us?,
            rate: self.times.rate(None).ok()?,
        })
    }

    /// Returns all contacts, from the first.
    ///
    /// # Errors
    /// The temporary file cannot be written completely.
    pub fn read(&mut self) -> io::Result<SpooledRows<'_, SentContact>> {
        self.spool.rows()
    }
}

/// Span and rate of [`Contacts`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpanAndRate {
    /// Time of the first contact, µs.
    pub first_us: i64,
    /// Time of the last contact, µs.
    pub last_us: i64,
    /// Contacts per second.
    pub rate: f32,
}

impl Spooled for SentContact {
    /// Nine probabilities, the standard deviation of the velocity, four of the orientation, three of the
    /// acceleration.
    const NUMBERS: usize = 17;

    /// Returns the time, the numbers and three codes: decision and validity, phase, flags.
    fn encode(&self) -> (u64, impl Iterator<Item = f32>, [u8; 3]) {
        let p = &self.probabilities;
        let Quaternion { w, x, y, z } = self.orientation;
        let numbers = [p.stable, p.tangential, p.vertical]
            .into_iter()
            .chain(p.axes.to_array())
            .chain([self.velocity_sigma, w, x, y, z])
            .chain(components(self.acceleration));
        let decision = u8::from(self.decision == Decision::Stable);
        let valid = decision | u8::from(self.is_valid) << 1;
        let codes = [valid, phase_code(self.phase), self.flags.bits()];
        (self.time_us.cast_unsigned(), numbers, codes)
    }

    fn decode(time: u64, numbers: &[f32], [valid, phase, flags]: [u8; 3]) -> Self {
        let n = |place: usize| numbers[place];
        Self {
            time_us: time.cast_signed(),
            probabilities: Probabilities {
                axes: PerAxis::from_array([3, 4, 5, 6, 7, 8].map(n)),
                tangential: n(1),
                vertical: n(2),
                stable: n(0),
            },
            velocity_sigma: n(9),
            decision: match valid & 1 {
                0 => Decision::NotStable,
                _ => Decision::Stable,
            },
            phase: phase_of_code(phase),
            flags: Flags::from_bits(flags),
            is_valid: valid & 2 != 0,
            orientation: Quaternion { w: n(10), x: n(11), y: n(12), z: n(13) },
            acceleration: Vec3::new(n(14), n(15), n(16)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact(k: i64) -> SentContact {
        let number = |place: i64| (20 * k + place) as f32 / 3.0;
        SentContact {
            time_us: 1000 * k - 2500,
            probabilities: Probabilities {
                axes: PerAxis::from_array([0, 1, 2, 3, 4, 5].map(number)),
                tangential: number(6),
                vertical: number(7),
                stable: number(8),
            },
            velocity_sigma: number(9),
            decision: [Decision::Stable, Decision::NotStable][k as usize % 2],
            phase: Phase::ALL[k as usize % Phase::ALL.len()],
            flags: Flags::NONE.with(Flag::ALL[k as usize % Flag::ALL.len()]),
            is_valid: k % 3 == 0,
            orientation: Quaternion { w: number(10), x: number(11), y: number(12), z: number(13) },
            acceleration: Vec3::new(number(14), number(15), number(16)),
        }
    }

    #[test]
    fn contacts_read_back_in_order() {
        let mut contacts = Contacts::default();
        assert_eq!(contacts.span_and_rate(), None);
        for k in 0..100 {
            assert!(contacts.push(&contact(k)).unwrap());
            assert!(!contacts.push(&contact(k / 2)).unwrap(), "not after it");
        }
        assert_eq!(contacts.count(), 100);
        assert_eq!(
            contacts.span_and_rate(),
            Some(SpanAndRate { first_us: -2500, last_us: 96_500, rate: 1000.0 })
        );
        for _ in 0..2 {
            let read: Vec<_> = contacts.read().unwrap().map(Result::unwrap).collect();
            assert_eq!(read, (0..100).map(contact).collect::<Vec<_>>());
        }
    }
}
