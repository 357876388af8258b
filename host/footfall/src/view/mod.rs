//! Display of feet in third-party viewers: Foxglove and `PlotJuggler`.
//!
//! | content | module |
//! |---|---|
//! | serving of streaming feet | `serving` |
//! | server for both viewers | `server` |
//! | panels by page | [`pages`] |
//! | layouts for Foxglove and for `PlotJuggler` | [`foxglove_layout`], [`plotjuggler_layout`] |

#[cfg(feature = "foxglove")]
mod error;
pub mod foxglove_layout;
pub mod pages;
pub mod plotjuggler_layout;
#[cfg(feature = "foxglove")]
pub mod server;
#[cfg(feature = "foxglove")]
pub mod serving;
#[cfg(feature = "foxglove")]
#[cfg(feature = "foxglove")]
pub use error::ViewError;
