//! Tables: rows of cells with a header that names the columns.
//!
//! | step | file |
//! |---|---|
//! | column separators, rows of cells with their line numbers | `lines`, `head`, `reader` |
//! | `csv`: a header names the columns | [`csv`]; `columns`, `cells`, `intake`, `clock` |
//! | `parquet`: the same columns | `parquet` |
//! | tables of other origin: options, names, ROS 2 without a header | [`options`], [`mapping`]; `layout`, `names`, `sensors`, `ros2` |

pub(super) mod cells;
mod clock;
pub(super) mod columns;
pub mod csv;
mod head;
mod intake;
pub(super) mod layout;
mod lines;
pub mod mapping;
pub(super) mod names;
pub mod options;
#[cfg(feature = "parquet")]
pub(crate) mod parquet;
pub(super) mod reader;
mod ros2;
pub(super) mod sensors;
