//! The functions for C, called with any memory, any parameters and any samples.

#![no_main]

use std::ptr;

use estimator_c::boundary::{
    footfall_default_params, footfall_estimator_init, footfall_estimator_learnt,
    footfall_estimator_update,
};
use estimator_c::estimator::SIZE;
use estimator_c::types::{CEstimate, CLearnt, CParams, CSample};

/// Memory of an estimator, and room to start later in it.
#[repr(align(8))]
struct Memory([u8; SIZE + 8]);

/// Takes a struct of the header from the bytes.
fn take<T: Copy>(data: &mut &[u8]) -> Option<T> {
    let (bytes, rest) = data.split_at_checked(size_of::<T>())?;
    *data = rest;
    // SAFETY: as long as the struct, which has only floats and integers.
    Some(unsafe { bytes.as_ptr().cast::<T>().read_unaligned() })
}

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let mut data = data;
    let Some([offset, missing, given]) = take::<[u8; 3]>(&mut data) else {
        return;
    };
    let mut params = CParams::default();
    // SAFETY: a struct of that type.
    assert_eq!(unsafe { footfall_default_params(&raw mut params) }, 0);
    if given & 1 != 0 {
        let Some(any) = take(&mut data) else { return };
        params = any;
    }
    let mut memory = Box::new(Memory([given; SIZE + 8]));
    let offset = usize::from(offset % 9);
    let at = match given & 2 {
        0 => memory.0.as_mut_ptr().wrapping_add(offset).cast(),
        _ => ptr::null_mut(),
    };
    let size = SIZE.saturating_sub(usize::from(missing));
    let mut estimator = ptr::null_mut();
    // SAFETY: NULL, or at least `size` bytes from there on.
    let error = unsafe { footfall_estimator_init(at, size, &params, &raw mut estimator) };
    assert_eq!(error == 0, !estimator.is_null());
    while let Some(sample) = take::<CSample>(&mut data) {
        let Some(load) = take::<f32>(&mut data) else {
            return;
        };
        let load = match load.to_bits() & 1 {
            0 => ptr::null(),
            _ => &raw const load,
        };
        let mut estimate = CEstimate::doubtful();
        // SAFETY: NULL, or an estimator; the structs are of their types.
        let error =
            unsafe { footfall_estimator_update(estimator, &sample, load, &raw mut estimate) };
        assert!((0.0..=1.0).contains(&estimate.stable));
        assert!(error == 0 || estimate.stable == 0.0);
        assert!(error != 0 || !estimator.is_null());
    }
    let mut learnt = CLearnt::default();
    // SAFETY: as above.
    let error = unsafe { footfall_estimator_learnt(estimator, &raw mut learnt) };
    assert_eq!(error == 0, !estimator.is_null());
});
