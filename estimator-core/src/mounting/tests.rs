use std::format;
use std::string::{String, ToString};
use std::vec::Vec;

use super::SensorAxis::{MinusX, MinusY, MinusZ, X, Y, Z};
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

fn along(axes: [SensorAxis; 3]) -> Mounting {
    MountingParams::Axes(axes).validate().expect("possible")
}

fn quaternion([w, x, y, z]: [f32; 4]) -> Result<Mounting, MountingError> {
    MountingParams::Rotation(Quaternion { w, x, y, z }).validate()
}

fn rotation(parts: [f32; 4]) -> Mounting {
    quaternion(parts).expect("a unit quaternion")
}

fn refusal(axes: [SensorAxis; 3]) -> String {
    MountingParams::Axes(axes).validate().expect_err("impossible").to_string()
}

fn bits(vector: Vec3) -> [u32; 3] {
    [vector.x, vector.y, vector.z].map(f32::to_bits)
}

const READING: Vec3 = Vec3::new(0.25, -0.0, 9.81);

#[test]
fn axes_are_given_in_the_order_of_the_foots_axes() {
    // The foot's z is along the sensor's y.
    let mounting = along([X, MinusZ, Y]);
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
    let rotations = [[1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, -0.0, 0.0], [0.9995, 0.0, 0.0, 0.0]];
    for mounting in rotations.map(rotation).into_iter().chain([along([X, Y, Z])]) {
        assert_eq!(mounting, Mounting::IDENTITY);
        assert_eq!(bits(mounting.turn(READING)), bits(READING));
    }
    assert_eq!(Mounting::default(), Mounting::IDENTITY);
}

#[test]
fn quaternion_rotates_like_the_equivalent_axes() {
    let half = 0.5_f32.sqrt();
    for (quaternion, axes) in [
        ([half, half, 0.0, 0.0], [X, MinusZ, Y]),
        ([half, 0.0, half, 0.0], [Z, Y, MinusX]),
        ([half, 0.0, 0.0, -half], [Y, MinusX, Z]),
        ([0.5; 4], [Z, X, Y]),
        ([0.0, 1.0, 0.0, 0.0], [X, MinusY, MinusZ]),
    ] {
        let vector = Vec3::new(3.0, -5.0, 7.0);
        let difference = rotation(quaternion).turn(vector) - along(axes).turn(vector);
        assert!(difference.length() < 3e-6, "{quaternion:?}: {difference:?}");
    }
}

#[test]
fn quaternion_with_three_decimals_is_normalised() {
    let vector = Vec3::new(3.0, -5.0, 7.0);
    let turned = rotation([0.707, 0.707, 0.0, 0.0]).turn(vector);
    assert!((turned.length() - vector.length()).abs() < 1e-5);
    assert!((turned - along([X, MinusZ, Y]).turn(vector)).length() < 1e-5);
}

#[test]
fn params_of_a_mounting_make_it_again() {
    let quaternions = [[0.707, 0.707, 0.0, 0.0], [0.1, -0.7, 0.5, 0.4998], [1e-3, 0.6, 0.8, 0.0]];
    for mounting in quaternions.map(rotation) {
        assert_eq!(mounting.params().validate(), Ok(mounting));
    }
}

#[test]
fn mirror_image_is_rejected_with_the_axis_to_flip() {
    assert_eq!(
        refusal([X, Z, Y]),
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
    for axes in [[X, X, Z], [X, MinusX, Z], [Z, Y, Z]] {
        let expected = format!("{} has an axis twice: ", axes.map(SensorAxis::name).join(","));
        assert!(refusal(axes).starts_with(&expected), "{}", refusal(axes));
    }
}

#[test]
fn quaternion_of_wrong_length_is_rejected_with_its_length() {
    assert_eq!(
        quaternion([1.0, 1.0, 0.0, 0.0]).expect_err("long").to_string(),
        "the quaternion has the length 1.4142135, allowed is 0.999 to 1.001: \
         divide its four numbers by their length"
    );
    for parts in [
        [0.0; 4],
        [f32::NAN, 0.0, 0.0, 1.0],
        [f32::INFINITY, 0.0, 0.0, 0.0],
        [1.002, 0.0, 0.0, 0.0],
        [0.0, 0.998, 0.0, 0.0],
    ] {
        assert!(matches!(quaternion(parts), Err(MountingError::Length { .. })), "{parts:?}");
    }
}
