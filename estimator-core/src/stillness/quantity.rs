//! Types for a value or a coefficient per quantity.

use super::learnt::Classes;
use super::params::QuantityParams;

/// Upper end of stillness for one quantity, and its influence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Edge {
    /// Logarithm of the amplitude.
    pub at: f32,
    /// Share of the probability that the quantity cannot remove.
    pub floor: f32,
}

/// A value for each quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct PerQuantity<T> {
    pub acceleration: T,
    pub rate: T,
    pub velocity: T,
}

impl<T: Copy> PerQuantity<T> {
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> PerQuantity<U> {
        PerQuantity {
            acceleration: f(self.acceleration),
            rate: f(self.rate),
            velocity: f(self.velocity),
        }
    }
}

/// Coefficients of a quantity, derived from its constants.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct QuantityCoefficients {
    pub floor: f32,
    pub floor_squared: f32,
    pub prior: Classes,
    pub edge: f32,
    /// 1/(h√2) for the kernel's bandwidth h.
    pub inverse_scale: f32,
    pub indifference: f32,
    pub inverse_separation: f32,
}

impl QuantityCoefficients {
    // Not inlined: it runs at a start, once for each of several values.
    #[inline(never)]
    pub fn new(params: &QuantityParams, prior: Classes) -> Self {
        Self {
            floor: params.floor,
            floor_squared: params.floor * params.floor,
            prior,
            edge: params.edge,
            inverse_scale: core::f32::consts::FRAC_1_SQRT_2 / params.bandwidth,
            indifference: params.indifference,
            inverse_separation: 1.0 / params.separation,
        }
    }
}
