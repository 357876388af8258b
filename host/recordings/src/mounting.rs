//! Mounting of a sensor, from the direction of gravity while the foot stood still.
//!
//! Rest determines up but not the heading. Of all mountings with z up, the one with the smallest rotation is
//! chosen: x is kept if possible.

use estimator_core::{Mounting, MountingParams, Quaternion, SensorAxis, Vec3};

use crate::samples::space::{Rotation, Vector};

/// Angle within which up counts as along an axis, degrees: soles and boards are not more level than that.
pub const NEAR_DEGREES: f64 = 20.0;

/// Unit vectors along x, y and z.
const UNIT: [Vec3; 3] =
    [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];

/// Angle between z and up, degrees. `up` is the accelerometer reading at rest, in any unit.
#[must_use]
pub fn tilt_degrees(up: Vec3) -> f64 {
    angle_degrees(SensorAxis::Z, up)
}

/// Returns the mounting that makes z up: along the axes if one is up within [`NEAR_DEGREES`], otherwise the smallest
/// rotation. `None` if z is already up within [`NEAR_DEGREES`], or if `up` has no direction.
#[must_use]
pub fn with_z_up(up: Vec3) -> Option<Mounting> {
    let shortest = Quaternion::from_up(up)?;
    let mut near = SensorAxis::ALL.into_iter();
    let params = match near.find(|axis| angle_degrees(*axis, up) <= NEAR_DEGREES) {
        Some(SensorAxis::Z) => return None,
        Some(axis) => MountingParams::Axes(least_turn(axis)),
        None => MountingParams::Rotation(shortest),
    };
    Some(checked(params))
}

/// The axes with `up` along z and the smallest rotation; of equal ones, x is kept.
fn least_turn(up: SensorAxis) -> [SensorAxis; 3] {
    let own = [SensorAxis::X, SensorAxis::Y, SensorAxis::Z];
    // The greater the trace of the rotation, the smaller its angle.
    let kept = |axes: &[SensorAxis; 3]| -> i8 {
        let sign = |(axis, own): (&SensorAxis, SensorAxis)| {
            i8::from(*axis == own) - i8::from(*axis == own.opposite())
        };
        axes.iter().zip(own).map(sign).sum()
    };
    let all = SensorAxis::ALL.into_iter();
    let all = all.flat_map(|x| SensorAxis::ALL.map(|y| [x, y, up]));
    let valid = all.filter(|axes| MountingParams::Axes(*axes).validate().is_ok());
    // The first of equal ones.
    valid.rev().max_by_key(kept).unwrap_or(own)
}

/// Composes two mountings: `first`, then `second`.
#[must_use]
pub fn then(first: &Mounting, second: &Mounting) -> Mounting {
    let turned = UNIT.map(|axis| (axis, second.turn(first.turn(axis))));
    // Mountings along the axes stay exact.
    let along = |component: fn(Vec3) -> f32| {
        let is_along = |axis: &SensorAxis| {
            turned.iter().all(|(from, to)| axis.component(*from) == component(*to))
        };
        SensorAxis::ALL.into_iter().find(is_along)
    };
    if let (Some(x), Some(y), Some(z)) = (along(|v| v.x), along(|v| v.y), along(|v| v.z)) {
        return checked(MountingParams::Axes([x, y, z]));
    }
    let Rotation { w, v } = rotation(second).after(rotation(first));
    let [w, x, y, z] = [w, v.x, v.y, v.z].map(|part| part as f32);
    checked(MountingParams::Rotation(Quaternion { w, x, y, z }))
}

/// The mounting as a rotation, sensor → foot.
#[must_use]
pub fn rotation(mounting: &Mounting) -> Rotation {
    let axes = match mounting.params() {
        MountingParams::Rotation(Quaternion { w, x, y, z }) => {
            let [w, x, y, z] = [w, x, y, z].map(f64::from);
            return normalised(w, Vector::new(x, y, z));
        }
        MountingParams::Axes(axes) => axes,
    };
    // Rows of the matrix: components of each axis of the foot in the sensor's frame.
    let row = |axis: SensorAxis| UNIT.map(|unit| f64::from(axis.component(unit)));
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = axes.map(row);
    // The four formulas for a quaternion differ by a factor; the one with the largest divisor is used.
    let ways = [
        (1.0 + xx + yy + zz, [zy - yz, xz - zx, yx - xy]),
        (zy - yz, [1.0 + xx - yy - zz, xy + yx, xz + zx]),
        (xz - zx, [xy + yx, 1.0 - xx + yy - zz, yz + zy]),
        (yx - xy, [xz + zx, yz + zy, 1.0 - xx - yy + zz]),
    ];
    let diagonal = |k: usize| match k {
        0 => ways[0].0,
        _ => ways[k].1[k - 1],
    };
    let best = (1..4).fold(0, |best, k| if diagonal(k) > diagonal(best) { k } else { best });
    let (w, v) = ways[best];
    normalised(w, Vector::from_array(v))
}

