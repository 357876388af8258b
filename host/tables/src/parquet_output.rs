//! Tables in Parquet, written row by row. One row group is held in memory.
//!
//! Estimates have the columns of [`HEADER`]:
//!
//! | columns | type |
//! |---|---|
//! | `foot`, in a table of several feet | text, dictionary |
//! | `t` | f64, s |
//! | the numbers | f32, bit-exact; null if unknown |
//! | `state`, `flags` | text, dictionary |
//! | `decision` | u8: 1 stable, 0 not |
//!
//! Samples have the columns of a recording, as [`csv`](crate::csv) reads them:
//!
//! | columns | type |
//! |---|---|
//! | `t` | f64, s on the recording's clock |
//! | `ax` … `wz` | f32, bit-exact input of the estimator |
//! | `force` | f32, null if the load is unknown |
//! | `label` | u8: 1 stable, 0 not; null if the truth is unknown |
//! | `validity` | text, dictionary |

use std::fs::File;
use std::io::{self, Write};
use std::mem;
use std::sync::Arc;

use arrow_array::builder::{
    ArrayBuilder, Float32Builder, Float64Builder, StringDictionaryBuilder, UInt8Builder,
};
use arrow_array::types::Int32Type;
use arrow_array::{ArrayRef, RecordBatch};
use arrow_schema::{DataType, Field, Schema};
use estimator_core::{Axis, ContactEstimate, Decision, Flag, Load};
use parquet::arrow::ArrowWriter;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;

use crate::output::{HEADER, RowNames, numbers, seconds};
use samples::space::components;
use samples::{Label, RecordedSample, validity_name};

/// A table of estimates that is being written. One row group is held in memory.
pub struct ParquetEstimates<W: Write> {
    rows: ParquetRows<W>,
    names: RowNames,
}

