//! Structs of the header, in its order of fields, and their conversion. Every bit pattern is a value of each.

use estimator_core::params::{DecisionParams, LoadParams};
use estimator_core::velocity::VelocityParams;
use estimator_core::{
    AngularRate, ContactEstimate, Gravity, ImuSample, Learning, Learnt, Params, Phase, Saturation,
    SpecificForce, Stream, Timestamp, Validity, Vec3,
};

use crate::error::Error;

/// `footfall_learnt`: state learnt from a foot, as [`Learnt::to_bytes`] stores it, with the same bytes on every machine.
/// The value of `Default` is rejected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct CLearnt {
    /// [`Learnt::to_bytes`].
    pub bytes: [u8; Learnt::BYTES],
}

impl Default for CLearnt {
    fn default() -> Self {
        Self { bytes: [0; Learnt::BYTES] }
    }
}

impl From<&Learnt> for CLearnt {
    fn from(from: &Learnt) -> Self {
        Self { bytes: from.to_bytes() }
    }
}

impl CLearnt {
    /// Returns the learnt state.
    ///
    /// # Errors
    /// The state is of another version, or damaged.
    pub fn checked(&self) -> Result<Learnt, Error> {
        Learnt::from_bytes(&self.bytes).map_err(|_| Error::Learnt)
    }
}

/// `footfall_params`: parameters of an estimator.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct CParams {
    /// Rate of the samples, Hz.
    pub sample_rate_hz: f32,
    /// [`DecisionParams::threshold`].
    pub decision_threshold: f32,
    /// [`DecisionParams::on_delay`], s.
    pub decision_on_delay_s: f32,
    /// [`DecisionParams::off_delay`], s.
    pub decision_off_delay_s: f32,
    /// [`LoadParams::on_threshold`], N.
    pub load_on: f32,
    /// [`LoadParams::off_threshold`], N.
    pub load_off: f32,
    /// [`VelocityParams::speed`], m/s.
    pub velocity_speed_m_s: f32,
    /// [`VelocityParams::lever`], m.
    pub velocity_lever_m: f32,
    /// [`VelocityParams::floor`], m/s.
    pub velocity_floor_m_s: f32,
    /// State learnt before.
    pub learnt: CLearnt,
    /// 1 if `learnt` holds one, else 0.
    pub has_learnt: u8,
    /// 0: included; 1: removed.
    pub gravity: u8,
    /// 0: on; 1: frozen.
    pub learning: u8,
}

impl Default for CParams {
    fn default() -> Self {
        let Params { decision, load, velocity, .. } = Params::DEFAULT;
        Self {
            sample_rate_hz: Stream::KILOHERTZ.sample_rate(),
            decision_threshold: decision.threshold,
            decision_on_delay_s: decision.on_delay,
            decision_off_delay_s: decision.off_delay,
            load_on: load.on_threshold,
            load_off: load.off_threshold,
            velocity_speed_m_s: velocity.speed,
            velocity_lever_m: velocity.lever,
            velocity_floor_m_s: velocity.floor,
            learnt: CLearnt::default(),
            has_learnt: 0,
            gravity: 0,
            learning: 0,
        }
    }
}

/// Returns the value with this number; an error if no value has it.
fn choice<T: Copy, const N: usize>(number: u8, values: [T; N]) -> Result<T, Error> {
    values.get(usize::from(number)).copied().ok_or(Error::Choice)
}

impl CParams {
    /// Returns the checked parameters, and the facts about the samples. The groups are set and checked one after the
    /// other, so that the first invalid one is known.
    ///
    /// # Errors
    /// The group with a number out of its range, or a field with an invalid constant.
    pub fn checked(&self) -> Result<(Params, Stream), Error> {
        let gravity = choice(self.gravity, [Gravity::Included, Gravity::Removed])?;
        let mut params = Params {
            learning: choice(self.learning, [Learning::On, Learning::Frozen])?,
            ..Params::DEFAULT
        };
        let has_learnt = choice(self.has_learnt, [false, true])?;
        let stream = Stream::new(self.sample_rate_hz, gravity).map_err(|_| Error::SampleRate)?;
        let check = |params: &Params, error| params.check().map_err(|_| error);
        params.decision = DecisionParams {
            threshold: self.decision_threshold,
            on_delay: self.decision_on_delay_s,
            off_delay: self.decision_off_delay_s,
        };
        check(&params, Error::Decision)?;
        params.load = LoadParams { on_threshold: self.load_on, off_threshold: self.load_off };
        check(&params, Error::Load)?;
        params.velocity = VelocityParams {
            speed: self.velocity_speed_m_s,
            lever: self.velocity_lever_m,
            floor: self.velocity_floor_m_s,
        };
        check(&params, Error::Velocity)?;
        if has_learnt {
            params.learnt = Some(self.learnt.checked()?);
            check(&params, Error::Learnt)?;
        }
        Ok((params, stream))
    }
}

