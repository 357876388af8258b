//! How much of the stack was ever used. Start-up code paints it; what lost its paint was used.

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

/// The size of the stack, bytes.
pub fn size() -> usize {
    (&raw const _stack_start) as usize - (&raw const _stack_end) as usize
}

/// The deepest the stack has been, bytes.
pub fn high_water() -> usize {
    let mut place = &raw const _stack_end;
    let start = &raw const _stack_start;
    while place < start {
        // SAFETY: between its two ends there is the stack, readable and aligned.
        if unsafe { place.read_volatile() } != STACK_PAINT_VALUE {
            break;
        }
        // SAFETY: at most one past the end.
        place = unsafe { place.add(1) };
    }
    start as usize - place as usize
}
