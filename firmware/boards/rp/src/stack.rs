//! The stack, which start-up code paints.

use cortex_m_rt::STACK_PAINT_VALUE;
use firmware::supervision::StackDepth;

unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Size of the stack, bytes.
pub fn size() -> usize {
    (&raw const _stack_start) as usize - (&raw const _stack_end) as usize
}

/// Checks the next piece of the stack. Returns the maximum depth, bytes, if it has changed.
pub fn look(depth: &mut StackDepth) -> Option<usize> {
    depth.look(size() / size_of::<u32>(), |word| {
        // SAFETY: the words passed by `look` lie in the stack, readable and aligned.
        unsafe { (&raw const _stack_end).add(word).read_volatile() == STACK_PAINT_VALUE }
    })
}
