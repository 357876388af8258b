//! The trailing window: a ring of masses and the exact sums over the newest of them.
//!
//! Masses are integers, so the running sum is exact for any history: no drift
//! after a billion samples, no dependence on order, and one addition and one subtraction per
//! axis whatever the window's length is.
//!
//! The sums do not depend on the ring's capacity, so one machine code serves rings of
//! all sizes: the ring comes last and is seen as a slice. It is optimised with this crate, whatever
//! the crate that chose the size.

use crate::axis::PerAxis;
use crate::kde::kernel::Mass;

/// Masses of the last *n* samples on all six axes, 1 ≤ n ≤ the ring's capacity, with *n* chosen at
/// run time, and the sums over all of them. Made as a `Window<Ring<N>>`, used
/// as a `Window<AnyRing>`, to which a reference to it coerces.
#[derive(Clone, Debug)]
pub struct Window<R: ?Sized> {
    whole: Trailing,
    next: usize,
    ring: R,
}

/// Room for `CAPACITY` samples.
pub type Ring<const CAPACITY: usize> = [PerAxis<Mass>; CAPACITY];

/// A ring of any size.
pub type AnyRing = [PerAxis<Mass>];

/// Sums over the newest samples of a ring.
#[derive(Clone, Copy, Debug)]
struct Trailing {
    sum: PerAxis<u64>,
    length: usize,
    filled: usize,
}

impl Trailing {
    const fn new(length: usize) -> Self {
        Self { sum: PerAxis::splat(0), length, filled: 0 }
    }

    /// Adds the newest sample's masses; `oldest` are those from `length` samples before it.
    #[inline]
    fn push(&mut self, masses: &PerAxis<Mass>, oldest: &PerAxis<Mass>) {
        let full = self.filled == self.length;
        self.filled += usize::from(!full);
        // All bits set if the oldest masses leave, all clear while the window is not full.
        let leaving = u32::from(full).wrapping_neg();
        // In place, axis by axis: an MCU would copy sums more often than it adds. Masses have 25
        // bits, so their difference fits into 32 with its sign.
        let change = |sum: &mut u64, mass: Mass, oldest: Mass| {
            let difference = mass.steps() as i32 - (oldest.steps() & leaving) as i32;
            *sum = sum.wrapping_add_signed(difference.into());
        };
        change(&mut self.sum.ax, masses.ax, oldest.ax);
        change(&mut self.sum.ay, masses.ay, oldest.ay);
        change(&mut self.sum.az, masses.az, oldest.az);
        change(&mut self.sum.wx, masses.wx, oldest.wx);
        change(&mut self.sum.wy, masses.wy, oldest.wy);
        change(&mut self.sum.wz, masses.wz, oldest.wz);
    }

    #[inline]
    fn mean(&self) -> PerAxis<f32> {
        let whole = nearest(self.filled.max(1) as u64 * u64::from(Mass::ONE.steps()));
        PerAxis {
            ax: nearest(self.sum.ax) / whole,
            ay: nearest(self.sum.ay) / whole,
            az: nearest(self.sum.az) / whole,
            wx: nearest(self.sum.wx) / whole,
            wy: nearest(self.sum.wy) / whole,
            wz: nearest(self.sum.wz) / whole,
        }
    }
}

/// Fill level of a [`Window`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Filling {
    /// Fewer samples than the window's length have passed: means cover the available ones.
    Partial,
    /// The window holds as many samples as its length.
    Full,
}

impl<const CAPACITY: usize> Window<Ring<CAPACITY>> {
    /// An empty window of `length` samples, limited to 1 … `CAPACITY`.
    #[must_use]
    pub fn new(length: usize) -> Self {
        const { assert!(CAPACITY > 0, "a window needs room for at least one sample") };
        Self {
            ring: [PerAxis::splat(Mass::ZERO); CAPACITY],
            whole: Trailing::new(length.clamp(1, CAPACITY)),
            next: 0,
        }
    }
}

impl Window<AnyRing> {
    /// Adds the newest sample's masses and, if the window is full, removes the oldest.
    #[inline]
    pub fn push(&mut self, masses: PerAxis<Mass>) {
        // `next` stays below `length`, which the ring has room for: the slot always exists.
        let Some(slot) = self.ring.get_mut(self.next) else {
            return;
        };
        self.whole.push(&masses, slot);
        *slot = masses;
        self.next += 1;
        if self.next == self.whole.length {
            self.next = 0;
        }
    }

