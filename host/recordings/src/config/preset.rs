//! Presets of the parameters.

use estimator_core::params::WindowLength;
use estimator_core::{Params, PerAxis};
use lsm6dsox::{Config, Noise};

use crate::hint::{Hint, Notice};
use crate::input::Format;

/// Relative difference below which durations count as equal, because the rate is measured.
const SAME_DURATION: f64 = 0.05;

/// Returns the default parameters of the estimator for the foot's sensor: its own defaults, with the bandwidths
/// that follow from the noise of the sensor's setting.
#[must_use]
pub fn default_params() -> Params {
    with_bandwidth_of(&Config::FRESH_KILOHERTZ.noise(), Params::DEFAULT)
}

/// Sets the bandwidths to a sensor's noise. Unknown noise leaves them unchanged.
fn with_bandwidth_of(noise: &Noise, params: Params) -> Params {
    Params {
        bandwidth: PerAxis::by_sensor(
            noise.specific_force.unwrap_or(params.bandwidth.ax),
            noise.angular_rate.unwrap_or(params.bandwidth.wx),
        ),
        ..params
    }
}

crate::named! {
    /// Preset from which the parameters start.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum Preset {
        /// Settings for an LSM6DSOX on a robot's foot.
        #[default]
        Default = "default",
        /// Settings of the paper.
        Paper = "paper",
    } or |name| {
        let names = Self::ALL.map(|preset| format!("{:?}", preset.name()));
        format!("preset is {name:?}, but {} is expected", names.join(" or "))
    }
}

impl Preset {
    /// Returns the purpose, in one line.
    #[must_use]
    pub const fn help(self) -> &'static str {
        match self {
            Self::Default => "Self-calibrating, for any foot and sensor",
            Self::Paper => {
                "The paper's settings: those for the GO1 with the format pce-go1, else those for ATLAS"
            }
        }
    }

    /// Returns the parameters for recordings of a format; the load trigger is in the unit of its load. Sample rate
    /// and gravity are placeholders: they depend on the recording.
    #[must_use]
    pub fn params(self, format: Format) -> Params {
        let default_with_load_of = |other: Params| Params { load: other.load, ..default_params() };
        match (self, format) {
            (Self::Default, Format::PceAtlas) => default_with_load_of(Params::PAPER),
            (Self::Default, Format::PceGo1) => default_with_load_of(Params::PAPER_GO1),
            // A NAO weighs a third of the load from which the paper's ATLAS is loaded.
            (Self::Paper, Format::Lcd) => Params { load: default_params().load, ..Params::PAPER },
            (Self::Paper, Format::PceGo1) => Params::PAPER_GO1,
            (Self::Default, _) => default_params(),
            (Self::Paper, _) => Params::PAPER,
        }
    }

    /// Returns a notice if the paper's window, a count of samples, has another duration than at the paper's rate.
    /// Returns `None` otherwise, or if `params` have another window. Rows of the authors' GO1 are counted as by the
    /// authors.
    #[must_use]
    pub fn window_notice(
        self,
        format: Format,
        params: &Params,
        recording: &str,
        sample_rate: f32,
    ) -> Option<Notice> {
        let preset = self.params(format);
        let WindowLength::Samples(samples) = preset.window else {
            return None;
        };
        if params.window != preset.window || format == Format::PceGo1 {
            return None;
        }
        let [there, here] = [preset.sample_rate, sample_rate]
            .map(|rate| 1.0e3 * f64::from(samples) / f64::from(rate));
        ((here / there - 1.0).abs() > SAME_DURATION).then(|| {
            let text = format!(
                "{recording}: the window of the paper's preset, {samples} samples, lasts {here:.0} ms at {sample_rate} Hz \
                 and {there:.0} ms at the paper's rate"
            );
            Notice::with_hint(text, Hint::Window(there))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bandwidths_follow_the_noise_if_it_is_known() {
        let noise = Noise { specific_force: Some(0.5), angular_rate: None };
        let params = with_bandwidth_of(&noise, Params::DEFAULT);
        assert_eq!((params.bandwidth.ax, params.bandwidth.az), (0.5, 0.5));
        assert_eq!(params.bandwidth.wz, Params::DEFAULT.bandwidth.wz);
        assert_eq!(params.half_width, Params::DEFAULT.half_width);
    }
}
