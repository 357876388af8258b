//! Exact bytes on the bus, checked against a mock.

use embedded_hal_mock::eh1::delay::{CheckedDelay, NoopDelay, Transaction as Delay};
use embedded_hal_mock::eh1::spi::{Mock, Transaction};
use lsm6dsox::{Config, Error, Lsm6dsox, register};

/// A transfer of one frame: bytes sent, bytes received.
fn frame(out: &[u8], back: &[u8]) -> Vec<Transaction<u8>> {
    vec![
        Transaction::transaction_start(),
        Transaction::transfer_in_place(out.to_vec(), back.to_vec()),
        Transaction::transaction_end(),
    ]
}

fn write(address: u8, value: u8) -> Vec<Transaction<u8>> {
    vec![
        Transaction::transaction_start(),
        Transaction::write_vec(vec![address, value]),
        Transaction::transaction_end(),
    ]
}

fn read(address: u8, value: u8) -> Vec<Transaction<u8>> {
    frame(&[address | 0x80, 0], &[0, value])
}

/// The kilohertz preset: foreign interfaces off, pins, filters, data rates last.
const PRESET: [(u8, u8); 23] = [
    (0x01, 0x00), // FUNC_CFG_ACCESS: the bank of all that follows
    (0x18, 0xE2), // CTRL9_XL: I3C off
    (0x13, 0x06), // CTRL4_C: I²C off, gyroscope LPF1 on
    (0x12, 0x44), // CTRL3_C: block data update, address increment
    (0x62, 0x00), // I3C_BUS_AVB
    (0x0B, 0x80), // COUNTER_BDR_REG1: data-ready pulsed
    (0x0D, 0x02), // INT1_CTRL: gyroscope's data-ready
    (0x0E, 0x00), // INT2_CTRL
    (0x15, 0x00), // CTRL6_C: FTYPE 000, 335 Hz
    (0x17, 0x40), // CTRL8_XL: ODR/20
    (0x02, 0x3F), // PIN_CTRL: as after a reset
    (0x14, 0x00), // CTRL5_C: no self-test
    (0x16, 0x00), // CTRL7_G: no high-pass filter, full performance
    (0x73, 0x00), // X_OFS_USR
    (0x74, 0x00), // Y_OFS_USR
    (0x75, 0x00), // Z_OFS_USR
    (0x19, 0x20), // CTRL10_C: timestamp on
    (0x07, 0x00), // FIFO_CTRL1
    (0x08, 0x00), // FIFO_CTRL2
    (0x09, 0x00), // FIFO_CTRL3
    (0x0A, 0x00), // FIFO_CTRL4: bypass
    (0x11, 0xAC), // CTRL2_G: 6667 Hz, ±2000 °/s
    (0x10, 0xA6), // CTRL1_XL: 6667 Hz, ±16 g, LPF2 on
];

/// Transfers that make the registers readable and read the identity.
fn identity(id: u8) -> Vec<Transaction<u8>> {
    [write(0x01, 0x00), write(0x0D, 0x00), write(0x18, 0xE2), write(0x12, 0x44), read(0x0F, id)]
        .concat()
}

/// Begin of a reset: gyroscope off, accelerometer in high-performance mode, `SW_RESET`.
fn reset() -> Vec<Transaction<u8>> {
    [write(0x11, 0x00), write(0x15, 0x00), write(0x12, 0x05)].concat()
}

fn init_until_written() -> Vec<Transaction<u8>> {
    let mut bytes = identity(0x6C);
    bytes.extend(reset());
    bytes.extend(read(0x12, 0x05));
    bytes.extend(read(0x12, 0x04));
    bytes.extend(PRESET.into_iter().flat_map(|(a, v)| write(a, v)));
    bytes
}

fn init() -> Vec<Transaction<u8>> {
    let mut bytes = init_until_written();
    bytes.extend(PRESET.into_iter().flat_map(|(a, v)| read(a, v)));
    bytes
}

