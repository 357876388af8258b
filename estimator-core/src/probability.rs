//! From motion to probability: six kernels, one or two windows, and the paper's three products.

use crate::axis::PerAxis;
use crate::kernel::{Kernel, Mass};
use crate::params::Config;
use crate::sample::{AngularRate, LinearAcceleration};
use crate::slide::Slide;
use crate::window::{AnyRing, Filling, Ring, Window};

/// How probable it is that the foot is in stable contact, and along which axes. Every value is
/// a number in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Probabilities {
    /// Probability per axis that its true value lies within ±half-width (the paper's P(|m| < δ)).
    /// Where there are several witnesses, the least favourable: the longer window, the shorter
    /// one ([`Params::short_window`](crate::Params::short_window)), and along the ground the
    /// speed picked up ([`Params::slide`](crate::Params::slide)).
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
/// their mean, and what else may testify against an axis. It has room for `CAPACITY` samples.
#[derive(Clone, Debug)]
pub struct DensityEstimator<const CAPACITY: usize>(Density<Ring<CAPACITY>>);

impl<const CAPACITY: usize> DensityEstimator<CAPACITY> {
    /// An empty window over the kernels of `config`.
    #[must_use]
    pub fn new(config: &Config<CAPACITY>) -> Self {
        Self(Density::new(config))
    }

    /// Takes in one sample's motion, gravity and bias removed, and returns what the window now
    /// says. A value that is not finite has mass 0 on its axis. O(1), whatever the window.
    #[inline]
    pub fn push(
        &mut self,
        acceleration: LinearAcceleration,
        angular_rate: AngularRate,
    ) -> Probabilities {
        let density: &mut Density<AnyRing> = &mut self.0;
        density.push(acceleration, angular_rate)
    }

    /// Takes in a sample that cannot be believed: mass 0 on every axis. It adds nothing to the
    /// speed.
    #[inline]
    pub fn push_doubt(&mut self) -> Probabilities {
        let density: &mut Density<AnyRing> = &mut self.0;
        density.push_doubt()
    }

    /// What the windows and the speed say now. 0 where there is no sample.
    #[must_use]
    pub fn probabilities(&self) -> Probabilities {
        let density: &Density<AnyRing> = &self.0;
        density.probabilities()
    }
}

/// The same with any ring.
#[derive(Clone, Debug)]
pub(crate) struct Density<R: ?Sized> {
    kernels: PerAxis<Kernel>,
    slide: Option<Slide>,
    /// Every axis at rest, according to the shortest window alone.
    newest: f32,
    window: Window<R>,
}

impl<const CAPACITY: usize> Density<Ring<CAPACITY>> {
    pub(crate) fn new(config: &Config<CAPACITY>) -> Self {
        Self {
            kernels: config.kernels,
            slide: config.slide.map(Slide::new),
            newest: 0.0,
            window: Window::new(config.window_length()).with_newest(config.short_window_length()),
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
        if let Some(slide) = &mut self.slide {
            slide.push(acceleration);
        }
        self.testify()
    }

    /// See [`DensityEstimator::push_doubt`].
    pub(crate) fn push_doubt(&mut self) -> Probabilities {
        self.window.push(PerAxis::splat(Mass::ZERO));
        self.testify()
    }

    /// Hears what the windows and the speed say now, and remembers whether the foot is quiet.
    #[inline]
    fn testify(&mut self) -> Probabilities {
        let whole = self.window.mean();
        let (axes, newest) = match self.window.mean_of_newest() {
            Some(newest) => (whole.zip_with(newest, lower), newest),
            None => (whole, whole),
        };
        self.newest = Probabilities::from_axes(newest).stable;
        Probabilities::from_axes(self.with_slide(axes))
    }

    #[inline]
    fn with_slide(&self, mut axes: PerAxis<f32>) -> PerAxis<f32> {
        if let Some(slide) = &self.slide {
            let (x, y) = slide.probabilities();
            axes.ax = lower(axes.ax, x);
            axes.ay = lower(axes.ay, y);
        }
        axes
    }

    /// See [`DensityEstimator::probabilities`].
    pub(crate) fn probabilities(&self) -> Probabilities {
        let whole = self.window.mean();
        let newest = self.window.mean_of_newest().unwrap_or(whole);
        Probabilities::from_axes(self.with_slide(whole.zip_with(newest, lower)))
    }

    /// Forgets every sample: the probabilities are 0 until the next.
    pub(crate) fn clear(&mut self) {
        self.window.clear();
        if let Some(slide) = &mut self.slide {
            slide.clear();
        }
        self.newest = 0.0;
    }

    /// Whether the shortest window finds it more probable than not that every axis is at rest.
    #[inline]
    pub(crate) fn is_quiet(&self) -> bool {
        self.newest >= QUIET
    }

    /// Length of the window in samples.
    pub(crate) const fn window_length(&self) -> usize {
        self.window.length()
    }

    /// Whether the window is full.
    pub(crate) const fn filling(&self) -> Filling {
        self.window.filling()
    }
}

/// More probable than not.
const QUIET: f32 = 0.5;

/// Neither is NaN.
#[inline]
fn lower(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}
