//! Depth of the stack. Start-up code paints it; words that lost their paint were used.

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Words checked per call. All of the stack would take half a per cent of the processor.
const PIECE: usize = 128;

/// Size of the stack, bytes.
pub fn size() -> usize {
    (&raw const _stack_start) as usize - (&raw const _stack_end) as usize
}

/// Depth of the stack, as far as it was checked.
#[derive(Default)]
pub struct Depth {
    /// Words from the stack's far end on that still have their paint in this round.
    painted: usize,
    /// Maximum depth so far, words.
    deepest: usize,
}

impl Depth {
    /// Checks the next piece, and starts again at the far end when a part known to be used is reached:
    /// returns the maximum depth, bytes, if it has changed.
    pub fn look(&mut self) -> Option<usize> {
        let words = size() / size_of::<u32>();
        let unknown = words - self.deepest;
        let end = unknown.min(self.painted + PIECE);
        for place in self.painted..end {
            // SAFETY: the stack lies between its two ends, readable and aligned.
            let word = unsafe { (&raw const _stack_end).add(place).read_volatile() };
            if word != STACK_PAINT_VALUE {
                self.painted = 0;
                self.deepest = words - place;
                return Some(self.deepest * size_of::<u32>());
            }
        }
        self.painted = if end == unknown { 0 } else { end };
        None
    }
}