    /// Returns the mean mass per axis over the samples held: the probability in [0, 1] that the axis is
    /// at rest. 0 while the window is empty.
    #[inline]
    #[must_use]
    pub fn mean(&self) -> PerAxis<f32> {
        self.whole.mean()
    }

    /// Discards every sample. O(1): the old contents of the ring are never read again.
    pub fn clear(&mut self) {
        self.whole = Trailing::new(self.whole.length);
        self.next = 0;
    }

    /// Length of the window in samples.
    #[must_use]
    pub const fn length(&self) -> usize {
        self.whole.length
    }

    /// Returns whether the window holds as many samples as its length.
    #[must_use]
    pub const fn filling(&self) -> Filling {
        if self.whole.filled == self.whole.length { Filling::Full } else { Filling::Partial }
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
    use std::boxed::Box;
    use std::vec::Vec;

    fn window<const CAPACITY: usize>(length: usize) -> Box<Window<AnyRing>> {
        Box::new(Window::<Ring<CAPACITY>>::new(length))
    }

    /// Reference for a running sum, computed from all masses.
    fn sum_of(masses: &[PerAxis<Mass>]) -> PerAxis<u64> {
        masses.iter().fold(PerAxis::splat(0), |sum, masses| {
            sum.zip_with(*masses, |sum, mass| sum + u64::from(mass.steps()))
        })
    }

    fn masses(mass: f32) -> PerAxis<Mass> {
        PerAxis::splat(Mass::from_f32(mass))
    }

    #[test]
    fn an_empty_window_has_probability_zero() {
        assert_eq!(window::<4>(4).mean(), PerAxis::splat(0.0));
    }

    #[test]
    fn mean_covers_the_samples_so_far_until_the_window_is_full() {
        let mut window = window::<4>(4);
        window.push(masses(1.0));
        assert_eq!(window.mean().ax, 1.0);
        window.push(masses(0.0));
        assert_eq!((window.mean().ax, window.filling()), (0.5, Filling::Partial));
        window.push(masses(0.0));
        window.push(masses(0.0));
        assert_eq!((window.mean().ax, window.filling()), (0.25, Filling::Full));
    }

    #[test]
    fn the_oldest_sample_leaves_when_a_new_one_comes() {
        let mut window = window::<8>(2);
        for mass in [1.0, 0.0, 0.0] {
            window.push(masses(mass));
        }
        assert_eq!(window.mean().wz, 0.0);
    }

    #[test]
    fn a_length_outside_the_capacity_is_limited_to_it() {
        assert_eq!(window::<8>(0).length(), 1);
        assert_eq!(window::<8>(9).length(), 8);
    }

    #[test]
    fn window_of_full_masses_has_probability_exactly_one() {
        for length in 1..=300 {
            let mut window = window::<300>(length);
            for _ in 0..length {
                window.push(masses(1.0));
            }
            assert_eq!(window.mean(), PerAxis::splat(1.0), "length {length}");
        }
    }

    proptest! {
        #[test]
        fn the_running_sums_are_those_of_the_newest_samples_after_any_history(
            length in 1_usize..=64,
            history in prop::collection::vec(prop::array::uniform6(0.0_f32..=1.0), 0..2_000),
            clear_at in 0_usize..2_000,
        ) {
            let mut window = window::<64>(length);
            let mut since_clear = Vec::new();
            for (i, mass) in history.iter().enumerate() {
                if i == clear_at {
                    window.clear();
                    since_clear.clear();
                }
                let masses = PerAxis::from_array(*mass).map(Mass::from_f32);
                window.push(masses);
                since_clear.push(masses);
                let held = since_clear.len().min(length);
                prop_assert_eq!(window.whole.filled, held);
                prop_assert_eq!(window.whole.sum, sum_of(&since_clear[since_clear.len() - held..]));
            }
        }

        #[test]
        fn the_order_of_samples_within_a_window_does_not_matter(
            mut masses in prop::collection::vec(prop::array::uniform6(0.0_f32..=1.0), 32),
            rotation in 0_usize..32,
        ) {
            let mean = |masses: &[[f32; 6]]| {
                let mut window = window::<32>(32);
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
        // Halfway between two values, and next to it.
        for middle in [(1 << 24) + 1, (1 << 40) + (1 << 16), 3 << 38 | 1 << 15] {
            for sum in middle - 1..=middle + 1 {
                assert_eq!(nearest(sum), sum as f32, "{sum}");
            }
        }
    }
}
