//! The driver on the simulated part: samples, time, pins, self-test.

use std::cell::Cell;
use std::rc::Rc;

use crate::common::{QUIET, part, sensor};
use estimator_core::{Timestamp, Validity};
use lsm6dsox::imu::Conversion;
use lsm6dsox::scale::{DEGREE, STANDARD_GRAVITY};
use lsm6dsox::sim::{Part, PartOptions, SharedPart, Stimulus};
use lsm6dsox::{
    AccelFilter, Config, DataReady, DataReadyMode, GyroFilter, Odr, Params, Pin, SelfTest, Sensor,
};

const MILLISECOND: u64 = 1_000_000;

#[test]
fn init_violates_no_register() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, Config::FRESH_KILOHERTZ);
    sensor.verify().unwrap();
    sensor.self_test(&mut part.delay()).unwrap();
    sensor.power_down().unwrap();
    assert_eq!(part.with(|part| part.violations().to_vec()), []);
}

#[test]
fn each_millisecond_gets_a_fresh_sample_within_one_period() {
    for clock_error in [-0.03, 0.0, 0.021] {
        let part = part(PartOptions { clock_error, jitter_ns: 2_000, ..QUIET });
        let mut sensor = sensor(&part, Config::FRESH_KILOHERTZ);
        let period_ns = (150_000.0 / (1.0 + clock_error)) as u64 + 1 + 2_000;
        let start = part.now_ns();
        for tick in 1..=2_000 {
            part.advance_to(start + tick * MILLISECOND);
            let edge = part.next_rising_edge_ns(Pin::Int1).expect("samples come");
            let wait = edge - part.now_ns();
            assert!(wait <= period_ns, "tick {tick}: {wait} ns");
            part.advance_to(edge);
            assert!(part.pin_is_high(Pin::Int1));
            assert!(sensor.sample().unwrap().is_fresh(), "tick {tick}");
        }
    }
}

#[test]
fn some_milliseconds_lack_a_new_sample_at_833_hz() {
    let part = part(QUIET);
    let mut params = Params::FRESH_KILOHERTZ;
    params.accel.odr = Odr::Hz833;
    params.gyro.odr = Odr::Hz833;
    params.gyro.filter = GyroFilter::Lpf2;
    let mut sensor = sensor(&part, params.validate().unwrap());
    let stale = (0..1000)
        .filter(|_| {
            part.advance_by(MILLISECOND);
            !sensor.sample().unwrap().is_fresh()
        })
        .count();
    assert!((150..=180).contains(&stale), "{stale}");
}

/// Standard deviations of specific force in mg and of angular rate in °/s.
fn scatter(config: Config, seed: u64) -> ([f64; 3], [f64; 3]) {
    let part = part(PartOptions { seed, noise: true, ..QUIET });
    let mut sensor = sensor(&part, config);
    let count = 20_000;
    let mut sums = [[0.0; 2]; 6];
    for _ in 0..count {
        part.advance_by(MILLISECOND);
        let sample = sensor.sample().unwrap().to_si();
        let values = sample.specific_force.map(|x| x / STANDARD_GRAVITY * 1e3);
        let rates = sample.angular_rate.map(|x| x / DEGREE);
        for (sum, x) in sums.iter_mut().zip(values.into_iter().chain(rates)) {
            sum[0] += f64::from(x);
            sum[1] += f64::from(x) * f64::from(x);
        }
    }
    let n = f64::from(count);
    let deviation = sums.map(|[sum, squares]| (squares / n - (sum / n) * (sum / n)).sqrt());
    let [ax, ay, az, gx, gy, gz] = deviation;
    ([ax, ay, az], [gx, gy, gz])
}

#[test]
fn the_scatter_at_rest_is_the_settings_noise() {
    for filter in [AccelFilter::OdrDiv10, AccelFilter::OdrDiv20, AccelFilter::OdrDiv45] {
        let mut params = Params::FRESH_KILOHERTZ;
        params.accel.filter = filter;
        let config = params.validate().unwrap();
        let noise = config.noise();
        let accel = f64::from(noise.specific_force.unwrap() / STANDARD_GRAVITY * 1e3);
        let gyro = f64::from(noise.angular_rate.unwrap() / DEGREE);
        // A second-order Butterworth filter is not steep, so it passes 5.4 % more noise than its
        // cut-off suggests (less if the cut-off nears the rate). Rounding adds 1/√12 of a code.
        let expected = |noise: f64, code: f64| (noise * noise * 1.11 + code * code / 12.0).sqrt();
        let (accel_found, gyro_found) = scatter(config, 5);
        for (found, noise, code) in accel_found
            .map(|found| (found, accel, 0.488))
            .into_iter()
            .chain(gyro_found.map(|found| (found, gyro, 0.070)))
        {
            assert!((found / noise - 1.0).abs() < 0.1, "{filter:?}: {found}, {noise}");
            let expected = expected(noise, code);
            assert!((found / expected - 1.0).abs() < 0.03, "{filter:?}: {found}, {expected}");
        }
    }
}

