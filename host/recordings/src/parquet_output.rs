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
use std::sync::Arc;

use arrow_array::builder::{
    ArrayBuilder, Float32Builder, Float64Builder, StringDictionaryBuilder, UInt8Builder,
};
use arrow_array::types::Int32Type;
use arrow_schema::{DataType, Field, Schema};
use estimator_core::{ContactEstimate, Decision, Flag};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::errors::ParquetError;

use crate::output::{FOOT, HEADER, TableFeet, numbers, seconds};
use crate::parquet_encoder::{BATCH, Encoder};

/// Numbers of a row between `t` and `state`.
const NUMBERS: usize = 20;

type Texts = StringDictionaryBuilder<Int32Type>;

/// A table of estimates that is being written. Its memory is that of a row group.
pub struct ParquetEstimates<W: Write> {
    encoder: Encoder<W>,
    names: Option<Texts>,
    t: Float64Builder,
    numbers: Vec<Float32Builder>,
    state: Texts,
    decision: UInt8Builder,
    flags: Texts,
}

impl<W: Write> ParquetEstimates<W> {
    /// Starts a table without rows.
    ///
    /// # Errors
    /// Any error of the writer.
    pub fn new(to: W, feet: TableFeet) -> io::Result<Self> {
        let column = match feet {
            TableFeet::One => None,
            TableFeet::Several => Some(FOOT),
        };
        Ok(Self {
            encoder: Encoder::new(to, Arc::new(schema(column)))?,
            names: column.map(|_| Texts::new()),
            t: Float64Builder::new(),
            numbers: (0..NUMBERS).map(|_| Float32Builder::new()).collect(),
            state: Texts::new(),
            decision: UInt8Builder::new(),
            flags: Texts::new(),
        })
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
        if let Some(names) = &mut self.names {
            names.append_value(name.unwrap_or_default());
        }
        self.t.append_value(seconds(estimate.timestamp, start_us));
        for (builder, number) in self.numbers.iter_mut().zip(numbers(estimate)) {
            builder.append_option((!number.is_nan()).then_some(number));
        }
        self.state.append_value(estimate.phase.name());
        let is_stable = estimate.decision == Decision::Stable;
        self.decision.append_value(u8::from(is_stable));
        let flags: Vec<_> = estimate.flags.iter().map(Flag::name).collect();
        self.flags.append_value(flags.join("|"));
        if self.t.len() == BATCH {
            self.encode()?;
        }
        Ok(())
    }

    /// Writes the pending rows and the end of the file.
    ///
    /// # Errors
    /// Any error of the writer.
    pub fn finish(mut self) -> io::Result<W> {
        self.encode()?;
        self.encoder.finish()
    }

    /// Encodes the pending rows.
    fn encode(&mut self) -> io::Result<()> {
        let mut columns: Vec<&mut dyn ArrayBuilder> = Vec::new();
        columns.extend(self.names.iter_mut().map(|names| names as _));
        columns.push(&mut self.t);
        columns.extend(self.numbers.iter_mut().map(|numbers| numbers as _));
        columns.extend([
            &mut self.state as _,
            &mut self.decision as _,
            &mut self.flags as _,
        ]);
        self.encoder.write_built(columns)
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
            encoder
                .iter_mut()
                .try_for_each(|encoder| encoder.write(&batch))?;
        }
    }
    encoder.map_or(Ok(()), |encoder| encoder.finish().map(|_| ()))
}

fn schema(name: Option<&'static str>) -> Schema {
    let text = || DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8));
    let field = |column: &str| {
        let data_type = match column {
            "state" | "flags" => text(),
            "t" => DataType::Float64,
            "decision" => DataType::UInt8,
            _ => DataType::Float32,
        };
        let is_number = data_type == DataType::Float32;
        Field::new(column, data_type, is_number)
    };
    let name = name.map(|name| Field::new(name, text(), false));
    let fields = name.into_iter().chain(HEADER.split(',').map(field));
    Schema::new(fields.collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parquet_encoder::ROW_GROUP;
    use arrow_array::cast::AsArray;
    use arrow_array::types::{Float32Type, Float64Type, UInt8Type};
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
        let number = |place: usize| (k * NUMBERS + place) as f32 / 3.0;
        ContactEstimate {
            timestamp: Timestamp::from_micros(1_500_001 * k as u64),
            probabilities: Probabilities {
                axes: PerAxis::from_array([0, 1, 2, 3, 4, 5].map(number)),
                tangential: number(6),
                vertical: number(7),
                stable: number(8),
            },
            orientation: Quaternion {
                w: number(9),
                x: number(10),
                y: number(11),
                z: number(12),
            },
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
        let unknown = ContactEstimate {
            velocity_sigma: VelocitySigma(f32::NAN),
            ..estimate(1)
        };
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
