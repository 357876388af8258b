use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

use super::*;

/// All combinations of three axes.
fn all_ways() -> Vec<[SensorAxis; 3]> {
    let mut ways = Vec::new();
    for x in SensorAxis::ALL {
        for y in SensorAxis::ALL {
            ways.extend(SensorAxis::ALL.map(|z| [x, y, z]));
        }
    }
    ways
}

fn mounting(text: &str) -> Mounting {
    text.parse().expect(text)
}

fn refusal(text: &str) -> String {
    text.parse::<Mounting>().expect_err(text).to_string()
}

fn bits(vector: Vec3) -> [u32; 3] {
    [vector.x, vector.y, vector.z].map(f32::to_bits)
}

const READING: Vec3 = Vec3::new(0.25, -0.0, 9.81);

#[test]
fn axes_are_given_in_the_order_of_the_foots_axes() {
    // The foot's z is along the sensor's y.
    let mounting = mounting("x,-z,y");
    let up = Vec3::new(0.0, 9.81, 0.0);
    assert_eq!(mounting.turn(up), Vec3::new(0.0, 0.0, 9.81));
    let mut force = SpecificForce(Vec3::new(1.0, 2.0, 3.0));
    let mut rate = AngularRate(Vec3::new(4.0, 5.0, 6.0));
    mounting.apply(&mut force, &mut rate);
    assert_eq!(force.0, Vec3::new(1.0, -3.0, 2.0));
    assert_eq!(rate.0, Vec3::new(4.0, -6.0, 5.0));
}

#[test]
fn identity_mounting_keeps_every_bit_in_every_notation() {
    for text in ["x,y,z", " +x, y ,z", "1,0,0,0", "-1,0,-0,0", "0.9995,0,0,0"] {
        let mounting = mounting(text);
        assert_eq!(mounting, Mounting::IDENTITY, "{text}");
        assert_eq!(bits(mounting.turn(READING)), bits(READING));
    }
    assert_eq!(Mounting::default(), Mounting::IDENTITY);
}

#[test]
fn quaternion_rotates_like_the_equivalent_axes() {
    let half = 0.5_f32.sqrt();
    for (quaternion, axes) in [
        (format!("{half},{half},0,0"), "x,-z,y"),
        (format!("{half},0,{half},0"), "z,y,-x"),
        (format!("{half},0,0,-{half}"), "y,-x,z"),
        ("0.5,0.5,0.5,0.5".to_string(), "z,x,y"),
        ("0,1,0,0".to_string(), "x,-y,-z"),
    ] {
        let vector = Vec3::new(3.0, -5.0, 7.0);
        let difference = mounting(&quaternion).turn(vector) - mounting(axes).turn(vector);
        assert!(difference.length() < 3e-6, "{quaternion}: {difference:?}");
    }
}

#[test]
fn quaternion_with_three_decimals_is_normalised() {
    let vector = Vec3::new(3.0, -5.0, 7.0);
    let turned = mounting("0.707,0.707,0,0").turn(vector);
    assert!((turned.length() - vector.length()).abs() < 1e-5);
    assert!((turned - mounting("x,-z,y").turn(vector)).length() < 1e-5);
}

#[test]
fn mounting_round_trips_through_text() {
    for axes in all_ways() {
        let params = MountingParams::Axes(axes);
        assert_eq!(params.to_string().parse(), Ok(params));
    }
    for text in ["0.707,0.707,0,0", "0.1,-0.7,0.5,0.4998", "1e-3,0.6,0.8,0"] {
        let mounting = mounting(text);
        assert_eq!(mounting.to_string().parse(), Ok(mounting), "{text}");
        assert_eq!(mounting.params().validate(), Ok(mounting));
    }
}

#[test]
fn mirror_image_is_rejected_with_the_axis_to_flip() {
    assert_eq!(
        refusal("x,z,y"),
        "x,z,y is left-handed, and a sensor is not: flip the sign of one axis, as in x,-z,y or -x,z,y"
    );
    for axes in all_ways() {
        if let Err(MountingError::LeftHanded { axes: refused @ [x, y, z] }) =
            MountingParams::Axes(axes).validate()
        {
            assert_eq!(refused, axes);
            for flipped in [[x, y.opposite(), z], [x.opposite(), y, z]] {
                assert!(MountingParams::Axes(flipped).validate().is_ok());
            }
        }
    }
}

#[test]
fn axis_used_twice_is_rejected() {
    for text in ["x,x,z", "x,-x,z", "z,y,z"] {
        let expected = format!("{text} has an axis twice: ");
        assert!(refusal(text).starts_with(&expected), "{}", refusal(text));
    }
}

#[test]
fn quaternion_of_wrong_length_is_rejected_with_its_length() {
    assert_eq!(
        refusal("1,1,0,0"),
        "the quaternion has the length 1.4142135, allowed is 0.999 to 1.001: \
         divide its four numbers by their length"
    );
    for text in ["0,0,0,0", "nan,0,0,1", "inf,0,0,0", "1.002,0,0,0", "0,0.998,0,0"] {
        assert!(refusal(text).starts_with("the quaternion has the length"));
    }
}

#[test]
fn unreadable_text_is_rejected_with_the_expected_format() {
    for text in ["", "x", "x,y", "x,y,z,x", "x,y,w", "1,0,0", "1,0,0,0,0", "X,Y,Z", "--x,y,z"] {
        assert!(refusal(text).contains("such as x,-z,y"), "{text}");
    }
}
