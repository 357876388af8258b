//! An evaluation as tables ([`table`]) and [`pictures`].

pub mod pictures;
mod rates;
pub mod table;

pub use pictures::{histogram, reliability};
pub use table::{brief_table, full_tables};

/// The folder of datasets where none is named.
pub const DATASETS: &str = "../shared/datasets";
