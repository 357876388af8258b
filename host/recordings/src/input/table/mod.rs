//! Tables: rows of cells with a header that names the columns.
//!
//! | step | file |
//! |---|---|
//! | a text into rows of cells, with separator, preamble and line numbers; the cells of a row | `reader` |
//! | names of the columns of an IMU in tables of other origin | `names` |
//! | whether there is a header; a header into one with our names | `header` |
//! | `csv`: rows of named cells into the rows of a recording | [`csv`] |
//! | `parquet`: the same columns | `parquet` |

pub mod csv;
pub(super) mod header;
pub(super) mod names;
#[cfg(feature = "parquet")]
pub(crate) mod parquet;
pub(super) mod reader;
