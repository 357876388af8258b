//! Parallel processing of recordings.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Gives each of `items` to `work`, on up to `jobs` threads. Returns the results in the order of the items. After a
/// failure no further item is started, and unprocessed items have no result.
pub fn run<I, T: Send, E: Send>(
    items: impl ExactSizeIterator<Item = I> + Send,
    jobs: NonZeroUsize,
    work: impl Fn(I) -> Result<T, E> + Sync,
) -> Vec<Result<T, E>> {
    let threads = jobs.get().min(items.len());
    let items = Mutex::new(items.enumerate());
    let has_failed = AtomicBool::new(false);
    let results: Mutex<Vec<(usize, Result<T, E>)>> = Mutex::default();
    // The lock is held only while the next item is taken.
    let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
    let worker = || {
        while !has_failed.load(Ordering::Relaxed)
            && let Some((index, item)) = next()
        {
            let result = work(item);
            if result.is_err() {
                has_failed.store(true, Ordering::Relaxed);
            }
            let mut results = results.lock().unwrap_or_else(PoisonError::into_inner);
            results.push((index, result));
        }
    };
    thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(worker);
        }
        worker();
    });
    let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

/// Returns the number of cores of this machine.
#[must_use]
pub fn all_cores() -> NonZeroUsize {
    thread::available_parallelism().unwrap_or(NonZeroUsize::MIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jobs(count: usize) -> NonZeroUsize {
        NonZeroUsize::new(count).unwrap()
    }

    #[test]
    fn results_keep_the_order_of_the_items() {
        for threads in [1, 2, 7, 200] {
            let doubled: Result<Vec<u32>, ()> =
                run(0..100, jobs(threads), |k| Ok(2 * k)).into_iter().collect();
            assert!(doubled.unwrap().into_iter().eq((0..100).map(|k| 2 * k)));
        }
        assert!(run([(); 0].into_iter(), jobs(4), |()| Ok::<(), ()>(())).is_empty());
    }

    #[test]
    fn no_item_is_started_after_a_failure() {
        let results = run([1, 2, 3].into_iter(), jobs(1), |k| if k == 2 { Err(k) } else { Ok(()) });
        assert_eq!(results, [Ok(()), Err(2)]);
    }
}
