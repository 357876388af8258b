//! The constants of self-calibration: one set for all feet, sensors and rates.

mod evidence;
mod slide;

pub use evidence::EvidenceParams;
pub use slide::SlideParams;

use super::learnt::Classes;
use crate::logarithm::ln;
use crate::range::{ParamsError, in_range};

/// Whether the classes follow the foot.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Learning {
    /// The classes follow: the foot calibrates itself while it walks.
    #[default]
    On,
    /// The classes are fixed, so that the same motion gives the same probability, as for a certified
    /// behaviour. The residual of gravity, the limit of the slide and the strength of a usual swing are
    /// still followed.
    Frozen,
}

/// The constants of one quantity. Amplitudes are in its unit: m/s² (acceleration), rad/s (rate) or
/// m/s² (the leaky mean of the acceleration).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuantityParams {
    /// Floor of the logarithm: smaller amplitudes are treated alike. 1e-4 to 10.
    pub floor: f32,
    /// Amplitude of stillness before anything is learnt. 1e-4 to 100.
    pub still: f32,
    /// Amplitude of motion before anything is learnt. 1e-4 to 100.
    pub moving: f32,
    /// Mean deviation of stillness before anything is learnt, of the logarithm. 0.01 to 3.
    pub width: f32,
    /// Distance of the edge from the mean of stillness, widths. 0 to 20.
    pub edge: f32,
    /// Kernel bandwidth, of the logarithm. 0.01 to 3.
    pub bandwidth: f32,
    /// Share of the probability that this quantity cannot remove. 0 to 1.
    pub indifference: f32,
    /// Distance between stillness and motion, of the logarithm, at which the quantity has half of
    /// its influence. 0.01 to 10.
    pub separation: f32,
}

/// Constants of the estimation of the residual of gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GravityErrorParams {
    /// Share of mass from which the foot counts as quiet. 0.01 to 1.
    pub quiet: f32,
    /// Duration credited to a quiet stretch when it begins, s. 1e-3 to 10.
    pub start: f32,
    /// Memory of a long quiet stretch, s. 1e-3 to 100.
    pub memory: f32,
    /// Time constant of the decay without quiet, s. 0.01 to 1000.
    pub forgetting: f32,
    /// Largest error, m/s². 0 to 10.
    pub limit: f32,
}

/// All constants of self-calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StillnessParams {
    /// Acceleration without gravity.
    pub acceleration: QuantityParams,
    /// Angular rate.
    pub rate: QuantityParams,
    /// Leaky mean of the acceleration, small under shaking and large in a swing.
    pub velocity: QuantityParams,
    /// Time constant of the windows over masses, s. 1e-4 to 1.
    pub window: f32,
    /// Time constant of the leaky mean, s. 1e-4 to 1.
    pub leak: f32,
    /// Limit of an acceleration in the leaky mean, m/s². 0.1 to 1000.
    pub impact: f32,
    /// Largest part of the way from stillness to motion at which the edge lies. 0 to 1.
    pub part_of_the_way: f32,
    /// Least width of stillness. 0.01 to 3.
    pub least_width: f32,
    /// Largest width of stillness; not below the least. 0.01 to 3.
    pub largest_width: f32,
    /// Weight of these constants against the learnt state, s of each class. 1e-3 to 100.
    pub prior: f32,
    /// Memory of each class, s of itself. 0.1 to 1000.
    pub memory: f32,
    /// Duration of each stance that is learnt from, s. 0.01 to 100.
    pub stance: f32,
    /// Duration of each motion that is learnt from, s. 0.01 to 100.
    pub motion: f32,
    /// Time constant with which the still class of a foot without stillness returns to these constants,
    /// s. 0.1 to 1000.
    pub relaxation: f32,
    /// The slide test.
    pub slide: SlideParams,
    /// Evidence that a foot must show.
    pub evidence: EvidenceParams,
    /// Residual of gravity's removal.
    pub gravity_error: GravityErrorParams,
}

