//! An evaluation as tables ([`table`]) and [`pictures`], and [`odometry`] as tables.

pub mod odometry;
pub mod pictures;
mod rates;
pub mod table;

pub use odometry::odometry_tables;
pub use pictures::{histogram, reliability};
pub use table::{brief_table, full_tables};

/// The folder of datasets where none is named.
pub const DATASETS: &str = "../shared/datasets";
