//! The keys of a sensor's static calibration: what is wrong with its readings.

use estimator_core::{AccelerometerCorrection, Mounting};
use recordings::input::Correction;
use recordings::number::shown;
use serde::Deserialize;

use super::{AccelerationAxes, AngularRateAxes, Refusal};

/// What is wrong with an accelerometer.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct AccelerometerOverrides {
    /// What it reads in free fall, m/s²; −5 to 5.
    #[serde(default)]
    pub bias_m_s2: AccelerationAxes,
    /// By what its readings, without the bias, are multiplied; 0.5 to 2.
    #[serde(default)]
    pub scale: AccelerationAxes,
}

/// What is wrong with a gyroscope.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct GyroscopeOverrides {
    /// What it reads at rest, rad/s; −1 to 1. Less than a bias that is learnt while it runs, but
    /// known from the first sample on.
    #[serde(default)]
    pub bias_rad_s: AngularRateAxes,
}

/// The correction that the keys of a file ask for.
pub(super) fn correction(
    accelerometer: &AccelerometerOverrides,
    gyroscope: &GyroscopeOverrides,
    axes: Option<Mounting>,
    file: &str,
) -> Result<Correction, Refusal> {
    let mut correction = Correction::NONE;
    let Correction {
        accelerometer: AccelerometerCorrection { bias, scale },
        gyroscope_bias,
        mounting,
    } = &mut correction;
    *mounting = axes.unwrap_or_default();
    let AccelerationAxes { ax, ay, az } = &accelerometer.bias_m_s2;
    let AngularRateAxes { wx, wy, wz } = &gyroscope.bias_rad_s;
    for (part, key, value, limit) in [
        (&mut bias.x, "accelerometer.bias_m_s2.ax", ax, 5.0),
        (&mut bias.y, "accelerometer.bias_m_s2.ay", ay, 5.0),
        (&mut bias.z, "accelerometer.bias_m_s2.az", az, 5.0),
        (&mut gyroscope_bias.x, "gyroscope.bias_rad_s.wx", wx, 1.0),
        (&mut gyroscope_bias.y, "gyroscope.bias_rad_s.wy", wy, 1.0),
        (&mut gyroscope_bias.z, "gyroscope.bias_rad_s.wz", wz, 1.0),
    ] {
        if let Some(value) = *value {
            *part = checked(file, key, value, -limit, limit)?;
        }
    }
    let AccelerationAxes { ax, ay, az } = &accelerometer.scale;
    for (part, key, value) in [
        (&mut scale.x, "accelerometer.scale.ax", ax),
        (&mut scale.y, "accelerometer.scale.ay", ay),
        (&mut scale.z, "accelerometer.scale.az", az),
    ] {
        if let Some(value) = *value {
            *part = checked(file, key, value, 0.5, 2.0)?;
        }
    }
    Ok(correction)
}

fn checked(file: &str, key: &str, value: f32, min: f32, max: f32) -> Result<f32, Refusal> {
    if (min..=max).contains(&value) {
        Ok(value)
    } else {
        let [is, low, high] = [value, min, max].map(shown);
        Err(Refusal::new(format!(
            "{file}: {key} is {is}, allowed is {low} to {high}"
        )))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Overrides;
    use estimator_core::{AngularRate, SpecificForce, Vec3};

    fn corrected(text: &str) -> Result<[f32; 6], String> {
        let overrides = Overrides::parse(text, "robot.toml").unwrap();
        let correction = overrides.correction("robot.toml");
        let correction = correction.map_err(|refusal| refusal.to_string())?;
        let force = SpecificForce(Vec3::new(1.0, 2.0, 3.0));
        let rate = AngularRate(Vec3::new(4.0, 5.0, 6.0));
        let (SpecificForce(f), AngularRate(w)) = correction.apply(force, rate);
        Ok([f.x, f.y, f.z, w.x, w.y, w.z])
    }

    #[test]
    fn a_file_without_the_keys_corrects_nothing() {
        assert_eq!(corrected(""), Ok([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    }

    #[test]
    fn the_bias_is_taken_off_before_the_scale_is_applied() {
        let text = "[accelerometer]\nbias_m_s2 = { ax = 0.5, az = -1 }\nscale = { ax = 2, ay = 0.5 }\n\
                    [gyroscope]\nbias_rad_s = { wx = 0.25, wz = -0.5 }\n";
        assert_eq!(corrected(text), Ok([1.0, 1.0, 4.0, 3.75, 5.0, 6.5]));
    }

    #[test]
    fn what_is_wrong_with_a_sensor_is_along_its_own_axes_and_taken_out_before_they_are_turned() {
        let text = "axes = 'x,-z,y'\n[accelerometer]\nbias_m_s2 = { az = -1 }\nscale = { ay = 0.5 }\n\
                    [gyroscope]\nbias_rad_s = { wz = -0.5 }\n";
        assert_eq!(corrected(text), Ok([1.0, -4.0, 1.0, 4.0, -6.5, 5.0]));
    }

    #[test]
    fn what_no_sensor_has_is_refused_by_its_key() {
        for (text, refusal) in [
            (
                "accelerometer.bias_m_s2 = { ay = 9.81 }",
                "robot.toml: accelerometer.bias_m_s2.ay is 9.81, allowed is -5 to 5",
            ),
            (
                "accelerometer.scale = { az = 9.81 }",
                "robot.toml: accelerometer.scale.az is 9.81, allowed is 0.5 to 2",
            ),
            (
                "gyroscope.bias_rad_s = { wy = nan }",
                "robot.toml: gyroscope.bias_rad_s.wy is NaN, allowed is -1 to 1",
            ),
        ] {
            assert_eq!(corrected(text), Err(refusal.to_owned()));
        }
    }
}