#[test]
fn aliasing_vibration_is_damped_by_the_presets_filters() {
    // 1 g at 1010 Hz looks like 10 Hz to a kilohertz timer.
    let shaking = |seconds: f64| Stimulus {
        specific_force: [(seconds * 1010.0 * core::f64::consts::TAU).sin() * 9.81, 0.0, 9.81],
        ..Stimulus::REST
    };
    let largest = |filter| {
        let part = Part::with_options(shaking, QUIET).shared();
        let mut params = Params::FRESH_KILOHERTZ;
        params.accel.filter = filter;
        let mut sensor = sensor(&part, params.validate().unwrap());
        let samples = (0..1000).map(|_| {
            part.advance_by(MILLISECOND);
            sensor.sample().unwrap().to_si().specific_force[0].abs()
        });
        samples.fold(0.0, f32::max)
    };
    assert!(largest(AccelFilter::OdrDiv2) > 9.0);
    assert!(largest(AccelFilter::OdrDiv20) < 1.2);
}

#[test]
fn a_latched_pin_stays_high_until_the_sample_is_read() {
    let part = part(QUIET);
    let params = Params {
        data_ready: Some(DataReady {
            sensor: Sensor::Accel,
            pin: Pin::Int2,
            mode: DataReadyMode::Latched,
        }),
        ..Params::FRESH_KILOHERTZ
    };
    let mut sensor = sensor(&part, params.validate().unwrap());
    for _ in 0..10 {
        assert!(part.pin_is_high(Pin::Int2) && !part.pin_is_high(Pin::Int1));
        assert_eq!(part.next_rising_edge_ns(Pin::Int2), None);
        part.advance_by(MILLISECOND);
        assert!(part.pin_is_high(Pin::Int2));
        sensor.sample().unwrap();
        assert!(!part.pin_is_high(Pin::Int2));
        part.advance_to(part.next_rising_edge_ns(Pin::Int2).unwrap());
    }
}

/// Counts torn words of a part whose x code rises by 255 per sample, on a slow bus.
fn torn_words(block_data_update: bool) -> usize {
    let code = Rc::new(Cell::new(0_i16));
    let step = Rc::clone(&code);
    let counting = move |_: f64| {
        step.set((step.get() + 255) % 16_320);
        let codes_to_si = 0.488e-3 * 9.806_65;
        Stimulus { specific_force: [f64::from(step.get()) * codes_to_si; 3], ..Stimulus::REST }
    };
    let options = PartOptions { byte_time_ns: 20_000, ..QUIET };
    let part = Part::with_options(counting, options).shared();
    let mut params = Params::FRESH_KILOHERTZ;
    params.block_data_update = block_data_update;
    params.accel.filter = AccelFilter::OdrDiv2;
    let mut sensor = sensor(&part, params.validate().unwrap());
    (0..1000)
        .flat_map(|_| sensor.sample().unwrap().specific_force.codes)
        .filter(|code| code % 255 != 0)
        .count()
}

#[test]
fn block_data_update_keeps_the_two_bytes_of_a_word_together() {
    assert!(torn_words(false) > 100);
    assert_eq!(torn_words(true), 0);
}

/// Number of rising edges of INT1 in a time.
fn edges(part: &SharedPart, ns: u64) -> u64 {
    let end = part.now_ns() + ns;
    let mut edges = 0;
    while let Some(edge) = part.next_rising_edge_ns(Pin::Int1).filter(|ns| *ns <= end) {
        part.advance_to(edge);
        edges += 1;
    }
    part.advance_to(end);
    edges
}

#[test]
fn trim_shows_the_error_of_a_specimens_clock() {
    let part = part(PartOptions { clock_error: 0.03, ..QUIET });
    let mut sensor = sensor(&part, Config::FRESH_KILOHERTZ);
    let trim = sensor.frequency_fine().unwrap();
    assert_eq!(trim.0, 20);
    let expected = 3.0 / 150.0e-6 * trim.ratio();
    let edges = edges(&part, 3_000 * MILLISECOND);
    assert!(edges.abs_diff(expected as u64) <= 1, "{edges}, {expected}");
}

#[test]
fn a_sound_part_passes_its_self_test_and_goes_on_measuring() {
    let part = part(PartOptions { noise: true, ..QUIET });
    let mut sensor = sensor(&part, Config::FRESH_KILOHERTZ);
    let result = sensor.self_test(&mut part.delay()).unwrap();
    assert!(result.passed(), "{result:?}");
    assert!(result.specific_force.iter().all(|x| (x - 4.9).abs() < 0.05));
    assert!(result.angular_rate.iter().all(|x| (x - 7.0).abs() < 0.05));
    sensor.verify().unwrap();
    part.advance_by(MILLISECOND);
    assert!(sensor.sample().unwrap().is_fresh());
}

