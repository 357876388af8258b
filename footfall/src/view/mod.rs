//! Feet in the viewers of others: Foxglove and `PlotJuggler`.
//!
//! | what | module |
//! |---|---|
//! | feet that stream are served until it is over | `serving` |
//! | the server that both connect to | `server` |
//! | a client that is too slow is noticed | `slow` |
//! | what is drawn, as pages of panels | [`pages`] |
//! | pages as a layout of Foxglove, of `PlotJuggler` | [`foxglove_layout`], [`plotjuggler_layout`] |

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
pub mod slow;

#[cfg(feature = "foxglove")]
pub use error::ViewError;