/// Configurations of the self-test: the preset's registers with other values.
const ACCEL_SELF_TEST: [(u8, u8); 7] = [
    (0x13, 0x04), // CTRL4_C: I²C off
    (0x0B, 0x00),
    (0x0D, 0x00),
    (0x17, 0x00),
    (0x19, 0x00),
    (0x11, 0x0C), // CTRL2_G: off
    (0x10, 0x38), // CTRL1_XL: 52 Hz, ±4 g
];
const GYRO_SELF_TEST: [(u8, u8); 7] = [
    (0x13, 0x04),
    (0x0B, 0x00),
    (0x0D, 0x00),
    (0x17, 0x00),
    (0x19, 0x00),
    (0x11, 0x5C), // CTRL2_G: 208 Hz, ±2000 °/s
    (0x10, 0x08), // CTRL1_XL: off
];

/// A fresh sample with a code for every axis.
fn sample(code: i16) -> Vec<Transaction<u8>> {
    sample_with_status(0x03, code)
}

fn sample_with_status(status: u8, code: i16) -> Vec<Transaction<u8>> {
    let mut out = [0; 17];
    out[0] = 0x9E;
    let back = [0, status, 0, 0, 0].into_iter();
    let codes = [code.to_le_bytes(); 6].into_iter().flatten();
    frame(&out, &back.chain(codes).collect::<Vec<_>>())
}

/// Half of ST's procedure: samples without and with the test signal, and the signal off again.
fn test_signal(changes: &[(u8, u8)], signal: u8, change: i16) -> Vec<Transaction<u8>> {
    let configuration = PRESET.map(|(address, value)| {
        let other = changes.iter().find(|(changed, _)| *changed == address);
        (address, other.map_or(value, |(_, other)| *other))
    });
    let mut bytes = reset();
    bytes.extend(read(0x12, 0x04));
    bytes.extend(configuration.into_iter().flat_map(|(a, v)| write(a, v)));
    bytes.extend(configuration.into_iter().flat_map(|(a, v)| read(a, v)));
    // One sample is discarded, a stale one is waited for, five count.
    bytes.extend(sample(i16::MAX));
    bytes.extend(sample_with_status(0x04, i16::MIN));
    bytes.extend([10, 20, 30, 40, 50].into_iter().flat_map(sample));
    bytes.extend(write(0x14, signal));
    bytes.extend(sample(i16::MIN));
    let codes = [50, 40, 30, 20, 10].map(|code| code + change);
    bytes.extend(codes.into_iter().flat_map(sample));
    bytes.extend(write(0x14, 0x00));
    bytes
}

#[test]
fn the_self_test_is_sts_procedure_and_then_init() {
    let mut bytes = identity(0x6C);
    // ST_XL negative; ST_G positive.
    bytes.extend(test_signal(&ACCEL_SELF_TEST, 0x02, -4000));
    bytes.extend(test_signal(&GYRO_SELF_TEST, 0x04, 5000));
    bytes.extend(init());
    let mut spi = Mock::new(&bytes);
    let half =
        [Delay::delay_us(100), Delay::delay_ms(100), Delay::delay_ms(1), Delay::delay_ms(100)];
    let mut delay = CheckedDelay::new(&[&half[..], &half, &init_delays()].concat());
    let mut sensor = Lsm6dsox::new(spi.clone(), Config::FRESH_KILOHERTZ);
    let result = sensor.self_test(&mut delay).unwrap();
    // Sensitivities of 0.122 mg and 70 m°/s per code.
    for force in result.specific_force {
        assert!((force - 4.0 * 0.122 * 9.806_65).abs() < 1e-4, "{force}");
    }
    for rate in result.angular_rate {
        assert!((rate - 350.0_f32.to_radians()).abs() < 1e-4, "{rate}");
    }
    assert!(result.passed());
    spi.done();
    delay.done();
}

/// Delays of init: boot, two polls of the reset, and the gyroscope's turn-on.
fn init_delays() -> Vec<Delay> {
    [10_000, 100, 100, 80_000].map(Delay::delay_us).to_vec()
}

