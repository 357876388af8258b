//! Functions of the header.
//!
//! Each pointer is checked for NULL and alignment before its use. Every bit pattern is a valid value of the structs
//! behind the pointers. The caller has to ensure the rest: a pointer that is neither NULL nor misaligned points to as
//! much memory as the header states, and no two calls use one estimator at a time.

use core::ffi::{CStr, c_char, c_void};
use core::mem::MaybeUninit;
use core::{ptr, slice};

use crate::error::{self, Error};
use crate::estimator::{self, Before, Estimator, MOST_SAMPLES, READY};
use crate::types::{CEstimate, CLearnt, CParams, CSample};

const VERSION: &CStr =
    match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
        Ok(version) => version,
        Err(_) => panic!("evaluated by the compiler"),
    };

/// Rejects NULL and misaligned pointers.
fn check<T>(pointer: *const T) -> Result<(), Error> {
    if pointer.is_null() {
        Err(Error::Null)
    } else if !pointer.is_aligned() {
        Err(Error::Misaligned)
    } else {
        Ok(())
    }
}

/// Rejects memory without an estimator.
fn check_ready(this: *const Estimator) -> Result<(), Error> {
    check(this)?;
    // SAFETY: Neither NULL nor misaligned, so by the header's terms memory of an estimator's size.
    let mark = unsafe { (&raw const (*this).ready).read() };
    if mark == READY { Ok(()) } else { Err(Error::NotInitialised) }
}

/// Returns the number of a result: 0, or that of the error.
fn number(result: Result<(), Error>) -> i32 {
    result.map_or_else(|error| error as i32, |()| 0)
}

/// Version of the library.
// SAFETY (of the name, here and below): no other library has names that begin with `footfall_`.
#[unsafe(no_mangle)]
pub extern "C" fn footfall_version() -> *const c_char {
    VERSION.as_ptr()
}

/// Text of an error.
#[unsafe(no_mangle)]
pub extern "C" fn footfall_error_text(error: i32) -> *const c_char {
    error::text(error).as_ptr()
}

/// Size of an estimator, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn footfall_estimator_size() -> usize {
    size_of::<Estimator>()
}

/// Alignment of an estimator, bytes.
#[unsafe(no_mangle)]
pub extern "C" fn footfall_estimator_align() -> usize {
    align_of::<Estimator>()
}

/// Writes the default parameters.
///
/// # Safety
/// As the header says: `params` is NULL or points to one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_default_params(params: *mut CParams) -> i32 {
    number(check(params).map(|()| {
        // SAFETY: Checked, and by the header's terms writable.
        unsafe { params.write(CParams::default()) };
    }))
}

/// Makes an estimator in the caller's memory.
///
/// # Safety
/// As the header says: `memory` is NULL or has `size` bytes, the other pointers are NULL or point to one of their type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_estimator_init(
    memory: *mut c_void,
    size: usize,
    params: *const CParams,
    estimator: *mut *mut Estimator,
) -> i32 {
    let this = memory.cast::<Estimator>();
    let init = || {
        check(estimator)?;
        // SAFETY: Checked, and by the header's terms writable.
        unsafe { estimator.write(ptr::null_mut()) };
        check(this)?;
        if size < size_of::<Estimator>() {
            return Err(Error::TooSmall);
        }
        // SAFETY: Aligned, and large enough.
        unsafe { (&raw mut (*this).ready).write(0) };
        check(params)?;
        // SAFETY: Checked, and by the header's terms readable, and not a part of the memory.
        let config = estimator::config(unsafe { &*params });
        // The configuration is passed by reference, because a copy would be on the stack below the estimator.
        let config = config.as_ref().map_err(|error| *error)?;
        // SAFETY: The memory is aligned and large enough, and its previous contents need not be dropped.
        let place = unsafe { &mut *(&raw mut (*this).core).cast::<MaybeUninit<_>>() };
        estimator::build(place, config);
        // SAFETY: As above.
        unsafe { (&raw mut (*this).before).write(Before::new(config.1)) };
        // SAFETY: As above.
        unsafe { (&raw mut (*this).ready).write(READY) };
        // SAFETY: As above.
        unsafe { estimator.write(this) };
        Ok(())
    };
    number(init())
}

/// Processes a sample.
///
/// # Safety
/// As the header says: each pointer is NULL or points to one of its type, and they do not overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_estimator_update(
    estimator: *mut Estimator,
    sample: *const CSample,
    load: *const f32,
    estimate: *mut CEstimate,
) -> i32 {
    let update = || {
        check(estimate)?;
        // SAFETY: Checked, and by the header's terms writable. An error leaves the doubtful estimate.
        unsafe { estimate.write(CEstimate::doubtful()) };
        check_ready(estimator)?;
        check(sample)?;
        let load = if load.is_null() {
            None
        } else {
            check(load)?;
            // SAFETY: Checked, and by the header's terms readable.
            Some(unsafe { load.read() })
        };
        // SAFETY: Checked, initialised, and by the header's terms not in use elsewhere.
        unsafe { &mut *estimator }.update(unsafe { &*sample }, load, unsafe { &mut *estimate })
    };
    number(update())
}

/// Spreads the timestamps of samples that were read at once.
///
/// # Safety
/// As the header says: `estimator` is NULL or points to one, `samples` is NULL or points to `count` samples.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_estimator_spread_timestamps(
    estimator: *mut Estimator,
    samples: *mut CSample,
    count: usize,
) -> i32 {
    let spread = || {
        check_ready(estimator)?;
        check(samples)?;
        if count > MOST_SAMPLES {
            return Err(Error::Count);
        }
        // SAFETY: Checked, and by the header's terms `count` samples that nothing else uses.
        let samples = unsafe { slice::from_raw_parts_mut(samples, count) };
        // SAFETY: Checked, initialised, and by the header's terms not in use elsewhere.
        unsafe { &mut *estimator }.spread_timestamps(samples);
        Ok(())
    };
    number(spread())
}

/// Checks the unit of the accelerometer's readings.
///
/// # Safety
/// As the header says: `estimator` is NULL or points to one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_estimator_check_unit(estimator: *const Estimator) -> i32 {
    // SAFETY: Checked, and initialised.
    number(check_ready(estimator).and_then(|()| unsafe { &*estimator }.check_unit()))
}

/// Writes the mean force of a foot at rest.
///
/// # Safety
/// As the header says: each pointer is NULL or points to one of its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_estimator_force_at_rest(
    estimator: *const Estimator,
    force_m_s2: *mut f32,
) -> i32 {
    let get = || {
        check(force_m_s2)?;
        // SAFETY: Checked, and by the header's terms writable. An error leaves no number.
        unsafe { force_m_s2.write(f32::NAN) };
        check_ready(estimator)?;
        // SAFETY: Both are checked, the estimator is initialised.
        unsafe { force_m_s2.write((*estimator).force_at_rest()) };
        Ok(())
    };
    number(get())
}

/// Writes the state learnt so far.
///
/// # Safety
/// As the header says: each pointer is NULL or points to one of its type.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn footfall_estimator_learnt(
    estimator: *const Estimator,
    learnt: *mut CLearnt,
) -> i32 {
    let get = || {
        check(learnt)?;
        // SAFETY: Checked, and by the header's terms writable. An error leaves a state that no estimator takes.
        unsafe { learnt.write(CLearnt::default()) };
        check_ready(estimator)?;
        // SAFETY: Both are checked, the estimator is initialised.
        unsafe { learnt.write((*estimator).learnt()) };
        Ok(())
    };
    number(get())
}
