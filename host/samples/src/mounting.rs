//! Mounting of a sensor in the foot: as text, from gravity while the foot stood still, and as the report of a calibration.
//!
//! As text it is `x,-z,y`, or a quaternion such as `0.8,0.6,0,0`.
//!
//! Rest determines up but not the heading. Of all mountings with z up, the mounting with the smallest
//! rotation is chosen, which keeps x if possible.

use std::fmt;

use estimator_core::mounting::{Mounting, MountingParams, SensorAxis};
use estimator_core::{Quaternion, Vec3};
use serde::{Serialize, Serializer};
use wire::dictionary::code_of_axes;

use crate::space::{Rotation, Vector};

/// Parses the mounting of the sensor: for each of the foot's x, y and z the axis of the sensor along it, such as
/// `x,-z,y`, or a unit quaternion `w,x,y,z` from the sensor's frame to the foot's.
///
/// # Errors
/// A sentence with the accepted notation, or the necessary change.
pub fn parse_axes(text: &str) -> Result<Mounting, String> {
    let parts: Vec<&str> = text.split(',').map(str::trim).collect();
    let axis = |name: &&str| {
        let name = name.strip_prefix('+').unwrap_or(name);
        SensorAxis::ALL.into_iter().find(|axis| axis.name() == name)
    };
    let axes: Option<Vec<_>> = parts.iter().map(axis).collect();
    let numbers: Option<Vec<f32>> = parts.iter().map(|number| number.parse().ok()).collect();
    let params = match (axes.as_deref(), numbers.as_deref()) {
        (Some(&[x, y, z]), _) => MountingParams::Axes([x, y, z]),
        (_, Some(&[w, x, y, z])) => MountingParams::Rotation(Quaternion { w, x, y, z }),
        _ => {
            return Err(format!(
                "{text:?} is neither axes nor a quaternion: write for the foot's x, y and z (up) the axis of the sensor that lies along it, such as x,-z,y, or a unit quaternion w,x,y,z from the sensor's frame to the foot's"
            ));
        }
    };
    params.validate().map_err(|error| error.to_string())
}

/// Notation of a mounting, from which [`parse_axes`] restores every bit.
#[must_use]
pub fn axes_text(mounting: &Mounting) -> String {
    match mounting.params() {
        MountingParams::Axes(axes) => axes.map(SensorAxis::name).join(","),
        MountingParams::Rotation(Quaternion { w, x, y, z }) => format!("{w},{x},{y},{z}"),
    }
}

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

/// Returns the axes with `up` along z and the smallest rotation. Of several equally small rotations, it chooses the one
/// that keeps x.
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
    // The first, if several are equally small.
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
    // The four formulas for a quaternion differ by a factor. The formula with the largest divisor is used.
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

/// Angle between up in a recording and the mean, above which the mountings differ, degrees.
const SAME_UP: f64 = 30.0;

/// Direction of up at rest in each recording.
#[derive(Clone, Debug, Default)]
pub struct RestingUp {
    ups: Vec<Vec3>,
}

impl RestingUp {
    /// Adds the gravity at rest in a recording, m/s², if it is known.
    pub fn add(&mut self, gravity: Option<Vec3>) {
        self.ups.extend(gravity);
    }

    fn mean(&self) -> Option<Vec3> {
        (!self.ups.is_empty()).then(|| {
            let sum = self.ups.iter().fold(Vec3::ZERO, |sum, up| sum + *up);
            sum * (1.0 / self.ups.len() as f32)
        })
    }

    /// Returns the largest angle in degrees between up in a recording and the mean, if it is too large for one
    /// mounting.
    #[must_use]
    pub fn disagreement(&self) -> Option<f64> {
        let rotation = Quaternion::from_up(self.mean()?);
        let to_z = rotation.unwrap_or_default();
        let angles = self.ups.iter().map(|up| tilt_degrees(to_z.rotate(*up)));
        let largest = angles.fold(0.0, f64::max);
        (largest > SAME_UP).then_some(largest)
    }
}

/// Source of a mounting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MountingSource {
    /// The mounting was found at rest.
    Found,
    /// The mounting was given, and no finding contradicts it.
    Given,
}