/// `footfall_sample`: reading of an IMU.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct CSample {
    /// Time at which it was acquired, µs.
    pub timestamp_us: u64,
    /// Accelerometer, m/s².
    pub specific_force_m_s2: [f32; 3],
    /// Gyroscope, rad/s.
    pub angular_rate_rad_s: [f32; 3],
    /// Number of a `FOOTFALL_SAMPLE_…`.
    pub validity: u8,
}

/// Validities in the order of their constants.
pub const VALIDITIES: [Validity; 6] = [
    Validity::Valid,
    Validity::Saturated(Saturation::Accelerometer),
    Validity::Saturated(Saturation::Gyroscope),
    Validity::Saturated(Saturation::Both),
    Validity::Stale,
    Validity::Invalid,
];

impl CSample {
    /// Returns the sample.
    ///
    /// # Errors
    /// Its validity is not one of the constants.
    pub fn checked(&self) -> Result<ImuSample, Error> {
        let vector = |[x, y, z]: [f32; 3]| Vec3::new(x, y, z);
        Ok(ImuSample {
            timestamp: Timestamp::from_micros(self.timestamp_us),
            specific_force: SpecificForce(vector(self.specific_force_m_s2)),
            angular_rate: AngularRate(vector(self.angular_rate_rad_s)),
            validity: choice(self.validity, VALIDITIES)?,
        })
    }
}

/// `footfall_estimate`: estimate after a sample; see [`ContactEstimate`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct CEstimate {
    /// Timestamp of the sample, µs.
    pub timestamp_us: u64,
    /// Probability of stable contact.
    pub stable: f32,
    /// Probability of no motion along the ground.
    pub tangential: f32,
    /// Probability of no lifting.
    pub vertical: f32,
    /// Probability of each axis: ax, ay, az, wx, wy, wz.
    pub axes: [f32; 6],
    /// Orientation, foot to world: w, x, y, z.
    pub orientation: [f32; 4],
    /// Acceleration without gravity, m/s².
    pub linear_acceleration_m_s2: [f32; 3],
    /// Angular rate without bias, rad/s.
    pub angular_rate_rad_s: [f32; 3],
    /// Bias of the gyroscope, rad/s.
    pub gyro_bias_rad_s: [f32; 3],
    /// Standard deviation of the foot's velocity, m/s.
    pub velocity_sigma_m_s: f32,
    /// Bits of [`Flag::ALL`](estimator_core::Flag::ALL), [`Self::UNIT`] and [`Self::GRAVITY`].
    pub flags: u32,
    /// 1: stable; 0: not, or not known.
    pub decision: u8,
    /// Index in [`Phase::ALL`].
    pub phase: u8,
    /// 0; for fields of later versions.
    pub reserved: [u8; 6],
}

impl CEstimate {
    /// Flag: no foot can have the forces, see
    /// [`implausible_force`](estimator_core::ContactEstimator::implausible_force).
    pub const UNIT: u32 = 1 << 8;

    /// Flag: gravity is not removed, see [`GravityCheck`](estimator_core::gravity::GravityCheck).
    pub const GRAVITY: u32 = 1 << 9;

    /// [`ContactEstimate::DOUBTFUL`], for a sample that was not processed.
    #[must_use]
    pub fn doubtful() -> Self {
        (&ContactEstimate::DOUBTFUL).into()
    }
}

impl From<&ContactEstimate> for CEstimate {
    fn from(from: &ContactEstimate) -> Self {
        let vector = |v: Vec3| [v.x, v.y, v.z];
        let axes = from.probabilities.axes;
        let turn = from.orientation;
        Self {
            timestamp_us: from.timestamp.as_micros(),
            stable: from.probabilities.stable,
            tangential: from.probabilities.tangential,
            vertical: from.probabilities.vertical,
            axes: [axes.ax, axes.ay, axes.az, axes.wx, axes.wy, axes.wz],
            orientation: [turn.w, turn.x, turn.y, turn.z],
            linear_acceleration_m_s2: vector(from.linear_acceleration.0),
            angular_rate_rad_s: vector(from.angular_rate.0),
            gyro_bias_rad_s: vector(from.gyro_bias.0),
            velocity_sigma_m_s: from.velocity_sigma.0,
            flags: from.flags.bits().into(),
            decision: from.decision as u8,
            phase: match from.phase {
                Phase::Unknown => 0,
                Phase::Stance => 1,
                Phase::Slip => 2,
                Phase::Swing => 3,
                Phase::QuietSwing => 4,
                Phase::Landing => 5,
            },
            reserved: [0; 6],
        }
    }
}
