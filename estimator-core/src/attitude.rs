//! interim

use crate::params::{ParamsError, in_range};
use crate::sample::{AngularRate, SpecificForce, Validity};
use crate::vector::{Quaternion, Vec3};

/// interim
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AttitudeParams {
    /// interim
    pub time_constant: f32,
}
impl AttitudeParams {
    /// interim
    pub const DEFAULT: Self = Self { time_constant: 1.0 };
    pub(crate) fn validate(&self, _sample_rate: f32) -> Result<AttitudeCoefficients, ParamsError> {
        in_range("attitude.time_constant", self.time_constant, 0.01, 100.0)?;
        Ok(AttitudeCoefficients {
            tau: self.time_constant,
        })
    }
}
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttitudeCoefficients {
    tau: f32,
}

/// Whether up is known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Alignment {
    /// Not yet.
    #[default]
    Searching,
    /// Yes.
    Aligned,
}

/// interim
#[derive(Clone, Debug)]
pub struct AttitudeFilter {
    coefficients: AttitudeCoefficients,
    orientation: Quaternion,
    sum: Vec3,
    count: u32,
}

impl AttitudeFilter {
    pub(crate) fn new(coefficients: AttitudeCoefficients) -> Self {
        Self {
            coefficients,
            orientation: Quaternion::IDENTITY,
            sum: Vec3::ZERO,
            count: 0,
        }
    }
    /// interim
    pub fn update(&mut self, force: SpecificForce, rate: AngularRate, validity: Validity, dt: f32) {
        if self.count < 50 {
            self.sum += force.0;
            self.count += 1;
            if let Some(q) = Quaternion::from_up(self.sum) {
                self.orientation = q;
            }
            return;
        }
        let mut turn = rate.0 * dt;
        if validity == Validity::Valid {
            let up = self.orientation.up();
            turn += force.0.cross(up) * (dt / self.coefficients.tau / 9.81);
        }
        self.orientation = self
            .orientation
            .multiply(Quaternion::from_small_rotation(turn))
            .renormalised();
    }
    /// interim
    pub fn alignment(&self) -> Alignment {
        if self.count < 50 {
            Alignment::Searching
        } else {
            Alignment::Aligned
        }
    }
    /// interim
    pub fn orientation(&self) -> Quaternion {
        self.orientation
    }
    /// interim
    pub fn gyro_bias(&self) -> AngularRate {
        AngularRate(Vec3::ZERO)
    }
}
