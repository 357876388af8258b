//! Properties of the estimator for arbitrary input.

use estimator_core::any::{AnyEstimator, AnyParams, Method};
use estimator_core::half_widths::{HalfWidthParams, WindowLength};
use estimator_core::internals::{AMPLITUDE, SPEED};
use estimator_core::parameter::Parameter;
use estimator_core::parameter::Row;
use estimator_core::params::{Constants, GyroTiming, LoadParams};
use estimator_core::velocity::VelocityParams;
use estimator_core::{
    AngularRate, ContactEstimate, Decision, Flag, Gravity, ImuSample, Learning, Learnt,
    LinearAcceleration, Load, Params, PerAxis, Probabilities, Saturation, SpecificForce, Stream,
    Timestamp, Validity, Vec3, VelocitySigma,
};
use gait::{GaitName, Ground, Plan, SensorParams, record};
use proptest::prelude::*;
use samples::Recording;
use samples::estimate::estimates_of;
use std::sync::OnceLock;

const CAPACITY: usize = 128;

/// Any bit pattern, with special values often, and ordinary motion most of the time.
fn any_component() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => -20.0_f32..20.0,
        1 => any::<u32>().prop_map(f32::from_bits),
        1 => prop::sample::select(vec![
            f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, f32::MIN_POSITIVE, -0.0, 1.0e4,
        ]),
    ]
}

fn any_vector() -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(any_component()).prop_map(|[x, y, z]| Vec3::new(x, y, z))
}

fn any_validity() -> impl Strategy<Value = Validity> {
    prop_oneof![
        8 => Just(Validity::Valid),
        1 => prop::sample::select(vec![
            Validity::Saturated(Saturation::Accelerometer),
            Validity::Saturated(Saturation::Gyroscope),
            Validity::Saturated(Saturation::Both),
        ]),
        1 => Just(Validity::Stale),
        1 => Just(Validity::Invalid),
    ]
}

/// A sample with the time since the previous one, µs: mostly 1 ms.
fn any_sample() -> impl Strategy<Value = (ImuSample, u64)> {
    let elapsed = prop_oneof![8 => Just(1_000_u64), 1 => 0_u64..5_000, 1 => any::<u32>().prop_map(u64::from), 1 => any::<u64>()];
    (any_vector(), any_vector(), any_validity(), elapsed).prop_map(
        |(force, rate, validity, elapsed)| {
            let sample = ImuSample {
                specific_force: SpecificForce(force),
                angular_rate: AngularRate(rate),
                validity,
                ..ImuSample::default()
            };
            (sample, elapsed)
        },
    )
}

fn scale(low: f32, high: f32) -> impl Strategy<Value = f32> {
    (low.ln()..high.ln()).prop_map(f32::exp)
}

prop_compose! {
    fn any_learnt()(
        still in AMPLITUDE.0..=AMPLITUDE.1,
        above in 0.0_f32..=1.0,
        speed in SPEED.0..=SPEED.1,
        still_seconds in 0.0_f32..=1.0e3,
        moving_seconds in 0.0_f32..=1.0e3,
    ) -> Learnt {
        Learnt { still, moving: still + above * (AMPLITUDE.1 - still), speed, still_seconds, moving_seconds }
    }
}

/// A number of a range, of any magnitude where all are above 0.
fn any_number_of(least: f32, most: f32) -> BoxedStrategy<f32> {
    if least > 0.0 { scale(1.01 * least, 0.99 * most).boxed() } else { (least..=most).boxed() }
}

fn any_number(parameter: Parameter) -> BoxedStrategy<(Parameter, f32)> {
    let Row { least, most, .. } = parameter.row();
    any_number_of(least, most).prop_map(move |number| (parameter, number)).boxed()
}

/// The default constants, or any others that are accepted.
fn any_constants() -> impl Strategy<Value = Constants> {
    let each: Vec<_> = Constants::ranges()
        .map(|(name, least, most)| any_number_of(least, most).prop_map(move |value| (name, value)))
        .collect();
    let others = each.prop_map(|all| {
        let constants = all
            .into_iter()
            .try_fold(Constants::DEFAULT, |constants, (name, value)| constants.with(name, value));
        constants.expect("in range")
    });
    prop_oneof![2 => Just(Constants::DEFAULT), 1 => others]
}

fn any_stream() -> impl Strategy<Value = Stream> {
    let gravity = prop_oneof![Just(Gravity::Included), Just(Gravity::Removed)];
    (scale(20.2, 9_900.0), gravity)
        .prop_map(|(rate, gravity)| Stream::new(rate, gravity).expect("in range"))
}

