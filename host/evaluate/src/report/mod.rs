//! Reports of an evaluation: tables ([`table`] of [`cells`]) and [`pictures`], which are a [`histogram`](mod@histogram) and
//! a [`reliability`](mod@reliability) diagram; and tables of [`odometry`].

mod axes;
pub mod cells;
pub mod histogram;
pub mod odometry;
pub mod pictures;
mod rates;
pub mod reliability;
pub mod table;

pub use odometry::odometry_tables;
pub use pictures::{histogram, reliability};
pub use table::{brief_table, full_tables};
