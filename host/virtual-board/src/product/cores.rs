//! Runs on all cores.

use std::convert::Infallible;

use recordings::jobs::{all_cores, run};

/// Calls a function with each item, on all cores. Returns the results in the order of the items.
pub fn on_all_cores<T: Sync, R: Send>(items: &[T], act: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let results = run(items, all_cores(), |item| Ok::<_, Infallible>(act(item)));
    results.into_iter().map(|Ok(result)| result).collect()
}
