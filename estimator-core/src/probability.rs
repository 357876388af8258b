//! Probabilities of stable contact, by axis, by direction and in total.

use crate::axis::PerAxis;
use crate::math::Order;

/// Probability that the foot is in stable contact, in total and by direction. Every value is a number in [0, 1].
///
/// The two methods judge directions differently:
///
/// | value | with half-widths | self-calibrating |
/// |---|---|---|
/// | axis | true value within ±half-width: the paper's P(\|m\| < δ) | acceleration along the axis, or the turn about it, is alone that of a stance |
/// | tangential | P(ax)·P(ay)·P(ωz): the paper's conditions on `v_x`, `v_y` and `ω_z` | acceleration across up is still, and the foot does not slide |
/// | vertical | P(az)·P(ωx)·P(ωy): the paper's conditions on `v_z`, `ω_x` and `ω_y` | acceleration along up is still |
/// | stable | product of all six axes | acceleration and turn together are those of a stance, and the foot does not slide |
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Probabilities {
    /// No motion along or about each axis.
    pub axes: PerAxis<f32>,
    /// No motion along the ground.
    pub tangential: f32,
    /// No lifting and no tilting.
    pub vertical: f32,
    /// Stable contact; never above any of the others.
    pub stable: f32,
}

impl Probabilities {
    /// Limits each probability to the same one in `others`.
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

    /// Probabilities of directions and in total, as products of those of independent axes.
    pub(crate) fn from_axes(axes: PerAxis<f32>) -> Self {
        let tangential = axes.ax * axes.ay * axes.wz;
        let vertical = axes.az * axes.wx * axes.wy;
        Self { axes, tangential, vertical, stable: tangential * vertical }
    }
}
