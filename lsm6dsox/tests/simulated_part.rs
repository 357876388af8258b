//! The driver on the simulated part: samples, time, pins, self-test.

use std::cell::Cell;
use std::rc::Rc;

use crate::common::{QUIET, at_rest, part, sensor};
use embedded_hal::spi::SpiDevice as _;
use estimator_core::{Timestamp, Validity};
use lsm6dsox::imu::Conversion;
use lsm6dsox::register::Register;
use lsm6dsox::scale::{DEGREE, STANDARD_GRAVITY};
use lsm6dsox::sim::{Part, PartFault, PartOptions, SharedPart, SimSpi, Stimulus};
use lsm6dsox::{
    AccelFilter, AccelFullScale, Config, DataReady, DataReadyMode, GyroFilter, GyroFullScale,
    Lsm6dsox, Odr, Params, Pin, SelfTest, Sensor, register,
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
fn readings_match_the_motion_at_every_full_scale() {
    let truth = Stimulus {
        specific_force: [1.0, -2.0, 9.5],
        angular_rate: [0.5, -1.0, 2.0],
        temperature: 31.5,
    };
    for accel in AccelFullScale::ALL {
        for gyro in GyroFullScale::ALL {
            let part = Part::with_options(move |_: f64| truth, QUIET).shared();
            let mut params = Params::FRESH_KILOHERTZ;
            params.accel.full_scale = accel;
            params.gyro.full_scale = gyro;
            let sample = sensor(&part, params.validate().unwrap())
                .sample()
                .unwrap()
                .to_si();
            let accel_step = accel.milli_g_per_code() * 1e-3 * STANDARD_GRAVITY;
            let gyro_step = gyro.milli_dps_per_code() * 1e-3 * DEGREE;
            for axis in 0..3 {
                let force = sample.specific_force[axis] - truth.specific_force[axis] as f32;
                let rate = sample.angular_rate[axis] - truth.angular_rate[axis] as f32;
                assert!(force.abs() <= 0.51 * accel_step, "{accel:?} {axis}");
                assert!(rate.abs() <= 0.51 * gyro_step, "{gyro:?} {axis}");
            }
            assert_eq!(sample.temperature, 31.5);
            assert!(!sample.accel_saturated && !sample.gyro_saturated);
        }
    }
}

#[test]
fn each_millisecond_gets_a_fresh_sample_within_one_period() {
    for clock_error in [-0.03, 0.0, 0.021] {
        let part = part(PartOptions {
            clock_error,
            jitter_ns: 2_000,
            ..QUIET
        });
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
fn a_simulated_mcu_drives_the_bus_byte_by_byte() {
    let part = part(QUIET);
    part.advance_by(10 * MILLISECOND);
    part.with(|part| {
        // The part does not drive the line, which the board pulls down.
        assert_eq!(part.exchange(0x8F), 0x00);
        part.select();
        part.exchange(0x8F);
        // WHO_AM_I and, the address having moved on, CTRL1_XL.
        assert_eq!([part.exchange(0), part.exchange(0)], [0x6C, 0x00]);
        part.deselect();
        part.select();
        part.exchange(0x12);
        part.exchange(0x40); // IF_INC off
        part.select();
        part.exchange(0x8F);
        assert_eq!([part.exchange(0), part.exchange(0)], [0x6C, 0x6C]);
        part.deselect();
    });
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
    let part = part(PartOptions {
        seed,
        noise: true,
        ..QUIET
    });
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
    for filter in [
        AccelFilter::OdrDiv10,
        AccelFilter::OdrDiv20,
        AccelFilter::OdrDiv45,
    ] {
        let mut params = Params::FRESH_KILOHERTZ;
        params.accel.filter = filter;
        let config = params.validate().unwrap();
        let noise = config.noise();
        let accel = f64::from(noise.specific_force.unwrap() / STANDARD_GRAVITY * 1e3);
        let gyro = f64::from(noise.angular_rate.unwrap() / DEGREE);
        // By its second-order skirts a Butterworth filter passes 5.4 % more noise than its
        // cut-off suggests (less if the cut-off nears the rate), and rounding adds 1/√12 of a code.
        let expected = |noise: f64, code: f64| (noise * noise * 1.11 + code * code / 12.0).sqrt();
        let (accel_found, gyro_found) = scatter(config, 5);
        for (found, noise, code) in accel_found
            .map(|found| (found, accel, 0.488))
            .into_iter()
            .chain(gyro_found.map(|found| (found, gyro, 0.070)))
        {
            assert!(
                (found / noise - 1.0).abs() < 0.1,
                "{filter:?}: {found}, {noise}"
            );
            let expected = expected(noise, code);
            assert!(
                (found / expected - 1.0).abs() < 0.03,
                "{filter:?}: {found}, {expected}"
            );
        }
    }
}

#[test]
fn aliasing_vibration_is_damped_by_the_presets_filters() {
    // 1 g at 1010 Hz looks like 10 Hz to a kilohertz timer.
    let shaking = |seconds: f64| Stimulus {
        specific_force: [
            (seconds * 1010.0 * core::f64::consts::TAU).sin() * 9.81,
            0.0,
            9.81,
        ],
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

#[test]
fn a_pulsed_pin_is_high_for_75_microseconds_whether_read_or_not() {
    let part = part(QUIET);
    let _sensor = sensor(&part, Config::FRESH_KILOHERTZ);
    for _ in 0..10 {
        part.advance_to(part.next_rising_edge_ns(Pin::Int1).unwrap());
        assert!(part.pin_is_high(Pin::Int1));
        part.advance_by(74_999);
        assert!(part.pin_is_high(Pin::Int1));
        part.advance_by(1);
        assert!(!part.pin_is_high(Pin::Int1));
    }
}

/// Counts torn words of a part whose x code rises by 255 per sample, on a slow bus.
fn torn_words(block_data_update: bool) -> usize {
    let code = Rc::new(Cell::new(0_i16));
    let step = Rc::clone(&code);
    let counting = move |_: f64| {
        step.set((step.get() + 255) % 16_320);
        let codes_to_si = 0.488e-3 * 9.806_65;
        Stimulus {
            specific_force: [f64::from(step.get()) * codes_to_si; 3],
            ..Stimulus::REST
        }
    };
    let options = PartOptions {
        byte_time_ns: 20_000,
        ..QUIET
    };
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
    let part = part(PartOptions {
        clock_error: 0.03,
        ..QUIET
    });
    let mut sensor = sensor(&part, Config::FRESH_KILOHERTZ);
    let trim = sensor.frequency_fine().unwrap();
    assert_eq!(trim.0, 20);
    let expected = 3.0 / 150.0e-6 * trim.ratio();
    let edges = edges(&part, 3_000 * MILLISECOND);
    assert!(edges.abs_diff(expected as u64) <= 1, "{edges}, {expected}");
}

#[test]
fn a_sound_part_passes_its_self_test_and_goes_on_measuring() {
    let part = part(PartOptions {
        noise: true,
        ..QUIET
    });
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
        let part = part(PartOptions {
            seed,
            noise: true,
            jitter_ns: 500,
            ..QUIET
        });
        let mut sensor = sensor(&part, Config::FRESH_KILOHERTZ);
        (0..2_000).fold(0xCBF2_9CE4_8422_2325_u64, |hash, _| {
            part.advance_by(MILLISECOND);
            let sample = sensor.sample().unwrap();
            let codes = sample
                .specific_force
                .codes
                .into_iter()
                .chain(sample.angular_rate.codes);
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

/// Samples of a shock of 75 g along x, at 20 phases of the tick: how many phases have a sample at the end of the range,
/// and how many one that counts as saturated.
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
        let mut conversion = Conversion::default();
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
fn part_does_not_answer_before_it_has_booted() {
    let part = Part::with_options(at_rest, QUIET).shared();
    let mut sensor = Lsm6dsox::new(part.spi(), Config::FRESH_KILOHERTZ);
    assert!(sensor.check_identity().is_err());
    part.advance_by(10 * MILLISECOND);
    assert!(sensor.check_identity().is_ok());
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
        let stimulus = Stimulus {
            temperature,
            ..Stimulus::REST
        };
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

/// Reads a register over the bus.
fn register(part: &SharedPart, register: Register) -> u8 {
    let mut frame = [register.read_address(), 0];
    part.spi().transfer_in_place(&mut frame).unwrap();
    frame[1]
}

fn write(part: &SharedPart, register: Register, value: u8) {
    part.spi().write(&[register.address, value]).unwrap();
}

#[test]
fn first_samples_follow_the_turn_on_times() {
    for (ctrl, odr, fresh, turn_on) in [
        (register::CTRL2_G, 0xA0, 0x02, 35 * MILLISECOND),
        (register::CTRL1_XL, 0xA0, 0x01, 5 * MILLISECOND),
    ] {
        let part = part(QUIET);
        part.advance_by(10 * MILLISECOND);
        write(&part, ctrl, odr);
        part.advance_by(turn_on - 1);
        assert_eq!(register(&part, register::STATUS_REG) & 0x03, 0);
        // Within the time of a sample.
        part.advance_by(150_001);
        assert_eq!(register(&part, register::STATUS_REG) & 0x03, fresh);
    }
}

#[test]
fn each_kind_of_reset_stops_the_sensors() {
    let resets: [fn(&SharedPart); 3] = [
        |part| write(part, register::CTRL3_C, 0x05),
        |part| write(part, register::CTRL3_C, 0x84),
        |part| part.inject(PartFault::Reset),
    ];
    for reset in resets {
        let part = part(QUIET);
        let mut sensor = sensor(&part, Config::FRESH_KILOHERTZ);
        assert!(sensor.status().unwrap().gyro_fresh());
        reset(&part);
        part.advance_by(100 * MILLISECOND);
        assert_eq!(sensor.status().unwrap().bits(), 0);
        assert_eq!(register(&part, register::CTRL2_G), 0);
    }
}

#[test]
fn reset_bit_reads_one_until_the_reset_is_over() {
    let part = part(QUIET);
    part.advance_by(10 * MILLISECOND);
    let read = || [register::CTRL3_C, register::WHO_AM_I].map(|r| register(&part, r));
    write(&part, register::CTRL3_C, 0x05);
    assert_eq!(read(), [0x05, 0x6C]);
    part.advance_by(MILLISECOND);
    assert_eq!(read(), [0x04, 0x6C]);
}

/// A part that the driver has initialised, with some bits of a register set afterwards.
fn with_bits(register: Register, bits: u8) -> (SharedPart, Lsm6dsox<SimSpi>) {
    let part = part(QUIET);
    let sensor = sensor(&part, Config::FRESH_KILOHERTZ);
    part.with(|part| {
        part.select();
        part.exchange(register.read_address());
        let value = part.exchange(0);
        part.deselect();
        part.select();
        part.exchange(register.address);
        part.exchange(value | bits);
        part.deselect();
    });
    (part, sensor)
}

#[test]
fn a_sleeping_gyroscope_gives_no_samples() {
    let (part, mut sensor) = with_bits(register::CTRL4_C, 0x40);
    sensor.sample().unwrap();
    part.advance_by(MILLISECOND);
    let status = sensor.sample().unwrap().status;
    assert!(status.accel_fresh() && !status.gyro_fresh());
}

#[test]
fn pins_that_are_active_low_rise_at_the_end_of_a_pulse() {
    let (part, _) = with_bits(register::CTRL3_C, 0x20);
    let edge = part.next_rising_edge_ns(Pin::Int1).unwrap();
    part.advance_to(edge - 1);
    assert!(!part.pin_is_high(Pin::Int1));
    part.advance_to(edge);
    assert!(part.pin_is_high(Pin::Int1));
    assert_eq!(part.next_rising_edge_ns(Pin::Int1), Some(edge + 150_000));
}

#[test]
fn the_second_pins_signals_appear_on_the_first() {
    let (part, _) = with_bits(register::CTRL4_C, 0x20);
    part.with(|part| {
        for (address, value) in [(register::INT1_CTRL, 0), (register::INT2_CTRL, 0x02)] {
            part.select();
            part.exchange(address.address);
            part.exchange(value);
            part.deselect();
        }
    });
    assert!(part.next_rising_edge_ns(Pin::Int1).is_some());
    assert_eq!(part.next_rising_edge_ns(Pin::Int2), None);
}

#[test]
fn rounding_brings_a_burst_back_to_the_first_output() {
    for (rounding, first) in [(0b01, 0x28), (0b10, 0x22), (0b11, 0x22)] {
        let (part, _) = with_bits(register::CTRL5_C, rounding << 5);
        part.with(|part| {
            part.select();
            part.exchange(0x80 | first);
            let length = if rounding == 0b11 { 12 } else { 6 };
            let once: Vec<u8> = (0..length).map(|_| part.exchange(0)).collect();
            let again: Vec<u8> = (0..length).map(|_| part.exchange(0)).collect();
            part.deselect();
            assert_eq!(once, again, "{rounding:#b}");
        });
    }
}

#[test]
fn mode_ending_at_8_g_maps_16_g_to_2_g() {
    let (part, mut sensor) = with_bits(register::CTRL8_XL, 0x02);
    part.advance_by(20 * MILLISECOND);
    // 1 g at 0.061 mg per code.
    assert_eq!(sensor.sample().unwrap().specific_force.codes[2], 16_393);
}

#[test]
fn other_banks_hold_their_values_without_affecting_the_first() {
    const EMBEDDED_FUNCTIONS: u8 = 0x80;
    const SENSOR_HUB: u8 = 0x40;
    let part = part(QUIET);
    part.advance_by(10 * MILLISECOND);
    let read = |address: u8| {
        let mut frame = [0x80 | address, 0];
        part.spi().transfer_in_place(&mut frame).unwrap();
        frame[1]
    };
    let banks = [(EMBEDDED_FUNCTIONS, 0x5A), (SENSOR_HUB, 0xC3)];
    for (bank, value) in banks {
        write(&part, register::FUNC_CFG_ACCESS, bank);
        part.spi().write(&[0x15, value]).unwrap();
    }
    for (bank, value) in banks {
        write(&part, register::FUNC_CFG_ACCESS, bank);
        assert_eq!((read(0x15), read(0x6A)), (value, 0), "{bank:#x}");
    }
    write(&part, register::FUNC_CFG_ACCESS, 0);
    assert_eq!(read(register::WHO_AM_I.address), 0x6C);
    assert_eq!(read(0x15), 0);
}

#[test]
fn clock_rate_change_does_not_repeat_a_sample() {
    let part = part(QUIET);
    sensor(&part, Config::FRESH_KILOHERTZ);
    let before = edges(&part, 10 * MILLISECOND);
    part.inject(PartFault::ClockRatio(1.0));
    assert!(edges(&part, 10 * MILLISECOND).abs_diff(before) <= 1);
    part.inject(PartFault::ClockRatio(0.5));
    assert!(edges(&part, 10 * MILLISECOND).abs_diff(before / 2) <= 1);
}

#[test]
fn a_byte_takes_as_long_as_eight_clocks_and_a_reset_its_time() {
    let part = part(PartOptions {
        byte_time_ns: 800,
        ..QUIET
    });
    part.advance_by(10 * MILLISECOND);
    let takes = || {
        let begin = part.now_ns();
        let value = register(&part, register::WHO_AM_I);
        (part.now_ns() - begin, value)
    };
    assert_eq!(takes(), (2 * 800, 0x6C));
    for (hertz, byte_ns) in [(5_000_000, 1_600), (0, 1_600), (10_000_000, 800)] {
        part.with(|part| part.set_bus_clock(hertz));
        assert_eq!(takes().0, 2 * byte_ns, "{hertz}");
    }
    // Until the reset is over, the part does not answer.
    write(&part, register::CTRL3_C, 0x84);
    assert_eq!(takes().1, 0);
    part.advance_by(10 * MILLISECOND);
    assert_eq!(takes().1, 0x6C);
}

#[test]
fn a_storm_of_edges_lifts_the_pin_for_half_of_its_period() {
    let part = part(QUIET);
    sensor(&part, Config::FRESH_KILOHERTZ);
    part.inject(PartFault::DataReadyStorm { period_ns: 10_000 });
    let high = (0..1_000).filter(|_| {
        part.advance_by(100);
        part.pin_is_high(Pin::Int1)
    });
    let high = high.count();
    assert!(high.abs_diff(500) <= 5, "{high}");
}
