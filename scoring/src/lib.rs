//! How good a contact probability is, and an orientation.
//!
//! | step | module |
//! |---|---|
//! | a probability beside the truth | [`scored`] |
//! | figures of merit | [`metrics`], [`reliability`]; of a long recording [`running`]; of an orientation, [`inclination`] |

pub mod inclination;
pub mod metrics;
pub mod reliability;
pub mod running;
pub mod scored;
