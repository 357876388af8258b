//! What holds for the estimator whatever comes in.

use estimator_core::{
    AngularRate, AttitudeParams, ContactEstimate, ContactEstimator, Decision, DecisionParams,
    DensityEstimator, Flag, Flags, Gravity, GyroTiming, ImuSample, LinearAcceleration, Load,
    LoadParams, Params, PerAxis, Phase, Residual, RestParams, Saturation, SlideParams,
    SpecificForce, Timestamp, Validity, Vec3, WindowLength,
};
use proptest::prelude::*;

const CAPACITY: usize = 128;

/// Any bit pattern, with the awkward ones often, and ordinary motion most of the time.
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

/// A sample with the time that has passed since the one before, in µs: mostly 1 ms.
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
    fn any_rest()(
        duration in scale(0.11, 90.0),
        acceleration in scale(1.1e-3, 9.0),
        rate in scale(1.1e-4, 0.9),
        bias_limit in 0.0_f32..=1.0,
        bias_time_constant in scale(0.11, 9.0e2),
    ) -> RestParams {
        RestParams { duration, acceleration, rate, bias_limit, bias_time_constant }
    }
}

prop_compose! {
    fn any_attitude()(
        gyro_timing in prop_oneof![
            Just(GyroTiming::PeriodMean),
            (0.0_f32..=0.05).prop_map(GyroTiming::Delay),
        ],
        motion_time_constant in scale(0.11, 90.0),
        quiet_gain in scale(1.1, 9.0e3),
        quiet_acceleration in scale(1.1e-3, 9.0),
        quiet_rate in scale(1.1e-4, 0.9),
        rest in any_rest(),
    ) -> AttitudeParams {
        AttitudeParams {
            gyro_timing, motion_time_constant, quiet_gain, quiet_acceleration, quiet_rate, rest,
        }
    }
}

prop_compose! {
    /// Parameters from all over their allowed ranges.
    fn any_params()(
        gravity in prop_oneof![Just(Gravity::Included), Just(Gravity::Removed)],
        window in (1_u32..=CAPACITY as u32).prop_map(WindowLength::Samples),
        bandwidth in prop::array::uniform6(scale(2.0e-6, 9.0e2)).prop_map(PerAxis::from_array),
        half_width in prop::array::uniform6(scale(2.0e-6, 9.0e3)).prop_map(PerAxis::from_array),
        sample_rate in scale(21.0, 9.0e3),
        short_window in prop::option::of((0_u32..=300).prop_map(WindowLength::Samples)),
        slide in prop::option::of(
            (scale(1.1e-6, 9.0e2), scale(1.1e-3, 9.0))
                .prop_map(|(speed, time_constant)| SlideParams { speed, time_constant }),
        ),
        residual in prop_oneof![Just(Residual::Kept), Just(Residual::Removed)],
        tolerance in 0.0_f32..=1.0,
        attitude in any_attitude(),
        (threshold, on_delay, off_delay) in (0.01_f32..=0.99, 0.0_f32..=0.1, 0.0_f32..=0.1),
        (on_threshold, hysteresis) in (-1.0e3_f32..=1.0e3, 0.0_f32..=1.0e3),
    ) -> Params {
        Params {
            sample_rate, gravity, residual, window, short_window, slide, bandwidth, half_width,
            tolerance, attitude,
            decision: DecisionParams { threshold, on_delay, off_delay },
            load: LoadParams { on_threshold, off_threshold: on_threshold - hysteresis },
        }
    }
}

fn estimator(params: &Params) -> ContactEstimator<CAPACITY> {
    ContactEstimator::new(&params.validate().expect("parameters in their ranges"))
}

