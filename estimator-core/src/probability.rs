//! Probabilities of stable contact, by axis, by direction and in total.

use crate::axis::PerAxis;
use crate::math::Order;

/// Probability that the foot is in stable contact, in total and by direction. Every value is
/// a number in [0, 1].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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
        Self { axes: PerAxis::from_array([ax, ay, az, wx, wy, wz]), tangential, vertical, stable }
    }

    pub(crate) fn from_axes(axes: PerAxis<f32>) -> Self {
        let tangential = axes.ax * axes.ay * axes.wz;
        let vertical = axes.az * axes.wx * axes.wy;
        Self { axes, tangential, vertical, stable: tangential * vertical }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
