//! The paper's method: a kernel density per axis, integrated between configured half-widths, over a trailing window.
//!
//! The paper puts a Gaussian of bandwidth h on every sample m of the window and integrates the sum over [−δ, δ]. The
//! integral of one such Gaussian does not depend on the other samples:
//!
//! ```text
//! mass(m) = ½ [erf((δ − m)/(h√2)) + erf((δ + m)/(h√2))]
//! P(axis) = mean of the window's masses
//! P       = P(ax) P(ay) P(az) P(ωx) P(ωy) P(ωz)
//! ```
//!
//! So a sample costs six masses, one addition and one subtraction per axis, whatever the length of the window. See
//! Maravgakis et al., ICRA 2023, the equations of section III.
//!
//! [`HalfWidthEstimator`](crate::half_widths::HalfWidthEstimator) is the estimator with this method.

use crate::estimate::{PerAxis, Probabilities};
use crate::math::erf;
use crate::sample::{AngularRate, LinearAcceleration};

/// The kernel density estimate of the paper, causal and in closed form, with room for `CAPACITY` samples in the window.
#[derive(Clone, Debug)]
pub struct DensityEstimator<const CAPACITY: usize> {
    kernels: PerAxis<Kernel>,
    window: Window<Ring<CAPACITY>>,
}

impl<const CAPACITY: usize> DensityEstimator<CAPACITY> {
    /// Creates a kernel density estimate without samples, for these standard deviations of the kernels and half-widths.
    /// Both are positive. The window has `window_length` samples, limited to 1 … `CAPACITY`.
    pub(crate) fn new(
        bandwidth: PerAxis<f32>,
        half_width: PerAxis<f32>,
        window_length: usize,
    ) -> Self {
        Self {
            kernels: bandwidth.zip_with(half_width, Kernel::new),
            window: Window::new(window_length),
        }
    }

    /// Adds one sample's motion, with gravity and bias removed, and returns the probabilities of the
    /// window. A value that is not finite has mass 0 on its axis. O(1), whatever the window.
    #[inline]
    pub fn push(
        &mut self,
        acceleration: LinearAcceleration,
        angular_rate: AngularRate,
    ) -> Probabilities {
        let (a, w) = (acceleration.0, angular_rate.0);
        self.push_masses(PerAxis {
            ax: self.kernels.ax.mass(a.x),
            ay: self.kernels.ay.mass(a.y),
            az: self.kernels.az.mass(a.z),
            wx: self.kernels.wx.mass(w.x),
            wy: self.kernels.wy.mass(w.y),
            wz: self.kernels.wz.mass(w.z),
        })
    }

    /// Adds an unreliable sample: mass 0 on every axis.
    #[inline]
    pub fn push_doubt(&mut self) -> Probabilities {
        self.push_masses(PerAxis::splat(Mass::ZERO))
    }

    fn push_masses(&mut self, masses: PerAxis<Mass>) -> Probabilities {
        let window: &mut Window<AnyRing> = &mut self.window;
        window.push(masses);
        Probabilities::from_axes(window.mean())
    }

    /// Probabilities of the current window; 0 while it holds no sample.
    #[must_use]
    pub fn probabilities(&self) -> Probabilities {
        let window: &Window<AnyRing> = &self.window;
        Probabilities::from_axes(window.mean())
    }

    /// Discards every sample, so that the probabilities are 0 until the next one.
    pub(crate) fn clear(&mut self) {
        let window: &mut Window<AnyRing> = &mut self.window;
        window.clear();
    }

    /// Length of the window in samples.
    pub(crate) fn window_length(&self) -> usize {
        let window: &Window<AnyRing> = &self.window;
        window.length()
    }

    /// Returns whether the window holds as many samples as its length.
    pub(crate) fn is_full(&self) -> bool {
        let window: &Window<AnyRing> = &self.window;
        window.is_full()
    }
}

/// Beyond this many bandwidths from ±δ the mass is 0 or 1 to within half an f32 step:
/// ½(1 − erf(5.5/√2)) = 1.9e-8.
const TAIL_BANDWIDTHS: f32 = 5.5;

/// Probability mass of a sample inside [−δ, δ], in steps of 2⁻²⁴.
///
/// f32 resolves a mass near 1 in the same steps, so no precision is lost; as an
/// integer it can be added and subtracted exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mass(u32);

