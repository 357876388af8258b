//! The result of a sample: one [`ContactEstimate`], with its probabilities and the reasons to doubt it.

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
    /// The estimate where a sample could not be processed: not stable, with probability 0, the identity as orientation,
    /// [`VelocitySigma::MOST`] and [`Flag::InvalidSample`].
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
    /// No lifting; with half-widths also no tilting.
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

/// A reason to doubt an estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Flag {
    /// Fewer samples than the window's length have been used. The means cover the samples so far. Samples before up is
    /// known are not used, so that the flag stays with [`Self::AttitudeNotInitialised`].
    WindowNotFull,
    /// The attitude filter has not found up yet, or has lost it in a gap, so gravity cannot be removed. With
    /// half-widths every probability is 0; otherwise each sample counts as mass 0.
    AttitudeNotInitialised,
    /// The newest sample is at the end of the sensor's range; it counts as mass 0.
    Saturated,
    /// The newest sample repeats an earlier one; it counts as mass 0.
    Stale,
    /// The newest sample is not finite, beyond any sensor's range, or not later than the one
    /// before; it counts as mass 0.
    InvalidSample,
    /// At least one sample is missing before this one. With half-widths, missing samples count as mass 0. Otherwise a
    /// gap of up to half a window is bridged, with a probability no higher than before it; a longer gap reduces the
    /// probability, to almost 0 within three windows.
    TimeGap,
    /// The foot has not yet shown enough stillness and motion: the limits between them
    /// are still mostly those that fit all feet. Walking a few steps clears it.
    Settling,
    /// The foot moves as little as in a stance, but has neither rested nor landed for longer than a stride: it may
    /// hang, or be carried. The probability is at most one half.
    Unproven,
}

impl Flag {
    /// All flags, in the order of their bits.
    pub const ALL: [Self; 8] = [
        Self::WindowNotFull,
        Self::AttitudeNotInitialised,
        Self::Saturated,
        Self::Stale,
        Self::InvalidSample,
        Self::TimeGap,
        Self::Settling,
        Self::Unproven,
    ];

    /// The flag's name as written in files: `window_not_full` and so on.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::WindowNotFull => "window_not_full",
            Self::AttitudeNotInitialised => "attitude_not_initialised",
            Self::Saturated => "saturated",
            Self::Stale => "stale",
            Self::InvalidSample => "invalid_sample",
            Self::TimeGap => "time_gap",
            Self::Settling => "settling",
            Self::Unproven => "unproven",
        }
    }

    const fn bit(self) -> u8 {
        1 << self as u8
    }
}

/// A set of [`Flag`]s.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Flags(u8);

impl Flags {
    /// No reason for doubt.
    pub const NONE: Self = Self(0);

    /// Returns this set with `flag` added.
    #[must_use]
    pub const fn with(self, flag: Flag) -> Self {
        Self(self.0 | flag.bit())
    }

    /// Returns whether `flag` is in the set.
    #[must_use]
    pub const fn contains(self, flag: Flag) -> bool {
        self.0 & flag.bit() != 0
    }

    /// Returns whether the data are in doubt, so that the decision must not be "stable".
    ///
    /// True for any flag but two: the missing samples of a [`Flag::TimeGap`] have already been accounted for, and a
    /// foot that is [`Flag::Settling`], since it has never walked, may stand.
    #[must_use]
    pub const fn are_doubt(self) -> bool {
        self.0 & !(Flag::TimeGap.bit() | Flag::Settling.bit()) != 0
    }

    /// Returns whether the set is empty.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Iterates over the flags in the set, in the order of their bits.
    pub fn iter(self) -> impl Iterator<Item = Flag> {
        Flag::ALL.into_iter().filter(move |flag| self.contains(*flag))
    }

    /// Creates the set of these bits, as of [`bits`](Self::bits).
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// The set as bits: bit *i* stands for `Flag::ALL[i]`.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
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

    #[test]
    fn set_holds_the_flags_put_into_it_and_no_others() {
        let set = Flags::NONE.with(Flag::Saturated).with(Flag::TimeGap);
        assert!(set.iter().eq([Flag::Saturated, Flag::TimeGap]));
        assert!(!set.contains(Flag::Stale) && !set.is_empty());
    }

    #[test]
    fn every_flag_has_its_own_bit_at_its_place_in_the_list() {
        for (i, flag) in Flag::ALL.into_iter().enumerate() {
            assert_eq!(Flags::NONE.with(flag).bits(), 1 << i);
        }
    }

    #[test]
    fn flags_of_bits_are_those_that_were_joined() {
        for flag in Flag::ALL {
            let flags = Flags::NONE.with(flag).with(Flag::Saturated);
            assert_eq!(Flags::from_bits(flags.bits()), flags);
        }
    }
}