/// A mounting with other axes than the foot's. `Display` is the report for the terminal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MountingReport {
    /// The mounting.
    #[serde(serialize_with = "serialize_as_text")]
    pub axes: Mounting,
    /// Source of the mounting.
    pub source: MountingSource,
    /// Angle, with this mounting, between z and up at rest, degrees; `None` if no recording shows gravity at rest.
    pub tilt_deg: Option<f64>,
    /// The values of the foot's object 0x2019, in the order of its sub-indices from 1.
    pub object: (u16, [f32; 4]),
}

impl MountingReport {
    /// Returns the mounting for recordings read with `given`: `given` itself if z was up at rest or up is unknown,
    /// otherwise the mounting that puts z up. `None` if the sensor's axes are the axes of the foot.
    #[must_use]
    pub fn of(rest: &RestingUp, given: &Mounting) -> Option<Self> {
        let up = rest.mean().filter(|_| rest.disagreement().is_none());
        let found = up.and_then(with_z_up);
        let (axes, source) = match &found {
            Some(found) => (then(given, found), MountingSource::Found),
            None => (*given, MountingSource::Given),
        };
        let turned = up.map(|up| found.unwrap_or_default().turn(up));
        (axes != Mounting::IDENTITY).then(|| Self {
            axes,
            source,
            tilt_deg: turned.map(tilt_degrees),
            object: object_of(&axes),
        })
    }

    /// Returns a line for a configuration file.
    #[must_use]
    pub fn remark(&self) -> String {
        match (self.source, self.tilt_deg) {
            (MountingSource::Found, _) => "axes from gravity where the foot stood still".to_owned(),
            (MountingSource::Given, Some(tilt)) => {
                format!("axes as given: z was within {tilt:.0}° of up where the foot stood still")
            }
            (MountingSource::Given, None) => {
                "axes as given: gravity does not show which way is up".to_owned()
            }
        }
    }
}

impl fmt::Display for MountingReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "axes {}", axes_text(&self.axes))?;
        match (self.source, self.tilt_deg) {
            (MountingSource::Found, Some(tilt)) => writeln!(
                f,
                "z was not up where the foot stood still; with these axes it is, within {tilt:.0}°"
            )?,
            _ => writeln!(f, "{}", self.remark())?,
        }
        f.write_str("if the foot has a footfall board: set")?;
        for (name, value) in settings_of(&self.axes) {
            write!(f, " {name}={value}")?;
        }
        Ok(())
    }
}

/// Names and values of the foot's settings for a mounting.
#[must_use]
pub fn settings_of(axes: &Mounting) -> Vec<(&'static str, String)> {
    match axes.params() {
        MountingParams::Axes(_) => vec![("axes", axes_text(axes))],
        MountingParams::Rotation(Quaternion { w, x, y, z }) => vec![
            ("mounting.rotation_w", w.to_string()),
            ("mounting.rotation_x", x.to_string()),
            ("mounting.rotation_y", y.to_string()),
            ("mounting.rotation_z", z.to_string()),
            // The selector comes last, so that all four values take effect together.
            ("axes", "quaternion".to_owned()),
        ],
    }
}

/// Returns the values of the foot's object.
fn object_of(axes: &Mounting) -> (u16, [f32; 4]) {
    match axes.params() {
        MountingParams::Axes(axes) => (code_of_axes(axes), [1.0, 0.0, 0.0, 0.0]),
        MountingParams::Rotation(Quaternion { w, x, y, z }) => (0, [w, x, y, z]),
    }
}