fn normalised(w: f64, v: Vector) -> Rotation {
    let length = (w * w + v.dot(v)).sqrt();
    Rotation { w: w / length, v: v * (1.0 / length) }
}

/// Validates parameters, which are right-handed and of length 1 by construction.
fn checked(params: MountingParams) -> Mounting {
    params.validate().unwrap_or_default()
}

fn angle_degrees(axis: SensorAxis, up: Vec3) -> f64 {
    let along = Vector::from_array(UNIT.map(|unit| f64::from(axis.component(unit))));
    along.angle_to(up.into()).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{axes_text, parse_axes};

    fn found(x: f32, y: f32, z: f32) -> String {
        let up = Vec3::new(x, y, z);
        let mounting = with_z_up(up).expect("z is not up");
        let turned = mounting.turn(up);
        assert!(tilt_degrees(turned) <= NEAR_DEGREES, "{turned:?}");
        axes_text(&mounting)
    }

    fn mounting(text: &str) -> Mounting {
        parse_axes(text).expect(text)
    }

    /// All mountings along the axes, and some others.
    fn mountings() -> Vec<Mounting> {
        let mut all = Vec::new();
        for x in SensorAxis::ALL {
            for y in SensorAxis::ALL {
                let axes = SensorAxis::ALL.map(|z| MountingParams::Axes([x, y, z]).validate());
                all.extend(axes.into_iter().flatten());
            }
        }
        assert_eq!(all.len(), 24);
        all.extend([[0.8, 0.6, 0.0, 0.0], [0.5, -0.5, 0.1, 0.7]].map(|[w, x, y, z]| {
            checked(MountingParams::Rotation(Quaternion { w, x, y, z }.normalised()))
        }));
        all
    }

    #[test]
    fn axis_up_becomes_z_with_the_smallest_rotation() {
        assert_eq!(found(0.0, 9.81, 0.0), "x,-z,y");
        assert_eq!(found(0.0, -9.81, 0.0), "x,z,-y");
        assert_eq!(found(9.81, 0.0, 0.0), "-z,y,x");
        assert_eq!(found(-9.81, 0.5, 1.0), "z,y,-x");
        assert_eq!(found(1.0, 2.0, -9.5), "x,-y,-z");
        // 19° from y.
        assert_eq!(found(0.0, 9.3, 3.2), "x,-z,y");
    }

    #[test]
    fn up_between_axes_is_rotated_to_z() {
        for (x, y, z) in [(0.0, 5.0, 8.5), (4.0, -7.0, 5.0), (7.0, 0.0, -7.0)] {
            let up = Vec3::new(x, y, z);
            let mounting = with_z_up(up).expect("z is not up");
            assert!(matches!(mounting.params(), MountingParams::Rotation(_)));
            assert!(tilt_degrees(mounting.turn(up)) < 1e-3);
        }
    }

    #[test]
    fn no_mounting_if_z_is_up_or_up_is_undefined() {
        for up in [
            Vec3::new(0.0, 0.0, 9.81),
            Vec3::new(2.0, 2.0, 9.3),
            Vec3::ZERO,
            Vec3::new(f32::NAN, 0.0, 1.0),
        ] {
            assert_eq!(with_z_up(up), None, "{up:?}");
        }
    }

    #[test]
    fn composed_mountings_turn_as_both_do() {
        assert_eq!(then(&mounting("x,-z,y"), &mounting("x,z,-y")), Mounting::IDENTITY);
        let vector = Vec3::new(0.3, -7.0, 2.0);
        for first in mountings() {
            for second in mountings() {
                let both = then(&first, &second);
                let difference = both.turn(vector) - second.turn(first.turn(vector));
                assert!(difference.length() < 1e-5, "{first:?}; {second:?}: {both:?}");
            }
        }
    }

    #[test]
    fn rotation_turns_as_the_mounting_does() {
        let vector = Vec3::new(0.3, -7.0, 2.0);
        for mounting in mountings() {
            let expected = Vector::from(mounting.turn(vector));
            let found = rotation(&mounting).to_world(vector.into());
            assert!((found - expected).length() < 1e-5, "{mounting:?}");
        }
    }
}
