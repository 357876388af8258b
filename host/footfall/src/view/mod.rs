//! Display of feet in third-party viewers: Foxglove and `PlotJuggler`.
//!
//! | content | module |
//! |---|---|
//! | serving of streaming feet | `serving` |
//! | server for both viewers | `server` |

#[cfg(feature = "foxglove")]
mod error;
#[cfg(feature = "foxglove")]
pub mod server;
#[cfg(feature = "foxglove")]
pub mod serving;
#[cfg(feature = "foxglove")]
#[cfg(feature = "foxglove")]
pub use error::ViewError;
