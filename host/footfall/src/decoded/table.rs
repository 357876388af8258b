//! Table of decoded rows, as CSV or Parquet.

use std::io::{self, Write};

use feet::decode::ContactRow;
use feet::decode::row::{HEADER, write_row};
use recordings::analysis::replay::estimates::Layout;

#[cfg(feature = "parquet")]
use parquet::Cells;
#[cfg(feature = "parquet")]
use recordings::parquet_rows::ParquetRows;

/// Table that is written row by row.
pub enum DecodedTable<'a> {
    /// CSV text; whether its header was written.
    Csv(&'a mut dyn Write, bool),
    /// Parquet: the columns of [`HEADER`], null where a cell is blank.
    #[cfg(feature = "parquet")]
    Parquet(Box<ParquetRows<&'a mut dyn Write>>),
}

impl<'a> DecodedTable<'a> {
    /// Starts a table without rows. Nothing is written before the first row.
    ///
    /// # Errors
    /// Any error of the writer, or Parquet is not built in.
    pub fn new(layout: Layout, to: &'a mut dyn Write) -> io::Result<Self> {
        match layout {
            Layout::Csv => Ok(Self::Csv(to, false)),
            #[cfg(feature = "parquet")]
            Layout::Parquet => Ok(Self::Parquet(Box::new(ParquetRows::new(
                to,
                parquet::columns(),
            )?))),
            #[cfg(not(feature = "parquet"))]
            Layout::Parquet => Err(io::ErrorKind::Unsupported.into()),
        }
    }

    /// Appends a row.
    ///
    /// # Errors
    /// Any error of the writer.
    pub fn add(&mut self, row: &ContactRow) -> io::Result<()> {
        match self {
            Self::Csv(to, is_begun) => {
                if !std::mem::replace(is_begun, true) {
                    writeln!(to, "{HEADER}")?;
                }
                write_row(row, to)
            }
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => table.add(&Cells(row)),
        }
    }

    /// Writes the end of the table.
    ///
    /// # Errors
    /// Any error of the writer.
    pub fn finish(self) -> io::Result<()> {
        match self {
            Self::Csv(_, true) => Ok(()),
            Self::Csv(to, false) => writeln!(to, "{HEADER}"),
            #[cfg(feature = "parquet")]
            Self::Parquet(table) => table.finish().map(|_| ()),
        }
    }
}

#[cfg(feature = "parquet")]
mod parquet {
    use estimator_core::{Decision, PerAxis, Timestamp};
    use feet::decode::ContactRow;
    use feet::decode::row::HEADER;
    use recordings::parquet_rows::{DataType, Field};
    use recordings::samples::space::components;
    use serde::Serialize;
    use serde::ser::{SerializeMap, Serializer};

    /// Columns that have a value in every row.
    const REQUIRED: [&str; 9] = [
        "t",
        "segment",
        "sequence",
        "p_stable",
        "p_tangential",
        "p_vertical",
        "state",
        "decision",
        "flags",
    ];

    /// Columns of [`HEADER`] with their types.
    pub(super) fn columns() -> Vec<Field> {
        HEADER.split(',').map(field).collect()
    }

    fn field(column: &str) -> Field {
        let data_type = match column {
            "t" | "t_received" | "t_common" => DataType::Float64,
            "clock" | "interface" | "foot" | "state" | "flags" => DataType::Utf8,
            "node" | "decision" => DataType::UInt8,
            "segment" => DataType::UInt32,
            "sequence" => DataType::UInt16,
            _ => DataType::Float32,
        };
        Field::new(column, data_type, !REQUIRED.contains(&column))
    }

    /// Cells of a row by the names of their columns; blank ones are left out.
    pub(super) struct Cells<'a>(pub(super) &'a ContactRow);

    impl Serialize for Cells<'_> {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let row = self.0;
            let mut map = serializer.serialize_map(None)?;
            map.serialize_entry("t", &seconds(row.timestamp))?;
            if let Some(received) = row.received {
                map.serialize_entry("t_received", &seconds(received))?;
            }
            if let Some((common, clock)) = row.common {
                map.serialize_entry("t_common", &seconds(common))?;
                map.serialize_entry("clock", clock.name())?;
            }
            for (column, name) in [("interface", &row.interface), ("foot", &row.foot)] {
                if let Some(name) = name {
                    map.serialize_entry(column, &**name)?;
                }
            }
            if let Some(node) = row.node {
                map.serialize_entry("node", &node.get())?;
            }
            map.serialize_entry("segment", &row.segment)?;
            map.serialize_entry("sequence", &row.sequence)?;
            map.serialize_entry("p_stable", &row.stable)?;
            map.serialize_entry("p_tangential", &row.tangential)?;
            map.serialize_entry("p_vertical", &row.vertical)?;
            let axes = row.axes.map(PerAxis::to_array);
            let columns = ["p_ax", "p_ay", "p_az", "p_wx", "p_wy", "p_wz"];
            numbers(&mut map, columns, axes)?;
            let orientation = row.orientation.map(|q| [q.w, q.x, q.y, q.z]);
            numbers(&mut map, ["qw", "qx", "qy", "qz"], orientation)?;
            for (columns, vector) in [
                (["lax", "lay", "laz"], row.acceleration),
                (["uwx", "uwy", "uwz"], row.rate),
                (["bwx", "bwy", "bwz"], row.bias),
            ] {
                numbers(&mut map, columns, vector.map(components))?;
            }
            let temperature = row.temperature.map(|celsius| [celsius]);
            numbers(&mut map, ["temperature"], temperature)?;
            map.serialize_entry("state", row.status.phase().name())?;
            let decision = u8::from(row.status.decision() == Decision::Stable);
            map.serialize_entry("decision", &decision)?;
            map.serialize_entry("flags", &row.flag_names().join("|"))?;
            map.end()
        }
    }

    fn seconds(time: Timestamp) -> f64 {
        time.as_micros() as f64 / 1.0e6
    }

    /// Adds those of these numbers that are known.
    fn numbers<M: SerializeMap, const N: usize>(
        map: &mut M,
        columns: [&'static str; N],
        numbers: Option<[f32; N]>,
    ) -> Result<(), M::Error> {
        let known = columns.into_iter().zip(numbers.unwrap_or([f32::NAN; N]));
        for (column, number) in known.filter(|(_, number)| !number.is_nan()) {
            map.serialize_entry(column, &number)?;
        }
        Ok(())
    }
}
