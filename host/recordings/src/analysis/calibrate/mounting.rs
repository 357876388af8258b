//! Mounting of the sensor in the foot, from the direction of up while the foot stood still.

use std::fmt;

use crate::config::axes_text;
use crate::mounting;
use estimator_core::{Mounting, MountingParams, Quaternion, Vec3};
use serde::{Serialize, Serializer};
use wire::dictionary::{code_of_axes, index};

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
        let angles = self.ups.iter().map(|up| mounting::tilt_degrees(to_z.rotate(*up)));
        let largest = angles.fold(0.0, f64::max);
        (largest > SAME_UP).then_some(largest)
    }
}

/// Where a mounting comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MountingSource {
    /// It was found at rest.
    Found,
    /// It was given, and nothing speaks against it.
    Given,
}

/// A mounting that is not that of the foot's own axes. `Display` is the report for the terminal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MountingReport {
    /// The mounting.
    #[serde(serialize_with = "as_text")]
    pub axes: Mounting,
    /// Where it comes from.
    pub source: MountingSource,
    /// With it, the angle between z and what was up at rest, degrees; `None` where no recording shows
    /// gravity at rest.
    pub tilt_deg: Option<f64>,
    /// The values of the foot's object 0x2019, in the order of its sub-indices from 1.
    pub object: (u16, [f32; 4]),
}

impl MountingReport {
    /// Returns the mounting for recordings read with `given`: `given` itself if z was up at rest or up is unknown,
    /// otherwise the mounting that puts z up. `None` if the sensor's axes are those of the foot.
    #[must_use]
    pub fn of(rest: &RestingUp, given: &Mounting) -> Option<Self> {
        let up = rest.mean().filter(|_| rest.disagreement().is_none());
        let found = up.and_then(mounting::with_z_up);
        let (axes, source) = match &found {
            Some(found) => (mounting::then(given, found), MountingSource::Found),
            None => (*given, MountingSource::Given),
        };
        let turned = up.map(|up| found.unwrap_or_default().turn(up));
        (axes != Mounting::IDENTITY).then(|| Self {
            axes,
            source,
            tilt_deg: turned.map(mounting::tilt_degrees),
            object: object(&axes),
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
        let (code, [w, x, y, z]) = self.object;
        write!(f, "on the foot, 0x{:04X}: ", index::MOUNTING)?;
        match self.axes.params() {
            MountingParams::Axes(_) => write!(f, "1 = {code}"),
            // The selector comes last, so that all four values take effect together.
            MountingParams::Rotation(_) => {
                write!(f, "2 = {w}, 3 = {x}, 4 = {y}, 5 = {z}, 1 = {code}")
            }
        }
    }
}

/// Returns the values of the foot's object.
fn object(axes: &Mounting) -> (u16, [f32; 4]) {
    match axes.params() {
        MountingParams::Axes(axes) => (code_of_axes(axes), [1.0, 0.0, 0.0, 0.0]),
        MountingParams::Rotation(Quaternion { w, x, y, z }) => (0, [w, x, y, z]),
    }
}

fn as_text<S: Serializer>(axes: &Mounting, to: S) -> Result<S::Ok, S::Error> {
    to.serialize_str(&axes_text(axes))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::parse_axes;

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
        // The samples were already turned, so the result is added to that mounting.
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
        assert!(level.to_string().ends_with("on the foot, 0x2019: 1 = 162"));
        let slanted = report([0.0, 6.0, 8.0]);
        let (code, [w, x, y, z]) = slanted.object;
        assert_eq!(code, 0);
        assert_eq!(axes_text(&slanted.axes), format!("{w},{x},{y},{z}"));
        let values = format!("0x2019: 2 = {w}, 3 = {x}, 4 = {y}, 5 = {z}, 1 = 0");
        assert!(slanted.to_string().ends_with(&values), "{slanted}");
    }
}
