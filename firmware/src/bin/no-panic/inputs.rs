//! Inputs with values unknown to the compiler.

use core::cell::UnsafeCell;

use estimator_core::stillness::{EvidenceParams, GravityErrorParams, QuantityParams, SlideParams};
use estimator_core::{
    AngularRate, AttitudeParams, ContactEstimate, DecisionParams, Gravity, ImuSample, Learning,
    Learnt, LinearAcceleration, LoadParams, Method, MountingParams, Params, PerAxis, Phase,
    Probabilities, Quaternion, RestParams, Saturation, SensorAxis, SpecificForce, StillnessParams,
    Timestamp, Validity, Vec3, VelocityParams, VelocitySigma, WindowLength,
};
use wire::{CanFrame, Faults};

/// Memory with contents unknown to the compiler.
struct Unknown(UnsafeCell<[u32; 64]>);

// SAFETY: there is only one thread.
unsafe impl Sync for Unknown {}

static UNKNOWN: Unknown = Unknown(UnsafeCell::new([0; 64]));

/// Returns any value of a type for which all bit patterns are valid.
pub fn any<T: Bits>() -> T {
    const { assert!(size_of::<T>() <= size_of::<[u32; 64]>()) };
    // SAFETY: the memory is large enough and aligned, and all its bits make a `T`.
    unsafe { UNKNOWN.0.get().cast::<T>().read_volatile() }
}

/// Types for which all bit patterns are valid.
///
/// # Safety
/// All bit patterns must be valid.
pub unsafe trait Bits: Copy {}

// SAFETY: all bit patterns are numbers.
unsafe impl Bits for u8 {}
// SAFETY: as above.
unsafe impl Bits for i8 {}
// SAFETY: as above.
unsafe impl Bits for u16 {}
// SAFETY: as above.
unsafe impl Bits for i16 {}
// SAFETY: as above.
unsafe impl Bits for u32 {}
// SAFETY: as above.
unsafe impl Bits for u64 {}
// SAFETY: as above.
unsafe impl Bits for f32 {}
// SAFETY: as above.
unsafe impl<T: Bits, const N: usize> Bits for [T; N] {}

pub fn any_bool() -> bool {
    any::<u8>() & 1 == 1
}

pub fn any_vec3() -> Vec3 {
    Vec3::new(any(), any(), any())
}

fn any_per_axis() -> PerAxis<f32> {
    PerAxis::from_array(any())
}

fn any_window() -> WindowLength {
    if any_bool() {
        WindowLength::Duration(any())
    } else {
        WindowLength::Samples(any())
    }
}

fn any_quantity() -> QuantityParams {
    QuantityParams {
        floor: any(),
        still: any(),
        moving: any(),
        width: any(),
        edge: any(),
        bandwidth: any(),
        indifference: any(),
        separation: any(),
    }
}

fn any_stillness() -> StillnessParams {
    StillnessParams {
        acceleration: any_quantity(),
        rate: any_quantity(),
        velocity: any_quantity(),
        window: any(),
        leak: any(),
        impact: any(),
        part_of_the_way: any(),
        least_width: any(),
        largest_width: any(),
        prior: any(),
        memory: any(),
        stance: any(),
        motion: any(),
        relaxation: any(),
        slide: SlideParams {
            speed: any(),
            spread: any(),
            shaking: any(),
            lever: any(),
            rate: any(),
            largest_rate: any(),
            turn_time_constant: any(),
            impact: any(),
            time_constant: any(),
            moving_time_constant: any(),
            shake_time_constant: any(),
            limit: any(),
            usual: any(),
            quantile: any(),
            gain: any(),
            prior: any(),
            memory: any(),
            learn_from: any(),
            learn_until: any(),
        },
        evidence: EvidenceParams {
            rest: any(),
            lasts: any(),
            fading: any(),
            rest_margin: any(),
            swing: any(),
            first_swing: any(),
            calm: any(),
            calm_time_constant: any(),
            stride: any(),
            learns: any(),
        },
        gravity_error: GravityErrorParams {
            quiet: any(),
            start: any(),
            memory: any(),
            forgetting: any(),
            limit: any(),
        },
    }
}

pub fn any_learnt() -> Learnt {
    Learnt::from_array(any())
}

pub fn any_params() -> Params {
    Params {
        sample_rate: any(),
        method: if any_bool() {
            Method::SelfCalibrating
        } else {
            Method::HalfWidths
        },
        learning: if any_bool() {
            Learning::On
        } else {
            Learning::Frozen
        },
        learnt: any_bool().then(any_learnt),
        stillness: any_stillness().check().unwrap_or_default(),
        window: any_window(),
        bandwidth: any_per_axis(),
        half_width: any_per_axis(),
        gravity: if any_bool() {
            Gravity::Included
        } else {
            Gravity::Removed
        },
        attitude: AttitudeParams {
            motion_time_constant: any(),
            quiet_gain: any(),
            quiet_acceleration: any(),
            quiet_rate: any(),
            rest: RestParams {
                duration: any(),
                acceleration: any(),
                rate: any(),
                bias_limit: any(),
                bias_time_constant: any(),
            },
            ..AttitudeParams::DEFAULT
        },
        decision: DecisionParams {
            threshold: any(),
            on_delay: any(),
            off_delay: any(),
        },
        load: LoadParams {
            on_threshold: any(),
            off_threshold: any(),
        },
        velocity: VelocityParams {
            speed: any(),
            lever: any(),
            floor: any(),
        },
    }
}

pub fn any_mounting() -> MountingParams {
    let axis = || {
        let mut axes = SensorAxis::ALL.into_iter();
        axes.nth(usize::from(any::<u8>())).unwrap_or_default()
    };
    if any_bool() {
        MountingParams::Axes([axis(), axis(), axis()])
    } else {
        let [w, x, y, z] = any();
        MountingParams::Rotation(Quaternion { w, x, y, z })
    }
}

pub fn any_sample() -> ImuSample {
    ImuSample {
        timestamp: Timestamp::from_micros(any()),
        specific_force: SpecificForce(any_vec3()),
        angular_rate: AngularRate(any_vec3()),
        validity: match any::<u8>() {
            0 => Validity::Valid,
            1 => Validity::Saturated(Saturation::Both),
            2 => Validity::Stale,
            _ => Validity::Invalid,
        },
    }
}

pub fn any_estimate() -> ContactEstimate {
    ContactEstimate {
        timestamp: Timestamp::from_micros(any()),
        probabilities: Probabilities {
            axes: any_per_axis(),
            tangential: any(),
            vertical: any(),
            stable: any(),
        },
        phase: Phase::ALL
            .get(usize::from(any::<u8>()))
            .copied()
            .unwrap_or_default(),
        orientation: Quaternion {
            w: any(),
            x: any(),
            y: any(),
            z: any(),
        },
        linear_acceleration: LinearAcceleration(any_vec3()),
        angular_rate: AngularRate(any_vec3()),
        gyro_bias: AngularRate(any_vec3()),
        velocity_sigma: VelocitySigma(any()),
        ..ContactEstimate::default()
    }
}

pub fn any_faults() -> Faults {
    Faults::from_bits(any())
}

pub fn any_can_frame() -> Option<CanFrame> {
    let data: [u8; 8] = any();
    CanFrame::new(any(), data.get(..usize::from(any::<u8>()))?)
}
