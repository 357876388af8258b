//! The paper's method: a kernel density per axis, integrated between configured half-widths, over a trailing window.
//!
//! | step | module |
//! |---|---|
//! | share of a sample's kernel within the half-width | [`kernel`] |
//! | the trailing window's masses and their exact sums | [`window`] |
//! | probabilities of the window | [`density`] |

pub mod density;
pub mod kernel;
pub mod window;
