//! The result of a sample: one [`ContactEstimate`], with its probabilities and the reasons to doubt it.

use crate::flags::{Flag, Flags};
use crate::math::Order;
use crate::phase::{Decision, Phase};
use crate::sample::{AngularRate, LinearAcceleration, Timestamp};
use crate::vector::{Quaternion, Vec3};
use crate::velocity::VelocitySigma;

/// Estimate of the foot's contact after one sample.
///
/// Vectors are in the frame of the samples: that of the foot if a [mounting](crate::mounting) has rotated them,
/// otherwise that of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ContactEstimate {
    /// Timestamp of the sample that produced this estimate.
    pub timestamp: Timestamp,
    /// The probabilities over the trailing window, in [0, 1].
    pub probabilities: Probabilities,
    /// The debounced decision.
    pub decision: Decision,
    /// One of the paper's four cases; unknown without a load signal.
    pub phase: Phase,
    /// Reasons to doubt the estimate.
    pub flags: Flags,
    /// Orientation, foot → world; heading is arbitrary. The identity with [`Gravity::Removed`](crate::Gravity::Removed).
    pub orientation: Quaternion,
    /// Acceleration with gravity removed, frame of the foot, m/s². Zero if it is unknown.
    pub linear_acceleration: LinearAcceleration,
    /// Angular rate with bias removed, frame of the foot, rad/s. Zero if it is unknown.
    pub angular_rate: AngularRate,
    /// Estimated gyroscope bias, frame of the foot, rad/s.
    pub gyro_bias: AngularRate,
    /// Standard deviation of the foot's velocity, each axis, about zero, m/s: a
    /// [zero-velocity measurement](crate::velocity) of this sample.
    pub velocity_sigma: VelocitySigma,
}

impl ContactEstimate {
    /// The estimate for a sample that could not be processed: not stable, with probability 0, the identity as
    /// orientation, [`VelocitySigma::MOST`] and [`Flag::InvalidSample`].
    pub const DOUBTFUL: Self = Self {
        timestamp: Timestamp::from_micros(0),
        probabilities: Probabilities {
            axes: PerAxis::splat(0.0),
            tangential: 0.0,
            vertical: 0.0,
            stable: 0.0,
        },
        decision: Decision::NotStable,
        phase: Phase::Unknown,
        flags: Flags::NONE.with(Flag::InvalidSample),
        orientation: Quaternion::IDENTITY,
        linear_acceleration: LinearAcceleration(Vec3::ZERO),
        angular_rate: AngularRate(Vec3::ZERO),
        gyro_bias: AngularRate(Vec3::ZERO),
        velocity_sigma: VelocitySigma::MOST,
    };
}

/// Probability that the foot is in stable contact, in total and by direction. Every value is a number in [0, 1], and 0
/// where the sample is not valid or up is not known.
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
    /// No lifting; with half-widths also no tilting.
    pub vertical: f32,
    /// Stable contact; never above any of the other probabilities.
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

    /// Multiplies the probabilities of the axes, taken as independent, for each direction and in total.
    pub(crate) fn from_axes(axes: PerAxis<f32>) -> Self {
        let tangential = axes.ax * axes.ay * axes.wz;
        let vertical = axes.az * axes.wx * axes.wy;
        Self { axes, tangential, vertical, stable: tangential * vertical }
    }
}

/// One of the six axes of an IMU, in the frame of the foot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Axis {
    /// Acceleration along x.
    Ax,
    /// Acceleration along y.
    Ay,
    /// Acceleration along z.
    Az,
    /// Angular rate about x.
    Wx,
    /// Angular rate about y.
    Wy,
    /// Angular rate about z.
    Wz,
}

impl Axis {
    /// All axes in canonical order.
    pub const ALL: [Self; 6] = [Self::Ax, Self::Ay, Self::Az, Self::Wx, Self::Wy, Self::Wz];

    /// The axis' short name, as in file headers: `ax` … `wz`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ax => "ax",
            Self::Ay => "ay",
            Self::Az => "az",
            Self::Wx => "wx",
            Self::Wy => "wy",
            Self::Wz => "wz",
        }
    }
}

/// A value for each of the six axes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PerAxis<T> {
    /// Acceleration along x.
    pub ax: T,
    /// Acceleration along y.
    pub ay: T,
    /// Acceleration along z.
    pub az: T,
    /// Angular rate about x.
    pub wx: T,
    /// Angular rate about y.
    pub wy: T,
    /// Angular rate about z.
    pub wz: T,
}

impl<T: Copy> PerAxis<T> {
    /// The same value on every axis.
    #[must_use]
    pub const fn splat(value: T) -> Self {
        Self::by_sensor(value, value)
    }

    /// One value for the three acceleration axes, another for the three angular-rate axes.
    #[must_use]
    pub const fn by_sensor(acceleration: T, angular_rate: T) -> Self {
        Self {
            ax: acceleration,
            ay: acceleration,
            az: acceleration,
            wx: angular_rate,
            wy: angular_rate,
            wz: angular_rate,
        }
    }

    /// Creates a value per axis from an array in the order of [`Axis::ALL`].
    #[must_use]
    pub const fn from_array([ax, ay, az, wx, wy, wz]: [T; 6]) -> Self {
        Self { ax, ay, az, wx, wy, wz }
    }

    /// Returns the values as an array in the order of [`Axis::ALL`].
    #[must_use]
    pub const fn to_array(self) -> [T; 6] {
        [self.ax, self.ay, self.az, self.wx, self.wy, self.wz]
    }

    /// Returns the value of one axis.
    #[must_use]
    pub const fn get(&self, axis: Axis) -> T {
        match axis {
            Axis::Ax => self.ax,
            Axis::Ay => self.ay,
            Axis::Az => self.az,
            Axis::Wx => self.wx,
            Axis::Wy => self.wy,
            Axis::Wz => self.wz,
        }
    }

    /// Applies `f` to the value of every axis.
    #[inline]
    pub fn map<U>(self, mut f: impl FnMut(T) -> U) -> PerAxis<U> {
        PerAxis {
            ax: f(self.ax),
            ay: f(self.ay),
            az: f(self.az),
            wx: f(self.wx),
            wy: f(self.wy),
            wz: f(self.wz),
        }
    }

    /// Combines two values on every axis.
    #[inline]
    pub fn zip_with<U: Copy, V>(
        self,
        other: PerAxis<U>,
        mut f: impl FnMut(T, U) -> V,
    ) -> PerAxis<V> {
        PerAxis {
            ax: f(self.ax, other.ax),
            ay: f(self.ay, other.ay),
            az: f(self.az, other.az),
            wx: f(self.wx, other.wx),
            wy: f(self.wy, other.wy),
            wz: f(self.wz, other.wz),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_follow_the_order_of_the_axes() {
        let values = PerAxis::from_array([0, 1, 2, 3, 4, 5]);
        assert_eq!(Axis::ALL.map(|axis| values.get(axis)), values.to_array());
    }

    #[test]
    fn zipping_pairs_each_axis_with_itself() {
        let left = PerAxis::from_array([1, 2, 3, 4, 5, 6]);
        let pairs = left.zip_with(left.map(|v| v * 10), |a, b| (a, b));
        assert_eq!(pairs.to_array(), [(1, 10), (2, 20), (3, 30), (4, 40), (5, 50), (6, 60)]);
    }
}
