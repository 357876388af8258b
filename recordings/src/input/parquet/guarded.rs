//! Calls of a library that may panic where a file is damaged.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;

thread_local! {
    /// Whether a panic of this thread is an answer and no accident.
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// What `call` returns; `None` where it panics, of which nothing is printed.
///
/// parquet 60 asserts what a sound file has: that ranges are not negative and that levels of nulls are
/// not empty, for instance.
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
    // What has panicked is not used any more.
    let result = panic::catch_unwind(AssertUnwindSafe(call));
    IS_GUARDED.set(false);
    result.ok()
}
