//! Minimum and maximum of two numbers, in a comparison and a move: `f32::min` and `f32::max`
//! are library calls on a Cortex-M4.

pub(crate) trait Order {
    /// Returns the lesser number; `other` if either is not a number.
    fn lesser(self, other: Self) -> Self;

    /// Returns the greater number; `other` if either is not a number.
    fn greater(self, other: Self) -> Self;
}

impl Order for f32 {
    #[inline]
    fn lesser(self, other: Self) -> Self {
        if self < other { self } else { other }
    }

    #[inline]
    fn greater(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
}
