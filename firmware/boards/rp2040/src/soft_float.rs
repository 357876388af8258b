//! Additions and multiplications of f32 under the names that compiled code calls. They are in RAM, because each sample
//! makes a thousand calls.

use firmware::float::{SIGN, add, multiply};

/// Sum.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".data.float")]
extern "C" fn __aeabi_fadd(a: u32, b: u32) -> u32 {
    add(a, b)
}

/// Difference.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".data.float")]
extern "C" fn __aeabi_fsub(a: u32, b: u32) -> u32 {
    add(a, b ^ SIGN)
}

/// Product.
#[unsafe(no_mangle)]
#[unsafe(link_section = ".data.float")]
extern "C" fn __aeabi_fmul(a: u32, b: u32) -> u32 {
    multiply(a, b)
}
