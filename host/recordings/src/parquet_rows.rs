//! Rows of any serde type in Parquet, in typed columns.
//!
//! Field names are column names. A nullable column is an `Option`, and `None` if the file lacks it.

use std::fs::File;
use std::io::{self, Write};
use std::sync::Arc;

use arrow_json::ArrayWriter;
use arrow_json::reader::{Decoder, ReaderBuilder};
use arrow_schema::{ArrowError, Schema};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::errors::ParquetError;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::input::table::parquet::guarded::guarded;
use crate::parquet_encoder::{BATCH, Encoder};

pub use arrow_schema::{DataType, Field};

/// A table of rows that is being written.
pub struct ParquetRows<W: Write> {
    encoder: Encoder<W>,
    decoder: Decoder,
    waiting: usize,
}

impl<W: Write> ParquetRows<W> {
    /// Starts a table of these columns, without rows.
    ///
    /// # Errors
    /// Any error of the writer, or two columns of the same name.
    pub fn new(to: W, columns: Vec<Field>) -> io::Result<Self> {
        let schema = Arc::new(Schema::new(columns));
        Ok(Self {
            encoder: Encoder::new(to, schema.clone())?,
            decoder: ReaderBuilder::new(schema)
                .with_batch_size(BATCH)
                .build_decoder()
                .map_err(io_error)?,
            waiting: 0,
        })
    }

    /// Appends a row.
    ///
    /// # Errors
    /// Any error of the writer, or a field of another type than its column.
    pub fn add(&mut self, row: &impl Serialize) -> io::Result<()> {
        self.decoder.serialize(&[row]).map_err(io_error)?;
        self.waiting += 1;
        if self.waiting == BATCH {
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

    fn encode(&mut self) -> io::Result<()> {
        self.waiting = 0;
        match self.decoder.flush().map_err(io_error)? {
            Some(batch) => self.encoder.write(&batch),
            None => Ok(()),
        }
    }
}

/// Reads all rows of a file.
///
/// # Errors
/// The file cannot be read, is not valid Parquet, or lacks a required column.
pub fn read<T: DeserializeOwned>(file: File) -> io::Result<Vec<T>> {
    let json = guarded(|| -> io::Result<Vec<u8>> {
        let rows = ParquetRecordBatchReaderBuilder::try_new(file).map_err(io::Error::from)?;
        let rows = rows.build().map_err(io::Error::from)?;
        let mut writer = ArrayWriter::new(Vec::new());
        for batch in rows {
            writer.write(&batch.map_err(io_error)?).map_err(io_error)?;
        }
        writer.finish().map_err(io_error)?;
        Ok(writer.into_inner())
    });
    let json = json.unwrap_or_else(|| Err(io::ErrorKind::InvalidData.into()))?;
    Ok(serde_json::from_slice(&json)?)
}

fn io_error(error: ArrowError) -> io::Error {
    ParquetError::from(error).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;
    use std::io::{Seek, SeekFrom};

    #[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
    struct Row {
        name: String,
        count: u64,
        number: f64,
        single: Option<f32>,
        yes: bool,
        words: Vec<String>,
    }

    fn columns() -> Vec<Field> {
        let words = Field::new("item", DataType::Utf8, false);
        vec![
            Field::new("name", DataType::Utf8, false),
            Field::new("count", DataType::UInt64, false),
            Field::new("number", DataType::Float64, false),
            Field::new("single", DataType::Float32, true),
            Field::new("yes", DataType::Boolean, false),
            Field::new("words", DataType::List(Arc::new(words)), false),
        ]
    }

    fn row(k: u64) -> Row {
        Row {
            name: format!("walk \"{k}\"\n"),
            count: u64::MAX - k,
            number: 1.0e-7 / (k as f64 + 0.3),
            single: k.is_multiple_of(3).then_some(k as f32 / 7.0),
            yes: k.is_multiple_of(2),
            words: (0..k % 3).map(|word| word.to_string()).collect(),
        }
    }

    fn written(rows: &[Row]) -> File {
        let mut table = ParquetRows::new(tempfile::tempfile().unwrap(), columns()).unwrap();
        rows.iter().for_each(|row| table.add(row).unwrap());
        let mut file = table.finish().unwrap();
        file.seek(SeekFrom::Start(0)).unwrap();
        file
    }

    #[test]
    fn rows_read_back_bit_exact_over_all_batches() {
        let rows: Vec<Row> = (0..BATCH as u64 + 10).map(row).collect();
        assert!(read::<Row>(written(&rows)).unwrap() == rows);
        assert!(read::<Row>(written(&[])).unwrap().is_empty());
    }

    #[test]
    fn damaged_file_is_an_error() {
        let mut file = written(&[row(1), row(2)]);
        let length = file.metadata().unwrap().len();
        for place in (0..length).step_by(7) {
            let mut damaged = Vec::new();
            file.seek(SeekFrom::Start(0)).unwrap();
            io::copy(&mut file, &mut damaged).unwrap();
            damaged[place as usize] ^= 0xff;
            let mut copy = tempfile::tempfile().unwrap();
            copy.write_all(&damaged).unwrap();
            // Either rows or an error, but no panic.
            let _ = read::<Row>(copy);
        }
        let cut = tempfile::tempfile().unwrap();
        assert!(read::<Row>(cut).is_err());
    }
}
