//! JSON report of the parameters with which a result was computed.

use std::collections::BTreeMap;

use crate::input::{Correction, Format};
use crate::number::shown;
use crate::samples::space::components;
use estimator_core::{GyroTiming, Parameter, Params, WindowLength};
use serde::Serialize;
#[cfg(test)]
use serde_json::json;

use crate::config::{GRAVITIES, LEARNINGS, LearntValues, METHODS, Preset, axes_text, word_of};

/// How one foot was estimated.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Estimation {
    /// Preset that the parameters started from, as `--preset` takes it.
    pub preset: &'static str,
    /// Parameters in force.
    pub parameters: ParametersReport,
    /// Correction of the recording's readings before the estimate.
    pub correction: CorrectionReport,
    /// Values the estimator had learnt at the end, with any method.
    pub learnt: LearntValues,
}

/// The parameters of the estimator.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ParametersReport {
    /// Whether the accelerations contain gravity.
    pub gravity: &'static str,
    /// Where the limits of stillness come from.
    pub method: &'static str,
    /// With `self_calibrating`: whether the foot goes on learning.
    pub learning: &'static str,
    /// With `half_widths`: how far back the estimate looks.
    pub window: WindowReport,
    /// When the gyroscope measured what a sample says.
    pub gyro_timing: GyroTimingReport,
    /// With `self_calibrating`: what it started with; `null` for a cold start.
    pub learnt_before: Option<LearntValues>,
    /// The numbers, by their names in the estimator's table of limits.
    pub numbers: BTreeMap<&'static str, f32>,
}

/// A window's length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum WindowReport {
    /// A duration, s.
    DurationS(f32),
    /// A count of samples.
    Samples(u32),
}

/// When the gyroscope measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum GyroTimingReport {
    /// The mean over the time since the sample before.
    PeriodMean,
    /// So long before the accelerometer, s.
    DelayS(f32),
}

/// Correction of the readings of the sensor; x, y, z of its frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CorrectionReport {
    /// Bias subtracted from accelerations, m/s².
    pub accelerometer_bias_m_s2: [f32; 3],
    /// Factors of the accelerations after that.
    pub accelerometer_scale: [f32; 3],
    /// Bias subtracted from angular rates, rad/s.
    pub gyroscope_bias_rad_s: [f32; 3],
    /// How the sensor lies in the foot, as `--axes` has it: then they were turned by this.
    pub axes: String,
}

impl ParametersReport {
    /// Reports the parameters with which a recording was estimated.
    #[must_use]
    pub fn of(params: &Params) -> Self {
        Self {
            gravity: word_of(&GRAVITIES, params.gravity),
            method: word_of(&METHODS, params.method),
            learning: word_of(&LEARNINGS, params.learning),
            window: match params.window {
                WindowLength::Duration(seconds) => WindowReport::DurationS(seconds),
                WindowLength::Samples(samples) => WindowReport::Samples(samples),
            },
            gyro_timing: match params.attitude.gyro_timing {
                GyroTiming::PeriodMean => GyroTimingReport::PeriodMean,
                GyroTiming::Delay(seconds) => GyroTimingReport::DelayS(seconds),
            },
            learnt_before: params.learnt.map(LearntValues::from),
            numbers: Parameter::ALL
                .into_iter()
                .map(|number| (number.name(), number.get(params)))
                .collect(),
        }
    }
}

impl From<&Correction> for CorrectionReport {
    fn from(correction: &Correction) -> Self {
        let [bias, scale, gyroscope] = [
            correction.accelerometer.bias,
            correction.accelerometer.scale,
            correction.gyroscope_bias,
        ]
        .map(components);
        Self {
            accelerometer_bias_m_s2: bias,
            accelerometer_scale: scale,
            gyroscope_bias_rad_s: gyroscope,
            axes: axes_text(&correction.mounting),
        }
    }
}

/// Returns the differences from the preset for recordings of a format, as `name = value`, in one line; empty if
/// there are none. The recording's own rate and gravity are ignored.
#[must_use]
pub fn differences(params: &Params, preset: Preset, format: Format) -> String {
    let before = preset.params(format);
    let [now, then] = [params, &before].map(ParametersReport::of);
    let mut all = Vec::new();
    for (name, value) in &now.numbers {
        let was = then.numbers.get(name);
        if was != Some(value) && *name != Parameter::SampleRate.name() {
            let was = was.copied().unwrap_or_default();
            all.push(format!("{name} = {} ({})", shown(*value), shown(was)));
        }
    }
    for (name, now, then) in
        [("method", now.method, then.method), ("learning", now.learning, then.learning)]
    {
        if now != then {
            all.push(format!("{name} = {now} ({then})"));
        }
    }
    if now.window != then.window {
        all.push(format!("window = \"{}\"", crate::config::window_text(params.window)));
    }
    if now.gyro_timing != then.gyro_timing {
        let timing = crate::config::gyro_timing_text(params.attitude.gyro_timing);
        all.push(format!("attitude.gyro_timing = \"{timing}\""));
    }
    if now.learnt_before != then.learnt_before {
        all.push("learnt is set".to_owned());
    }
    all.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_is_reported_with_its_value() {
        let json = serde_json::to_value(ParametersReport::of(&Params::PAPER_GO1)).unwrap();
        for number in Parameter::ALL {
            let value = json["numbers"][number.name()].as_f64().expect("a number");
            assert_eq!(value as f32, number.get(&Params::PAPER_GO1));
        }
        assert_eq!(json["window"], json!({ "samples": 50 }));
        assert_eq!(json["gyro_timing"], "period_mean");
        assert_eq!(json["method"], "half_widths");
    }

    #[test]
    fn differences_from_the_preset_name_both_values() {
        let mut params = Preset::Default.params(Format::Csv);
        assert_eq!(differences(&params, Preset::Default, Format::Csv), "");
        params.sample_rate = 123.0;
        params.decision.threshold = 0.6;
        params.attitude.gyro_timing = GyroTiming::Delay(0.0015);
        assert_eq!(
            differences(&params, Preset::Default, Format::Csv),
            "decision.threshold = 0.6 (0.5), attitude.gyro_timing = \"1.5ms\""
        );
    }
}
