//! Calls of a library that may panic on damaged files.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    /// Whether a panic of this thread is expected.
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Result of `call`; `None` if it panics, in which case nothing is printed.
///
/// parquet 60 asserts properties of valid files, for instance that ranges are not negative and that levels of
/// nulls are not empty.
pub(crate) fn guarded<T>(call: impl FnOnce() -> T) -> Option<T> {
    static SILENCE: Once = Once::new();
    SILENCE.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |about| {
            if !IS_GUARDED.get() {
                others(about);
            }
        }));
    });
    IS_GUARDED.set(true);
    // Values involved in a panic are not used afterwards.
    let result = panic::catch_unwind(AssertUnwindSafe(call));
    IS_GUARDED.set(false);
    result.ok()
}
