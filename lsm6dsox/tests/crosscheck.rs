//! Cross-check of the simulated part and our driver against drivers by others.
//!
//! `lsm6dsox` 2.1.0 of crates.io speaks I²C only, so it goes to the part through I²C framing
//! while ours uses SPI; both read the same sample. At ±16 g its factor is wrong;
//! there `lsm6dso` 0.2.1, for a sibling, takes its place.

mod common;

use accelerometer::Accelerometer as _;
use common::QUIET;
use embedded_hal::spi::SpiDevice as _;
use lsm6dsox::register::Register;
use lsm6dsox::sample::SAMPLE_BYTES;
use lsm6dsox::scale::STANDARD_GRAVITY;
use lsm6dsox::sim::{Part, SharedPart, SimDelay, SimI2c, Stimulus};
use lsm6dsox::{
    AccelFilter, AccelFullScale, Config, GyroFilter, GyroFullScale, Lsm6dsox, Odr, Params,
    RawSample, Sample, register,
};
use peer_lsm6dsox::{AccelerometerScale, DataRate, GyroscopeScale, SlaveAddress};

type Peer = peer_lsm6dsox::Lsm6dsox<SimI2c, SimDelay>;

const TRUTH: Stimulus = Stimulus {
    specific_force: [3.3, -5.1, 8.7],
    angular_rate: [0.31, -1.3, 1.9],
    temperature: 33.25,
};

const ACCEL: [(AccelFullScale, AccelerometerScale); 3] = [
    (AccelFullScale::G2, AccelerometerScale::Accel2g),
    (AccelFullScale::G4, AccelerometerScale::Accel4g),
    (AccelFullScale::G8, AccelerometerScale::Accel8g),
];

const GYRO: [(GyroFullScale, GyroscopeScale); 5] = [
    (GyroFullScale::Dps125, GyroscopeScale::Dps125),
    (GyroFullScale::Dps250, GyroscopeScale::Dps250),
    (GyroFullScale::Dps500, GyroscopeScale::Dps500),
    (GyroFullScale::Dps1000, GyroscopeScale::Dps1000),
    (GyroFullScale::Dps2000, GyroscopeScale::Dps2000),
];

fn part() -> SharedPart {
    let part = Part::with_options(|_: f64| TRUTH, QUIET).shared();
    part.advance_by(10_000_000);
    part
}

fn peer(part: &SharedPart) -> Peer {
    Peer::new(part.i2c(), SlaveAddress::Low, part.delay())
}

/// Configuration of the peer, expressed in our settings.
fn config(accel: AccelFullScale, gyro: GyroFullScale) -> Config {
    let mut params = Params {
        data_ready: None,
        timestamp: false,
        ..Params::FRESH_KILOHERTZ
    };
    params.accel.odr = Odr::Hz208;
    params.accel.full_scale = accel;
    params.accel.filter = AccelFilter::OdrDiv2;
    params.gyro.odr = Odr::Hz208;
    params.gyro.full_scale = gyro;
    params.gyro.filter = GyroFilter::Lpf2;
    params.validate().unwrap()
}

/// Checks that the part's registers hold the values that our driver would write.
fn holds(part: &SharedPart, config: &Config, registers: &[Register]) {
    for write in config.writes() {
        if registers.contains(write.register) {
            let mut frame = [write.register.read_address(), 0];
            part.spi().transfer_in_place(&mut frame).unwrap();
            assert_eq!(frame[1], write.value, "{}", write.register.name);
        }
    }
}

/// The current sample, decoded by our codec: our driver returns no samples of a part that it has not
/// configured itself.
fn taken_apart(part: &SharedPart, config: &Config) -> Sample {
    let mut frame = [0; SAMPLE_BYTES + 1];
    frame[0] = register::STATUS_REG.read_address();
    part.spi().transfer_in_place(&mut frame).unwrap();
    let bytes = frame[1..].try_into().unwrap();
    RawSample::decode(bytes, config).unwrap().to_si()
}

/// Checks that both drivers read the current sample alike.
fn agree(part: &SharedPart, peer: &mut Peer, config: Config) {
    part.advance_by(200_000_000);
    let force = peer.accel_norm().unwrap();
    let rate = peer.angular_rate().unwrap();
    let temperature = peer.temperature().unwrap();
    let ours = taken_apart(part, &config);
    let near = |a: f32, b: f64| (f64::from(a) - b).abs() <= 3.0e-6 * b.abs();
    for (ours, theirs) in ours
        .specific_force
        .into_iter()
        .zip([force.x, force.y, force.z])
    {
        let theirs = f64::from(theirs) * f64::from(STANDARD_GRAVITY);
        assert!(near(ours, theirs), "{ours} m/s², {theirs} m/s²");
    }
    for (ours, theirs) in ours.angular_rate.into_iter().zip([rate.x, rate.y, rate.z]) {
        let theirs = theirs.as_radians_per_second();
        assert!(near(ours, theirs), "{ours} rad/s, {theirs} rad/s");
    }
    assert!(near(ours.temperature, temperature.as_celsius()));
}