impl Default for StillnessParams {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Validated [`StillnessParams`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constants {
    params: StillnessParams,
    /// The classes before anything is learnt, of acceleration, rate and velocity.
    priors: [Classes; 3],
}

impl Constants {
    /// [`StillnessParams::DEFAULT`], checked by the compiler.
    pub const DEFAULT: Self = match StillnessParams::DEFAULT.check() {
        Ok(constants) => constants,
        Err(_) => panic!("a constant is out of its range"),
    };

    /// The constants.
    #[must_use]
    pub const fn params(&self) -> &StillnessParams {
        &self.params
    }

    pub(super) const fn priors(&self) -> [Classes; 3] {
        self.priors
    }
}

impl Default for Constants {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Range of an amplitude, in the constants and in the learnt state.
const AMPLITUDE: (f32, f32) = (1.0e-4, 100.0);

/// Returns early on an error, as `?` does, which is not available in `const fn`.
macro_rules! checked {
    ($check:expr) => {
        match $check {
            Ok(_) => {}
            Err(error) => return Err(error),
        }
    };
}

/// Checks fields, given as name, value, least and largest.
const fn all_in_range(mut fields: &[(&'static str, f32, f32, f32)]) -> Result<(), ParamsError> {
    while let Some(((name, value, least, largest), rest)) = fields.split_first() {
        checked!(in_range(name, *value, *least, *largest));
        fields = rest;
    }
    Ok(())
}

impl QuantityParams {
    /// The classes before anything is learnt.
    const fn prior(&self) -> Classes {
        Classes {
            still: ln(self.still),
            moving: ln(self.moving),
            width: self.width,
        }
    }

    /// `names` are the fields' paths, in their order.
    const fn validate(&self, names: &[&'static str; 8]) -> Result<(), ParamsError> {
        let (least, largest) = AMPLITUDE;
        let [
            floor,
            still,
            moving,
            width,
            edge,
            bandwidth,
            indifference,
            separation,
        ] = *names;
        checked!(in_range(floor, self.floor, least, 10.0));
        checked!(in_range(still, self.still, least, largest));
        checked!(in_range(moving, self.moving, self.still, largest));
        checked!(in_range(width, self.width, 0.01, 3.0));
        checked!(in_range(edge, self.edge, 0.0, 20.0));
        checked!(in_range(bandwidth, self.bandwidth, 0.01, 3.0));
        checked!(in_range(indifference, self.indifference, 0.0, 1.0));
        in_range(separation, self.separation, 0.01, 10.0)
    }
}

/// The paths of a quantity's fields.
macro_rules! names {
    ($quantity:literal) => {
        &[
            concat!("stillness.", $quantity, ".floor"),
            concat!("stillness.", $quantity, ".still"),
            concat!("stillness.", $quantity, ".moving"),
            concat!("stillness.", $quantity, ".width"),
            concat!("stillness.", $quantity, ".edge"),
            concat!("stillness.", $quantity, ".bandwidth"),
            concat!("stillness.", $quantity, ".indifference"),
            concat!("stillness.", $quantity, ".separation"),
        ]
    };
}

impl StillnessParams {
    /// Chosen on the labelled recordings together, from a cold start, without labels in the estimate itself: see
    /// `docs/choosing.md`.
    pub const DEFAULT: Self = Self {
        acceleration: QuantityParams {
            floor: 0.262,
            still: 0.554,
            moving: 4.78,
            width: 1.25,
            edge: 3.95,
            bandwidth: 0.305,
            indifference: 0.00571,
            separation: 0.0571,
        },
        rate: QuantityParams {
            floor: 0.0866,
            still: 0.281,
            moving: 4.94,
            width: 0.227,
            edge: 7.72,
            bandwidth: 1.0,
            indifference: 0.605,
            separation: 2.62,
        },
        velocity: QuantityParams {
            floor: 0.00328,
            still: 0.477,
            moving: 3.28,
            width: 0.537,
            edge: 5.57,
            bandwidth: 0.305,
            indifference: 0.383,
            separation: 2.23,
        },
        window: 0.0172,
        leak: 0.00304,
        impact: 1.67,
        part_of_the_way: 0.635,
        least_width: 0.173,
        largest_width: 1.38,
        prior: 0.0668,
        memory: 5.16,
        stance: 0.251,
        motion: 0.851,
        relaxation: 2.0,
        slide: SlideParams {
            speed: 0.0018,
            spread: 24.8,
            shaking: 0.000191,
            lever: 0.136,
            rate: 0.0802,
            largest_rate: 0.466,
            turn_time_constant: 0.0373,
            impact: 0.566,
            time_constant: 0.0373,
            moving_time_constant: 0.024,
            shake_time_constant: 0.0287,
            limit: 3.82,
            usual: 0.00568,
            quantile: 0.443,
            gain: 9.74,
            prior: 0.0785,
            memory: 1.48,
            learn_from: 0.0821,
            learn_until: 0.266,
        },
        evidence: EvidenceParams {
            rest: 0.169,
            lasts: 1.38,
            fading: 0.05,
            rest_margin: 0.4,
            swing: 0.368,
            first_swing: 3.0,
            calm: 1.5,
            calm_time_constant: 0.04,
            stride: 2.0,
            learns: 1.0,
        },
        gravity_error: GravityErrorParams {
            quiet: 0.76,
            start: 0.303,
            memory: 3.41,
            forgetting: 72.2,
            limit: 0.287,
        },
    };

    /// Checks every field. The compiler can do so if it knows the constants.
    ///
    /// # Errors
    /// The first field that is out of its range, with its value and the range.
    pub const fn check(self) -> Result<Constants, ParamsError> {
        checked!(self.acceleration.validate(names!("acceleration")));
        checked!(self.rate.validate(names!("rate")));
        checked!(self.velocity.validate(names!("velocity")));
        checked!(in_range("stillness.window", self.window, 1.0e-4, 1.0));
        checked!(in_range("stillness.leak", self.leak, 1.0e-4, 1.0));
        checked!(in_range("stillness.impact", self.impact, 0.1, 1.0e3));
        checked!(in_range(
            "stillness.part_of_the_way",
            self.part_of_the_way,
            0.0,
            1.0
        ));
        checked!(in_range(
            "stillness.least_width",
            self.least_width,
            0.01,
            3.0
        ));
        let widest = self.largest_width;
        checked!(in_range(
            "stillness.largest_width",
            widest,
            self.least_width,
            3.0
        ));
        checked!(in_range("stillness.prior", self.prior, 1.0e-3, 100.0));
        checked!(in_range("stillness.memory", self.memory, 0.1, 1.0e3));
        checked!(in_range("stillness.stance", self.stance, 0.01, 100.0));
        checked!(in_range("stillness.motion", self.motion, 0.01, 100.0));
        checked!(in_range(
            "stillness.relaxation",
            self.relaxation,
            0.1,
            1.0e3
        ));
        checked!(self.slide.check());
        checked!(self.evidence.check());
        let error = &self.gravity_error;
        checked!(in_range(
            "stillness.gravity_error.quiet",
            error.quiet,
            0.01,
            1.0
        ));
        checked!(in_range(
            "stillness.gravity_error.start",
            error.start,
            1.0e-3,
            10.0
        ));
        let memory = error.memory;
        checked!(in_range(
            "stillness.gravity_error.memory",
            memory,
            1.0e-3,
            100.0
        ));
        let forgetting = error.forgetting;
        checked!(in_range(
            "stillness.gravity_error.forgetting",
            forgetting,
            0.01,
            1.0e3,
        ));
        checked!(in_range(
            "stillness.gravity_error.limit",
            error.limit,
            0.0,
            10.0
        ));
        Ok(Constants {
            params: self,
            priors: [
                self.acceleration.prior(),
                self.rate.prior(),
                self.velocity.prior(),
            ],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(change: impl FnOnce(&mut StillnessParams)) -> &'static str {
        let mut params = StillnessParams::DEFAULT;
        change(&mut params);
        match params.check() {
            Err(ParamsError::OutOfRange { field, .. }) => field,
            Err(ParamsError::WindowLength { .. }) | Ok(_) => "nothing",
        }
    }

    #[test]
    fn out_of_range_constant_is_rejected_with_its_field_name() {
        type Set = fn(&mut StillnessParams, f32);
        // Each field with a value just below its range and one just above it.
        let fields: [(&str, Set, f32, f32); 7] = [
            (
                "stillness.acceleration.floor",
                |p, v| p.acceleration.floor = v,
                0.9e-4,
                10.1,
            ),
            (
                "stillness.rate.indifference",
                |p, v| p.rate.indifference = v,
                -0.1,
                1.1,
            ),
            (
                "stillness.velocity.moving",
                |p, v| p.velocity.moving = v,
                0.9 * StillnessParams::DEFAULT.velocity.still,
                101.0,
            ),
            ("stillness.window", |p, v| p.window = v, 0.9e-4, 1.1),
            (
                "stillness.largest_width",
                |p, v| p.largest_width = v,
                0.9 * StillnessParams::DEFAULT.least_width,
                3.1,
            ),
            (
                "stillness.slide.speed",
                |p, v| p.slide.speed = v,
                0.9e-4,
                1.1,
            ),
            (
                "stillness.gravity_error.limit",
                |p, v| p.gravity_error.limit = v,
                -0.1,
                10.1,
            ),
        ];
        for (field, set, low, high) in fields {
            for value in [low, high, f32::NAN] {
                assert_eq!(refused(|params| set(params, value)), field, "{value}");
            }
        }
    }
}