prop_compose! {
    /// Parameters from their whole allowed ranges.
    fn any_params()(
        numbers in Parameter::ALL.map(any_number).to_vec(),
        constants in any_constants(),
        window in (1_u32..=CAPACITY as u32).prop_map(WindowLength::Samples),
        method in prop_oneof![3 => Just(Method::SelfCalibrating), 1 => Just(Method::HalfWidths)],
        learning in prop_oneof![Just(Learning::On), Just(Learning::Frozen)],
        learnt in prop::option::of(any_learnt()),
        gyro_timing in prop_oneof![Just(GyroTiming::PeriodMean), (0.0_f32..=0.05).prop_map(GyroTiming::Delay)],
        // Longer ones would hide the decisions of a few hundred samples.
        delays in prop::array::uniform2(0.0_f32..=0.1),
        (on_threshold, hysteresis) in (-1.0e3_f32..=1.0e3, 0.0_f32..=1.0e3),
    ) -> AnyParams {
        let mut params = AnyParams {
            method,
            params: Params { learning, learnt, constants, ..Params::DEFAULT },
            half_widths: HalfWidthParams { window, ..HalfWidthParams::DEFAULT },
        };
        for (parameter, number) in numbers {
            parameter.set(&mut params, number);
        }
        params.params.attitude.gyro_timing = gyro_timing;
        [params.params.decision.on_delay, params.params.decision.off_delay] = delays;
        params.params.load = LoadParams { on_threshold, off_threshold: on_threshold - hysteresis };
        params
    }
}

fn estimator(params: &AnyParams, stream: Stream) -> AnyEstimator<CAPACITY> {
    AnyEstimator::new(&params.validate(stream).expect("parameters in their ranges"))
}

/// Maximum amount by which a partial probability may be below the total, because of rounding.
const ABOVE_THE_WHOLE: f32 = 1.0e-5;

fn assert_is_sound(estimate: &ContactEstimate) -> Result<(), TestCaseError> {
    let p = estimate.probabilities;
    let products = [p.tangential, p.vertical, p.stable];
    for probability in p.axes.to_array().into_iter().chain(products) {
        prop_assert!((0.0..=1.0).contains(&probability), "{estimate:?}");
    }
    let q = estimate.orientation;
    let norm2 = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
    prop_assert!((norm2 - 1.0).abs() < 1e-4, "{estimate:?}");
    for vector in [estimate.linear_acceleration.0, estimate.angular_rate.0, estimate.gyro_bias.0] {
        prop_assert!(vector.is_within(f32::MAX), "{estimate:?}");
    }
    for part in [p.tangential, p.vertical].into_iter().chain(p.axes.to_array()) {
        prop_assert!(p.stable <= part + ABOVE_THE_WHOLE, "{estimate:?}");
    }
    if estimate.flags.are_doubt() {
        prop_assert_eq!(estimate.decision, Decision::NotStable);
    }
    let is_unknown = |flag: &Flag| estimate.flags.contains(*flag);
    let unknown = [Flag::AttitudeNotInitialised, Flag::Saturated, Flag::Stale, Flag::InvalidSample];
    if unknown.iter().any(is_unknown) {
        prop_assert_eq!(estimate.probabilities, Probabilities::default());
    }
    Ok(())
}

