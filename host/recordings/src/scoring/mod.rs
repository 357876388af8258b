//! Figures of merit of contact probabilities and orientations.
//!
//! | step | module |
//! |---|---|
//! | probability with the truth | [`scored`] |
//! | figures of merit | [`metrics`], `reliability`; of a long recording [`running`]; of an orientation, [`inclination`] |

pub mod inclination;
pub mod metrics;
mod reliability;
pub mod running;
pub mod scored;
