//! How much of the stack was ever used. Start-up code paints it; what lost its paint was used.

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    static _stack_end: u32;
    static _stack_start: u32;
}

/// Words that one look takes in: a fifth of a tick's work. To look at all of the stack at once would
/// be eight times that work.
const PIECE: usize = 256;

/// The size of the stack, bytes.
pub fn size() -> usize {
    (&raw const _stack_start) as usize - (&raw const _stack_end) as usize
}

/// How deep the stack has been, as far as it was looked at.
#[derive(Default)]
pub struct Depth {
    /// Words from the stack's far end on that still had their paint in this round.
    painted: usize,
    /// The deepest so far, words.
    deepest: usize,
}

impl Depth {
    /// Looks at the next piece, and from the far end again when what is known to be used is reached:
    /// the deepest the stack has been, bytes, where that is news.
    pub fn look(&mut self) -> Option<usize> {
        let words = size() / size_of::<u32>();
        let unknown = words - self.deepest;
        let end = unknown.min(self.painted + PIECE);
        for place in self.painted..end {
            // SAFETY: between its two ends there is the stack, readable and aligned.
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