#[test]
fn peer_accepts_the_parts_identity() {
    assert_eq!(peer(&part()).check_id(), Ok(0x6C));
}

#[test]
fn both_read_the_same_after_the_peer_configures() {
    for (accel, peer_accel) in ACCEL {
        for (gyro, peer_gyro) in GYRO {
            let part = part();
            let mut peer = peer(&part);
            peer.setup().unwrap();
            peer.set_accel_sample_rate(DataRate::Freq208Hz).unwrap();
            peer.set_accel_scale(peer_accel).unwrap();
            peer.set_gyro_sample_rate(DataRate::Freq208Hz).unwrap();
            peer.set_gyro_scale(peer_gyro).unwrap();
            let config = config(accel, gyro);
            holds(&part, &config, &[register::CTRL1_XL, register::CTRL2_G]);
            agree(&part, &mut peer, config);
        }
    }
}

#[test]
fn both_read_the_same_after_our_driver_configures() {
    for (accel, peer_accel) in ACCEL {
        let part = part();
        let config = config(accel, GyroFullScale::Dps1000);
        let mut ours = Lsm6dsox::new(part.spi(), config);
        ours.init(&mut part.delay()).unwrap();
        // Our driver has switched I²C off; it is enabled again for the peer.
        let mut peer = peer(&part);
        assert!(peer.check_id().is_err());
        part.spi()
            .write(&[register::CTRL4_C.address, 0x00])
            .unwrap();
        peer.set_accel_scale(peer_accel).unwrap();
        peer.set_gyro_scale(GyroscopeScale::Dps1000).unwrap();
        agree(&part, &mut peer, config);
    }
}

#[test]
fn peer_reads_1_376_g_for_1_g_at_16_g() {
    let part = part();
    let mut peer = peer(&part);
    peer.setup().unwrap();
    peer.set_accel_sample_rate(DataRate::Freq208Hz).unwrap();
    peer.set_accel_scale(AccelerometerScale::Accel16g).unwrap();
    part.advance_by(200_000_000);
    let theirs = peer.accel_norm().unwrap().z;
    let truth = TRUTH.specific_force[2] as f32 / STANDARD_GRAVITY;
    assert!((theirs / truth - 1.376).abs() < 0.001);
}

/// `lsm6dso` 0.2.1, for a register-compatible sibling of the same identity, has ST's factor at
/// ±16 g and the accelerometer's filter: it can follow the kilohertz preset.
#[test]
fn preset_set_by_a_siblings_driver_matches_ours() {
    let part = part();
    let mut sibling = lsm6dso::Lsm6dso::new(part.i2c(), SimI2c::ADDRESS);
    sibling.check().unwrap();
    sibling
        .set_accelerometer_output(lsm6dso::AccelerometerOutput::Rate6_66k)
        .unwrap();
    sibling
        .set_accelerometer_scale(lsm6dso::AccelerometerScale::G16)
        .unwrap();
    sibling
        .set_accelerometer_low_pass(Some(lsm6dso::Bandwidth::OdrDiv20))
        .unwrap();
    sibling
        .set_gyroscope_output(lsm6dso::GyroscopeOutput::Rate6_66k)
        .unwrap();
    sibling
        .set_gyroscope_scale(lsm6dso::GyroscopeFullScale::Dps2000)
        .unwrap();
    holds(
        &part,
        &Config::FRESH_KILOHERTZ,
        &[register::CTRL1_XL, register::CTRL2_G, register::CTRL8_XL],
    );
    part.advance_by(200_000_000);
    assert!(sibling.accel_data_available().unwrap() && sibling.gyro_data_available().unwrap());
    let theirs = sibling.read_all().unwrap();
    let ours = taken_apart(&part, &Config::FRESH_KILOHERTZ);
    let pairs = [
        (ours.temperature, theirs.temp),
        (ours.specific_force[0], theirs.accel_x),
        (ours.specific_force[1], theirs.accel_y),
        (ours.specific_force[2], theirs.accel_z),
        (ours.angular_rate[0], theirs.gyro_x),
        (ours.angular_rate[1], theirs.gyro_y),
        (ours.angular_rate[2], theirs.gyro_z),
    ];
    for (ours, theirs) in pairs {
        assert!(
            (ours - theirs).abs() <= 1.0e-6 * theirs.abs(),
            "{ours}, {theirs}"
        );
    }
}
