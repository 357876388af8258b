//! Faults of the part, and their detection by the driver.

use crate::common::{QUIET, part, sensor};
use embedded_hal::spi::{self, Operation, SpiDevice};
use lsm6dsox::sim::{Part, PartFault, PartOptions, SharedPart, SimSpi};
use lsm6dsox::{BusSpeed, Config, Error, FrozenDetector, Lsm6dsox, Pin, SetBusSpeed, register};

const MILLISECOND: u64 = 1_000_000;
const PRESET: Config = Config::FRESH_KILOHERTZ;

#[test]
fn data_line_stuck_low_after_init_gives_stale_samples() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    part.inject(PartFault::MisoStuckLow);
    let sample = sensor.sample().unwrap();
    assert!(!sample.status.accel_fresh() && !sample.status.gyro_fresh());
    assert!(matches!(
        sensor.verify(),
        Err(Error::ReadBack { register: register::CTRL9_XL, written: 0xE2, read: 0x00 })
    ));
}

#[test]
fn data_line_stuck_high_reads_identity_0xff_and_no_samples() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    part.inject(PartFault::MisoStuckHigh);
    assert_eq!(sensor.sample(), Err(Error::Status { register: register::STATUS_REG, read: 0xFF }));
    assert_eq!(sensor.init(&mut part.delay()), Err(Error::Identity { read: 0xFF }));
}

#[test]
fn reset_in_mid_run_gives_stale_samples_and_fails_verify() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    sensor.sample().unwrap();
    part.inject(PartFault::Reset);
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

/// A bus on which the first readings of `CTRL3_C` fail, as if the part did not answer during its reset.
struct Deaf {
    spi: SimSpi,
    left: usize,
}

#[derive(Debug, PartialEq)]
struct NoAnswer;

impl spi::Error for NoAnswer {
    fn kind(&self) -> spi::ErrorKind {
        spi::ErrorKind::Other
    }
}

impl spi::ErrorType for Deaf {
    type Error = NoAnswer;
}

impl SpiDevice for Deaf {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), NoAnswer> {
        const READ: u8 = register::CTRL3_C.read_address();
        if let [Operation::TransferInPlace([READ, ..])] = operations
            && let Some(left) = self.left.checked_sub(1)
        {
            self.left = left;
            return Err(NoAnswer);
        }
        self.spi.transaction(operations).map_err(|never| match never {})
    }
}

#[test]
fn part_that_does_not_answer_during_its_reset_starts() {
    for (left, started) in [(1, Ok(())), (20, Ok(())), (100, Err(Error::Bus(NoAnswer)))] {
        let part = part(QUIET);
        let mut sensor = Lsm6dsox::new(Deaf { spi: part.spi(), left }, PRESET);
        assert_eq!(sensor.init(&mut part.delay()), started, "{left}");
    }
}

#[test]
fn frozen_outputs_are_detected_although_marked_fresh() {
    let noisy = PartOptions { noise: true, ..QUIET };
    let part = part(noisy);
    let mut sensor = sensor(&part, PRESET);
    let mut detector = FrozenDetector::new();
    for _ in 0..5_000 {
        part.advance_by(MILLISECOND);
        assert_eq!(detector.update(&sensor.sample().unwrap()), 0);
    }
    part.inject(PartFault::FrozenOutput);
    let noticed = (0..20).position(|_| {
        part.advance_by(MILLISECOND);
        let sample = sensor.sample().unwrap();
        assert!(sample.is_fresh());
        detector.update(&sample) == FrozenDetector::EVERY_AXIS
    });
    assert_eq!(noticed, Some(usize::from(FrozenDetector::REPEATS) - 1));
}

#[test]
fn init_recovers_from_another_bank_and_3_wire_spi() {
    for (register, bits) in [
        (register::FUNC_CFG_ACCESS, 0x80),
        (register::FUNC_CFG_ACCESS, 0x40),
        (register::FUNC_CFG_ACCESS, 0xC0),
        (register::CTRL3_C, 0x08),
    ] {
        let part = part(QUIET);
        let mut sensor = sensor(&part, PRESET);
        part.inject(PartFault::RegisterFlipped { address: register.address, bits });
        let name = register.name;
        let identity = sensor.check_identity();
        assert_eq!(identity, Err(Error::Identity { read: 0x00 }), "{name}");
        assert!(sensor.verify().is_err(), "{name}");
        assert_eq!(sensor.init(&mut part.delay()), Ok(()), "{name}");
        part.advance_by(MILLISECOND);
        assert!(sensor.sample().unwrap().is_fresh(), "{name}");
    }
}

