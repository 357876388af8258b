//! Readings of the same bytes by third-party drivers, recorded on the simulated part: `lsm6dsox` 2.1.0 of crates.io, and
//! `lsm6dso` 0.2.1 at ±16 g, where the former has a wrong factor. `lsm6dso` is for a register-compatible sibling.

use lsm6dsox::sample::SAMPLE_BYTES;
use lsm6dsox::scale::STANDARD_GRAVITY;
use lsm6dsox::{
    AccelFilter, AccelFullScale, Config, GyroFilter, GyroFullScale, Odr, Params, RawSample,
};

/// Bytes of the accelerometer's three words, and the reading, g.
const ACCEL: [(AccelFullScale, [u8; 6], [f32; 3]); 4] = [
    (AccelFullScale::G2, [140, 21, 179, 222, 207, 56], [0.336_476, -0.520_025, 0.887_123]),
    (AccelFullScale::G4, [198, 10, 89, 239, 104, 28], [0.336_476, -0.520_086, 0.887_184]),
    (AccelFullScale::G8, [99, 5, 173, 247, 52, 14], [0.336_476, -0.519_964, 0.887_184]),
    (AccelFullScale::G16, [178, 2, 214, 251, 26, 7], [0.336_720, -0.520_208, 0.887_184]),
];

/// Bytes of the gyroscope's three words, and the reading, rad/s.
const GYRO: [(GyroFullScale, [u8; 6], [f32; 3]); 5] = [
    (GyroFullScale::Dps125, [220, 15, 127, 189, 51, 97], [0.310_014_1, -1.299_997_6, 1.900_02]),
    (GyroFullScale::Dps250, [238, 7, 191, 222, 153, 48], [0.310_014_1, -1.300_073_9, 1.899_943_6]),
    (GyroFullScale::Dps500, [247, 3, 96, 239, 77, 24], [0.310_014_1, -1.299_921_3, 1.900_096_2]),
    (GyroFullScale::Dps1000, [251, 1, 176, 247, 38, 12], [0.309_708_7, -1.299_921_3, 1.899_790_8]),
    (GyroFullScale::Dps2000, [254, 0, 216, 251, 19, 6], [0.310_319_5, -1.299_921_3, 1.899_790_8]),
];

/// Bytes of the temperature, and the reading, °C.
const TEMPERATURE: ([u8; 2], f32) = ([64, 8], 33.25);

fn config(accel: AccelFullScale, gyro: GyroFullScale) -> Config {
    let mut params = Params::FRESH_KILOHERTZ;
    params.accel.odr = Odr::Hz208;
    params.accel.full_scale = accel;
    params.accel.filter = AccelFilter::OdrDiv2;
    params.gyro.odr = Odr::Hz208;
    params.gyro.full_scale = gyro;
    params.gyro.filter = GyroFilter::Lpf2;
    params.validate().unwrap()
}

#[test]
fn readings_are_those_of_other_drivers_at_every_full_scale() {
    for (accel, force_bytes, force) in ACCEL {
        for (gyro, rate_bytes, rate) in GYRO {
            let bytes = [&[7, 0][..], &TEMPERATURE.0, &rate_bytes, &force_bytes].concat();
            let bytes: [u8; SAMPLE_BYTES] = bytes.try_into().unwrap();
            let raw = RawSample::decode(&bytes, &config(accel, gyro)).unwrap();
            let ours = raw.to_si();
            let theirs = force.map(|g| g * STANDARD_GRAVITY).into_iter().chain(rate);
            let values = ours.specific_force.into_iter().chain(ours.angular_rate);
            for (ours, theirs) in values.zip(theirs) {
                let is_near = (ours - theirs).abs() <= 3.0e-6 * theirs.abs();
                assert!(is_near, "{accel:?}, {gyro:?}: {ours}, {theirs}");
            }
            assert_eq!(ours.temperature, TEMPERATURE.1);
        }
    }
}
