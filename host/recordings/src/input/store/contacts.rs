//! Contacts that a foot sent, as the estimates of a recording, in a temporary file.

use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};

use estimator_core::{
    AngularRate, ContactEstimate, Decision, Flag, Flags, LinearAcceleration, PerAxis, Phase,
    Probabilities, Quaternion, Timestamp, Vec3, VelocitySigma,
};
use samples::space::components;
use tempfile::SpooledTempFile;

use super::rate::TimesSoFar;
use crate::phase::{code_of, phase_of};

/// Source of the estimates of a recording that has contacts of its foot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ContactUse {
    /// The contacts are ignored.
    #[default]
    Ignored,
    /// The contacts are the estimates.
    Recorded,
}

impl ContactUse {
    /// Returns the use of contacts in a recording whose estimates may be computed again from its samples.
    #[must_use]
    pub const fn unless_estimated(again: bool) -> Self {
        match again {
            true => Self::Ignored,
            false => Self::Recorded,
        }
    }
}

/// Returns a sentence about the given options that change an estimate and nothing else, for a file whose estimates are
/// its contacts; `None` without such an option.
#[must_use]
pub fn without_effect(file: &str, options: &[&str]) -> Option<String> {
    let named = options.join(", ");
    (!options.is_empty()).then(|| {
        format!(
            "{file}: {named} apply to estimates, not to contacts as they were recorded: --estimate-again"
        )
    })
}

/// Bytes kept in memory; longer data go to a file in the system's temporary folder.
const IN_MEMORY: usize = 32 << 20;

/// Numbers per contact: nine probabilities, the standard deviation of the velocity, four of the orientation, three of the
/// acceleration.
const NUMBERS: usize = 17;

/// Bytes per contact: its time, its numbers, and the codes of decision and validity, phase, and flags.
const ROW: usize = 8 + 4 * NUMBERS + 3;

/// Value of a number that was not recorded.
const UNKNOWN: f32 = f32::NAN;

/// Vector that was not recorded.
pub const NO_VECTOR: Vec3 = Vec3::new(UNKNOWN, UNKNOWN, UNKNOWN);

/// Orientation that was not recorded.
pub const NO_ORIENTATION: Quaternion = Quaternion {
    w: UNKNOWN,
    x: UNKNOWN,
    y: UNKNOWN,
    z: UNKNOWN,
};

/// Maximum age of the orientation of a contact, µs: feet send one every 20 ms.
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
    /// Reasons for doubt. On CAN those of the newest health frame, up to 0.1 s older than the contact.
    pub flags: Flags,
    /// Whether the foot sent it as valid.
    pub is_valid: bool,
    /// Newest orientation of the foot at that time, foot → world.
    pub orientation: Quaternion,
    /// Acceleration without gravity of this sample, m/s².
    pub acceleration: Vec3,
}

impl SentContact {
    /// Estimate with what the message of a contact contains, at this time. All other numbers are NaN.
    pub(super) const fn estimate(&self, timestamp: Timestamp) -> ContactEstimate {
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

/// Flags of a contact. One that is not valid without a flag, as while the foot has a fault, has that of an invalid
/// sample.
#[must_use]
pub const fn flags_of_contact(flags: Flags, is_valid: bool) -> Flags {
    if is_valid || flags.are_doubt() {
        flags
    } else {
        flags.with(Flag::InvalidSample)
    }
}

/// Newest orientation of a foot, which is sent less often than its contacts.
#[derive(Clone, Copy, Debug, Default)]
pub struct NewestOrientation(Option<(i64, Quaternion)>);

impl NewestOrientation {
    /// Takes an orientation at `time_us`, µs.
    pub const fn set(&mut self, time_us: i64, orientation: Quaternion) {
        self.0 = Some((time_us, orientation));
    }

    /// Returns the orientation at `time_us`, µs; [`NO_ORIENTATION`] where the newest is more than 25 ms older.
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
pub struct Contacts {
    file: BufWriter<SpooledTempFile>,
    len: usize,
    times: TimesSoFar,
    /// Times of the first and the last contact, µs.
    span_us: Option<(i64, i64)>,
}

impl Default for Contacts {
    fn default() -> Self {
        Self {
            file: BufWriter::with_capacity(1 << 16, SpooledTempFile::new(IN_MEMORY)),
            len: 0,
            times: TimesSoFar::default(),
            span_us: None,
        }
    }
}

impl Contacts {
    /// Appends a contact; returns whether it is after the last one, else it is left out.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn push(&mut self, contact: &SentContact) -> io::Result<bool> {
        let now_us = contact.time_us;
        match &mut self.span_us {
            None => self.span_us = Some((now_us, now_us)),
            Some((_, last_us)) if *last_us < now_us => *last_us = now_us,
            Some(_) => return Ok(false),
        }
        self.file.write_all(&encode(contact))?;
        self.times.add(now_us);
        self.len += 1;
        Ok(true)
    }

    /// Number of contacts.
    pub(super) const fn len(&self) -> usize {
        self.len
    }

    /// Times of the first and the last contact, µs, and their rate, Hz; `None` of fewer than two.
    pub(super) fn span_and_rate(&self) -> Option<((i64, i64), f32)> {
        self.span_us.zip(self.times.rate(None).ok())
    }

    /// Returns all contacts, from the first.
    ///
    /// # Errors
    /// The temporary file cannot be written completely.
    pub(super) fn read(&mut self) -> io::Result<Reading<'_>> {
        self.file.seek(SeekFrom::Start(0))?;
        Ok(Reading {
            left: self.len,
            file: BufReader::with_capacity(1 << 16, self.file.get_mut()),
        })
    }
}

/// The contacts of [`Contacts`].
pub(super) struct Reading<'a> {
    left: usize,
    file: BufReader<&'a mut SpooledTempFile>,
}

