//! Decoded rows of feet, for `footfall decode`.
//!
//! | result | file |
//! |---|---|
//! | table, as CSV or Parquet | `table` |
//! | feet of the rows, whose events and pictures are those of a replay | `feet` |

mod feet;
mod table;

pub use feet::DecodedFeet;
pub use table::DecodedTable;
