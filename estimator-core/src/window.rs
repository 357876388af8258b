//! The trailing window: a ring of masses and their exact sum.
//!
//! Masses are integers, so the running sum is the sum, whatever has passed through: no drift
//! after a billion samples, no dependence on order, and one addition and one subtraction per
//! axis whatever the window's length is.

use crate::axis::PerAxis;
use crate::kernel::Mass;

/// The last *n* samples' masses on all six axes, 1 ≤ n ≤ `CAPACITY`, with *n* chosen at run time.
#[derive(Clone, Debug)]
pub struct Window<const CAPACITY: usize> {
    ring: [PerAxis<Mass>; CAPACITY],
    sum: PerAxis<u64>,
    length: usize,
    filled: usize,
    next: usize,
}

/// How much of a [`Window`] holds samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filling {
    /// Fewer samples than the window's length have passed: means are over those there are.
    Partial,
    /// Every place holds a sample.
    Full,
}

impl<const CAPACITY: usize> Window<CAPACITY> {
    /// An empty window of `length` samples, limited to 1 … `CAPACITY`.
    #[must_use]
    pub fn new(length: usize) -> Self {
        const { assert!(CAPACITY > 0, "a window needs room for at least one sample") };
        Self {
            ring: [PerAxis::splat(Mass::ZERO); CAPACITY],
            sum: PerAxis::splat(0),
            length: length.clamp(1, CAPACITY),
            filled: 0,
            next: 0,
        }
    }

    /// Takes in the newest sample's masses and, where the window is full, lets go of the oldest.
    #[inline]
    pub fn push(&mut self, masses: PerAxis<Mass>) {
        // `next` stays below `length`, which is at most CAPACITY: the slot is always there.
        let Some(slot) = self.ring.get_mut(self.next) else {
            return;
        };
        let oldest = core::mem::replace(slot, masses);
        let leaving = if self.filled == self.length {
            oldest
        } else {
            self.filled += 1;
            PerAxis::splat(Mass::ZERO)
        };
        self.sum = self
            .sum
            .zip_with(masses, |sum, mass| sum + u64::from(mass.steps()))
            .zip_with(leaving, |sum, mass| sum - u64::from(mass.steps()));
        self.next += 1;
        if self.next == self.length {
            self.next = 0;
        }
    }

    /// The mean mass per axis over the samples held: the probability in [0, 1] that the axis is
    /// at rest. 0 where nothing has been pushed.
    #[inline]
    #[must_use]
    pub fn mean(&self) -> PerAxis<f32> {
        let whole = nearest(self.filled.max(1) as u64 * u64::from(Mass::ONE.steps()));
        self.sum.map(|sum| nearest(sum) / whole)
    }

    /// Forgets every sample. O(1): what lies in the ring is never read again.
    pub fn clear(&mut self) {
        self.sum = PerAxis::splat(0);
        self.filled = 0;
        self.next = 0;
    }

    /// Length of the window in samples.
    #[must_use]
    pub const fn length(&self) -> usize {
        self.length
    }

    /// Whether the window holds as many samples as it is long.
    #[must_use]
    pub const fn filling(&self) -> Filling {
        if self.filled == self.length {
            Filling::Full
        } else {
            Filling::Partial
        }
    }
}

/// The nearest f32, as a cast gives it. A microcontroller casts 64 bits in software; up to 2⁴⁸
/// both halves are exact, and so their sum is rounded once.
#[inline]
fn nearest(sum: u64) -> f32 {
    const HALF: u32 = 24;
    let upper = (sum >> HALF) as u32 as f32;
    let lower = (sum & ((1 << HALF) - 1)) as u32 as f32;
    upper * (1_u32 << HALF) as f32 + lower
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What the running sum must be, added up anew from the ring.
    fn recomputed_sum<const CAPACITY: usize>(window: &Window<CAPACITY>) -> PerAxis<u64> {
        let held = window.ring.iter().take(window.filled);
        held.fold(PerAxis::splat(0), |sum, masses| {
            sum.zip_with(*masses, |sum, mass| sum + u64::from(mass.steps()))
        })
    }

    fn masses(mass: f32) -> PerAxis<Mass> {
        PerAxis::splat(Mass::from_f32(mass))
    }

    #[test]
    fn an_empty_window_has_probability_zero() {
        assert_eq!(Window::<4>::new(4).mean(), PerAxis::splat(0.0));
    }

    #[test]
    fn until_it_is_full_the_mean_is_over_the_samples_so_far() {
        let mut window = Window::<4>::new(4);
        window.push(masses(1.0));
        assert_eq!(window.mean().ax, 1.0);
        window.push(masses(0.0));
        assert_eq!(
            (window.mean().ax, window.filling()),
            (0.5, Filling::Partial)
        );
        window.push(masses(0.0));
        window.push(masses(0.0));
        assert_eq!((window.mean().ax, window.filling()), (0.25, Filling::Full));
    }

    #[test]
    fn the_oldest_sample_leaves_when_a_new_one_comes() {
        let mut window = Window::<8>::new(2);
        for mass in [1.0, 0.0, 0.0] {
            window.push(masses(mass));
        }
        assert_eq!(window.mean().wz, 0.0);
    }

    #[test]
    fn a_length_outside_the_capacity_is_limited_to_it() {
        assert_eq!(Window::<8>::new(0).length(), 1);
        assert_eq!(Window::<8>::new(9).length(), 8);
    }

    #[test]
    fn a_window_full_of_certainty_has_probability_exactly_one_at_every_length() {
        for length in 1..=300 {
            let mut window = Window::<300>::new(length);
            for _ in 0..length {
                window.push(masses(1.0));
            }
            assert_eq!(window.mean(), PerAxis::splat(1.0), "length {length}");
        }
    }

    proptest! {
        #[test]
        fn the_running_sum_is_the_sum_of_the_ring_after_any_history(
            length in 1_usize..=64,
            history in prop::collection::vec(prop::array::uniform6(0.0_f32..=1.0), 0..2_000),
            clear_at in 0_usize..2_000,
        ) {
            let mut window = Window::<64>::new(length);
            for (i, mass) in history.iter().enumerate() {
                if i == clear_at {
                    window.clear();
                }
                window.push(PerAxis::from_array(*mass).map(Mass::from_f32));
                prop_assert_eq!(window.sum, recomputed_sum(&window));
            }
        }

        #[test]
        fn the_order_of_samples_within_a_window_does_not_matter(
            mut masses in prop::collection::vec(prop::array::uniform6(0.0_f32..=1.0), 32),
            rotation in 0_usize..32,
        ) {
            let mean = |masses: &[[f32; 6]]| {
                let mut window = Window::<32>::new(32);
                for mass in masses {
                    window.push(PerAxis::from_array(*mass).map(Mass::from_f32));
                }
                window.mean()
            };
            let before = mean(&masses);
            masses.rotate_left(rotation);
            masses.swap(3, 17);
            prop_assert_eq!(before, mean(&masses));
        }
    }

    #[test]
    fn sums_become_the_f32_that_a_cast_gives() {
        let mut sum = 1_u64;
        for i in 0..2_000_000 {
            sum = sum.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(i);
            let sum = sum >> (16 + i % 48);
            assert_eq!(nearest(sum), sum as f32, "{sum}");
        }
        // Halfway between two, and next to it.
        for middle in [(1 << 24) + 1, (1 << 40) + (1 << 16), 3 << 38 | 1 << 15] {
            for sum in middle - 1..=middle + 1 {
                assert_eq!(nearest(sum), sum as f32, "{sum}");
            }
        }
    }
}
