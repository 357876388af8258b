//! Values per axis: one number for the three axes of a sensor, or a table of axes.

use std::fmt;
use std::marker::PhantomData;

use estimator_core::PerAxis;
use serde::de::value::MapAccessDeserializer;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

/// A value for each axis of both sensors.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
pub struct SensorOverrides {
    /// For `ax`, `ay` and `az`, m/s².
    pub acceleration_m_s2: AxisOverrides<AccelerationAxes>,
    /// For `wx`, `wy` and `wz`, rad/s.
    pub angular_rate_rad_s: AxisOverrides<AngularRateAxes>,
}

/// Values for the three axes of one sensor.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum AxisOverrides<A> {
    /// Value of the preset.
    #[default]
    Unset,
    /// One value for all three axes.
    All(f32),
    /// One value for each axis.
    Each(A),
}

/// Values by acceleration axis, m/s².
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct AccelerationAxes {
    /// Along x.
    pub ax: Option<f32>,
    /// Along y.
    pub ay: Option<f32>,
    /// Along z.
    pub az: Option<f32>,
}

/// Values by angular-rate axis, rad/s.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct AngularRateAxes {
    /// About x.
    pub wx: Option<f32>,
    /// About y.
    pub wy: Option<f32>,
    /// About z.
    pub wz: Option<f32>,
}

impl SensorOverrides {
    pub(super) fn apply(&self, params: &mut PerAxis<f32>) {
        let acceleration = &self.acceleration_m_s2;
        let [ax, ay, az] = acceleration.values(|axes| [axes.ax, axes.ay, axes.az]);
        let rate = &self.angular_rate_rad_s;
        let [wx, wy, wz] = rate.values(|axes| [axes.wx, axes.wy, axes.wz]);
        let overrides = PerAxis::from_array([ax, ay, az, wx, wy, wz]);
        *params = params.zip_with(overrides, |value, given| given.unwrap_or(value));
    }
}

impl<A> AxisOverrides<A> {
    fn values(&self, each: impl Fn(&A) -> [Option<f32>; 3]) -> [Option<f32>; 3] {
        match self {
            Self::Unset => [None; 3],
            Self::All(value) => [Some(*value); 3],
            Self::Each(axes) => each(axes),
        }
    }
}

// Implemented by hand because serde's untagged enums cannot name the unknown key of the table.
impl<'de, A: Deserialize<'de>> Deserialize<'de> for AxisOverrides<A> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberOrTable<A>(PhantomData<A>);

        impl<'de, A: Deserialize<'de>> Visitor<'de> for NumberOrTable<A> {
            type Value = AxisOverrides<A>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number or a table of axes")
            }

            fn visit_f64<E>(self, value: f64) -> Result<Self::Value, E> {
                Ok(AxisOverrides::All(value as f32))
            }

            fn visit_i64<E>(self, value: i64) -> Result<Self::Value, E> {
                Ok(AxisOverrides::All(value as f32))
            }

            fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Self::Value, M::Error> {
                A::deserialize(MapAccessDeserializer::new(map)).map(AxisOverrides::Each)
            }
        }

        deserializer.deserialize_any(NumberOrTable(PhantomData))
    }
}
