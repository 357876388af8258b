//! One sample's kernel mass on one axis: the closed form of the integrated density.
//!
//! The paper puts a Gaussian of bandwidth h on every sample of the window and integrates the
//! sum over [−δ, δ]. The integral of one such Gaussian does not depend on the other samples:
//!
//! ```text
//! mass(m) = ½ [erf((δ − m)/(h√2)) + erf((δ + m)/(h√2))]
//! ```
//!
//! so a window's probability is the mean of its samples' masses. See Maravgakis et al.,
//! ICRA 2023, the equations of section III.

use crate::erf::erf;

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
    #[inline]
    #[must_use]
    pub fn to_f32(self) -> f32 {
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
    // Not inlined: it runs at a start, once for each of several values.
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

#[cfg(test)]
mod tests {
    use super::*;

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
    fn the_mass_is_within_its_error_bound_at_millions_of_points() {
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
    fn the_tails_are_exactly_one_and_zero() {
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
    fn the_mass_does_not_depend_on_the_sign_of_the_sample() {
        let kernel = Kernel::new(0.016_53, 0.04);
        for i in 0..10_000 {
            let m = i as f32 * 2e-5;
            assert_eq!(kernel.mass(m), kernel.mass(-m));
        }
    }

    #[test]
    fn rounding_to_steps_clamps_values_outside_zero_to_one() {
        assert_eq!(Mass::from_f32(-0.1), Mass::ZERO);
        assert_eq!(Mass::from_f32(1.1), Mass::ONE);
        assert_eq!(Mass::from_f32(f32::NAN), Mass::ZERO);
        assert_eq!(Mass::from_f32(0.25).to_f32(), 0.25);
    }
}
