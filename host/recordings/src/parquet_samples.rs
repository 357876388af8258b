//! Samples in Parquet: the columns of a recording, as [`input`](crate::input) reads them.
//!
//! | columns | type |
//! |---|---|
//! | `t` | f64, s on the recording's clock |
//! | `ax` … `wz` | f32, bit-exact input of the estimator |
//! | `force` | f32, null if the load is unknown |
//! | `label` | u8: 1 stable, 0 not; null if the truth is unknown |
//! | `validity` | text, dictionary |

use std::io::{self, Write};

use crate::samples::recording::{Label, RecordedSample};
use crate::samples::space::components;
use crate::samples::validity::name_of;
use arrow_schema::{DataType, Field};
use estimator_core::{Axis, Load};

use crate::output::seconds;
use crate::parquet_rows::{Cell, ParquetRows, text};

/// A recording that is being written. Its memory is that of a row group.
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
            Cell::Text(name_of(imu.validity)),
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
