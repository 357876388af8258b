//! The mounting of a sensor, from which way gravity pulled while the foot stood still.
//!
//! Rest shows which way is up and nothing of heading. So of all mountings with z up, the one with the
//! least turn is taken: x stays where it can.

use estimator_core::{Mounting, MountingParams, Quaternion, SensorAxis, Vec3};

use crate::space::{Rotation, Vector};

/// Up this near an axis is along it, degrees: soles and boards are not more level than that.
pub const NEAR_DEGREES: f64 = 20.0;

/// Along x, y and z.
const UNIT: [Vec3; 3] = [
    Vec3::new(1.0, 0.0, 0.0),
    Vec3::new(0.0, 1.0, 0.0),
    Vec3::new(0.0, 0.0, 1.0),
];

/// The angle between z and what is up, degrees. `up` is what an accelerometer reads at rest, in any
/// unit.
#[must_use]
pub fn tilt_degrees(up: Vec3) -> f64 {
    angle_degrees(SensorAxis::Z, up)
}

/// The mounting with which z is up, where it is not so already within [`NEAR_DEGREES`]: axes along axes
/// where one is up within as much, otherwise the rotation with the least turn. `None`, too, where `up`
/// has no direction.
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

/// The axes with `up` along z that turn least; of equal ones, x is kept.
fn least_turn(up: SensorAxis) -> [SensorAxis; 3] {
    let own = [SensorAxis::X, SensorAxis::Y, SensorAxis::Z];
    // The trace of the rotation: the greater, the smaller its angle.
    let kept = |axes: &[SensorAxis; 3]| -> i8 {
        let sign = |(axis, own): (&SensorAxis, SensorAxis)| {
            i8::from(*axis == own) - i8::from(*axis == own.opposite())
        };
        axes.iter().zip(own).map(sign).sum()
    };
    let mut best = own;
    let mut most = i8::MIN;
    for x in SensorAxis::ALL {
        for axes in SensorAxis::ALL.map(|y| [x, y, up]) {
            if MountingParams::Axes(axes).validate().is_ok() && kept(&axes) > most {
                (best, most) = (axes, kept(&axes));
            }
        }
    }
    best
}

/// First one mounting, then another.
#[must_use]
pub fn then(first: &Mounting, second: &Mounting) -> Mounting {
    let turned = UNIT.map(|axis| (axis, second.turn(first.turn(axis))));
    // Axes along axes stay exact.
    let along = |component: fn(Vec3) -> f32| {
        let is_along = |axis: &SensorAxis| {
            turned
                .iter()
                .all(|(from, to)| axis.component(*from) == component(*to))
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

/// The same as a rotation, sensor → foot.
#[must_use]
pub fn rotation(mounting: &Mounting) -> Rotation {
    let axes = match mounting.params() {
        MountingParams::Rotation(Quaternion { w, x, y, z }) => {
            let [w, x, y, z] = [w, x, y, z].map(f64::from);
            return normalised(w, Vector::new(x, y, z));
        }
        MountingParams::Axes(axes) => axes,
    };
    // Of each axis of the foot, its components in the sensor's frame: the rows of the matrix.
    let row = |axis: SensorAxis| UNIT.map(|unit| f64::from(axis.component(unit)));
    let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = axes.map(row);
    // The four ways to find a quaternion differ by a factor; the one that divides by most is taken.
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
    let best = (1..4).fold(0, |best, k| match diagonal(k) > diagonal(best) {
        true => k,
        false => best,
    });
    let (w, v) = ways[best];
    normalised(w, Vector::from_array(v))
}

fn normalised(w: f64, v: Vector) -> Rotation {
    let length = (w * w + v.dot(v)).sqrt();
    Rotation {
        w: w / length,
        v: v * (1.0 / length),
    }
}

/// What is made here is always right-handed, and of length 1.
fn checked(params: MountingParams) -> Mounting {
    params.validate().unwrap_or_default()
}

fn angle_degrees(axis: SensorAxis, up: Vec3) -> f64 {
    let along = Vector::from_array(UNIT.map(|unit| f64::from(axis.component(unit))));
    let up = Vector::new(up.x.into(), up.y.into(), up.z.into());
    along.angle_to(up).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(x: f32, y: f32, z: f32) -> String {
        let up = Vec3::new(x, y, z);
        let mounting = with_z_up(up).expect("z is not up");
        let turned = mounting.turn(up);
        assert!(tilt_degrees(turned) <= NEAR_DEGREES, "{turned:?}");
        mounting.to_string()
    }

    fn mounting(text: &str) -> Mounting {
        text.parse().expect(text)
    }

    /// All mountings of axes along axes, and some others.
    fn mountings() -> Vec<Mounting> {
        let mut all = Vec::new();
        for x in SensorAxis::ALL {
            for y in SensorAxis::ALL {
                let axes = SensorAxis::ALL.map(|z| MountingParams::Axes([x, y, z]).validate());
                all.extend(axes.into_iter().flatten());
            }
        }
        assert_eq!(all.len(), 24);
        all.extend(["0.8,0.6,0,0", "0.5,-0.5,0.1,0.7"].map(|text| {
            let Ok(MountingParams::Rotation(q)) = text.parse() else {
                panic!("{text}");
            };
            checked(MountingParams::Rotation(q.normalised()))
        }));
        all
    }

    #[test]
    fn the_axis_that_is_up_becomes_z_with_the_least_turn() {
        assert_eq!(found(0.0, 9.81, 0.0), "x,-z,y");
        assert_eq!(found(0.0, -9.81, 0.0), "x,z,-y");
        assert_eq!(found(9.81, 0.0, 0.0), "-z,y,x");
        assert_eq!(found(-9.81, 0.5, 1.0), "z,y,-x");
        assert_eq!(found(1.0, 2.0, -9.5), "x,-y,-z");
        // 19° from y.
        assert_eq!(found(0.0, 9.3, 3.2), "x,-z,y");
    }

    #[test]
    fn up_between_axes_is_turned_to_z_by_a_rotation() {
        for (x, y, z) in [(0.0, 5.0, 8.5), (4.0, -7.0, 5.0), (7.0, 0.0, -7.0)] {
            let up = Vec3::new(x, y, z);
            let mounting = with_z_up(up).expect("z is not up");
            assert!(matches!(mounting.params(), MountingParams::Rotation(_)));
            assert!(tilt_degrees(mounting.turn(up)) < 1e-3);
        }
    }

    #[test]
    fn where_z_is_up_or_nothing_is_there_is_no_mounting() {
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
    fn two_mountings_after_another_turn_as_both_do() {
        assert_eq!(
            then(&mounting("x,-z,y"), &mounting("x,z,-y")),
            Mounting::IDENTITY
        );
        let vector = Vec3::new(0.3, -7.0, 2.0);
        for first in mountings() {
            for second in mountings() {
                let both = then(&first, &second);
                let difference = both.turn(vector) - second.turn(first.turn(vector));
                assert!(difference.length() < 1e-5, "{first}; {second}: {both}");
            }
        }
    }

    #[test]
    fn as_a_rotation_it_turns_the_same() {
        let vector = Vec3::new(0.3, -7.0, 2.0);
        for mounting in mountings() {
            let turned = mounting.turn(vector);
            let expected = Vector::new(turned.x.into(), turned.y.into(), turned.z.into());
            let [x, y, z] = [vector.x, vector.y, vector.z].map(f64::from);
            let found = rotation(&mounting).to_world(Vector::new(x, y, z));
            assert!((found - expected).length() < 1e-5, "{mounting}");
        }
    }
}