/// Checks the standard deviation of the zero-velocity measurement against its formula in f64.
fn assert_sigma(params: &VelocityParams, estimate: &ContactEstimate) -> Result<(), TestCaseError> {
    let VelocitySigma(found) = estimate.velocity_sigma;
    prop_assert!(found > 0.0 && found <= 100.0, "{estimate:?}");
    let [speed, lever, floor] = [params.speed, params.lever, params.floor].map(f64::from);
    let p = f64::from(estimate.probabilities.stable);
    let Vec3 { x, y, z } = estimate.angular_rate.0;
    let rate: f64 = [x, y, z].map(|w| f64::from(w).powi(2)).iter().sum();
    let variance = (speed * (1.0 - p) / p).powi(2) + lever.powi(2) * rate + floor.powi(2);
    let expected = if estimate.flags.are_doubt() {
        100.0
    } else {
        // Infinite for P = 0.
        variance.sqrt().min(100.0)
    };
    prop_assert!((f64::from(found) / expected - 1.0).abs() < 1.0e-5, "{expected}, {estimate:?}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn every_output_is_a_number_in_its_range_for_any_input(
        params in any_params(),
        stream in any_stream(),
        samples in prop::collection::vec((any_sample(), prop::option::of(any_component())), 1..400),
    ) {
        let mut estimator = estimator(&params, stream);
        let mut now = 0_u64;
        for ((mut sample, elapsed), load) in samples {
            now = now.wrapping_add(elapsed);
            sample.timestamp = Timestamp::from_micros(now);
            let estimate = estimator.update(&sample, load.map(Load));
            assert_is_sound(&estimate)?;
            assert_sigma(&params.params.velocity, &estimate)?;
        }
        let learnt = Params { learnt: Some(estimator.learnt()), ..params.params };
        prop_assert!(learnt.check().is_ok(), "{:?}", estimator.learnt());
    }

    #[test]
    fn a_wider_half_width_never_lowers_a_probability(
        motion in prop::collection::vec(prop::array::uniform6(-1.0_f32..1.0), 1..100),
        half_width in prop::array::uniform6(0.001_f32..1.0),
        bandwidth in prop::array::uniform6(0.001_f32..0.5),
        wider in prop::array::uniform6(1.0_f32..3.0),
    ) {
        let narrow = HalfWidthParams {
            bandwidth: PerAxis::from_array(bandwidth),
            half_width: PerAxis::from_array(half_width),
            ..HalfWidthParams::DEFAULT
        };
        let wide = HalfWidthParams {
            half_width: narrow.half_width.zip_with(PerAxis::from_array(wider), |d, w| d * w),
            ..narrow
        };
        let [mut narrow, mut wide] =
            [narrow, wide].map(|p| {
                let config = p.validate::<CAPACITY>(&Params::DEFAULT, Stream::KILOHERTZ);
                config.expect("in range").density()
            });
        for [ax, ay, az, wx, wy, wz] in motion {
            let (a, w) = (
                LinearAcceleration(Vec3::new(ax, ay, az)),
                AngularRate(Vec3::new(wx, wy, wz)),
            );
            let (narrow, wide) = (narrow.push(a, w).axes, wide.push(a, w).axes);
            for (n, w) in narrow.to_array().into_iter().zip(wide.to_array()) {
                // Twice the error bound of a mass.
                prop_assert!(w >= n - 5.0e-7, "{w} < {n}");
            }
        }
    }
}

/// Maximum difference of P between two mountings of the sensor on the same foot.
const MOUNTED_OTHERWISE: f32 = 0.01;

/// A walk with gravity, and its P.
fn walk() -> &'static (Recording, Vec<ContactEstimate>) {
    static WALK: OnceLock<(Recording, Vec<ContactEstimate>)> = OnceLock::new();
    WALK.get_or_init(|| {
        let plan = Plan::steady(GaitName::Walk, Ground::Hard, 8.0, 1);
        let recording = record(&plan, &SensorParams::LSM6DSOX, 1);
        let estimates = estimates_of(&recording, &AnyParams::DEFAULT).expect("the preset");
        (recording, estimates)
    })
}

/// `v` turned about `axis`, a unit vector, by `angle` (Rodrigues).
fn turned(v: Vec3, axis: [f64; 3], angle: f64) -> Vec3 {
    let v = [v.x, v.y, v.z].map(f64::from);
    let [x, y, z] = axis;
    let (sine, cosine) = angle.sin_cos();
    let along = (v[0] * x + v[1] * y + v[2] * z) * (1.0 - cosine);
    let cross = [y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0]];
    let [x, y, z]: [f64; 3] =
        std::array::from_fn(|k| v[k] * cosine + cross[k] * sine + axis[k] * along);
    Vec3::new(x as f32, y as f32, z as f32)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn the_mounting_does_not_change_the_probability(
        (height, around) in (-1.0_f64..1.0, 0.0_f64..std::f64::consts::TAU),
        angle in 0.0_f64..std::f64::consts::PI,
    ) {
        let level = (1.0 - height * height).sqrt();
        let axis = [level * around.cos(), level * around.sin(), height];
        let (recording, expected) = walk();
        let mut mounted = recording.clone();
        for sample in &mut mounted.samples {
            let (force, rate) = (sample.imu.specific_force.0, sample.imu.angular_rate.0);
            sample.imu.specific_force = SpecificForce(turned(force, axis, angle));
            sample.imu.angular_rate = AngularRate(turned(rate, axis, angle));
        }
        let estimates = estimates_of(&mounted, &AnyParams::DEFAULT).expect("the preset");
        for (estimate, expected) in estimates.iter().zip(expected) {
            let (p, expected) = (estimate.probabilities.stable, expected.probabilities.stable);
            prop_assert!(
                (p - expected).abs() <= MOUNTED_OTHERWISE,
                "{p} instead of {expected} at {} µs", estimate.timestamp.as_micros()
            );
        }
    }
}
