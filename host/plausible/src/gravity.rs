//! Checks of the acceleration at rest: its unit, whether it contains gravity, and which axis points up.

use estimator_core::{Gravity, Vec3};
use samples::mounting;

use crate::finding::Finding;
use crate::limits::LARGEST_REST;
use crate::rest::{Rest, has_gravity, is_near, size};

/// Value of |a| at rest below which it contains no gravity, m/s².
pub(crate) const NO_GRAVITY: f32 = 0.5;

/// Finding about the acceleration at rest.
pub(crate) fn check_gravity(rest: &Rest, gravity: Gravity) -> Option<Finding> {
    let at_rest = rest.size;
    let has_gravity = has_gravity(rest);
    if is_near(at_rest, 1.0) {
        return Some(Finding::AccelerationInG { at_rest });
    }
    if at_rest > LARGEST_REST {
        return Some(Finding::AccelerationInOtherUnit { at_rest });
    }
    match gravity {
        Gravity::Removed => has_gravity.then_some(Finding::GravityIncluded { at_rest }),
        Gravity::Included if at_rest < NO_GRAVITY => Some(Finding::GravityRemoved { at_rest }),
        Gravity::Included if has_gravity => {
            let up = check_up(rest.mean)?;
            let axes = mounting::with_z_up(rest.mean)?;
            Some(Finding::GravityNotAlongZ { up, axes })
        }
        Gravity::Included => rest.is_steady.then_some(Finding::AccelerationInOtherUnit { at_rest }),
    }
}

/// Share of gravity along an axis from which that axis is up: the axis is within 30° of the vertical. A sensor on a shank
/// may stand at a larger angle, where another mounting would not change its estimate.
const UP: f32 = 0.866;

/// Returns the axis that is up, if it is not z; `None` for a slanted sensor. At rest the accelerometer reads upwards.
pub(crate) fn check_up(mean: Vec3) -> Option<&'static str> {
    let Vec3 { x, y, z } = mean;
    if z > size(mean) * std::f32::consts::FRAC_1_SQRT_2 {
        return None;
    }
    let largest = x.abs().max(y.abs()).max(z.abs());
    if largest < UP * size(mean) {
        return None;
    }
    Some(if x.abs() == largest {
        if x > 0.0 { "x" } else { "-x" }
    } else if y.abs() == largest {
        if y > 0.0 { "y" } else { "-y" }
    } else {
        "-z"
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    use samples::Recording;
    use samples::mounting::{axes_text, parse_axes};

    use crate::check;
    use crate::fixtures::{found, scaled, walk, with_force};

    #[test]
    fn accelerations_in_g_are_found_with_and_without_gravity() {
        let mut recording = with_force(scaled(1.0 / 9.81));
        assert_eq!(found(&recording), ["acceleration_in_g"]);
        recording.gravity = Gravity::Removed;
        assert_eq!(found(&recording), ["acceleration_in_g"]);
    }

    #[test]
    fn gravity_contradicting_its_declaration_is_found() {
        let mut recording = walk();
        recording.gravity = Gravity::Removed;
        assert_eq!(found(&recording), ["gravity_included"]);
        let said = check(&recording)[0].to_string();
        assert!(said.ends_with(" m/s² at rest: gravity included"), "{said}");
        let mut recording = with_force(|force| Vec3::new(force.x, force.y, force.z - 9.81));
        assert_eq!(found(&recording), ["gravity_removed"]);
        let said = check(&recording)[0].to_string();
        assert!(said.ends_with(" m/s² at rest: gravity removed"), "{said}");
        recording.gravity = Gravity::Removed;
        assert_eq!(found(&recording), [""; 0]);
    }

    #[test]
    fn sensor_on_its_side_is_found_with_the_axis_up() {
        let up = |recording: &Recording| match check(recording)[..] {
            [Finding::GravityNotAlongZ { up, axes }] => (up, axes_text(&axes)),
            ref other => panic!("{other:?}"),
        };
        let is = |up: &'static str, axes: &str| (up, axes.to_owned());
        let side = with_force(|f| Vec3::new(-f.z, f.y, f.x));
        assert_eq!(up(&side), is("-x", "z,y,-x"));
        let y_up = with_force(|f| Vec3::new(f.x, f.z, -f.y));
        assert_eq!(up(&y_up), is("y", "x,-z,y"));
        assert_eq!(up(&with_force(scaled(-1.0))), is("-z", "x,-y,-z"));
        // A shank may stand at 50° to all of its axes, where another mounting changes nothing.
        let shank = with_force(|f| Vec3::new(0.75 * f.z, 0.1 * f.y, 0.66 * f.z));
        assert_eq!(found(&shank), [""; 0]);
        // A foot may stand at 30°.
        let tilted = with_force(|f| Vec3::new(f.x + 0.5 * f.z, f.y, 0.866 * f.z));
        assert_eq!(found(&tilted), [""; 0]);
    }

    #[test]
    fn wrong_mounting_is_replaced_by_a_right_one() {
        // y of the sensor is up, but was declared as x of the foot.
        let wrong = parse_axes("y,z,x").expect("axes");
        let recording = with_force(|f| wrong.turn(Vec3::new(f.x, f.z, -f.y)));
        let [finding] = check(&recording)[..] else {
            panic!("one finding");
        };
        assert_eq!(
            finding.with_mounting(&wrong).to_string(),
            "x is up at rest, where the foot has z: axes -x,z,y"
        );
        let right = parse_axes("-x,z,y").expect("axes");
        let recording = with_force(|f| right.turn(Vec3::new(f.x, f.z, -f.y)));
        assert_eq!(found(&recording), [""; 0]);
    }

    #[test]
    fn accelerations_in_mg_or_counts_are_found() {
        // Half and twice the acceleration come from another full scale.
        for factor in [0.5, 2.0, 1000.0 / 9.81, 2048.0 / 9.81, 16384.0 / 9.81, 16384.0] {
            let found = found(&with_force(scaled(factor)));
            assert_eq!(found, ["acceleration_in_other_unit"], "{factor}");
        }
        // Readings of a sensor in counts, as if they were in g.
        let counts = check(&with_force(scaled(16384.0)));
        assert_eq!(
            counts[0].to_string(),
            "the acceleration is 160800 m/s² at rest, 16397 times gravity, so it is in another unit or of \
         another full scale: units m/s2, mm/s2, g or mg, or scale with the value of a count"
        );
    }
}
