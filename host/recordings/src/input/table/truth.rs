//! Columns with the true orientation of the sensor: `qw,qx,qy,qz`, and `movement` if present.
//!
//! | column | meaning | blank cell |
//! |---|---|---|
//! | `qw` … `qz` | unit quaternion, Hamilton, sensor → world, z up | unknown; all four or none |
//! | `movement` | 1 if the row counts, 0 if not | error |
//!
//! They are not part of a recording: a replay must not see them.

use samples::space::{Rotation, Vector};

use super::cells::Cells;
use super::extra::ExtraColumns;
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

impl ExtraColumns for Orientations {
    fn reads(&self, name: &str) -> bool {
        QUATERNION.contains(&name) || name == MOVEMENT
    }

    fn header(&mut self, header: &Row, file: &str) -> Result<(), InputError> {
        if header.cells().any(|name| name == ESTIMATE) {
            return Err(InputError::EstimatedOrientation {
                file: file.to_owned(),
            });
        }
        for name in QUATERNION.into_iter().chain([MOVEMENT]) {
            let mut cells = header.cells();
            if let Some(first) = cells.position(|cell| cell == name)
                && let Some(more) = cells.position(|cell| cell == name)
            {
                return Err(InputError::DuplicateColumn {
                    cell: header.cell(first + 1 + more, name),
                });
            }
        }
        let index_of = |column: &str| header.cells().position(|name| name == column);
        let mut missing = Vec::new();
        for (index, name) in self.quaternion.iter_mut().zip(QUATERNION) {
            match index_of(name) {
                Some(found) => *index = found,
                None => missing.push(name),
            }
        }
        self.movement = index_of(MOVEMENT);
        if missing.is_empty() {
            Ok(())
        } else {
            Err(InputError::MissingColumns {
                file: file.to_owned(),
                place: header.place,
                columns: missing.join(", "),
                slip: None,
                suggestion: None,
            })
        }
    }

    #[cfg(feature = "parquet")]
    fn used(&self) -> Vec<usize> {
        self.quaternion.into_iter().chain(self.movement).collect()
    }

    fn row(&mut self, row: &impl Cells) -> Result<(), InputError> {
        let counts = match self.movement {
            None => true,
            Some(index) => match row.number(index, MOVEMENT)? {
                0.0 => false,
                1.0 => true,
                _ => {
                    return Err(wrong(
                        row,
                        index,
                        MOVEMENT,
                        "0 (does not count) or 1 (counts)",
                    ));
                }
            },
        };
        let orientation = self.orientation(row)?;
        self.rows.push(orientation.filter(|_| counts));
        Ok(())
    }

    fn retain(&mut self, kept: &[bool]) {
        let mut of_row = kept.iter();
        self.rows.retain(|_| of_row.next().is_none_or(|kept| *kept));
    }
}

impl Orientations {
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
            let [index, ..] = self.quaternion;
            Err(wrong(
                row,
                index,
                QUATERNION[0],
                "the first of a quaternion of length 1",
            ))
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
