//! Encoder of a Parquet file, batch by batch. Its memory is that of a row group.

use std::io::{self, Write};
use std::mem;
use std::sync::Arc;

use arrow_array::RecordBatch;
use arrow_array::builder::ArrayBuilder;
use arrow_schema::Schema;
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;

/// Rows encoded at once.
pub(crate) const BATCH: usize = 8192;

/// Rows of a row group, which stays in memory until it is complete: about 10 MB of estimates.
pub(crate) const ROW_GROUP: usize = 16 * BATCH;

/// Writer named in files; independent of place and time, so that files are reproducible.
const WRITTEN_BY: &str = concat!("footfall version ", env!("CARGO_PKG_VERSION"));

/// A Parquet file that is being written.
pub(crate) struct Encoder<W: Write> {
    to: W,
    /// Writes into memory, from which the bytes are taken, because a writer need not be `Send`.
    writer: ArrowWriter<Vec<u8>>,
    schema: Arc<Schema>,
}

impl<W: Write> Encoder<W> {
    /// Starts a file with these columns and no rows.
    pub(crate) fn new(to: W, schema: Arc<Schema>) -> io::Result<Self> {
        let properties = WriterProperties::builder()
            .set_compression(Compression::ZSTD(ZstdLevel::default()))
            .set_created_by(WRITTEN_BY.to_owned())
            .set_max_row_group_row_count(Some(ROW_GROUP))
            .build();
        let writer = ArrowWriter::try_new(Vec::new(), schema.clone(), Some(properties));
        Ok(Self {
            to,
            writer: writer.map_err(io::Error::from)?,
            schema,
        })
    }

    /// Appends the rows that these builders hold, one for each column.
    pub(crate) fn write_built<'a>(
        &mut self,
        builders: impl IntoIterator<Item = &'a mut dyn ArrayBuilder>,
    ) -> io::Result<()> {
        let columns = builders.into_iter().map(ArrayBuilder::finish).collect();
        let batch = RecordBatch::try_new(self.schema.clone(), columns);
        self.write(&batch.map_err(ParquetError::from).map_err(io::Error::from)?)
    }

    /// Appends rows, and writes complete row groups.
    pub(crate) fn write(&mut self, batch: &RecordBatch) -> io::Result<()> {
        self.writer.write(batch).map_err(io::Error::from)?;
        self.to.write_all(&mem::take(self.writer.inner_mut()))
    }

    /// Writes the end of the file.
    pub(crate) fn finish(mut self) -> io::Result<W> {
        let rest = self.writer.into_inner().map_err(io::Error::from)?;
        self.to.write_all(&rest)?;
        self.to.flush()?;
        Ok(self.to)
    }
}