impl Mass {
    /// No part of the kernel lies inside; used for samples that are unreliable.
    pub const ZERO: Self = Self(0);

    /// The whole kernel lies inside.
    pub const ONE: Self = Self(1 << 24);

    /// Rounds a mass in [0, 1] to the nearest step; other values are clamped, NaN is 0.
    #[inline]
    #[must_use]
    pub fn from_f32(mass: f32) -> Self {
        // The cast saturates at 0 and takes NaN to 0.
        let steps = (mass * Self::ONE.0 as f32 + 0.5) as u32;
        Self(if steps < Self::ONE.0 { steps } else { Self::ONE.0 })
    }

    /// Returns the mass as a number in [0, 1]; exact.
    #[cfg(test)]
    fn to_f32(self) -> f32 {
        self.0 as f32 / Self::ONE.0 as f32
    }

    /// Returns the mass in steps of 2⁻²⁴.
    #[inline]
    #[must_use]
    pub const fn steps(self) -> u32 {
        self.0
    }
}

/// Kernel of one axis, with all terms that do not depend on the sample precomputed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    half_width: f32,
    /// 1/(h√2).
    inverse_scale: f32,
    /// Magnitude up to which the mass is 1; negative if the kernel is wider than the interval.
    inner: f32,
    /// Magnitude from which the mass is 0.
    outer: f32,
}

impl Kernel {
    /// A kernel of standard deviation `bandwidth` (h), integrated over ±`half_width` (δ), both in
    /// the unit of the axis. [`Params`](crate::Params) has checked that both are positive.
    #[must_use]
    // Not inlined, because it runs only at a start, once for each of several values.
    #[inline(never)]
    pub(crate) fn new(bandwidth: f32, half_width: f32) -> Self {
        let tail = TAIL_BANDWIDTHS * bandwidth;
        Self {
            half_width,
            inverse_scale: core::f32::consts::FRAC_1_SQRT_2 / bandwidth,
            inner: half_width - tail,
            outer: half_width + tail,
        }
    }

    /// Returns the mass of a sample with value `m`, in the unit of the axis.
    ///
    /// Exactly 0 and 1 in the tails; the absolute error is at most 2.5e-7 including the rounding
    /// to [`Mass`]. A value that is not finite has mass 0.
    #[inline]
    #[must_use]
    pub fn mass(&self, m: f32) -> Mass {
        let magnitude = m.abs();
        // Each test is written so that a NaN falls through to mass 0.
        if magnitude <= self.inner {
            Mass::ONE
        } else if magnitude < self.outer {
            // The mass is even in m, so the second argument is never negative.
            let near = erf((self.half_width - magnitude) * self.inverse_scale);
            let far = erf((self.half_width + magnitude) * self.inverse_scale);
            Mass::from_f32(0.5 * (near + far))
        } else {
            Mass::ZERO
        }
    }
}

/// The trailing window: a ring of the masses of the last *n* samples on all six axes, and their sums.
///
/// The length *n* is chosen at run time, 1 ≤ n ≤ the ring's capacity. Masses are integers, so the running sums are
/// exact for any history: they do not drift after a billion samples.
///
/// It is created as a `Window<Ring<N>>`, and a reference to it coerces to a `Window<AnyRing>`. The ring is the last
/// field and is seen as a slice, so that rings of all sizes share one machine code.
#[derive(Clone, Debug)]
pub struct Window<R: ?Sized> {
    sums: Sums,
    next: usize,
    ring: R,
}

/// Room for `CAPACITY` samples.
pub type Ring<const CAPACITY: usize> = [PerAxis<Mass>; CAPACITY];

/// A ring of any size.
pub type AnyRing = [PerAxis<Mass>];

/// Sums of the masses in a window.
#[derive(Clone, Copy, Debug)]
struct Sums {
    sum: PerAxis<u64>,
    length: usize,
    filled: usize,
}