fn assert_is_sound(estimate: &ContactEstimate) -> Result<(), TestCaseError> {
    let p = estimate.probabilities;
    let products = [p.tangential, p.vertical, p.stable];
    for probability in p.axes.to_array().into_iter().chain(products) {
        prop_assert!((0.0..=1.0).contains(&probability), "{estimate:?}");
    }
    let q = estimate.orientation;
    let norm2 = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
    prop_assert!((norm2 - 1.0).abs() < 1e-4, "{estimate:?}");
    for vector in [
        estimate.linear_acceleration.0,
        estimate.angular_rate.0,
        estimate.gyro_bias.0,
    ] {
        prop_assert!(vector.is_within(f32::MAX), "{estimate:?}");
    }
    let gap_alone = estimate.flags == Flags::NONE.with(Flag::TimeGap);
    if !estimate.flags.is_empty() && !gap_alone {
        prop_assert_eq!(estimate.decision, Decision::NotStable);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn whatever_comes_in_every_output_is_a_number_in_its_range(
        params in any_params(),
        samples in prop::collection::vec((any_sample(), prop::option::of(any_component())), 1..400),
    ) {
        let mut estimator = estimator(&params);
        let mut now = 0_u64;
        for ((mut sample, elapsed), load) in samples {
            now = now.wrapping_add(elapsed);
            sample.timestamp = Timestamp::from_micros(now);
            assert_is_sound(&estimator.update(&sample, load.map(Load)))?;
        }
    }

    #[test]
    fn a_reading_that_is_no_number_has_mass_zero_on_all_axes_and_raises_its_flag(
        axis in 0_usize..6,
        value in prop::sample::select(vec![f32::NAN, f32::INFINITY, f32::NEG_INFINITY]),
        at in 0_usize..50,
    ) {
        // One window, whose masses are whole at rest.
        let params = Params { gravity: Gravity::Removed, bandwidth: Params::DEFAULT.bandwidth, ..Params::PAPER };
        let mut estimator = estimator(&params);
        for k in 0..50_usize {
            let mut motion = [0.0; 6];
            if k == at {
                motion[axis] = value;
            }
            let [ax, ay, az, wx, wy, wz] = motion;
            let sample = ImuSample {
                timestamp: Timestamp::from_micros(k as u64 * 1000),
                specific_force: SpecificForce(Vec3::new(ax, ay, az)),
                angular_rate: AngularRate(Vec3::new(wx, wy, wz)),
                validity: Validity::Valid,
            };
            let estimate = estimator.update(&sample, Some(Load(100.0)));
            prop_assert_eq!(estimate.flags.contains(Flag::InvalidSample), k == at);
            if k == at {
                prop_assert_eq!(estimate.phase, Phase::Unknown);
            }
            // All the other samples are at rest: each axis has lost one sample's mass.
            let lost = if k >= at { 1.0 } else { 0.0 };
            let samples = k as f32 + 1.0;
            for p in estimate.probabilities.axes.to_array() {
                prop_assert_eq!(p, (samples - lost) / samples);
            }
        }
    }

    #[test]
    fn a_wider_half_width_never_lowers_a_probability(
        motion in prop::collection::vec(prop::array::uniform6(-1.0_f32..1.0), 1..100),
        half_width in prop::array::uniform6(0.001_f32..1.0),
        bandwidth in prop::array::uniform6(0.001_f32..0.5),
        wider in prop::array::uniform6(1.0_f32..3.0),
    ) {
        // Of a speed more is remembered the wider its half-width is, so that it lasts longer.
        let narrow = Params {
            slide: None,
            bandwidth: PerAxis::from_array(bandwidth),
            half_width: PerAxis::from_array(half_width),
            ..Params::DEFAULT
        };
        let wide = Params {
            half_width: narrow.half_width.zip_with(PerAxis::from_array(wider), |d, w| d * w),
            ..narrow
        };
        let [mut narrow, mut wide] =
            [narrow, wide].map(|p| DensityEstimator::<CAPACITY>::new(&p.validate().expect("in range")));
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

    #[test]
    fn the_order_of_samples_within_a_window_does_not_change_a_bit(
        mut motion in prop::collection::vec(prop::array::uniform6(-1.0_f32..1.0), 50),
        seed in any::<u64>(),
    ) {
        let run = |motion: &[[f32; 6]]| {
            let mut density =
                DensityEstimator::<CAPACITY>::new(&Params::PAPER.validate().expect("a preset"));
            for &[ax, ay, az, wx, wy, wz] in motion {
                density.push(
                    LinearAcceleration(Vec3::new(ax, ay, az)),
                    AngularRate(Vec3::new(wx, wy, wz)),
                );
            }
            density.probabilities()
        };
        let before = run(&motion);
        // Fisher and Yates, driven by a linear congruential generator.
        let mut random = seed;
        for i in (1..motion.len()).rev() {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            motion.swap(i, (random >> 33) as usize % (i + 1));
        }
        prop_assert_eq!(before, run(&motion));
    }
}