#[test]
fn init_waits_for_the_boot_and_for_the_turn_on() {
    let mut spi = Mock::new(&init());
    let mut delay = CheckedDelay::new(&init_delays());
    let mut sensor = Lsm6dsox::new(spi.clone(), Config::FRESH_KILOHERTZ);
    assert_eq!(sensor.init(&mut delay), Ok(()));
    spi.done();
    delay.done();
}

/// An initialised driver, before the given bytes.
fn brought_up(bytes: Vec<Transaction<u8>>) -> (Mock<u8>, Lsm6dsox<Mock<u8>>) {
    let spi = Mock::new(&[init(), bytes].concat());
    let mut sensor = Lsm6dsox::new(spi.clone(), Config::FRESH_KILOHERTZ);
    assert_eq!(sensor.init(&mut NoopDelay::new()), Ok(()));
    (spi, sensor)
}

#[test]
fn lost_write_is_reported_with_both_values() {
    let mut bytes = init_until_written();
    let until_ctrl6 = PRESET.into_iter().take(8);
    bytes.extend(until_ctrl6.flat_map(|(a, v)| read(a, v)));
    bytes.extend(read(0x15, 0x10));
    let mut spi = Mock::new(&bytes);
    let mut sensor = Lsm6dsox::new(spi.clone(), Config::FRESH_KILOHERTZ);
    assert_eq!(
        sensor.init(&mut NoopDelay::new()),
        Err(Error::ReadBack { register: register::CTRL6_C, written: 0x00, read: 0x10 })
    );
    spi.done();
}

#[test]
fn part_with_another_identity_is_not_configured() {
    let reset = [reset(), read(0x12, 0x04)].concat();
    let mut spi = Mock::new(&[identity(0x6B), reset, read(0x0F, 0x6B)].concat());
    let mut sensor = Lsm6dsox::new(spi.clone(), Config::FRESH_KILOHERTZ);
    assert_eq!(sensor.init(&mut NoopDelay::new()), Err(Error::Identity { read: 0x6B }));
    spi.done();
}

#[test]
fn endless_reset_times_out() {
    let mut bytes = identity(0x6C);
    bytes.extend(reset());
    bytes.extend((0..100).flat_map(|_| read(0x12, 0x05)));
    let mut spi = Mock::new(&bytes);
    let mut sensor = Lsm6dsox::new(spi.clone(), Config::FRESH_KILOHERTZ);
    assert_eq!(
        sensor.init(&mut NoopDelay::new()),
        Err(Error::ResetTimeout { written: 0x05, read: 0x05 })
    );
    spi.done();
}

#[test]
fn a_sample_is_one_transfer_of_seventeen_bytes() {
    let mut out = [0; 17];
    out[0] = 0x9E;
    #[rustfmt::skip]
    let back = [
        0x00,
        0x07, 0x00, 0x80, 0x00,
        0x10, 0x00, 0xF0, 0xFF, 0x00, 0x02,
        0x01, 0x00, 0xFF, 0x7F, 0x01, 0x08,
    ];
    let (mut spi, mut sensor) = brought_up(frame(&out, &back));
    let raw = sensor.sample().unwrap();
    assert_eq!(raw.angular_rate.codes, [16, -16, 512]);
    assert_eq!(raw.specific_force.codes, [1, i16::MAX, 2049]);
    assert_eq!(raw.specific_force.saturated(), [false, true, false]);
    assert!(raw.is_fresh());
    assert_eq!(raw.to_si().temperature, 25.5);
    spi.done();
}

#[test]
fn power_down_is_read_back() {
    let mut bytes = write(0x10, 0);
    bytes.extend(read(0x10, 0));
    bytes.extend(write(0x11, 0));
    bytes.extend(read(0x11, 0));
    let mut spi = Mock::new(&bytes);
    let mut sensor = Lsm6dsox::new(spi.clone(), Config::FRESH_KILOHERTZ);
    assert_eq!(sensor.power_down(), Ok(()));
    spi.done();
}
