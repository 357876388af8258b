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
use std::sync::Arc;

use crate::samples::recording::{Label, RecordedSample};
use crate::samples::space::components;
use crate::samples::validity::name_of;
use arrow_array::builder::{
    ArrayBuilder, Float32Builder, Float64Builder, StringDictionaryBuilder, UInt8Builder,
};
use arrow_array::types::Int32Type;
use arrow_schema::{DataType, Field, Schema};
use estimator_core::{Axis, Load};

use crate::output::seconds;
use crate::parquet_encoder::{BATCH, Encoder};

/// A recording that is being written. Its memory is that of a row group.
pub struct ParquetSamples<W: Write> {
    encoder: Encoder<W>,
    t: Float64Builder,
    axes: [Float32Builder; 6],
    force: Float32Builder,
    label: UInt8Builder,
    validity: StringDictionaryBuilder<Int32Type>,
}

impl<W: Write> ParquetSamples<W> {
    /// Starts a recording without samples.
    ///
    /// # Errors
    /// Any error of the writer.
    pub fn new(to: W) -> io::Result<Self> {
        Ok(Self {
            encoder: Encoder::new(to, Arc::new(schema()))?,
            t: Float64Builder::new(),
            axes: Default::default(),
            force: Float32Builder::new(),
            label: UInt8Builder::new(),
            validity: StringDictionaryBuilder::new(),
        })
    }

    /// Appends a sample; `start_us` is the time of the recording's clock at timestamp 0, µs.
    ///
    /// # Errors
    /// Any error of the writer.
    pub fn add(&mut self, sample: &RecordedSample, start_us: i64) -> io::Result<()> {
        let imu = &sample.imu;
        self.t.append_value(seconds(imu.timestamp, start_us));
        let force = components(imu.specific_force.0).into_iter();
        let values = force.chain(components(imu.angular_rate.0));
        for (builder, value) in self.axes.iter_mut().zip(values) {
            builder.append_value(value);
        }
        self.force.append_option(sample.load.map(|Load(load)| load));
        let label = sample.label.map(|label| u8::from(label == Label::Stable));
        self.label.append_option(label);
        self.validity.append_value(name_of(imu.validity));
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
        let mut columns: Vec<&mut dyn ArrayBuilder> = vec![&mut self.t];
        columns.extend(self.axes.iter_mut().map(|axis| axis as _));
        columns.extend([
            &mut self.force as _,
            &mut self.label as _,
            &mut self.validity as _,
        ]);
        self.encoder.write_built(columns)
    }
}

fn schema() -> Schema {
    let text = DataType::Dictionary(Box::new(DataType::Int32), Box::new(DataType::Utf8));
    let mut fields = vec![Field::new("t", DataType::Float64, false)];
    fields.extend(Axis::ALL.map(|axis| Field::new(axis.name(), DataType::Float32, false)));
    fields.push(Field::new("force", DataType::Float32, true));
    fields.push(Field::new("label", DataType::UInt8, true));
    fields.push(Field::new("validity", text, false));
    Schema::new(fields)
}
