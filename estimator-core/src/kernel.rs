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
//!
//! Where δ itself is not known exactly, its edges are blurred: a sample within the blur has the
//! share of its mass by which it is on the inner side. What blurs is known by its size and not by
//! its shape, so the shape is the cheapest: a straight ramp with the standard deviation
//! hypot(h, τδ) of noise and blur together, for a part τ of δ.

use crate::erf::erf;

/// Beyond this many bandwidths from ±δ the mass is 0 or 1 to within half an f32 step:
/// ½(1 − erf(5.5/√2)) = 1.9e-8.
const TAIL_BANDWIDTHS: f32 = 5.5;

/// The probability mass that a sample puts inside [−δ, δ], in steps of 2⁻²⁴.
///
/// f32 resolves a mass near 1 in just such steps, so nothing is lost that was there; as an
/// integer it can be added and taken away again without a trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Mass(u32);

impl Mass {
    /// Nothing of the kernel lies inside: what a sample that cannot be believed counts as.
    pub const ZERO: Self = Self(0);

    /// The whole kernel lies inside.
    pub const ONE: Self = Self(1 << 24);

    /// Rounds a mass in [0, 1] to the nearest step; what lies outside is clamped, NaN is 0.
    #[inline]
    #[must_use]
    pub fn from_f32(mass: f32) -> Self {
        // The cast saturates at 0 and takes NaN to 0.
        let steps = (mass * Self::ONE.0 as f32 + 0.5) as u32;
        Self(if steps < Self::ONE.0 {
            steps
        } else {
            Self::ONE.0
        })
    }

    /// The mass as a number in [0, 1]; exact.
    #[inline]
    #[must_use]
    pub fn to_f32(self) -> f32 {
        self.0 as f32 / Self::ONE.0 as f32
    }

    /// The mass in steps of 2⁻²⁴.
    #[inline]
    #[must_use]
    pub const fn steps(self) -> u32 {
        self.0
    }
}

/// Half the length of a ramp in its standard deviations, √3.
const RAMP_DEVIATIONS: f32 = 1.732_050_8;

/// The kernel of one axis with everything that does not depend on the sample worked out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kernel {
    edge: Edge,
    /// Up to this magnitude the mass is 1; negative where the kernel is wider than the interval.
    inner: f32,
    /// From this magnitude on the mass is 0.
    outer: f32,
}

/// What the mass does between inside and outside.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Edge {
    /// The paper's kernel: δ, and 1/(h√2).
    Gaussian(f32, f32),
    /// 1/(outer − inner).
    Ramp(f32),
}

impl Kernel {
    /// A kernel of standard deviation `bandwidth` (h), integrated over ±`half_width` (δ), both in
    /// the unit of the axis, of which the latter is known to a part `tolerance` (τ) of itself; with
    /// a tolerance of 0 it is the paper's. [`Params`](crate::Params) has checked that the first
    /// two are positive and the last is not negative.
    #[must_use]
    pub(crate) fn new(bandwidth: f32, half_width: f32, tolerance: f32) -> Self {
        let blur = tolerance * half_width;
        let (edge, reach) = if blur > 0.0 {
            let reach = RAMP_DEVIATIONS * libm::sqrtf(bandwidth * bandwidth + blur * blur);
            (Edge::Ramp(0.5 / reach), reach)
        } else {
            let inverse_scale = core::f32::consts::FRAC_1_SQRT_2 / bandwidth;
            let edge = Edge::Gaussian(half_width, inverse_scale);
            (edge, TAIL_BANDWIDTHS * bandwidth)
        };
        Self {
            edge,
            inner: half_width - reach,
            outer: half_width + reach,
        }
    }

    /// The mass of a sample with value `m`, in the unit of the axis.
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
            match self.edge {
                Edge::Gaussian(half_width, inverse_scale) => {
                    // The mass is even in m, so the second argument is never negative.
                    let near = erf((half_width - magnitude) * inverse_scale);
                    let far = erf((half_width + magnitude) * inverse_scale);
                    Mass::from_f32(0.5 * (near + far))
                }
                Edge::Ramp(slope) => Mass::from_f32((self.outer - magnitude) * slope),
            }
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
            let kernel = Kernel::new(h, d, 0.0);
            let edge = d + 7.0 * h;
            let points = 400_000;
            for i in 0..=points {
                let across = edge * (i as f32 / points as f32);
                // Once over the whole range, once packed around the edge of the interval.
                for m in [across, d - 7.0 * h + 14.0 * h * (i as f32 / points as f32)] {
                    let error = (f64::from(kernel.mass(m).to_f32()) - mass_f64(h, d, m)).abs();
                    assert!(error <= 2.5e-7, "h {h}, δ {d}, m {m}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn a_half_width_that_is_not_exact_blurs_its_edge() {
        // Of a standard deviation of 0.1, noise and blur together.
        let kernel = Kernel::new(0.06, 0.4, 0.2);
        let ends = [0.4 - 0.1 * RAMP_DEVIATIONS, 0.4 + 0.1 * RAMP_DEVIATIONS];
        for (m, mass) in [
            (0.0, 1.0),
            (0.99 * ends[0], 1.0),
            (-0.4, 0.5),
            (0.5 * (0.4 + ends[1]), 0.25),
            (1.01 * ends[1], 0.0),
        ] {
            let error = kernel.mass(m).to_f32() - mass;
            assert!(error.abs() < 1.0e-6, "{m}: {error:e}");
        }
        let share = |m: f32| kernel.mass(m).to_f32();
        let steps = 1_000;
        let width = ends[1] - ends[0];
        let moment = |power: i32| -> f64 {
            let step = |i: i32| {
                let edge = ends[0] + width * (i as f32 + 0.5) / steps as f32;
                let density = share(edge - 1.0e-3) - share(edge + 1.0e-3);
                f64::from(density) * f64::from(edge - 0.4).powi(power)
            };
            (0..steps).map(step).sum()
        };
        let deviation = (moment(2) / moment(0)).sqrt();
        assert!((deviation - 0.1).abs() < 2.0e-3, "{deviation}");
    }

    #[test]
    fn the_tails_are_exactly_one_and_zero() {
        let kernel = Kernel::new(0.024_67, 0.4, 0.0);
        for m in [0.0, 0.1, -0.2, 0.264] {
            assert_eq!(kernel.mass(m), Mass::ONE, "{m}");
        }
        for m in [0.536, -0.6, 10.0, f32::MAX] {
            assert_eq!(kernel.mass(m), Mass::ZERO, "{m}");
        }
    }

    #[test]
    fn what_is_not_a_number_has_no_mass() {
        let kernel = Kernel::new(0.024_67, 0.4, 0.0);
        for m in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            assert_eq!(kernel.mass(m), Mass::ZERO);
        }
    }

    #[test]
    fn the_mass_does_not_depend_on_the_sign_of_the_sample() {
        let kernel = Kernel::new(0.016_53, 0.04, 0.0);
        for i in 0..10_000 {
            let m = i as f32 * 2e-5;
            assert_eq!(kernel.mass(m), kernel.mass(-m));
        }
    }

    #[test]
    fn rounding_to_steps_clamps_what_is_no_probability() {
        assert_eq!(Mass::from_f32(-0.1), Mass::ZERO);
        assert_eq!(Mass::from_f32(1.1), Mass::ONE);
        assert_eq!(Mass::from_f32(f32::NAN), Mass::ZERO);
        assert_eq!(Mass::from_f32(0.25).to_f32(), 0.25);
    }
}
