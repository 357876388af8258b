//! Functions for the library in generic C, which is made from WebAssembly. It has no room for all samples of a read, so that
//! it asks for the time of each.

use crate::estimator::Estimator;

/// Announces that the next samples were read at once.
///
/// # Safety
/// `estimator` points to one that is initialised.
// SAFETY (of the name, here and below): no other library has names that begin with `footfall_`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_begin_read(estimator: *mut Estimator, count: usize) {
    // SAFETY: As above.
    unsafe { &mut *estimator }.begin_read(count);
}

/// Time of one sample of a read, µs, if the newest has this time.
///
/// # Safety
/// `estimator` points to one that is initialised.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_time_in_read(
    estimator: *const Estimator,
    newest_us: u64,
    count: usize,
    index: usize,
) -> u64 {
    // SAFETY: As above.
    let mut times = unsafe { &*estimator }.times_of_read(newest_us, count);
    times.nth(index).unwrap_or(newest_us)
}
