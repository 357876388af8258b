//! Keys of a sensor's static calibration: the errors of its readings.

use crate::input::Correction;
use crate::number::shown;
use estimator_core::Vec3;

/// Limits of a key with three axes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub key: &'static str,
    /// The numbers in a correction.
    pub of: fn(&mut Correction) -> &mut Vec3,
    pub axes: [&'static str; 3],
    pub unit: &'static str,
    pub least: f32,
    pub most: f32,
    /// Neutral value.
    pub none: f32,
    pub meaning: &'static str,
}

pub(super) const ACCELEROMETER_BIAS: Limits = Limits {
    key: "accelerometer.bias_m_s2",
    of: |correction| &mut correction.accelerometer.bias,
    axes: ["ax", "ay", "az"],
    unit: "m/s²",
    least: -5.0,
    most: 5.0,
    none: 0.0,
    meaning: "what the accelerometer that recorded reads in free fall",
};

pub(super) const ACCELEROMETER_SCALE: Limits = Limits {
    key: "accelerometer.scale",
    of: |correction| &mut correction.accelerometer.scale,
    axes: ["ax", "ay", "az"],
    unit: "",
    least: 0.5,
    most: 2.0,
    none: 1.0,
    meaning: "by what its readings, without the bias, are multiplied",
};

pub(super) const GYROSCOPE_BIAS: Limits = Limits {
    key: "gyroscope.bias_rad_s",
    of: |correction| &mut correction.gyroscope_bias,
    axes: ["wx", "wy", "wz"],
    unit: "rad/s",
    least: -1.0,
    most: 1.0,
    none: 0.0,
    meaning: "what the gyroscope that recorded reads at rest",
};

impl PartialEq for Limits {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl Limits {
    /// Checks the value of an axis; the error is a sentence with the range.
    pub(super) fn checked(&self, axis: &str, value: f32) -> Result<f32, String> {
        if (self.least..=self.most).contains(&value) {
            return Ok(value);
        }
        let [is, low, high] = [value, self.least, self.most].map(shown);
        Err(format!("{axis} is {is}, allowed is {low} to {high}"))
    }
}

#[cfg(test)]
mod tests {
    use super::super::Overrides;
    use estimator_core::{AngularRate, SpecificForce, Vec3};

    fn corrected(text: &str) -> Result<[f32; 6], String> {
        let overrides = Overrides::parse(text, "robot.toml").map_err(|error| error.to_string())?;
        let correction = overrides.correction();
        let force = SpecificForce(Vec3::new(1.0, 2.0, 3.0));
        let rate = AngularRate(Vec3::new(4.0, 5.0, 6.0));
        let (SpecificForce(f), AngularRate(w)) = correction.apply(force, rate);
        Ok([f.x, f.y, f.z, w.x, w.y, w.z])
    }

    #[test]
    fn missing_keys_correct_nothing() {
        assert_eq!(corrected(""), Ok([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    }

    #[test]
    fn the_bias_is_taken_off_before_the_scale_is_applied() {
        let text = "[accelerometer]\nbias_m_s2 = { ax = 0.5, az = -1 }\nscale = { ax = 2, ay = 0.5 }\n\
                    [gyroscope]\nbias_rad_s = { wx = 0.25, wz = -0.5 }\n";
        assert_eq!(corrected(text), Ok([1.0, 1.0, 4.0, 3.75, 5.0, 6.5]));
    }

    #[test]
    fn sensor_errors_are_corrected_before_axes_are_turned() {
        let text = "axes = 'x,-z,y'\n[accelerometer]\nbias_m_s2 = { az = -1 }\nscale = { ay = 0.5 }\n\
                    [gyroscope]\nbias_rad_s = { wz = -0.5 }\n";
        assert_eq!(corrected(text), Ok([1.0, -4.0, 1.0, 4.0, -6.5, 5.0]));
    }

    #[test]
    fn correction_out_of_range_is_rejected_by_key() {
        for (text, refusal) in [
            (
                "accelerometer.bias_m_s2 = { ay = 9.81 }",
                "robot.toml, line 1, column 34, key accelerometer.bias_m_s2: ay is 9.81, allowed is -5 to 5",
            ),
            (
                "accelerometer.scale = { az = 9.81 }",
                "robot.toml, line 1, column 30, key accelerometer.scale: az is 9.81, allowed is 0.5 to 2",
            ),
            (
                "gyroscope.bias_rad_s = { wy = nan }",
                "robot.toml, line 1, column 31, key gyroscope.bias_rad_s: wy is NaN, allowed is -1 to 1",
            ),
        ] {
            assert_eq!(corrected(text), Err(refusal.to_owned()));
        }
    }
}
