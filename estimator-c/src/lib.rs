//! The [estimator](estimator_core) for programs in C and C++; `include/footfall_estimator.h` documents its functions.
//!
//! | module | content |
//! |---|---|
//! | [`types`] | structs of the header, and their conversion |
//! | [`error`] | errors, and their texts |
//! | [`estimator`] | the state in the caller's memory, without `unsafe` |
//! | [`boundary`] | functions of the header: checks of pointers |
//! | `generic` | functions for the library in generic C |
//! | `memory` | functions of Arm's compilers that copy and clear memory, by those of C |
//!
//! The method is the self-calibrating one. It needs no window, so an estimator takes little more than 1 KiB.

#![no_std]
#![deny(unsafe_code)]

// In tests, panics are those of the standard library.
#[cfg(not(feature = "alone"))]
extern crate std;

#[allow(unsafe_code)] // Pointers of C.
pub mod boundary;
pub mod error;
pub mod estimator;
#[cfg(target_arch = "wasm32")]
#[allow(unsafe_code)] // Pointers of the machine.
mod generic;
#[cfg(all(feature = "alone", target_arch = "arm", target_os = "none"))]
#[allow(unsafe_code)] // Assembly.
mod memory;
pub mod types;

/// Link-time proof that no panic is reachable: the handler calls a symbol without a definition, so a program that could
/// panic does not link.
#[cfg(feature = "alone")]
#[allow(unsafe_code)]
mod panic {
    // SAFETY: The function is never called, as no program links with it.
    unsafe extern "C" {
        fn footfall_panic_is_reachable() -> !;
    }

    #[panic_handler]
    fn handler(_: &core::panic::PanicInfo) -> ! {
        // SAFETY: As above.
        unsafe { footfall_panic_is_reachable() }
    }
}