fn serialize_as_text<S: Serializer>(axes: &Mounting, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(&axes_text(axes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identity_is_read_in_every_notation() {
        for text in ["x,y,z", " +x, y ,z", "1,0,0,0", "-1,0,-0,0", "0.9995,0,0,0"] {
            assert_eq!(parse_axes(text), Ok(Mounting::IDENTITY), "{text}");
        }
        assert_eq!(axes_text(&Mounting::IDENTITY), "x,y,z");
    }

    #[test]
    fn mounting_round_trips_through_text() {
        for x in SensorAxis::ALL {
            for y in SensorAxis::ALL {
                for z in SensorAxis::ALL {
                    if let Ok(mounting) = MountingParams::Axes([x, y, z]).validate() {
                        assert_eq!(parse_axes(&axes_text(&mounting)), Ok(mounting));
                    }
                }
            }
        }
        for text in ["0.707,0.707,0,0", "0.1,-0.7,0.5,0.4998", "1e-3,0.6,0.8,0"] {
            let mounting = parse_axes(text).expect(text);
            assert_eq!(parse_axes(&axes_text(&mounting)), Ok(mounting), "{text}");
        }
    }

    #[test]
    fn unreadable_text_is_rejected_with_the_expected_format() {
        for text in ["", "x", "x,y", "x,y,z,x", "x,y,w", "1,0,0", "1,0,0,0,0", "X,Y,Z", "--x,y,z"] {
            assert!(
                parse_axes(text).is_err_and(|error| error.contains("such as x,-z,y")),
                "{text}"
            );
        }
    }

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

    fn report(ups: &[[f32; 3]], given: &str) -> Option<MountingReport> {
        let mut rest = RestingUp::default();
        for [x, y, z] in ups {
            rest.add(Some(Vec3::new(*x, *y, *z)));
        }
        MountingReport::of(&rest, &parse_axes(given).expect(given))
    }

    fn axes(ups: &[[f32; 3]], given: &str) -> Option<String> {
        report(ups, given).map(|report| axes_text(&report.axes))
    }

    #[test]
    fn axes_are_found_only_if_z_was_not_up() {
        let found = |axes: &str| Some(axes.to_owned());
        assert_eq!(axes(&[[0.0, 9.8, 0.5]], "x,y,z"), found("x,-z,y"));
        assert_eq!(axes(&[[0.5, 0.0, 9.8]], "x,y,z"), None);
        assert_eq!(axes(&[[0.5, 0.0, 9.8]], "x,-z,y"), found("x,-z,y"));
        assert_eq!(axes(&[], "x,-z,y"), found("x,-z,y"));
        assert_eq!(axes(&[], "x,y,z"), None);
        // The samples were already turned, so the result combines that mounting with the further turn.
        assert_eq!(axes(&[[0.0, 0.0, -9.8]], "x,-z,y"), found("x,z,-y"));
        assert_eq!(axes(&[[0.0, 0.0, -9.8]], "x,-y,-z"), None);
    }

    #[test]
    fn recordings_count_alike_and_share_one_mounting() {
        let sides = [[0.0, 9.8, 3.0], [0.0, 9.8, -3.0]];
        assert_eq!(axes(&sides, "x,y,z"), Some("x,-z,y".to_owned()));
        let mut rest = RestingUp::default();
        rest.add(Some(Vec3::new(0.0, 0.0, 9.8)));
        assert_eq!(rest.disagreement(), None);
        rest.add(Some(Vec3::new(9.8, 0.0, 0.0)));
        let degrees = rest.disagreement().expect("of two mountings");
        assert!((degrees - 45.0).abs() < 0.1, "{degrees}");
        assert_eq!(MountingReport::of(&rest, &Mounting::IDENTITY), None);
    }

    #[test]
    fn object_holds_an_axis_code_or_a_quaternion() {
        let report = |ups: [f32; 3]| report(&[ups], "x,y,z").expect("z is not up");
        let level = report([0.0, 9.8, 0.5]);
        assert_eq!(level.object, (162, [1.0, 0.0, 0.0, 0.0]));
        assert!(level.to_string().ends_with("if the foot has a footfall board: set axes=x,-z,y"));
        let slanted = report([0.0, 6.0, 8.0]);
        let (code, [w, x, y, z]) = slanted.object;
        assert_eq!(code, 0);
        assert_eq!(axes_text(&slanted.axes), format!("{w},{x},{y},{z}"));
        let values = format!(
            "set mounting.rotation_w={w} mounting.rotation_x={x} mounting.rotation_y={y} \
             mounting.rotation_z={z} axes=quaternion"
        );
        assert!(slanted.to_string().ends_with(&values), "{slanted}");
    }
}
