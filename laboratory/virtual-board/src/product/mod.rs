//! Runs of the product on the emulated board.
//!
//! | run | file |
//! |---|---|
//! | faults, their injection, the requirements on the board, pairs of them | [`scenario`], [`fault`] |
//! | all output of a board, its statistics | [`report`]; [`spread`] |
//! | boards in real time behind terminals | `serve` |
//! | comparison with the estimator on the host | [`parity`] |
//! | simulated motion of the sensor | [`motion`] |
//! | runs on all cores | [`on_all_cores`] |
//! | additional messages and traffic | [`traffic`] |

pub mod fault;
pub mod motion;
pub mod parity;
pub mod report;
pub mod scenario;
#[cfg(all(unix, feature = "serve"))]
pub mod serve;
pub mod spread;
pub mod traffic;

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{iter, panic, thread};

/// Calls a function with each item, on all cores. Returns the results in the order of the items.
pub fn on_all_cores<T: Sync, R: Send>(items: &[T], act: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let cores = thread::available_parallelism().map_or(1, NonZeroUsize::get);
    let next = AtomicUsize::new(0);
    let take = || {
        let index = next.fetch_add(1, Ordering::Relaxed);
        items.get(index).map(|item| (index, act(item)))
    };
    let mut results: Vec<(usize, R)> = thread::scope(|scope| {
        let start = |_| scope.spawn(|| iter::from_fn(take).collect::<Vec<_>>());
        let threads: Vec<_> = (0..cores).map(start).collect();
        let join = |thread: thread::ScopedJoinHandle<'_, _>| thread.join();
        let results = threads.into_iter().map(join);
        results
            .flat_map(|result| result.unwrap_or_else(|cause| panic::resume_unwind(cause)))
            .collect()
    });
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}
