//! Tables of samples and estimates: read into recordings, and written.
//!
//! | step | module |
//! |---|---|
//! | a text into rows of cells, with separator, preamble and line numbers; the cells of a row | `reader`: [`Table`] |
//! | whether there is a header; a header into one with our names | `header`: [`check_is_csv`] |
//! | a column that names the foot of each row | `feet` |
//! | `csv`: rows of named cells into the rows of a recording | `csv`: [`read_csv`] |
//! | `parquet`: the same columns | `parquet` |
//! | `pce-atlas`, `pce-go1`, `lcd`: published recordings of robots | [`published`] |
//! | tables of samples and estimates, written in CSV and Parquet | [`output`], `parquet_output` |

mod csv;
mod feet;
mod header;
pub mod output;
#[cfg(feature = "parquet")]
pub mod parquet;
#[cfg(feature = "parquet")]
pub mod parquet_output;
pub mod published;
mod reader;

pub use csv::{read as read_csv, stream as stream_csv};
pub use header::check_is_csv;
pub use reader::Table;
