//! Tables of estimates in Parquet: the columns of [`HEADER`], with their types.
//!
//! | columns | type |
//! |---|---|
//! | `foot`, in a table of several feet | text, dictionary |
//! | `t` | f64, s |
//! | the numbers | f32, bit-exact; null where they are not known |
//! | `state`, `flags` | text, dictionary |
//! | `decision` | u8: 1 stable, 0 not |

use std::fs::File;
use std::io::{self, Write};

use arrow_schema::{DataType, Field};
use estimator_core::{ContactEstimate, Decision, Flag};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::errors::ParquetError;

use crate::output::{FOOT, HEADER, TableFeet, numbers, seconds};
use crate::parquet_rows::{BATCH, Cell, Encoder, ParquetRows, text};

/// A table of estimates that is being written. Its memory is that of a row group.
pub struct ParquetEstimates<W: Write> {
    rows: ParquetRows<W>,
    feet: TableFeet,
}

impl<W: Write> ParquetEstimates<W> {
    /// Begins a table.
    ///
    /// # Errors
    /// Any error of the encoder.
    pub fn new(to: W, feet: TableFeet) -> io::Result<Self> {
        let foot = (feet == TableFeet::Several).then(|| text(FOOT));
        let fields = foot.into_iter().chain(HEADER.split(',').map(field));
        Ok(Self { rows: ParquetRows::new(to, fields.collect())?, feet })
    }

    /// Appends a row. `name` is given if the table has a column for it; `start_us` is the time of the recording's
    /// clock at timestamp 0, µs.
    ///
    /// # Errors
    /// Any error of the writer.
    pub fn add(
        &mut self,
        name: Option<&str>,
        estimate: &ContactEstimate,
        start_us: i64,
    ) -> io::Result<()> {
        let name = (self.feet == TableFeet::Several).then(|| Cell::Text(name.unwrap_or_default()));
        let known = |number: f32| Cell::Number((!number.is_nan()).then_some(number));
        let is_stable = estimate.decision == Decision::Stable;
        let flags: Vec<_> = estimate.flags.iter().map(Flag::name).collect();
        let flags = flags.join("|");
        let row = name.into_iter();
        let row = row.chain([Cell::Seconds(seconds(estimate.timestamp, start_us))]);
        let row = row.chain(numbers(estimate).map(known));
        self.rows.add(row.chain([
            Cell::Text(estimate.phase.name()),
            Cell::Digit(Some(u8::from(is_stable))),
            Cell::Text(&flags),
        ]))
    }

    /// Writes the rest, and returns the writer.
    ///
    /// # Errors
    /// Any error of the encoder or of the writer.
    pub fn finish(self) -> io::Result<W> {
        self.rows.finish()
    }
}

/// Column of a name in [`HEADER`].
fn field(column: &str) -> Field {
    match column {
        "state" | "flags" => text(column),
        "t" => Field::new(column, DataType::Float64, false),
        "decision" => Field::new(column, DataType::UInt8, false),
        _ => Field::new(column, DataType::Float32, true),
    }
}