impl Sums {
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
        // The sums change in place, axis by axis, because an MCU would otherwise copy sums more often than it adds.
        // Masses have 25 bits, so their difference fits into 32 with its sign.
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

impl<const CAPACITY: usize> Window<Ring<CAPACITY>> {
    /// An empty window of `length` samples, limited to 1 … `CAPACITY`.
    #[must_use]
    pub fn new(length: usize) -> Self {
        const { assert!(CAPACITY > 0, "a window needs room for at least one sample") };
        Self {
            ring: [PerAxis::splat(Mass::ZERO); CAPACITY],
            sums: Sums::new(length.clamp(1, CAPACITY)),
            next: 0,
        }
    }
}

impl Window<AnyRing> {
    /// Adds the newest sample's masses and, if the window is full, removes the oldest.
    #[inline]
    pub fn push(&mut self, masses: PerAxis<Mass>) {
        // `next` stays below `length`, which the ring has room for, so the slot always exists.
        let Some(slot) = self.ring.get_mut(self.next) else {
            return;
        };
        self.sums.push(&masses, slot);
        *slot = masses;
        self.next += 1;
        if self.next == self.sums.length {
            self.next = 0;
        }
    }

    /// Returns the mean mass per axis over the samples held: the probability in [0, 1] that the axis is
    /// at rest. 0 while the window is empty.
    #[inline]
    #[must_use]
    pub fn mean(&self) -> PerAxis<f32> {
        self.sums.mean()
    }

    /// Discards every sample. O(1), because the old contents of the ring are never read again.
    pub fn clear(&mut self) {
        self.sums = Sums::new(self.sums.length);
        self.next = 0;
    }

    /// Length of the window in samples.
    #[must_use]
    pub const fn length(&self) -> usize {
        self.sums.length
    }

    /// Returns whether the window holds as many samples as its length.
    #[must_use]
    pub const fn is_full(&self) -> bool {
        self.sums.filled == self.sums.length
    }
}

/// Returns the f32 nearest to a sum, as a cast does. A microcontroller casts 64 bits in software; up to 2⁴⁸ both halves
/// are exact, and so their sum is rounded once.
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
    use crate::params::HalfWidthParams;
    use crate::vector::Vec3;
    use proptest::prelude::*;
    use std::boxed::Box;
    use std::vec::Vec;

    fn estimator() -> DensityEstimator<64> {
        let HalfWidthParams { bandwidth, half_width, .. } = HalfWidthParams::PAPER;
        DensityEstimator::new(bandwidth, half_width, 50)
    }

    #[test]
    fn motion_lowers_the_probability_of_its_axis_only() {
        for axis in 0..6 {
            let mut motion = [0.0; 6];
            motion[axis] = 10.0;
            let [ax, ay, az, wx, wy, wz] = motion;
            let p = estimator().push(
                LinearAcceleration(Vec3::new(ax, ay, az)),
                AngularRate(Vec3::new(wx, wy, wz)),
            );
            for (other, p) in p.axes.to_array().into_iter().enumerate() {
                // A wide kernel leaves a small part outside its interval.
                assert_eq!(p > 0.98, other != axis, "{axis}, {other}: {p}");
            }
        }
    }

    #[test]
    fn doubtful_sample_halves_the_probability_of_one_at_rest() {
        let mut estimator = estimator();
        assert_eq!(estimator.probabilities().stable, 0.0);
        let (still, no_turn) = (LinearAcceleration::default(), AngularRate::default());
        let at_rest = estimator.push(still, no_turn);
        let doubtful = estimator.push_doubt();
        assert_eq!(doubtful.axes.ax, 0.5 * at_rest.axes.ax);
        assert_eq!(estimator.probabilities(), doubtful);
    }

    /// The paper's ATLAS axes, its GO1 axes in g and °/s, and kernels far wider and far
    /// narrower than the interval: (h, δ).
    const KERNELS: [(f32, f32); 8] = [
        (0.024_67, 0.4),
        (0.016_53, 0.04),
        (0.024_67, 0.9),
        (1.0, 56.0),
        (1.0, 0.01),
        (3.0, 1.0),
        (1.0e-6, 1.0),
        (1.0e-3, 100.0),
    ];

    fn mass_f64(bandwidth: f32, half_width: f32, m: f32) -> f64 {
        let [h, d, m] = [bandwidth, half_width, m].map(f64::from);
        let scale = h * core::f64::consts::SQRT_2;
        0.5 * (libm::erf((d - m) / scale) + libm::erf((d + m) / scale))
    }

