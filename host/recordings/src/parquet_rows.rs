//! Tables in Parquet, written row by row. Their memory is that of a row group.

use std::io::{self, Write};
use std::mem;
use std::sync::Arc;

use arrow_array::builder::{
    ArrayBuilder, Float32Builder, Float64Builder, StringDictionaryBuilder, UInt8Builder,
};
use arrow_array::types::Int32Type;
use arrow_array::{ArrayRef, RecordBatch};
use arrow_schema::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;

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

/// Value of a row in one column; `None` where it is not known.
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
