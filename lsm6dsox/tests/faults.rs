//! Each fault of the part, and what the driver reports.

mod common;

use common::{QUIET, part, sensor};
use lsm6dsox::sim::{Fault, Part, PartOptions};
use lsm6dsox::{Config, Error, FrozenDetector, Lsm6dsox, Pin, register};

const MILLISECOND: u64 = 1_000_000;
const PRESET: Config = Config::FRESH_KILOHERTZ;

#[test]
fn a_data_line_stuck_low_is_a_part_with_the_identity_0x00() {
    let part = part(QUIET);
    part.inject(Fault::MisoStuckLow);
    let mut sensor = Lsm6dsox::new(part.spi(), PRESET);
    assert_eq!(
        sensor.init(&mut part.delay()),
        Err(Error::Identity { read: 0x00 })
    );
}

#[test]
fn a_data_line_that_sticks_low_later_gives_stale_samples_and_fails_the_check() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    part.inject(Fault::MisoStuckLow);
    let sample = sensor.sample().unwrap();
    assert!(!sample.status.accel_fresh() && !sample.status.gyro_fresh());
    assert!(matches!(
        sensor.verify(),
        Err(Error::ReadBack {
            register: register::CTRL9_XL,
            written: 0xE2,
            read: 0x00
        })
    ));
}

#[test]
fn a_data_line_stuck_high_is_a_part_with_the_identity_0xff_and_sends_no_samples() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    part.inject(Fault::MisoStuckHigh);
    assert_eq!(
        sensor.sample(),
        Err(Error::Status {
            register: register::STATUS_REG,
            read: 0xFF
        })
    );
    assert_eq!(
        sensor.fifo_status(),
        Err(Error::Status {
            register: register::FIFO_STATUS2,
            read: 0xFF
        })
    );
    assert_eq!(
        sensor.init(&mut part.delay()),
        Err(Error::Identity { read: 0xFF })
    );
}

#[test]
fn another_identity_is_reported_as_it_was_read() {
    let part = part(QUIET);
    part.inject(Fault::WrongId(0x6B));
    let mut sensor = Lsm6dsox::new(part.spi(), PRESET);
    let error = sensor.init(&mut part.delay()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "WHO_AM_I (0x0F): read 0x6B, expected 0x6C"
    );
}

#[test]
fn frequent_bit_flips_stop_init_at_a_register_it_names() {
    let part = part(QUIET);
    part.inject(Fault::BitFlips {
        per_million: 100_000,
    });
    let mut sensor = Lsm6dsox::new(part.spi(), PRESET);
    assert!(matches!(
        sensor.init(&mut part.delay()),
        Err(Error::Identity { .. } | Error::ReadBack { .. } | Error::ResetTimeout { .. })
    ));
}

#[test]
fn rare_bit_flips_show_in_the_status_of_some_samples() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    part.inject(Fault::BitFlips { per_million: 1_000 });
    let refused = (0..10_000)
        .filter(|_| {
            part.advance_by(MILLISECOND);
            sensor.sample().is_err()
        })
        .count();
    // Five reserved bits, one in a thousand each.
    assert!((25..=75).contains(&refused), "{refused}");
}

#[test]
fn a_reset_in_mid_run_gives_stale_samples_and_names_the_register_that_lost_its_value() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    sensor.sample().unwrap();
    part.inject(Fault::Reset);
    for _ in 0..100 {
        part.advance_by(MILLISECOND);
        assert!(!sensor.sample().unwrap().is_fresh());
    }
    let error = sensor.verify().unwrap_err();
    assert_eq!(error.to_string(), "CTRL9_XL (0x18): wrote 0xE2, read 0xE0");
    sensor.init(&mut part.delay()).unwrap();
    part.advance_by(MILLISECOND);
    assert!(sensor.sample().unwrap().is_fresh());
}