impl Iterator for Reading<'_> {
    type Item = io::Result<SentContact>;

    fn next(&mut self) -> Option<Self::Item> {
        self.left = self.left.checked_sub(1)?;
        let mut row = [0; ROW];
        Some(self.file.read_exact(&mut row).map(|()| decode(&row)))
    }
}

fn encode(contact: &SentContact) -> [u8; ROW] {
    let p = &contact.probabilities;
    let Quaternion { w, x, y, z } = contact.orientation;
    let numbers = [p.stable, p.tangential, p.vertical]
        .into_iter()
        .chain(p.axes.to_array())
        .chain([contact.velocity_sigma, w, x, y, z])
        .chain(components(contact.acceleration));
    let mut row = [0; ROW];
    let (time, rest) = row.split_at_mut(8);
    time.copy_from_slice(&contact.time_us.to_le_bytes());
    for (bytes, number) in rest.chunks_exact_mut(4).zip(numbers) {
        bytes.copy_from_slice(&number.to_le_bytes());
    }
    let decision = u8::from(contact.decision == Decision::Stable);
    row[ROW - 3] = decision | u8::from(contact.is_valid) << 1;
    row[ROW - 2] = code_of(contact.phase);
    row[ROW - 1] = contact.flags.bits();
    row
}

fn decode(row: &[u8; ROW]) -> SentContact {
    let (time, rest) = row.split_at(8);
    let mut numbers = [0.0; NUMBERS];
    for (number, bytes) in numbers.iter_mut().zip(rest.chunks_exact(4)) {
        *number = f32::from_le_bytes(bytes.try_into().unwrap_or_default());
    }
    let [
        stable,
        tangential,
        vertical,
        axes @ ..,
        velocity_sigma,
        w,
        x,
        y,
        z,
        lax,
        lay,
        laz,
    ] = numbers;
    SentContact {
        time_us: i64::from_le_bytes(time.try_into().unwrap_or_default()),
        probabilities: Probabilities {
            axes: PerAxis::from_array(axes),
            tangential,
            vertical,
            stable,
        },
        velocity_sigma,
        decision: match row[ROW - 3] & 1 {
            0 => Decision::NotStable,
            _ => Decision::Stable,
        },
        phase: phase_of(row[ROW - 2]),
        flags: Flags::from_bits(row[ROW - 1]),
        is_valid: row[ROW - 3] & 2 != 0,
        orientation: Quaternion { w, x, y, z },
        acceleration: Vec3::new(lax, lay, laz),
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
            orientation: Quaternion {
                w: number(10),
                x: number(11),
                y: number(12),
                z: number(13),
            },
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
        assert_eq!(contacts.len(), 100);
        assert_eq!(contacts.span_and_rate(), Some(((-2500, 96_500), 1000.0)));
        for _ in 0..2 {
            let read: Vec<_> = contacts.read().unwrap().map(Result::unwrap).collect();
            assert_eq!(read, (0..100).map(contact).collect::<Vec<_>>());
        }
    }
}
