//! Runs of the product on the emulated board.
//!
//! | run | file |
//! |---|---|
//! | faults, their injection, the requirements on the board, pairs of them | [`scenario`], [`fault`] |
//! | all output of a board, its statistics | [`report`]; [`spread`] |
//! | boards in real time behind terminals | `serve` |
//! | comparison with the estimator on the host | [`parity`] |
//! | motion of the sensor, simulated and recorded | [`motion`] |
//! | runs on all cores | [`on_all_cores`] |
//! | additional messages and traffic | [`traffic`] |

pub mod fault;
pub mod motion;
pub mod parity;
pub mod report;
pub mod scenario;
#[cfg(unix)]
pub mod serve;
pub mod spread;
pub mod traffic;

use std::convert::Infallible;

use replay::jobs::{all_cores, run};

/// Calls a function with each item, on all cores. Returns the results in the order of the items.
pub fn on_all_cores<T: Sync, R: Send>(items: &[T], act: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let results = run(items.iter(), all_cores(), |item| Ok::<_, Infallible>(act(item)));
    results.into_iter().map(|Ok(result)| result).collect()
}