impl<W: Write> ParquetEstimates<W> {
    /// Begins a table.
    ///
    /// # Errors
    /// Any error of the encoder.
    pub fn new(to: W, names: RowNames) -> io::Result<Self> {
        let fields = names.column().map(text).into_iter().chain(HEADER.split(',').map(field));
        Ok(Self { rows: ParquetRows::new(to, fields.collect())?, names })
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
        let name = self.names.column().map(|_| Cell::Text(name.unwrap_or_default()));
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

/// A recording that is being written. One row group is held in memory.
pub struct ParquetSamples<W: Write>(ParquetRows<W>);

impl<W: Write> ParquetSamples<W> {
    /// Begins a table.
    ///
    /// # Errors
    /// Any error of the encoder.
    pub fn new(to: W) -> io::Result<Self> {
        let mut fields = vec![Field::new("t", DataType::Float64, false)];
        fields.extend(Axis::ALL.map(|axis| Field::new(axis.name(), DataType::Float32, false)));
        fields.push(Field::new("force", DataType::Float32, true));
        fields.push(Field::new("label", DataType::UInt8, true));
        fields.push(text("validity"));
        Ok(Self(ParquetRows::new(to, fields)?))
    }

    /// Adds a sample; `start_us` is the time of the recording's clock at timestamp 0, µs.
    ///
    /// # Errors
    /// Any error of the encoder or of the writer.
    pub fn add(&mut self, sample: &RecordedSample, start_us: i64) -> io::Result<()> {
        let imu = &sample.imu;
        let axes = components(imu.specific_force.0).into_iter();
        let axes = axes.chain(components(imu.angular_rate.0));
        let label = sample.label.map(|label| u8::from(label == Label::Stable));
        let row = [Cell::Seconds(seconds(imu.timestamp, start_us))].into_iter();
        let row = row.chain(axes.map(|axis| Cell::Number(Some(axis))));
        self.0.add(row.chain([
            Cell::Number(sample.load.map(|Load(load)| load)),
            Cell::Digit(label),
            Cell::Text(validity_name(imu.validity)),
        ]))
    }

    /// Writes the rest, and returns the writer.
    ///
    /// # Errors
    /// Any error of the encoder or of the writer.
    pub fn finish(self) -> io::Result<W> {
        self.0.finish()
    }
}

/// Number of rows that are encoded at a time.
pub(crate) const BATCH: usize = 8192;

/// Number of rows of a row group.
pub(crate) const ROW_GROUP: usize = 16 * BATCH;

/// Program in the metadata of a file.
const WRITTEN_BY: &str = concat!("footfall version ", env!("CARGO_PKG_VERSION"));

/// Encoder of a file, batch by batch.
pub(crate) struct Encoder<W: Write> {
    to: W,
    writer: ArrowWriter<Vec<u8>>,
    schema: Arc<Schema>,
}

impl<W: Write> Encoder<W> {
    pub(crate) fn new(to: W, schema: Arc<Schema>) -> io::Result<Self> {
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by(WRITTEN_BY.to_owned())
            .set_max_row_group_row_count(Some(ROW_GROUP))
            .build();
        let writer = ArrowWriter::try_new(Vec::new(), schema.clone(), Some(properties));
        Ok(Self { to, writer: writer.map_err(io::Error::from)?, schema })
    }

    pub(crate) fn write(&mut self, batch: &RecordBatch) -> io::Result<()> {
        self.writer.write(batch).map_err(io::Error::from)?;
        self.to.write_all(&mem::take(self.writer.inner_mut()))
    }

    pub(crate) fn finish(mut self) -> io::Result<W> {
        let rest = self.writer.into_inner().map_err(io::Error::from)?;
        self.to.write_all(&rest)?;
        self.to.flush()?;
        Ok(self.to)
    }
}

/// Value of a row in one column; `None` if it is unknown.
pub(crate) enum Cell<'a> {
    /// Time, s.
    Seconds(f64),
    Number(Option<f32>),
    Digit(Option<u8>),
    Text(&'a str),
}

/// Values of a column that wait for their batch.
enum Column {
    Seconds(Float64Builder),
    Number(Float32Builder),
    Digit(UInt8Builder),
    Text(StringDictionaryBuilder<Int32Type>),
}

impl Column {
    fn of(data_type: &DataType) -> Self {
        match data_type {
            DataType::Float64 => Self::Seconds(Float64Builder::new()),
            DataType::Float32 => Self::Number(Float32Builder::new()),
            DataType::UInt8 => Self::Digit(UInt8Builder::new()),
            _ => Self::Text(StringDictionaryBuilder::new()),
        }
    }

    fn push(&mut self, cell: &Cell<'_>) {
        match (self, cell) {
            (Self::Seconds(column), Cell::Seconds(value)) => column.append_value(*value),
            (Self::Number(column), Cell::Number(value)) => column.append_option(*value),
            (Self::Digit(column), Cell::Digit(value)) => column.append_option(*value),
            (Self::Text(column), Cell::Text(value)) => column.append_value(value),
            _ => {}
        }
    }

    fn finish(&mut self) -> ArrayRef {
        match self {
            Self::Seconds(column) => ArrayBuilder::finish(column),
            Self::Number(column) => ArrayBuilder::finish(column),
            Self::Digit(column) => ArrayBuilder::finish(column),
            Self::Text(column) => ArrayBuilder::finish(column),
        }
    }
}

/// Table that is written.
pub(crate) struct ParquetRows<W: Write> {
    encoder: Encoder<W>,
    columns: Vec<Column>,
    waiting: usize,
}

impl<W: Write> ParquetRows<W> {
    /// Begins a table with these columns, of the types of a [`Cell`].
    pub(crate) fn new(to: W, fields: Vec<Field>) -> io::Result<Self> {
        let columns = fields.iter().map(|field| Column::of(field.data_type()));
        Ok(Self {
            columns: columns.collect(),
            encoder: Encoder::new(to, Arc::new(Schema::new(fields)))?,
            waiting: 0,
        })
    }

    /// Adds a row, a cell for each column.
    pub(crate) fn add<'a>(&mut self, row: impl IntoIterator<Item = Cell<'a>>) -> io::Result<()> {
        let cells = self.columns.iter_mut().zip(row);
        cells.for_each(|(column, cell)| column.push(&cell));
        self.waiting += 1;
        match self.waiting {
            BATCH => self.encode(),
            _ => Ok(()),
        }
    }

    pub(crate) fn finish(mut self) -> io::Result<W> {
        self.encode()?;
        self.encoder.finish()
    }

    fn encode(&mut self) -> io::Result<()> {
        self.waiting = 0;
        let columns = self.columns.iter_mut().map(Column::finish).collect();
        let batch = RecordBatch::try_new(self.encoder.schema.clone(), columns);
        let batch = batch.map_err(ParquetError::from).map_err(io::Error::from)?;
        self.encoder.write(&batch)
    }
}

/// Column of a text with few values.
pub(crate) fn text(name: &str) -> Field {
    let data_type = DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8));
    Field::new(name, data_type, false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use arrow_array::cast::AsArray;
    use arrow_array::types::{Float32Type, Float64Type, Int32Type, UInt8Type};
    use arrow_array::{Array, ArrayRef, RecordBatch};
    use estimator_core::{
        AngularRate, Flags, LinearAcceleration, PerAxis, Phase, Probabilities, Quaternion,
        Timestamp, Vec3, VelocitySigma,
    };
    use parquet::arrow::arrow_reader::ParquetRecordBatchReader;

    use crate::output::write_row;

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
        for (names, foot) in [(RowNames::Absent, None), (RowNames::Foot, Some("fl"))] {
            let mut csv = Vec::new();
            names.write_header(HEADER, &mut csv).unwrap();
            let mut table = ParquetEstimates::new(Vec::new(), names).unwrap();
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
        let mut table = ParquetEstimates::new(Vec::new(), RowNames::Absent).unwrap();
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
        let table = ParquetEstimates::new(Vec::new(), RowNames::Absent).unwrap();
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
        let mut table = ParquetEstimates::new(Full, RowNames::Absent).unwrap();
        table.add(None, &estimate(1), 0).unwrap();
        let error = table.finish().err().unwrap();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    }
}