    #[test]
    fn mass_is_within_its_error_bound() {
        for (h, d) in KERNELS {
            let kernel = Kernel::new(h, d);
            let edge = d + 7.0 * h;
            let points = 400_000;
            for i in 0..=points {
                let across = edge * (i as f32 / points as f32);
                // Once over the whole range, once around the edge of the interval.
                for m in [across, d - 7.0 * h + 14.0 * h * (i as f32 / points as f32)] {
                    let error = (f64::from(kernel.mass(m).to_f32()) - mass_f64(h, d, m)).abs();
                    assert!(error <= 2.5e-7, "h {h}, δ {d}, m {m}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn mass_is_exactly_one_and_zero_in_the_tails() {
        let kernel = Kernel::new(0.024_67, 0.4);
        for m in [0.0, 0.1, -0.2, 0.264] {
            assert_eq!(kernel.mass(m), Mass::ONE, "{m}");
        }
        for m in [0.536, -0.6, 10.0, f32::MAX] {
            assert_eq!(kernel.mass(m), Mass::ZERO, "{m}");
        }
    }

    #[test]
    fn nan_has_no_mass() {
        let kernel = Kernel::new(0.024_67, 0.4);
        for m in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(kernel.mass(m), Mass::ZERO);
        }
    }

    #[test]
    fn mass_does_not_depend_on_the_sign_of_the_sample() {
        let kernel = Kernel::new(0.016_53, 0.04);
        for i in 0..10_000 {
            let m = i as f32 * 2e-5;
            assert_eq!(kernel.mass(m), kernel.mass(-m));
        }
    }

    #[test]
    fn mass_outside_zero_to_one_is_clamped() {
        assert_eq!(Mass::from_f32(-0.1), Mass::ZERO);
        assert_eq!(Mass::from_f32(1.1), Mass::ONE);
        assert_eq!(Mass::from_f32(f32::NAN), Mass::ZERO);
        assert_eq!(Mass::from_f32(0.25).to_f32(), 0.25);
    }

    fn window<const CAPACITY: usize>(length: usize) -> Box<Window<AnyRing>> {
        Box::new(Window::<Ring<CAPACITY>>::new(length))
    }

    /// Reference for the mean of a window: exact sums over all of its masses, rounded once.
    fn mean_of(masses: &[PerAxis<Mass>]) -> PerAxis<f32> {
        let whole = masses.len() as u64 * u64::from(Mass::ONE.steps());
        let sums = masses.iter().fold(PerAxis::splat(0_u64), |sums, masses| {
            sums.zip_with(*masses, |sum, mass| sum + u64::from(mass.steps()))
        });
        sums.map(|sum| sum as f32 / whole as f32)
    }

    fn masses(mass: f32) -> PerAxis<Mass> {
        PerAxis::splat(Mass::from_f32(mass))
    }

    #[test]
    fn empty_window_has_probability_zero() {
        assert_eq!(window::<4>(4).mean(), PerAxis::splat(0.0));
    }

    #[test]
    fn mean_covers_the_samples_so_far_until_the_window_is_full() {
        let mut window = window::<4>(4);
        window.push(masses(1.0));
        assert_eq!(window.mean().ax, 1.0);
        window.push(masses(0.0));
        assert_eq!((window.mean().ax, window.is_full()), (0.5, false));
        window.push(masses(0.0));
        window.push(masses(0.0));
        assert_eq!((window.mean().ax, window.is_full()), (0.25, true));
    }

    #[test]
    fn oldest_sample_leaves_when_a_new_one_comes() {
        let mut window = window::<8>(2);
        for mass in [1.0, 0.0, 0.0] {
            window.push(masses(mass));
        }
        assert_eq!(window.mean().wz, 0.0);
    }

    #[test]
    fn length_beyond_the_capacity_is_limited_to_it() {
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
        fn means_are_those_of_the_newest_samples_after_any_history(
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
                let held = &since_clear[since_clear.len().saturating_sub(length)..];
                prop_assert_eq!(window.is_full(), held.len() == length);
                prop_assert_eq!(window.mean(), mean_of(held));
            }
        }

        #[test]
        fn order_of_samples_within_a_window_does_not_matter(
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
    fn nearest_gives_the_f32_of_a_cast() {
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
