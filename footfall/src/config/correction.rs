//! The keys of a sensor's static calibration: what is wrong with its readings.

use serde::Deserialize;

use super::{AccelerationAxes, AngularRateAxes, Refusal};
use crate::input::Correction;
use crate::number::shown;

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
    file: &str,
) -> Result<Correction, Refusal> {
    let mut correction = Correction::NONE;
    let AccelerationAxes { ax, ay, az } = &accelerometer.bias_m_s2;
    let AngularRateAxes { wx, wy, wz } = &gyroscope.bias_rad_s;
    let biases = [
        ("accelerometer.bias_m_s2.ax", ax, 5.0),
        ("accelerometer.bias_m_s2.ay", ay, 5.0),
        ("accelerometer.bias_m_s2.az", az, 5.0),
        ("gyroscope.bias_rad_s.wx", wx, 1.0),
        ("gyroscope.bias_rad_s.wy", wy, 1.0),
        ("gyroscope.bias_rad_s.wz", wz, 1.0),
    ];
    for (bias, (key, value, limit)) in correction.bias.iter_mut().zip(biases) {
        if let Some(value) = *value {
            *bias = f64::from(checked(file, key, value, -limit, limit)?);
        }
    }
    let AccelerationAxes { ax, ay, az } = &accelerometer.scale;
    let scales = [
        ("accelerometer.scale.ax", ax),
        ("accelerometer.scale.ay", ay),
        ("accelerometer.scale.az", az),
    ];
    for (scale, (key, value)) in correction.scale.iter_mut().zip(scales) {
        if let Some(value) = *value {
            *scale = f64::from(checked(file, key, value, 0.5, 2.0)?);
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

    fn corrected(text: &str) -> Result<[f64; 6], String> {
        let overrides = Overrides::parse(text, "robot.toml").unwrap();
        let correction = overrides.correction("robot.toml");
        let correction = correction.map_err(|refusal| refusal.to_string())?;
        Ok(correction.apply([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
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