/// Writes tables of the same columns as one table, row group by row group.
///
/// # Errors
/// Any error of the writer or the files.
pub fn join(tables: Vec<File>, to: impl Write) -> io::Result<()> {
    let mut to = Some(to);
    let mut encoder = None;
    for table in tables {
        let rows = ParquetRecordBatchReaderBuilder::try_new(table).map_err(io::Error::from)?;
        if let Some(to) = to.take() {
            encoder = Some(Encoder::new(to, rows.schema().clone())?);
        }
        let rows = rows.with_batch_size(BATCH).build();
        for batch in rows.map_err(io::Error::from)? {
            let batch = batch.map_err(ParquetError::from).map_err(io::Error::from)?;
            encoder.iter_mut().try_for_each(|encoder| encoder.write(&batch))?;
        }
    }
    encoder.map_or(Ok(()), |encoder| encoder.finish().map(|_| ()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parquet_rows::ROW_GROUP;
    use arrow_array::cast::AsArray;
    use arrow_array::types::{Float32Type, Float64Type, Int32Type, UInt8Type};
    use arrow_array::{Array, ArrayRef, RecordBatch};
    use estimator_core::{
        AngularRate, Flags, LinearAcceleration, PerAxis, Phase, Probabilities, Timestamp,
        VelocitySigma,
    };
    use estimator_core::{Quaternion, Vec3};
    use parquet::arrow::arrow_reader::ParquetRecordBatchReader;

    use crate::output::{write_header, write_row};

    /// An estimate whose numbers are all different.
    fn estimate(k: usize) -> ContactEstimate {
        let number = |place: usize| (20 * k + place) as f32 / 3.0;
        ContactEstimate {
            timestamp: Timestamp::from_micros(1_500_001 * k as u64),
            probabilities: Probabilities {
                axes: PerAxis::from_array([0, 1, 2, 3, 4, 5].map(number)),
                tangential: number(6),
                vertical: number(7),
                stable: number(8),
            },
            orientation: Quaternion { w: number(9), x: number(10), y: number(11), z: number(12) },
            linear_acceleration: LinearAcceleration(Vec3::new(number(13), number(14), number(15))),
            gyro_bias: AngularRate(Vec3::new(number(16), number(17), number(18))),
            velocity_sigma: VelocitySigma(number(19)),
            decision: [Decision::Stable, Decision::NotStable][k % 2],
            phase: [Phase::Stance, Phase::QuietSwing][k % 2],
            flags: if k.is_multiple_of(2) {
                Flags::NONE
            } else {
                Flags::NONE.with(Flag::TimeGap).with(Flag::Saturated)
            },
            ..ContactEstimate::default()
        }
    }

    /// The cells of a batch as text, as in our `csv` table.
    fn text(batch: &RecordBatch) -> String {
        let mut text = String::new();
        for row in 0..batch.num_rows() {
            let cell = |column: &ArrayRef| match column.data_type() {
                DataType::Float64 => {
                    format!("{:.6}", column.as_primitive::<Float64Type>().value(row))
                }
                DataType::Float32 => column.as_primitive::<Float32Type>().value(row).to_string(),
                DataType::UInt8 => column.as_primitive::<UInt8Type>().value(row).to_string(),
                _ => {
                    let words = column.as_dictionary::<Int32Type>();
                    let key = words.key(row).expect("a word");
                    words.values().as_string::<i32>().value(key).to_owned()
                }
            };
            let cells: Vec<String> = batch.columns().iter().map(cell).collect();
            text += &(cells.join(",") + "\n");
        }
        text
    }

    #[test]
    fn table_equals_the_csv_over_all_batches() {
        for (feet, foot) in [(TableFeet::One, None), (TableFeet::Several, Some("fl"))] {
            let mut csv = Vec::new();
            write_header(feet, &mut csv).unwrap();
            let mut table = ParquetEstimates::new(Vec::new(), feet).unwrap();
            let rows = ROW_GROUP + BATCH / 2;
            for k in 0..rows {
                write_row(foot, &estimate(k), -2_000_000, &mut csv).unwrap();
                table.add(foot, &estimate(k), -2_000_000).unwrap();
            }
            let bytes = bytes::Bytes::from(table.finish().unwrap());
            let batches = ParquetRecordBatchReader::try_new(bytes, BATCH).unwrap();
            let mut read = String::new();
            for batch in batches {
                let batch = batch.unwrap();
                if read.is_empty() {
                    let schema = batch.schema();
                    let names: Vec<_> = schema.fields().iter().map(|f| f.name().as_str()).collect();
                    read = names.join(",") + "\n";
                }
                read += &text(&batch);
            }
            assert!(read.as_bytes() == csv);
        }
    }

    #[test]
    fn unknown_number_is_null() {
        let mut table = ParquetEstimates::new(Vec::new(), TableFeet::One).unwrap();
        let unknown = ContactEstimate { velocity_sigma: VelocitySigma(f32::NAN), ..estimate(1) };
        table.add(None, &unknown, 0).unwrap();
        table.add(None, &estimate(2), 0).unwrap();
        let bytes = bytes::Bytes::from(table.finish().unwrap());
        let mut batches = ParquetRecordBatchReader::try_new(bytes, BATCH).unwrap();
        let batch = batches.next().unwrap().unwrap();
        let nulls = batch.columns().iter().map(Array::null_count);
        assert_eq!(nulls.sum::<usize>(), 1);
        assert!(batch.column_by_name("sigma_v").unwrap().is_null(0));
    }

    #[test]
    fn table_without_rows_has_its_columns() {
        let table = ParquetEstimates::new(Vec::new(), TableFeet::One).unwrap();
        let bytes = bytes::Bytes::from(table.finish().unwrap());
        let reader = ParquetRecordBatchReader::try_new(bytes, BATCH).unwrap();
        use arrow_array::RecordBatchReader;
        assert_eq!(reader.schema().fields().len(), HEADER.split(',').count());
    }

    #[test]
    fn writer_error_is_returned() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::Error::from(io::ErrorKind::StorageFull))
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let mut table = ParquetEstimates::new(Full, TableFeet::One).unwrap();
        table.add(None, &estimate(1), 0).unwrap();
        let error = table.finish().err().unwrap();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    }
}
