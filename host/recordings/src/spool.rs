//! Buffer of samples between a file and the estimator: in memory while they are few, in a temporary file beyond
//! that, so that memory does not grow with the length of a recording.

use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};

use estimator_core::{AngularRate, ImuSample, Load, SpecificForce, Timestamp, Validity, Vec3};
use samples::space::components;
use tempfile::SpooledTempFile;

use crate::recording::{Label, RecordedSample};
use crate::validity::VALIDITIES;

/// Bytes kept in memory; longer data go to a file in the system's temporary folder.
const IN_MEMORY: usize = 32 << 20;

/// Bytes per sample: its time, six axes, the load, and the codes of validity, load and label.
const ROW: usize = 8 + 6 * 4 + 4 + 3;

/// Samples in order, written once and read as often as needed.
pub struct Spool {
    file: BufWriter<SpooledTempFile>,
    len: usize,
}

impl Default for Spool {
    fn default() -> Self {
        Self::holding(IN_MEMORY)
    }
}

impl Spool {
    fn holding(in_memory: usize) -> Self {
        Self {
            file: BufWriter::with_capacity(1 << 16, SpooledTempFile::new(in_memory)),
            len: 0,
        }
    }

    /// Appends a sample.
    ///
    /// # Errors
    /// The temporary file cannot be written.
    pub fn push(&mut self, sample: &RecordedSample) -> io::Result<()> {
        self.file.write_all(&encode(sample))?;
        self.len += 1;
        Ok(())
    }

    /// Number of samples.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Returns whether the spool is empty.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns all samples, from the first.
    ///
    /// # Errors
    /// The temporary file cannot be written completely.
    pub fn samples(&mut self) -> io::Result<Samples<'_>> {
        self.file.seek(SeekFrom::Start(0))?;
        Ok(Samples {
            left: self.len,
            file: BufReader::with_capacity(1 << 16, self.file.get_mut()),
        })
    }
}

/// The samples of a [`Spool`].
pub struct Samples<'a> {
    left: usize,
    file: BufReader<&'a mut SpooledTempFile>,
}

impl Iterator for Samples<'_> {
    type Item = io::Result<RecordedSample>;

    fn next(&mut self) -> Option<Self::Item> {
        self.left = self.left.checked_sub(1)?;
        let mut row = [0; ROW];
        Some(self.file.read_exact(&mut row).map(|()| decode(&row)))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left, Some(self.left))
    }
}

impl ExactSizeIterator for Samples<'_> {}

fn encode(sample: &RecordedSample) -> [u8; ROW] {
    let load = sample.load.map_or(0.0, |Load(load)| load);
    let validity = VALIDITIES
        .iter()
        .position(|(_, known)| *known == sample.imu.validity);
    let label = match sample.label {
        None => 0,
        Some(Label::NotStable) => 1,
        Some(Label::Stable) => 2,
    };
    let mut row = [0; ROW];
    let (time, rest) = row.split_at_mut(8);
    time.copy_from_slice(&sample.imu.timestamp.as_micros().to_le_bytes());
    let values = components(sample.imu.specific_force.0)
        .into_iter()
        .chain(components(sample.imu.angular_rate.0))
        .chain([load]);
    for (bytes, value) in rest.chunks_exact_mut(4).zip(values) {
        bytes.copy_from_slice(&value.to_le_bytes());
    }
    row[ROW - 3] = validity.unwrap_or(VALIDITIES.len()) as u8;
    row[ROW - 2] = u8::from(sample.load.is_some());
    row[ROW - 1] = label;
    row
}

fn decode(row: &[u8; ROW]) -> RecordedSample {
    let (time, rest) = row.split_at(8);
    let mut values = [0.0; 7];
    for (value, bytes) in values.iter_mut().zip(rest.chunks_exact(4)) {
        *value = f32::from_le_bytes(bytes.try_into().unwrap_or_default());
    }
    let [ax, ay, az, wx, wy, wz, load] = values;
    let validity = VALIDITIES.get(usize::from(row[ROW - 3]));
    RecordedSample {
        imu: ImuSample {
            timestamp: Timestamp::from_micros(u64::from_le_bytes(
                time.try_into().unwrap_or_default(),
            )),
            specific_force: SpecificForce(Vec3::new(ax, ay, az)),
            angular_rate: AngularRate(Vec3::new(wx, wy, wz)),
            validity: validity.map_or(Validity::Invalid, |(_, validity)| *validity),
        },
        load: (row[ROW - 2] != 0).then_some(Load(load)),
        label: match row[ROW - 1] {
            1 => Some(Label::NotStable),
            2 => Some(Label::Stable),
            _ => None,
        },
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
                let read: Vec<_> = spool.samples().unwrap().map(Result::unwrap).collect();
                assert!(
                    read.iter()
                        .eq((0..1000).map(sample).collect::<Vec<_>>().iter())
                );
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
        let read = spool.samples().unwrap().next().unwrap().unwrap();
        assert!(read.imu.specific_force.0.x.is_nan());
        assert_eq!(read.imu.validity, broken.imu.validity);
    }
}