#[test]
fn every_bit_that_invalidates_data_is_read_back() {
    // Self-test, high-pass filter, low power, user offsets, sleep, pins: every bit of every register
    // that can be written.
    let writable =
        register::ALL.iter().filter(|register| register.access == register::Access::ReadWrite);
    for register in writable {
        for bit in (0..8).filter(|bit| register.mask & 1 << bit != 0) {
            let part = part(QUIET);
            let mut sensor = sensor(&part, PRESET);
            part.inject(PartFault::RegisterFlipped { address: register.address, bits: 1 << bit });
            let name = register.name;
            assert!(sensor.verify().is_err(), "{name}, bit {bit}");
            assert_eq!(sensor.init(&mut part.delay()), Ok(()), "{name}, bit {bit}");
        }
    }
}

#[test]
fn reserved_bits_are_not_read_back() {
    let part = Part::with_options(crate::common::at_rest, QUIET).shared();
    part.inject(PartFault::ReservedBits);
    let mut sensor = Lsm6dsox::new(part.spi(), PRESET);
    assert_eq!(sensor.init(&mut part.delay()), Ok(()));
    assert_eq!(sensor.verify(), Ok(()));
    part.advance_by(MILLISECOND);
    assert!(sensor.sample().unwrap().is_fresh());
}

#[test]
fn the_first_sample_after_init_is_that_of_a_settled_gyroscope() {
    let part = Part::with_options(crate::common::at_rest, QUIET).shared();
    let mut sensor = Lsm6dsox::new(part.spi(), PRESET);
    sensor.init(&mut part.delay()).unwrap();
    part.advance_by(MILLISECOND);
    assert_eq!(sensor.sample().unwrap().angular_rate.codes, [0; 3]);
}

#[test]
fn slow_data_line_is_one_bit_late_until_the_clock_is_halved() {
    for (ns, late) in [(50, false), (95, false), (96, true), (100, true)] {
        let part = part(QUIET);
        part.inject(PartFault::SdoDelay { ns });
        let mut spi = part.spi();
        spi.set_bus_speed(BusSpeed::Full);
        let mut sensor = Lsm6dsox::new(spi, PRESET);
        let read = sensor.init(&mut part.delay());
        let expected = if late { Err(Error::Identity { read: 0x6C >> 1 }) } else { Ok(()) };
        assert_eq!(read, expected, "{ns} ns");
        part.spi().set_bus_speed(BusSpeed::Reduced);
        assert_eq!(sensor.init(&mut part.delay()), Ok(()), "{ns} ns");
    }
}

/// Waits for the middle of a pulse on INT1.
fn wait_for_pulse(part: &SharedPart) {
    part.advance_to(part.next_rising_edge_ns(Pin::Int1).unwrap() + 20_000);
    assert!(part.pin_is_high(Pin::Int1));
}

#[test]
fn init_ends_i3c_mode_from_power_up_or_a_reset_in_mid_pulse() {
    let enters: [fn(&SharedPart); 3] = [
        |part| part.inject(PartFault::Int1High),
        |part| {
            wait_for_pulse(part);
            part.with(Part::host_reset);
        },
        |part| {
            wait_for_pulse(part);
            let reset = [register::CTRL3_C.address, 0x05];
            part.spi().write(&reset).unwrap();
            part.advance_by(MILLISECOND);
        },
    ];
    // The line at rest reads either.
    for (enter, read) in enters.iter().flat_map(|enter| [(enter, 0x00), (enter, 0xFF)]) {
        let options = PartOptions { open_line: read, ..QUIET };
        let part = part(options);
        let mut sensor = sensor(&part, PRESET);
        enter(&part);
        assert_eq!(sensor.check_identity(), Err(Error::Identity { read }));
        sensor.init(&mut part.delay()).unwrap();
        part.advance_by(MILLISECOND);
        assert!(sensor.sample().unwrap().is_fresh());
    }
}

#[test]
fn init_and_self_test_do_not_enter_i3c_mode_in_mid_pulse() {
    let part = part(QUIET);
    let mut sensor = sensor(&part, PRESET);
    for phase in 0..10 {
        wait_for_pulse(&part);
        part.advance_by(phase * 15_000);
        assert_eq!(sensor.init(&mut part.delay()), Ok(()), "{phase}");
    }
    wait_for_pulse(&part);
    assert!(sensor.self_test(&mut part.delay()).is_ok());
}
