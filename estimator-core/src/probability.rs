//! The paper's method, from motion to probability: six kernels, a window, and three products.
//!
//! The limits are configured per axis ([`Method::HalfWidths`](crate::Method)); if the foot learns them
//! itself, [`stillness`](crate::stillness) is used instead.

use crate::axis::PerAxis;
use crate::config::Config;
use crate::kernel::{Kernel, Mass};
use crate::order::Order;
use crate::sample::{AngularRate, LinearAcceleration};
use crate::window::{AnyRing, Filling, Ring, Window};

/// Probability that the foot is in stable contact, in total and by direction. Every value is
/// a number in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Probabilities {
    /// Probability per axis that the foot does not move along or about it: with half-widths that its
    /// true value lies within ±half-width (the paper's P(|m| < δ)), otherwise the result of the classes for
    /// the motion along or about this axis alone.
    pub axes: PerAxis<f32>,
    /// No motion along the ground, the paper's conditions on `v_x`, `v_y` and `ω_z`: with half-widths
    /// P(ax)·P(ay)·P(ωz), otherwise the result of the classes for the motion across up and the turn about it.
    pub tangential: f32,
    /// No lifting and no tilting, the paper's conditions on `v_z`, `ω_x` and `ω_y`: with half-widths
    /// P(az)·P(ωx)·P(ωy), otherwise the result of the classes for the motion along up and the turn across it.
    pub vertical: f32,
    /// Stable contact: with half-widths the product of all six axes, otherwise the result of the classes for
    /// the whole motion; never above any of the others.
    pub stable: f32,
}

impl Probabilities {
    /// Limits each probability to that in `others`.
    pub(crate) fn limit(&mut self, others: &Self) {
        let mut all = self.to_array();
        for (p, most) in all.iter_mut().zip(others.to_array()) {
            *p = p.lesser(most);
        }
        *self = Self::from_array(all);
    }

    /// Multiplies each probability by `share`.
    #[must_use]
    pub(crate) fn scaled(&self, share: f32) -> Self {
        Self::from_array(self.to_array().map(|p| p * share))
    }

    /// Returns the probabilities as an array, the axes first.
    const fn to_array(self) -> [f32; 9] {
        let [ax, ay, az, wx, wy, wz] = self.axes.to_array();
        let (tangential, vertical, stable) = (self.tangential, self.vertical, self.stable);
        [ax, ay, az, wx, wy, wz, tangential, vertical, stable]
    }

    const fn from_array(all: [f32; 9]) -> Self {
        let [ax, ay, az, wx, wy, wz, tangential, vertical, stable] = all;
        Self {
            axes: PerAxis::from_array([ax, ay, az, wx, wy, wz]),
            tangential,
            vertical,
            stable,
        }
    }

    fn from_axes(axes: PerAxis<f32>) -> Self {
        let tangential = axes.ax * axes.ay * axes.wz;
        let vertical = axes.az * axes.wx * axes.wy;
        Self {
            axes,
            tangential,
            vertical,
            stable: tangential * vertical,
        }
    }
}

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
        Self {
            kernels: config.kernels,
            window: Window::new(config.window_length()),
        }
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
    fn directions_and_total_are_products_of_their_axes() {
        let axes = PerAxis::from_array([0.9, 0.8, 0.7, 0.6, 0.5, 0.4]);
        let p = Probabilities::from_axes(axes);
        for (found, expected) in [
            (p.tangential, 0.9 * 0.8 * 0.4),
            (p.vertical, 0.7 * 0.6 * 0.5),
            (p.stable, 0.9 * 0.8 * 0.7 * 0.6 * 0.5 * 0.4),
        ] {
            assert!((found - expected).abs() < 1.0e-6, "{found} for {expected}");
        }
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
