use super::*;
use std::string::ToString;

fn refused(change: impl FnOnce(&mut Params)) -> &'static str {
    let mut params = Params::FRESH_KILOHERTZ;
    change(&mut params);
    params.validate().map_or_else(|error| error.field, |_| "")
}

fn value_of(params: &Params, register: Register) -> u8 {
    let config = params.validate().unwrap();
    let mut found = config.writes().filter(|w| *w.register == register);
    let value = found.next().unwrap().value;
    assert!(found.next().is_none(), "{} is written twice", register.name);
    value
}

#[test]
fn the_presets_cut_offs_match_and_lie_below_500_hz() {
    let accel = Config::FRESH_KILOHERTZ.accel_cutoff().unwrap();
    let gyro = Config::FRESH_KILOHERTZ.gyro_cutoff().unwrap();
    assert!((accel - 333.35).abs() < 0.01 && gyro == 335.0);
}

#[test]
fn unsupported_setting_is_rejected_with_its_field_name() {
    assert_eq!(refused(|p| p.gyro.odr = Odr::Hz1_6), "gyro.odr");
    assert_eq!(refused(|p| p.accel.odr = Odr::Hz1_6), "accel.filter");
    assert_eq!(refused(|p| p.gyro.odr = Odr::Off), "data_ready.sensor");
    assert_eq!(
        refused(|p| {
            p.gyro.odr = Odr::Off;
            p.accel.odr = Odr::Off;
        }),
        "accel.odr"
    );
}

#[test]
fn the_message_names_the_field_and_the_problem() {
    let mut params = Params::FRESH_KILOHERTZ;
    params.gyro.odr = Odr::Hz1_6;
    assert_eq!(
        params.validate().unwrap_err().to_string(),
        "gyro.odr: the gyroscope has no 1.6 Hz rate"
    );
}

#[test]
fn no_configuration_touches_a_reserved_bit() {
    for odr in Odr::ALL {
        for full_scale in GyroFullScale::ALL {
            for ftype in Ftype::ALL {
                let mut params = Params::FRESH_KILOHERTZ;
                params.gyro.odr = odr;
                params.gyro.full_scale = full_scale;
                params.gyro.filter = GyroFilter::Lpf1(ftype);
                let Ok(config) = params.validate() else {
                    continue;
                };
                for Write { register, value } in config.writes() {
                    assert!(register.keeps_reserved_bits(value), "{}", register.name);
                }
            }
        }
    }
}

#[test]
fn full_scales_use_the_codes_of_st() {
    let mut params = Params::FRESH_KILOHERTZ;
    for (full_scale, value) in AccelFullScale::ALL.into_iter().zip([0xA2, 0xAA, 0xAE, 0xA6]) {
        params.accel.full_scale = full_scale;
        assert_eq!(value_of(&params, register::CTRL1_XL), value, "{full_scale:?}");
    }
    let values = [0xA2, 0xA0, 0xA4, 0xA8, 0xAC];
    for (full_scale, value) in GyroFullScale::ALL.into_iter().zip(values) {
        params.gyro.full_scale = full_scale;
        assert_eq!(value_of(&params, register::CTRL2_G), value, "{full_scale:?}");
    }
}

#[test]
fn the_data_ready_pin_is_driven_by_the_chosen_sensor_alone() {
    let mut params = Params::FRESH_KILOHERTZ;
    assert_eq!(value_of(&params, register::INT1_CTRL), 0x02);
    assert_eq!(value_of(&params, register::INT2_CTRL), 0x00);
    assert_eq!(value_of(&params, register::COUNTER_BDR_REG1), 0x80);
    params.data_ready =
        Some(DataReady { sensor: Sensor::Accel, pin: Pin::Int2, mode: DataReadyMode::Latched });
    assert_eq!(value_of(&params, register::INT1_CTRL), 0x00);
    assert_eq!(value_of(&params, register::INT2_CTRL), 0x01);
    assert_eq!(value_of(&params, register::COUNTER_BDR_REG1), 0x00);
}
