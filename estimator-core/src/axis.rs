//! The six axes of an IMU, and a value for each of them.

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
