//! Columns with the true orientation of the sensor: `qw,qx,qy,qz`, and `movement` if present.
//!
//! | column | meaning | blank cell |
//! |---|---|---|
//! | `qw` … `qz` | unit quaternion, Hamilton, sensor → world, z up | unknown; all four or none |
//! | `movement` | 1 if the row counts, 0 if not | error |
//!
//! They are not part of a recording: a replay must not see them.

use crate::samples::space::{Rotation, Vector};

use super::cells::Cells;
use super::reader::Row;
use crate::input::error::InputError;

const QUATERNION: [&str; 4] = ["qw", "qx", "qy", "qz"];

const MOVEMENT: &str = "movement";

/// Column that marks the orientation next to it as an estimate.
const ESTIMATE: &str = "p_stable";

/// Tolerance of the length about 1 of a quaternion written with few decimals.
const LENGTH_TOLERANCE: f64 = 0.01;

/// Collects the orientation of each row, if it is known and counts.
#[derive(Default)]
pub(in crate::input) struct Orientations {
    quaternion: [usize; 4],
    movement: Option<usize>,
    pub(in crate::input) rows: Vec<Option<Rotation>>,
}

impl Orientations {
    /// Returns whether it reads the column of this name.
    pub(super) fn reads(name: &str) -> bool {
        QUATERNION.contains(&name) || name == MOVEMENT
    }

    /// Finds the columns in a header.
    pub(super) fn header(&mut self, header: &Row) -> Result<(), InputError> {
        if header.cells().any(|name| name == ESTIMATE) {
            return Err(InputError::EstimatedOrientation {
                file: header.file.clone(),
            });
        }
        let index_of = |column: &str| {
            let named = header.cells().enumerate();
            let mut named = named.filter(|(_, name)| *name == column);
            let first = named.next().map(|(index, _)| index);
            match named.next() {
                Some((second, _)) => Err(InputError::DuplicateColumn {
                    cell: header.cell(second, column),
                }),
                None => Ok(first),
            }
        };
        let mut missing = Vec::new();
        for (index, name) in self.quaternion.iter_mut().zip(QUATERNION) {
            match index_of(name)? {
                Some(found) => *index = found,
                None => missing.push(name),
            }
        }
        self.movement = index_of(MOVEMENT)?;
        if missing.is_empty() {
            Ok(())
        } else {
            Err(header.lacks(&missing, None))
        }
    }

    /// Indices of the columns.
    #[cfg(feature = "parquet")]
    pub(super) fn used(&self) -> impl Iterator<Item = usize> {
        self.quaternion.into_iter().chain(self.movement)
    }

    /// Processes a row.
    pub(super) fn row(&mut self, row: &impl Cells) -> Result<(), InputError> {
        let counts = match self.movement {
            None => true,
            Some(index) => match row.number(index, MOVEMENT)? {
                0.0 => false,
                1.0 => true,
                _ => {
                    let expected = "0 (does not count) or 1 (counts)";
                    return Err(wrong(row, index, MOVEMENT, expected));
                }
            },
        };
        let orientation = self.orientation(row)?;
        self.rows.push(orientation.filter(|_| counts));
        Ok(())
    }

    /// Removes the rows whose flag in `kept` is false.
    pub(super) fn retain(&mut self, kept: &[bool]) {
        let mut of_row = kept.iter();
        self.rows.retain(|_| of_row.next().is_none_or(|kept| *kept));
    }

    fn orientation(&self, row: &impl Cells) -> Result<Option<Rotation>, InputError> {
        if self.quaternion.iter().all(|index| row.is_blank(*index)) {
            return Ok(None);
        }
        let mut numbers = [0.0; 4];
        for ((number, index), name) in numbers.iter_mut().zip(self.quaternion).zip(QUATERNION) {
            *number = row.number(index, name)?;
        }
        let [w, x, y, z] = numbers;
        let length = numbers.iter().map(|n| n * n).sum::<f64>().sqrt();
        if (length - 1.0).abs() <= LENGTH_TOLERANCE {
            Ok(Some(Rotation {
                w: w / length,
                v: Vector::new(x, y, z) * (1.0 / length),
            }))
        } else {
            let expected = "the first of a quaternion of length 1";
            Err(wrong(row, self.quaternion[0], QUATERNION[0], expected))
        }
    }
}

fn wrong(row: &impl Cells, index: usize, name: &str, expected: &'static str) -> InputError {
    InputError::Truth {
        cell: row.cell(index, name),
        text: row.shown(index).into_owned(),
        expected,
    }
}