#[test]
fn a_lost_data_ready_leaves_samples_fresh_for_whoever_stops_waiting() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    part.inject(Fault::DataReadyLost);
    for _ in 0..100 {
        assert_eq!(part.next_rising_edge_ns(Pin::Int1), None);
        assert!(!part.pin_is_high(Pin::Int1));
        part.advance_by(MILLISECOND);
        assert!(sensor.sample().unwrap().is_fresh());
    }
}

#[test]
fn edges_of_a_storm_without_a_sample_behind_them_give_stale_samples() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    part.inject(Fault::DataReadyStorm { period_ns: 15_000 });
    let mut fresh = 0;
    for _ in 0..1_000 {
        part.advance_to(part.next_rising_edge_ns(Pin::Int1).unwrap());
        assert!(part.pin_is_high(Pin::Int1));
        fresh += u32::from(sensor.sample().unwrap().is_fresh());
    }
    // Ten edges to a sample.
    assert!((99..=101).contains(&fresh), "{fresh}");
}

#[test]
fn frozen_outputs_say_they_are_fresh_and_the_detector_knows_better() {
    let noisy = PartOptions {
        noise: true,
        ..QUIET
    };
    let part = part(noisy);
    let mut sensor = sensor(&part, PRESET);
    let mut detector = FrozenDetector::new();
    for _ in 0..5_000 {
        part.advance_by(MILLISECOND);
        assert!(!detector.update(&sensor.sample().unwrap()));
    }
    part.inject(Fault::FrozenOutput);
    let noticed = (0..20).position(|_| {
        part.advance_by(MILLISECOND);
        let sample = sensor.sample().unwrap();
        assert!(sample.is_fresh());
        detector.update(&sample)
    });
    assert_eq!(noticed, Some(usize::from(FrozenDetector::REPEATS) - 1));
}

#[test]
fn saturated_codes_are_flagged_and_not_hidden() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    assert!(!sensor.sample().unwrap().is_saturated());
    part.inject(Fault::Saturation);
    part.advance_by(MILLISECOND);
    let raw = sensor.sample().unwrap();
    assert_eq!(raw.specific_force.saturated(), [true; 3]);
    assert_eq!(raw.angular_rate.saturated(), [true; 3]);
    let sample = raw.to_si();
    assert!(sample.accel_saturated && sample.gyro_saturated);
    assert!(sample.specific_force[0] > 156.0);
}

#[test]
fn a_clock_three_per_cent_slow_still_gives_a_fresh_sample_each_millisecond() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    part.inject(Fault::ClockRatio(0.97));
    let before = sensor.timestamp().unwrap();
    for _ in 0..1_000 {
        part.advance_by(MILLISECOND);
        assert!(sensor.sample().unwrap().is_fresh());
    }
    // The timestamp tells, the trim does not.
    let steps = sensor.timestamp().unwrap().steps_since(before);
    assert!(steps.abs_diff(38_800) <= 1, "{steps}");
    assert_eq!(sensor.frequency_fine().unwrap().0, 0);
}

#[test]
fn a_clock_at_a_tenth_of_its_rate_gives_stale_samples() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    part.inject(Fault::ClockRatio(0.1));
    let fresh = (0..1_000)
        .filter(|_| {
            part.advance_by(MILLISECOND);
            sensor.sample().unwrap().is_fresh()
        })
        .count();
    assert!((660..=670).contains(&fresh), "{fresh}");
}

#[test]
fn a_part_is_sound_again_when_its_faults_are_gone() {
    let part = part(QUIET);
    for fault in [
        Fault::MisoStuckLow,
        Fault::MisoStuckHigh,
        Fault::BitFlips {
            per_million: 500_000,
        },
        Fault::WrongId(0),
        Fault::DataReadyLost,
        Fault::DataReadyStorm { period_ns: 1_000 },
        Fault::FrozenOutput,
        Fault::Saturation,
        Fault::ClockRatio(0.1),
    ] {
        part.inject(fault);
    }
    part.with(Part::clear_faults);
    let mut sensor = sensor(&part, PRESET);
    let sample = sensor.sample().unwrap();
    assert!(sample.is_fresh() && !sample.is_saturated());
}
