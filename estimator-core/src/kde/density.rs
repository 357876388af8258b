//! The paper's method, from motion to probability: six kernels, a window, and three products.
//!
//! The limits are configured per axis ([`Method::HalfWidths`](crate::Method)); if the foot learns them
//! itself, [`adaptive`](crate::adaptive) is used instead.

use crate::axis::PerAxis;
use crate::config::Config;
use crate::kde::kernel::{Kernel, Mass};
use crate::kde::window::{AnyRing, Filling, Ring, Window};
use crate::probability::Probabilities;
use crate::sample::{AngularRate, LinearAcceleration};

/// The kernel density estimate of the paper, causal and in closed form: the window's masses and
/// their mean. It has room for `CAPACITY` samples.
#[derive(Clone, Debug)]
pub struct DensityEstimator<const CAPACITY: usize>(Density<Ring<CAPACITY>>);

impl<const CAPACITY: usize> DensityEstimator<CAPACITY> {
    /// An empty window over the kernels of `config`.
    #[must_use]
    pub fn new(config: &Config<CAPACITY>) -> Self {
        Self(Density::new(config))
    }

    /// Adds one sample's motion, gravity and bias removed, and returns the probabilities of the
    /// window. A value that is not finite has mass 0 on its axis. O(1), whatever the window.
    #[inline]
    pub fn push(
        &mut self,
        acceleration: LinearAcceleration,
        angular_rate: AngularRate,
    ) -> Probabilities {
        let density: &mut Density<AnyRing> = &mut self.0;
        density.push(acceleration, angular_rate)
    }

    /// Adds an unreliable sample: mass 0 on every axis.
    #[inline]
    pub fn push_doubt(&mut self) -> Probabilities {
        let density: &mut Density<AnyRing> = &mut self.0;
        density.push_doubt()
    }

    /// Probabilities of the current window; 0 while it holds no sample.
    #[must_use]
    pub fn probabilities(&self) -> Probabilities {
        let density: &Density<AnyRing> = &self.0;
        density.probabilities()
    }
}

/// Implementation of [`DensityEstimator`] for any ring.
#[derive(Clone, Debug)]
pub(crate) struct Density<R: ?Sized> {
    kernels: PerAxis<Kernel>,
    window: Window<R>,
}

impl<const CAPACITY: usize> Density<Ring<CAPACITY>> {
    pub(crate) fn new(config: &Config<CAPACITY>) -> Self {
        Self { kernels: config.kernels, window: Window::new(config.window_length()) }
    }
}

impl Density<AnyRing> {
    /// See [`DensityEstimator::push`].
    pub(crate) fn push(
        &mut self,
        acceleration: LinearAcceleration,
        angular_rate: AngularRate,
    ) -> Probabilities {
        let (a, w) = (acceleration.0, angular_rate.0);
        self.window.push(PerAxis {
            ax: self.kernels.ax.mass(a.x),
            ay: self.kernels.ay.mass(a.y),
            az: self.kernels.az.mass(a.z),
            wx: self.kernels.wx.mass(w.x),
            wy: self.kernels.wy.mass(w.y),
            wz: self.kernels.wz.mass(w.z),
        });
        self.probabilities()
    }

    /// See [`DensityEstimator::push_doubt`].
    pub(crate) fn push_doubt(&mut self) -> Probabilities {
        self.window.push(PerAxis::splat(Mass::ZERO));
        self.probabilities()
    }

    /// See [`DensityEstimator::probabilities`].
    pub(crate) fn probabilities(&self) -> Probabilities {
        Probabilities::from_axes(self.window.mean())
    }

    /// Discards every sample: the probabilities are 0 until the next.
    pub(crate) fn clear(&mut self) {
        self.window.clear();
    }

    /// Length of the window in samples.
    pub(crate) const fn window_length(&self) -> usize {
        self.window.length()
    }

    /// Returns whether the window is full.
    pub(crate) const fn filling(&self) -> Filling {
        self.window.filling()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::Params;
    use crate::vector::Vec3;

    fn estimator() -> DensityEstimator<64> {
        DensityEstimator::new(&Params::PAPER.validate().expect("a preset"))
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
}
