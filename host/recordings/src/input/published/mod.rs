//! Published recordings of robots.
//!
//! | format | file |
//! |---|---|
//! | `pce-atlas`, `lcd`: simulated robots | [`simulated`] |
//! | `pce-go1`: a real GO1 | [`go1`] |

pub mod go1;
pub mod simulated;
