//! The probability of stillness, by the method of the configuration.

use crate::adaptive::{Adaptive, Learnt, Up};
use crate::config::Config;
use crate::kde::density::Density;
use crate::kde::window::{AnyRing, Filling, Ring};
use crate::params::Method;
use crate::probability::Probabilities;
use crate::sample::{AngularRate, LinearAcceleration};

/// The model of a [`Method`], with room for `CAPACITY` samples in a window of half-widths.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)] // It is always in place, in static memory, as large as the larger one.
pub(crate) enum Model<const CAPACITY: usize> {
    /// [`Method::SelfCalibrating`].
    SelfCalibrating(Adaptive),
    /// [`Method::HalfWidths`], which learns nothing: it returns what the parameters hold.
    HalfWidths(Density<Ring<CAPACITY>>, Learnt),
}

/// Knowledge of a sample.
#[derive(Clone, Copy)]
pub(crate) enum Known {
    /// Its motion, without gravity and bias.
    Motion(LinearAcceleration, AngularRate),
    /// Nothing, while up is unknown.
    NoAttitude,
    /// Nothing.
    Nothing,
}

impl<const CAPACITY: usize> Model<CAPACITY> {
    pub(crate) fn new(config: &Config<CAPACITY>) -> Self {
        let adaptive = Adaptive::new(&config.adaptive);
        match config.method {
            Method::SelfCalibrating => Self::SelfCalibrating(adaptive),
            Method::HalfWidths => Self::HalfWidths(Density::new(config), adaptive.learnt()),
        }
    }

    /// Processes what is known of one sample.
    #[inline]
    pub(crate) fn push(&mut self, known: Known, up: impl FnOnce() -> Up) -> Probabilities {
        match self {
            Self::SelfCalibrating(adaptive) => match known {
                Known::Motion(acceleration, rate) => adaptive.push(acceleration, rate, up()),
                Known::Nothing | Known::NoAttitude => adaptive.push_doubt(),
            },
            Self::HalfWidths(density, _) => {
                let density: &mut Density<AnyRing> = density;
                match known {
                    Known::Motion(acceleration, rate) => density.push(acceleration, rate),
                    Known::Nothing => density.push_doubt(),
                    // The remainder of gravity would count as motion.
                    Known::NoAttitude => {
                        density.clear();
                        Probabilities::default()
                    }
                }
            }
        }
    }

    /// Accounts for missing samples. Returns upper limits for the probabilities of the next sample: those
    /// before a short gap, which has no other effect. A longer gap counts like unreliable samples,
    /// at most a few windows of them; the limits are the probabilities after them.
    #[inline(never)]
    pub(crate) fn account_for(&mut self, missing: u64) -> Option<Probabilities> {
        match self {
            Self::SelfCalibrating(adaptive) => Some(adaptive.account_for(missing)),
            Self::HalfWidths(density, _) => {
                let density: &mut Density<AnyRing> = density;
                if missing + 1 >= density.window_length() as u64 {
                    // No sample in the window is recent.
                    density.clear();
                } else {
                    for _ in 0..missing {
                        density.push_doubt();
                    }
                }
                None
            }
        }
    }

    /// Returns whether the window is full.
    #[inline]
    pub(crate) const fn filling(&self) -> Filling {
        match self {
            Self::SelfCalibrating(adaptive) => adaptive.filling(),
            Self::HalfWidths(density, _) => {
                let density: &Density<AnyRing> = density;
                density.filling()
            }
        }
    }

    /// Returns whether nothing is left to be learnt before the probabilities are of this foot.
    #[inline]
    pub(crate) fn is_settled(&self) -> bool {
        match self {
            Self::SelfCalibrating(adaptive) => adaptive.is_settled(),
            Self::HalfWidths(..) => true,
        }
    }

    /// Returns whether evidence alone keeps the probability at or below a threshold.
    #[inline]
    pub(crate) fn is_unproven(&self, threshold: f32) -> bool {
        match self {
            Self::SelfCalibrating(adaptive) => adaptive.is_unproven(threshold),
            Self::HalfWidths(..) => false,
        }
    }

    /// Values learnt so far.
    #[inline]
    pub(crate) fn learnt(&self) -> Learnt {
        match self {
            Self::SelfCalibrating(adaptive) => adaptive.learnt(),
            Self::HalfWidths(_, learnt) => *learnt,
        }
    }
}
