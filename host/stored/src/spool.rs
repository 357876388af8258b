//! Buffer of samples between a file and the estimator: in memory while they are few, in a temporary file beyond
//! that, so that memory does not grow with the length of a recording.

use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::marker::PhantomData;

use estimator_core::{AngularRate, ImuSample, Load, SpecificForce, Timestamp, Validity, Vec3};
use tempfile::SpooledTempFile;

use samples::space::components;
use samples::{Label, RecordedSample, VALIDITIES};

/// Bytes kept in memory; longer data go to a file in the system's temporary folder.
const IN_MEMORY: usize = 32 << 20;

/// A row of a spool: a time, numbers, and three codes.
pub trait Spooled {
    /// Number of its numbers.
    const NUMBERS: usize;

    /// Time, the numbers and the codes.
    fn encode(&self) -> (u64, impl Iterator<Item = f32>, [u8; 3]);

    /// Row of these.
    fn decode(time: u64, numbers: &[f32], codes: [u8; 3]) -> Self;
}

/// Rows in order, written once and read as often as needed.
pub struct Spool<T = RecordedSample> {
    file: BufWriter<SpooledTempFile>,
    len: usize,
    rows: PhantomData<T>,
}

impl<T: Spooled> Default for Spool<T> {
    fn default() -> Self {
        Self::holding(IN_MEMORY)
    }
}

impl<T: Spooled> Spool<T> {
    fn holding(in_memory: usize) -> Self {
        Self {
            file: BufWriter::with_capacity(1 << 16, SpooledTempFile::new(in_memory)),
            len: 0,
            rows: PhantomData,
        }
    }

    /// Appends a row.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn push(&mut self, row: &T) -> io::Result<()> {
        let (time, numbers, codes) = row.encode();
        self.file.write_all(&time.to_le_bytes())?;
        for number in numbers {
            self.file.write_all(&number.to_le_bytes())?;
        }
        self.file.write_all(&codes)?;
        self.len += 1;
        Ok(())
    }

    /// Number of rows.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Returns whether the spool is empty.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns all rows, from the first.
    ///
    /// # Errors
    /// The temporary file cannot be written completely.
    pub fn rows(&mut self) -> io::Result<SpooledRows<'_, T>> {
        self.file.seek(SeekFrom::Start(0))?;
        Ok(SpooledRows {
            left: self.len,
            bytes: vec![0; 8 + 4 * T::NUMBERS + 3],
            numbers: vec![0.0; T::NUMBERS],
            file: BufReader::with_capacity(1 << 16, self.file.get_mut()),
            rows: PhantomData,
        })
    }
}

/// Iterator over the rows of a [`Spool`].
pub struct SpooledRows<'a, T> {
    left: usize,
    bytes: Vec<u8>,
    numbers: Vec<f32>,
    file: BufReader<&'a mut SpooledTempFile>,
    rows: PhantomData<T>,
}

impl<T: Spooled> SpooledRows<'_, T> {
    fn row(&mut self) -> io::Result<T> {
        self.file.read_exact(&mut self.bytes)?;
        let (time, rest) = self.bytes.split_at(8);
        let (numbers, codes) = rest.split_at(4 * T::NUMBERS);
        for (number, bytes) in self.numbers.iter_mut().zip(numbers.chunks_exact(4)) {
            *number = f32::from_le_bytes(bytes.try_into().unwrap_or_default());
        }
        let time = u64::from_le_bytes(time.try_into().unwrap_or_default());
        let codes = codes.try_into().unwrap_or_default();
        Ok(T::decode(time, &self.numbers, codes))
    }
}

impl<T: Spooled> Iterator for SpooledRows<'_, T> {
    type Item = io::Result<T>;

    fn next(&mut self) -> Option<Self::Item> {
        self.left = self.left.checked_sub(1)?;
        Some(self.row())
    }
}

impl Spooled for RecordedSample {
    /// Six axes and the load.
    const NUMBERS: usize = 7;

    /// Returns the time, the numbers and three codes: validity, load, label.
    fn encode(&self) -> (u64, impl Iterator<Item = f32>, [u8; 3]) {
        let mut validities = VALIDITIES.iter();
        let validity = validities.position(|(_, known)| *known == self.imu.validity);
        let label = match self.label {
            None => 0,
            Some(Label::NotStable) => 1,
            Some(Label::Stable) => 2,
        };
        let numbers = components(self.imu.specific_force.0)
            .into_iter()
            .chain(components(self.imu.angular_rate.0))
            .chain([self.load.map_or(0.0, |Load(load)| load)]);
        let validity = validity.unwrap_or(VALIDITIES.len()) as u8;
        let codes = [validity, u8::from(self.load.is_some()), label];
        (self.imu.timestamp.as_micros(), numbers, codes)
    }

    fn decode(time: u64, numbers: &[f32], [validity, has_load, label]: [u8; 3]) -> Self {
        let validity = VALIDITIES.get(usize::from(validity));
        Self {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(time),
                specific_force: SpecificForce(Vec3::new(numbers[0], numbers[1], numbers[2])),
                angular_rate: AngularRate(Vec3::new(numbers[3], numbers[4], numbers[5])),
                validity: validity.map_or(Validity::Invalid, |(_, validity)| *validity),
            },
            load: (has_load != 0).then_some(Load(numbers[6])),
            label: match label {
                1 => Some(Label::NotStable),
                2 => Some(Label::Stable),
                _ => None,
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use estimator_core::Saturation;

    fn sample(k: u64) -> RecordedSample {
        let value = k as f32;
        RecordedSample {
            imu: ImuSample {
                timestamp: Timestamp::from_micros(1 << 40 | k),
                specific_force: SpecificForce(Vec3::new(value, -value, value + 0.5)),
                angular_rate: AngularRate(Vec3::new(value / 3.0, f32::INFINITY, 1.0e-40)),
                validity: VALIDITIES[k as usize % VALIDITIES.len()].1,
            },
            load: k.is_multiple_of(2).then_some(Load(0.1 * value)),
            label: [None, Some(Label::Stable), Some(Label::NotStable)][k as usize % 3],
        }
    }

    #[test]
    fn samples_read_back_from_memory_and_file() {
        for in_memory in [1 << 20, 100] {
            let mut spool = Spool::holding(in_memory);
            assert!(spool.is_empty());
            for k in 0..1000 {
                spool.push(&sample(k)).unwrap();
            }
            assert_eq!(spool.len(), 1000);
            for _ in 0..2 {
                let read: Vec<_> = spool.rows().unwrap().map(Result::unwrap).collect();
                assert!(read.iter().eq((0..1000).map(sample).collect::<Vec<_>>().iter()));
            }
        }
    }

    #[test]
    fn non_number_is_kept() {
        let mut spool = Spool::default();
        let mut broken = sample(1);
        broken.imu.specific_force.0.x = f32::NAN;
        broken.imu.validity = Validity::Saturated(Saturation::Both);
        spool.push(&broken).unwrap();
        let read = spool.rows().unwrap().next().unwrap().unwrap();
        assert!(read.imu.specific_force.0.x.is_nan());
        assert_eq!(read.imu.validity, broken.imu.validity);
    }
}