#[test]
fn an_axis_that_does_not_answer_the_test_signal_fails_by_name() {
    let part = part(PartOptions {
        accel_test_signal: [4.9, 0.1, 4.9],
        gyro_test_signal: [7.0, 7.0, 20.0],
        ..QUIET
    });
    let mut sensor = sensor(&part, Config::FRESH_KILOHERTZ);
    let result: SelfTest = sensor.self_test(&mut part.delay()).unwrap();
    assert_eq!(result.accel_passed(), [true, false, true]);
    assert_eq!(result.gyro_passed(), [true, true, false]);
}

#[test]
fn the_same_seed_gives_the_same_bits() {
    let run = |seed| {
        let part = part(PartOptions { seed, noise: true, jitter_ns: 500, ..QUIET });
        let mut sensor = sensor(&part, Config::FRESH_KILOHERTZ);
        (0..2_000).fold(0xCBF2_9CE4_8422_2325_u64, |hash, _| {
            part.advance_by(MILLISECOND);
            let sample = sensor.sample().unwrap();
            let codes = sample.specific_force.codes.into_iter().chain(sample.angular_rate.codes);
            codes.fold(hash, |hash, code| {
                (hash ^ u64::from(code.cast_unsigned())).wrapping_mul(0x0100_0000_01B3)
            })
        })
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1), run(2));
    // Golden value: the same on every machine.
    assert_eq!(run(1), 0x64d7_cd44_51a3_d0db, "{:#x}", run(1));
}

/// Samples a shock of 75 g along x at 20 phases of the tick. Returns the number of phases with a sample at the end of the
/// range, and the number of phases with a sample that counts as saturated.
fn flagged(micros: u64) -> [usize; 2] {
    let mut flagged = [0; 2];
    for phase in 0..20 {
        let begin = 200_000 + 50 * phase;
        let shock = move |seconds: f64| {
            let mut felt = Stimulus::REST;
            if (begin..begin + micros).contains(&((seconds * 1.0e6) as u64)) {
                felt.specific_force[0] = 75.0 * 9.806_65;
            }
            felt
        };
        let part = Part::with_options(shock, QUIET).shared();
        let mut sensor = sensor(&part, Config::FRESH_KILOHERTZ);
        let mut conversion = Conversion::new(&Config::FRESH_KILOHERTZ);
        let mut found = [false; 2];
        for millisecond in 190..220 {
            part.advance_to(millisecond * MILLISECOND);
            let raw = sensor.sample().unwrap();
            let time = Timestamp::from_micros(millisecond * 1_000);
            let validity = conversion.imu_sample(&raw, time).validity;
            found[0] |= raw.is_saturated();
            found[1] |= validity != Validity::Valid;
        }
        flagged[0] += usize::from(found[0]);
        flagged[1] += usize::from(found[1]);
    }
    flagged
}

#[test]
fn shock_that_the_filter_smooths_counts_as_saturated() {
    // A shock of a millisecond comes out at three quarters of the range.
    let shocks = [1_000, 1_500, 2_000].map(flagged);
    assert_eq!(shocks, [[0, 0], [0, 12], [12, 20]]);
}

#[test]
fn offsets_drift_with_the_distance_from_25_degrees() {
    let options = PartOptions {
        accel_bias: [0.2, 0.0, -0.1],
        gyro_bias: [0.0, 0.01, 0.0],
        accel_drift: [0.0, 0.01, -0.02],
        gyro_drift: [0.001, 0.0, -0.002],
        ..QUIET
    };
    let read = |temperature: f64| {
        let stimulus = Stimulus { temperature, ..Stimulus::REST };
        let part = Part::with_options(move |_: f64| stimulus, options).shared();
        let raw = sensor(&part, Config::FRESH_KILOHERTZ).sample().unwrap();
        let sample = raw.to_si();
        assert_eq!(f64::from(sample.temperature), temperature);
        let accel = sample.specific_force.map(f64::from);
        (accel, sample.angular_rate.map(f64::from))
    };
    for (temperature, accel, gyro) in [
        (25.0, [0.2, 0.0, 9.706_65], [0.0, 0.01, 0.0]),
        (45.0, [0.2, 0.2, 9.306_65], [0.02, 0.01, -0.04]),
        (5.0, [0.2, -0.2, 10.106_65], [-0.02, 0.01, 0.04]),
    ] {
        let (force, rate) = read(temperature);
        // Half a code is 2.4 mm/s² and 0.61 mrad/s.
        for axis in 0..3 {
            let at = format!("axis {axis} at {temperature} °C");
            assert!((force[axis] - accel[axis]).abs() < 0.002_5, "{at}");
            assert!((rate[axis] - gyro[axis]).abs() < 0.000_65, "{at}");
        }
    }
}
