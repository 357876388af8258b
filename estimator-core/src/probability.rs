//! From motion to probability: six kernels, one window, and the paper's three products.

use crate::axis::PerAxis;
use crate::kernel::{Kernel, Mass};
use crate::params::Config;
use crate::sample::{AngularRate, LinearAcceleration};
use crate::window::{Filling, Window};

/// How probable it is that the foot is in stable contact, and along which axes. Every value is
/// a number in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Probabilities {
    /// Probability per axis that its true value lies within ±half-width (the paper's P(|m| < δ)).
    pub axes: PerAxis<f32>,
    /// No motion along the ground: P(ax)·P(ay)·P(ωz), the paper's conditions on `v_x`, `v_y` and `ω_z`.
    pub tangential: f32,
    /// No lifting and no tilting: P(az)·P(ωx)·P(ωy), the paper's conditions on `v_z`, `ω_x` and `ω_y`.
    pub vertical: f32,
    /// Stable contact: the product of all six axes.
    pub stable: f32,
}

impl Probabilities {
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
/// their mean.
#[derive(Clone, Debug)]
pub struct DensityEstimator<const CAPACITY: usize> {
    kernels: PerAxis<Kernel>,
    window: Window<CAPACITY>,
}

impl<const CAPACITY: usize> DensityEstimator<CAPACITY> {
    /// An empty window over the kernels of `config`.
    #[must_use]
    pub fn new(config: &Config<CAPACITY>) -> Self {
        Self {
            kernels: config.kernels,
            window: Window::new(config.window_length()),
        }
    }

    /// Takes in one sample's motion, gravity and bias removed, and returns what the window now
    /// says. A value that is not finite has mass 0 on its axis. O(1), whatever the window.
    #[inline]
    pub fn push(
        &mut self,
        acceleration: LinearAcceleration,
        angular_rate: AngularRate,
    ) -> Probabilities {
        let (a, w) = (acceleration.0, angular_rate.0);
        let motion = PerAxis::from_array([a.x, a.y, a.z, w.x, w.y, w.z]);
        self.window
            .push(self.kernels.zip_with(motion, |kernel, m| kernel.mass(m)));
        self.probabilities()
    }

    /// Takes in a sample that cannot be believed: mass 0 on every axis.
    #[inline]
    pub fn push_doubt(&mut self) -> Probabilities {
        self.window.push(PerAxis::splat(Mass::ZERO));
        self.probabilities()
    }

    /// What the window says now. 0 where it is empty.
    #[inline]
    #[must_use]
    pub fn probabilities(&self) -> Probabilities {
        Probabilities::from_axes(self.window.mean())
    }

    /// Forgets every sample.
    pub fn clear(&mut self) {
        self.window.clear();
    }

    /// Length of the window in samples.
    #[must_use]
    pub const fn window_length(&self) -> usize {
        self.window.length()
    }

    /// Whether the window is full.
    #[must_use]
    pub const fn filling(&self) -> Filling {
        self.window.filling()
    }
}
